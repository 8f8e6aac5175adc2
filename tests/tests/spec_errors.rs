//! Bad input to the spec reader: every key wrong in every way, and the corpus with the text that a user sees.

// Clippy sees the helpers of an integration test as production code.
use std::collections::BTreeSet;

use crate::support::help;
use crate::support::specs::{
    Choice, LEGS, PLATFORM, errors, every_key, folder_with_records, line_of, sections, source, spec_files,
};
use specgen::diagnostic::{Code, Diagnostic, codes, render};
use specgen::spec::keys::{Item, Key, Kind, Presence, Section, Shape};
use specgen::spec::{self, SpecSource};
use specgen::stability;
use specgen_tests::length;

#[test]
fn every_spec_of_the_repository_is_accepted_without_a_warning_and_stable() {
    // Every fourth in the short run; the others are compiled by other tests.
    for path in spec_files().into_iter().step_by(length(4, 1)) {
        let source = SpecSource::read(&path).expect("readable");
        let (model, findings) = spec::load(&source);
        assert!(findings.is_empty(), "{}", render(&findings, &source, false));
        let stability = stability::check(&model.expect("no findings"));
        assert!(stability.is_ok(), "{}: {stability:?}", path.display());
    }
}

/// One changed line in a spec that has every key, and what must come of it.
struct Case<'a> {
    key: &'static Key,
    path: &'a str,
    /// What stands in the place of the key's line.
    lines: String,
    code: Code,
    /// Key path of the finding.
    about: String,
    what: &'a str,
    /// The literal in it that is wrong, where one is.
    bad: &'a str,
}

/// A spec with every key, and where each key's line is.
struct Bench {
    folder: tempfile::TempDir,
    cases: usize,
    /// Lines with placeholders that were tried.
    offered: usize,
    /// Helps with a value that is not the user's own.
    foreign: Vec<String>,
    /// Helps that were looked at.
    known: BTreeSet<(String, String)>,
}

impl Bench {
    fn new() -> Self {
        Self { folder: folder_with_records(), cases: 0, offered: 0, foreign: Vec::new(), known: BTreeSet::new() }
    }
}

impl Bench {
    /// The kind of spec in which the key stands.
    fn choice(section: &Section, key: &Key) -> Choice {
        match (section.name, key.presence) {
            ("adaptation", _) if key.name.ends_with("_bandwidth") => Choice { weights: false, ..LEGS },
            ("adaptation" | "controller", _) => LEGS,
            (_, Presence::Form(forms)) => Choice { form: forms[0], ..PLATFORM },
            ("hysteresis", _) if key.name == "rate_tables" => Choice { dynamic: true, ..PLATFORM },
            ("hysteresis", _) if key.name == "dead_time" => LEGS,
            ("trajectory", _) => Choice {
                waveform: matches!(key.name, "file" | "period" | "repeat" | "columns"),
                step: matches!(key.name, "to" | "time"),
                ..PLATFORM
            },
            _ => PLATFORM,
        }
    }

    /// The text with the first line of `section`.`key` replaced, and the number of that line.
    fn with(section: &Section, key: &Key, lines: &str) -> (String, usize) {
        let mut text = Self::choice(section, key).text();
        let header = if section.name.is_empty() { String::new() } else { section.header() + "\n" };
        let from = text.find(&header).expect("section") + header.len();
        let start = if text[from..].starts_with(&format!("{} = ", key.name)) {
            from
        } else {
            from + text[from..].find(&format!("\n{} = ", key.name)).expect("key") + 1
        };
        let end = start + text[start..].find('\n').expect("line end") + 1;
        text.replace_range(start..end, lines);
        let line = 1 + text[..start].matches('\n').count();
        (text, line)
    }

    /// Key path of the first table's key.
    fn path(section: &Section, name: &str) -> String {
        match section.kind {
            Kind::Repeated(..) => format!("{}[0].{name}", section.name),
            Kind::Plain | Kind::Optional => section.path(name),
        }
    }

    fn findings(&self, text: &str) -> Vec<Diagnostic> {
        let source = source(text, "spec.toml", &self.folder);
        let (model, findings) = spec::load(&source);
        assert_eq!(model.is_none(), !errors(&findings).is_empty());
        // Rendering must take whatever loading finds.
        assert!(findings.is_empty() || render(&findings, &source, false).contains(findings[0].code));
        findings
    }

    /// The one line is to blame: the finding is there, on it, and nothing else is reported anywhere else.
    fn check(&mut self, section: &Section, case: Case<'_>, line_offset: usize) {
        let (text, line) = Self::with(section, case.key, &case.lines);
        let findings = self.findings(&text);
        let hint = format!("{} {}: {:?} gave {findings:#?}", case.path, case.what, case.lines);
        let found = errors(&findings).into_iter().find(|d| d.code == case.code && d.key == case.about);
        let found = found.unwrap_or_else(|| panic!("no {} about {}: {hint}", case.code.id, case.about));
        assert_eq!(line_of(found, &text), line + line_offset, "{hint}");
        for d in errors(&findings) {
            assert_eq!(line_of(d, &text), line + line_offset, "a follow-up: {hint}");
            assert!(!d.help.is_empty() && !d.message.is_empty(), "{hint}");
        }
        let help = found.help.clone();
        self.offered_by(section, &case, &help);
        self.cases += 1;
    }

    /// No value of the key's example is in the help, and a line or literal that it shows is refused until its placeholders are
    /// replaced; without any, it has the numbers of the line that was wrong, and no other. Adds what is not so to `foreign`.
    fn offered_by(&mut self, section: &Section, case: &Case<'_>, help: &str) {
        // One help comes of many slips.
        if !self.known.insert((case.path.to_owned(), help.to_owned())) {
            return;
        }
        let (mut foreign, mut refused_once) = (Vec::new(), 0);
        for value in help::values(case.key).iter().filter(|value| help.contains(*value) && !case.lines.contains(*value))
        {
            foreign.push(format!("{value} of the example"));
        }
        let name = case.key.name;
        let line = help::literal(help, &format!("{name} = ")).map(|new| format!("{name} = {new}\n"));
        let one = help::literal(help, "in the form ").map(|new| case.lines.replacen(case.bad, new, 1));
        for offered in line.into_iter().chain(one.filter(|_| !case.bad.is_empty())) {
            let about = |text: &str| {
                let found = self.findings(&Self::with(section, case.key, text).0);
                let mut found: Vec<_> = found.into_iter().filter(|d| d.key.starts_with(case.path)).collect();
                found.retain(|d| d.code.starts_with("E02") || d.code == codes::OUT_OF_RANGE.id);
                found
            };
            if offered.contains('<') {
                let found = about(&offered);
                let refused = |d: &Diagnostic| d.code == codes::PLACEHOLDER.id && d.help.contains("replace <");
                if found.is_empty() || !found.iter().all(refused) {
                    foreign.push(format!("not refused as a placeholder: {found:?}"));
                }
                refused_once += 1;
            } else if case.key.template() != case.key.example
                && !help::numbers(&offered).iter().all(|number| help::numbers(&case.lines).contains(number))
            {
                foreign.push(format!("{offered:?} has another number"));
            }
            let found = about(&help::filled(&offered, &items(case.key)));
            if !found.is_empty() {
                foreign.push(format!("refused when filled in: {found:?}"));
            }
        }
        let hint = |what| format!("{} {}, {:?}: {help:?}: {what}", case.path, case.what, case.lines);
        self.offered += refused_once;
        self.foreign.extend(foreign.into_iter().map(hint));
    }
}

fn items(key: &Key) -> Vec<Item> {
    match key.shape {
        Shape::One(item) => vec![item],
        Shape::List(items) | Shape::Leading(_, items) => items.to_vec(),
        // Of the first row; the rows are alike.
        Shape::Rows(_, items) => items.to_vec(),
        Shape::Records | Shape::Reasons | Shape::Paths => Vec::new(),
    }
}

/// Key path of the value `index` of the key at `path`.
fn item_path(key: &Key, path: &str, index: usize) -> String {
    match key.shape {
        Shape::One(_) => path.to_owned(),
        Shape::Rows(..) => format!("{path}[0][{index}]"),
        Shape::List(_) | Shape::Leading(..) | Shape::Records | Shape::Reasons | Shape::Paths => {
            format!("{path}[{index}]")
        }
    }
}

/// The key's line with its value, or the value `index` of its list, replaced.
fn line_with(key: &Key, index: usize, literal: &str) -> String {
    match key.shape {
        Shape::One(_) => format!("{} = {literal}\n", key.name),
        Shape::List(_) | Shape::Records | Shape::Reasons | Shape::Paths => {
            let inner = key.example.trim_matches(['[', ']']);
            let mut values: Vec<&str> = inner.split(", ").collect();
            values[index] = literal;
            format!("{} = [{}]\n", key.name, values.join(", "))
        }
        // What is more than the example has stands before it, as zero if it may be.
        Shape::Leading(_, items) => {
            let filler = |item: &Item| match item {
                Item::Choice(words) => format!("\"{}\"", words[0]),
                Item::Quantity { unit, range, .. } => {
                    format!("\"{} {unit}\"", if range.contains(0.0) { 0 } else { 1 })
                }
                Item::Number(_) => "0".to_owned(),
                _ => panic!("a quantity or a number is expected"),
            };
            let mut values: Vec<String> = items.iter().take(index.max(1) + 1).map(filler).collect();
            values[index] = literal.to_owned();
            format!("{} = [{}]\n", key.name, values.join(", "))
        }
        Shape::Rows(..) => {
            let (row, rest) = key.example[2..].split_once(']').expect("rows");
            let mut values: Vec<&str> = row.split(", ").collect();
            values[index] = literal;
            format!("{} = [[{}]{rest}\n", key.name, values.join(", "))
        }
    }
}

/// Bad literals for an item: what is wrong, the text, the code.
fn bad_literals(item: Item) -> Vec<(&'static str, String, Code)> {
    let mut bad = vec![("table", "{ a = 1 }".to_owned(), codes::WRONG_TYPE)];
    if !matches!(item, Item::Flag) {
        bad.push(("wrong type", "true".to_owned(), codes::WRONG_TYPE));
    }
    match item {
        Item::Quantity { unit, range, .. } => {
            bad.push(("no unit", "3".to_owned(), codes::UNIT_MISSING));
            bad.push(("no unit", "3.5".to_owned(), codes::UNIT_MISSING));
            bad.push(("no unit", "\"3\"".to_owned(), codes::UNIT_MISSING));
            bad.push(("wrong unit", "\"3 W\"".to_owned(), codes::WRONG_DIMENSION));
            bad.push(("unknown unit", "\"3 furlong\"".to_owned(), codes::UNKNOWN_UNIT));
            bad.push(("unknown unit", format!("\"3 furlong {unit}\""), codes::UNKNOWN_UNIT));
            bad.push(("no number", format!("\"{unit}\""), codes::BAD_QUANTITY));
            bad.push(("empty", "\"\"".to_owned(), codes::BAD_QUANTITY));
            bad.push(("not finite", "nan".to_owned(), codes::NOT_FINITE));
            bad.push(("not finite", "-inf".to_owned(), codes::NOT_FINITE));
            bad.push(("not finite", format!("\"nan {unit}\""), codes::NOT_FINITE));
            bad.push(("overflow", format!("\"1e400 {unit}\""), codes::NOT_FINITE));
            bad.push(("underflow", format!("\"1e-400 {unit}\""), codes::NOT_FINITE));
            bad.push(("too large", format!("\"1e30 {unit}\""), codes::OUT_OF_RANGE));
            bad.push(("too small", format!("\"-1e30 {unit}\""), codes::OUT_OF_RANGE));
            if !range.contains(0.0) {
                bad.push(("zero", format!("\"0 {unit}\""), codes::OUT_OF_RANGE));
            }
        }
        Item::Number(range) => {
            bad.push(("text", "\"0.1\"".to_owned(), codes::WRONG_TYPE));
            bad.push(("not finite", "nan".to_owned(), codes::NOT_FINITE));
            bad.push(("not finite", "inf".to_owned(), codes::NOT_FINITE));
            bad.push(("overflow", "1e999".to_owned(), codes::NOT_FINITE));
            bad.push(("underflow", "1e-999".to_owned(), codes::NOT_FINITE));
            bad.push(("too large", format!("{:?}", range.max * 1.01), codes::OUT_OF_RANGE));
            bad.push(("too small", format!("{:?}", range.min - 0.001), codes::OUT_OF_RANGE));
        }
        Item::Integer(min, max) => {
            bad.push(("text", format!("\"{min}\""), codes::WRONG_TYPE));
            bad.push(("fraction", format!("{min}.5"), codes::WRONG_TYPE));
            bad.push(("not finite", "nan".to_owned(), codes::NOT_FINITE));
            bad.push(("too small", (min - 1).to_string(), codes::OUT_OF_RANGE));
            bad.push(("too large", (max + 1).to_string(), codes::OUT_OF_RANGE));
            bad.push(("beyond 64 bits", "99999999999999999999".to_owned(), codes::OUT_OF_RANGE));
        }
        Item::Choice(words) => {
            bad.push(("unknown word", "\"other\"".to_owned(), codes::UNKNOWN_CHOICE));
            bad.push(("capitals", format!("\"{}\"", words[0].to_uppercase()), codes::UNKNOWN_CHOICE));
            bad.push(("number", "1".to_owned(), codes::WRONG_TYPE));
        }
        Item::Flag => {
            bad.push(("text", "\"true\"".to_owned(), codes::WRONG_TYPE));
            bad.push(("number", "1".to_owned(), codes::WRONG_TYPE));
        }
        Item::File => {
            bad.push(("number", "1".to_owned(), codes::WRONG_TYPE));
            for name in ["", " ", "/etc/hosts", "C:/a.csv", "a\\\\b.csv"] {
                bad.push(("not relative", format!("\"{name}\""), codes::RECORD_PATH));
            }
        }
        Item::Reason => {
            for reason in ["true", "\"\"", "\"yes\"", "1"] {
                bad.push(("no reason", reason.to_owned(), codes::WRONG_TYPE));
            }
        }
        Item::Columns => {
            for columns in ["\"\"", "\"drive_V\"", "2"] {
                bad.push(("no description", columns.to_owned(), codes::WRONG_TYPE));
            }
        }
        Item::Name => {
            for name in ["", "1st", "two words", "größe", "a/b"] {
                bad.push(("not a name", format!("\"{name}\""), codes::BAD_NAME));
            }
            bad.push(("too long", format!("\"{}\"", "a".repeat(65)), codes::BAD_NAME));
        }
    }
    bad
}

#[test]
fn every_key_is_checked_in_every_way() {
    let mut bench = Bench::new();
    assert!(errors(&bench.findings(&every_key())).is_empty());
    for section in sections() {
        for key in section.keys {
            let path = Bench::path(section, key.name);
            let case = |lines: String, code, about: &str, what| Case {
                key,
                path: &path,
                lines,
                code,
                about: about.to_owned(),
                what,
                bad: "",
            };
            for (i, item) in items(key).into_iter().enumerate() {
                let about = item_path(key, &path, i);
                for (what, literal, code) in bad_literals(item) {
                    let case = case(line_with(key, i, &literal), code, &about, what);
                    bench.check(section, Case { bad: &literal, ..case }, 0);
                }
            }
            if !matches!(key.shape, Shape::One(_)) {
                bench.check(section, case(format!("{} = 1\n", key.name), codes::WRONG_TYPE, &path, "not an array"), 0);
            }
            if let Shape::Rows(..) = key.shape {
                let (_, rest) = key.example.split_once("], ").expect("rows");
                let rows = format!("{} = [{rest}\n", key.name);
                bench.check(section, case(rows, codes::WRONG_COUNT, &path, "a row too few"), 0);
                let row = format!("{} = [[], {rest}\n", key.name);
                bench.check(section, case(row, codes::WRONG_COUNT, &format!("{path}[0]"), "an empty row"), 0);
                let row = format!("{} = [1, {rest}\n", key.name);
                bench.check(section, case(row, codes::WRONG_TYPE, &format!("{path}[0]"), "a row that is none"), 0);
            }
            if let Shape::List(_) | Shape::Leading(..) = key.shape {
                let longer = format!("{}{}]", key.example.trim_end_matches(']'), ", 1".repeat(5));
                bench.check(
                    section,
                    case(format!("{} = {longer}\n", key.name), codes::WRONG_COUNT, &path, "too many"),
                    0,
                );
                bench.check(section, case(format!("{} = []\n", key.name), codes::WRONG_COUNT, &path, "empty"), 0);
            }
            let good = format!("{} = {}\n", key.name, key.example);
            bench.check(section, case(format!("{good}{good}"), codes::DUPLICATE, &path, "twice"), 1);
            let slip = format!("{}x = {}\n", key.name, key.example);
            bench.check(
                section,
                case(slip.clone(), codes::UNKNOWN_KEY, &Bench::path(section, &format!("{}x", key.name)), "misspelt"),
                0,
            );
            let (text, _) = Bench::with(section, key, &slip);
            let findings = bench.findings(&text);
            let help = &errors(&findings)[0].help;
            assert!(help.contains(&format!("`{}`", key.name)), "{path}: {help}");
        }
    }
    // Fewer would mean that the loops above have come to skip something.
    assert!(bench.cases > 1000, "{} cases", bench.cases);
    assert!(bench.foreign.is_empty(), "{}:\n{}", bench.foreign.len(), bench.foreign.join("\n"));
    assert!(bench.offered > 400, "{} lines offered", bench.offered);
    println!("{} cases, {} lines offered", bench.cases, bench.offered);
}

#[test]
fn every_key_may_be_missing_only_if_it_has_a_default() {
    let mut bench = Bench::new();
    for section in sections() {
        for key in section.keys {
            let path = Bench::path(section, key.name);
            let (text, _) = Bench::with(section, key, "");
            let findings = bench.findings(&text);
            let errors = errors(&findings);
            for found in &errors {
                let (code, about, lines) = (codes::MISSING_KEY, found.key.clone(), String::new());
                let case = Case { key, path: &path, lines, code, about, what: "missing", bad: "" };
                bench.offered_by(section, &case, &found.help);
            }
            if path == "geometry.joints" {
                // Without any form, the keys of the first are missing.
                assert!(errors.len() == 4 && errors.iter().all(|d| d.code == codes::MISSING_KEY), "{findings:#?}");
                continue;
            }
            if path == "hysteresis.rate" {
                // What belongs to another value than the default is then refused.
                assert!(errors.len() == 2 && errors.iter().all(|d| d.code == codes::RATE_KEYS), "{findings:#?}");
                continue;
            }
            match key.presence {
                Presence::Required | Presence::Form(_) => {
                    assert_eq!(errors.len(), 1, "{path}: {findings:#?}");
                    assert_eq!((errors[0].code, errors[0].key.as_str()), (codes::MISSING_KEY.id, path.as_str()));
                    assert!(errors[0].help.contains(key.name), "{path}: {}", errors[0].help);
                    let header = section.header();
                    let line = 1 + text[..text.find(&header).expect("header")].matches('\n').count();
                    assert_eq!(line_of(errors[0], &text), line, "{path} points at its section");
                }
                Presence::InsteadOf(_) => {
                    assert_eq!(errors.len(), 1, "{path}: {findings:#?}");
                    assert_eq!(errors[0].code, codes::ALTERNATIVES, "{path}");
                    assert!(!errors[0].help.is_empty());
                }
                // Without its mode the adaptation rests; the weights are then pointed out, not refused.
                Presence::Default(_) | Presence::Optional => {
                    assert!(errors.is_empty(), "{path}: {findings:#?}")
                }
                Presence::Rule(rule) => {
                    let found: Vec<_> = errors.iter().map(|d| (d.code, d.key.as_str())).collect();
                    let expected = [(codes::MISSING_KEY.id, path.as_str())];
                    assert_eq!(found, if rule.contains("error") { &expected[..] } else { &[] }, "{path}: {rule}");
                }
            }
        }
    }
    assert!(bench.foreign.is_empty(), "{}:\n{}", bench.foreign.len(), bench.foreign.join("\n"));
}

#[test]
fn every_section_may_be_missing_only_if_nothing_in_it_is_required() {
    let bench = Bench::new();
    let whole = every_key();
    // Without [control] its parts are refused; repeated sections are counted: both have tests of their own.
    let apart = |section: &Section| matches!(section.kind, Kind::Repeated(..)) || section.name == "control";
    for section in sections().filter(|s| !s.name.is_empty() && s.name != "target" && !apart(s)) {
        let start = whole.find(&format!("[{}]\n", section.name)).expect("section");
        let end = whole[start + 1..].find("\n[").map_or(whole.len(), |i| start + 2 + i);
        let text = format!("{}{}", &whole[..start], &whole[end..]);
        let findings = bench.findings(&text);
        let errors = errors(&findings);
        if section.is_required() {
            let required = section.keys.iter().find(|key| key.presence == Presence::Required);
            assert_eq!(errors.len(), 1, "{}: {findings:#?}", section.name);
            assert_eq!((errors[0].code, errors[0].key.as_str()), (codes::MISSING_SECTION.id, section.name));
            assert!(errors[0].help.contains(required.expect("one").name));
            let (_, lines) = errors[0].help.split_once("Write:\n").expect("lines");
            let again = bench.findings(&format!("{text}\n{lines}\n"));
            let refused = |d: &Diagnostic| d.code == codes::PLACEHOLDER.id && d.key.starts_with(section.name);
            assert!(again.iter().any(refused) && again.iter().all(refused), "{again:#?}");
        } else {
            assert!(errors.is_empty(), "{}: {findings:#?}", section.name);
        }
    }
}

#[test]
fn all_findings_of_a_file_come_in_one_run() {
    let mut text = every_key();
    for (good, bad) in [
        ("base_radius = \"150 mm\"", "base_radius = 150"),
        ("mass = \"1.195 kg\"", "mass = 1.195 kg"),
        ("stacks = 5", "stacks = 5\nstacks = 6"),
        ("period = \"200 us\"", "perod = \"200 V\""),
        ("bits = 16", "bits = 160"),
        ("mode = \"pcc\"", "mode = \"pxc\""),
        ("[sensor]", "[sensors]"),
    ] {
        assert!(text.contains(good), "{good}");
        text = text.replacen(good, bad, 1);
    }
    let bench = Bench::new();
    let findings = bench.findings(&text);
    let found: Vec<&str> = errors(&findings).iter().map(|d| d.code).collect();
    for code in [
        codes::UNIT_MISSING,
        codes::UNQUOTED,
        codes::DUPLICATE,
        codes::UNKNOWN_KEY,
        codes::WRONG_DIMENSION,
        codes::OUT_OF_RANGE,
        codes::UNKNOWN_CHOICE,
        codes::UNKNOWN_SECTION,
    ] {
        assert_eq!(found.iter().filter(|c| **c == code).count(), 1, "{} in {found:?}", code.id);
    }
    assert_eq!(found.len(), 8, "{findings:#?}");
}

/// Four outputs and an input are taken; an output or an input more is refused at its own place, whatever stands between.
#[test]
fn a_spec_has_at_most_four_output_lines_and_an_input() {
    let of = |kinds: &[&str]| {
        let lines = kinds.iter().enumerate();
        let lines = lines.map(|(line, kind)| format!("\n[[trigger]]\nname = \"line{line}\"\nkind = \"{kind}\"\n"));
        let text = PLATFORM.text() + &lines.collect::<String>();
        Bench::new().findings(&text)
    };
    let accepted = of(&["motion", "input", "ticks", "motion", "points"]);
    assert!(errors(&accepted).is_empty(), "{accepted:?}");
    for (kinds, place) in [
        (&["motion", "input", "ticks", "motion", "points", "motion"][..], "trigger[5]"),
        (&["input", "motion", "ticks", "input"], "trigger[3]"),
    ] {
        let found = of(kinds);
        let one = matches!(&errors(&found)[..], [one] if one.code == codes::TOO_MANY_TRIGGERS.id && one.key == place);
        assert!(one, "{found:?}");
    }
}
