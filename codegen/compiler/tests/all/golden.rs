//! Compares every constant, margin and finding of many specs with committed text (`golden/`), so that a wrong number is reported with
//! its field. This detects changes but does not prove correctness: that is left to the tests of each module and those in `tests/`.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use specgen_compiler::assumed::Assumptions;
use specgen_compiler::compile::check_stability;
use specgen_compiler::ir::Ir;
use specgen_compiler::lower::{Origin, setpoint};
use specgen_compiler::{demand, lint, lower, reach, requirements, rest};
use specgen_identify::everett::EverettTable;
use specgen_identify::waveform::{self, Waveform};
use specgen_language::diagnostic::{Diagnostic, Place, Severity};
use specgen_language::model::{Model, RateDependence, TrajectoryKind};
use specgen_language::spec::{self, SpecSource};

#[expect(dead_code, reason = "the cases are only read here")]
#[path = "../../../../tests/src/cases.rs"]
mod cases;

/// Specs below `specs/`: first one of each kind of controller, written in full; of the others only the differences.
const SPECS: [&str; 19] = [
    "reference.toml",
    "legs.toml",
    "minimal.toml",
    "features/ewma-bandwidth.toml",
    "features/f32.toml",
    "features/leg-setpoint.toml",
    "features/m4f.toml",
    "features/offset-load.toml",
    "features/platform-calibration.toml",
    "features/platform-damping.toml",
    "features/platform-environment.toml",
    "features/platform-f32.toml",
    "features/platform-force-sensor.toml",
    "features/platform-frames.toml",
    "features/platform-gains.toml",
    "features/platform-joints.toml",
    "features/platform-no-notch.toml",
    "features/run-interval.toml",
    "features/six-records.toml",
];
/// Number of specs that are written in full.
const IN_FULL: usize = 2;
/// Specs with slips, and the factors for the numbers of each line.
const SLIPPED: [&str; 3] = ["reference.toml", "legs.toml", "features/platform-calibration.toml"];
const FACTORS: [f64; 5] = [-1.0, 1e-3, 0.3, 10.0, 1e3];
/// A line of numbers longer than this is written as its digest.
const WIDEST: usize = 160;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(name: &str) -> SpecSource {
    let path = root().join("specs").join(name);
    SpecSource { display_name: name.to_owned(), ..SpecSource::read(&path).unwrap() }
}

/// A committed text that is regenerated line by line and fails at the first difference; SPECGEN_BLESS=1 replaces it.
struct Golden {
    file: &'static str,
    committed: Vec<String>,
    found: Vec<String>,
    bless: bool,
}

impl Golden {
    fn open(file: &'static str) -> Self {
        let text = std::fs::read_to_string(Self::path(file)).unwrap_or_default();
        let bless = std::env::var_os("SPECGEN_BLESS").is_some();
        Self { file, committed: text.lines().map(str::to_owned).collect(), found: Vec::new(), bless }
    }

    fn path(file: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(file)
    }

    fn line(&mut self, line: impl Into<String>) {
        let line = line.into();
        self.compare(self.committed.get(self.found.len()), Some(&line));
        self.found.push(line);
    }

    fn end(self) {
        self.compare(self.committed.get(self.found.len()), None);
        if self.bless {
            std::fs::write(Self::path(self.file), self.found.join("\n") + "\n").unwrap();
        }
    }

    fn compare(&self, committed: Option<&String>, found: Option<&String>) {
        assert!(
            self.bless || committed == found,
            "golden/{}, `SPECGEN_BLESS=1 cargo test -p specgen-compiler --test all golden` if that is meant:\nwas {committed:?}\nis  {found:?}",
            self.file
        );
    }
}

/// One line for each field with exact numbers: the shortest text that reads back to the same number.
fn fields(path: &str, value: &Value, lines: &mut Vec<String>) {
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| fields(&format!("{path}.{key}"), value, lines)),
        Value::Array(items) if !items.iter().all(is_numbers) => {
            items.iter().enumerate().for_each(|(at, value)| fields(&format!("{path}[{at}]"), value, lines));
        }
        value => {
            let mut text = value.to_string();
            if text.len() > WIDEST {
                text = format!("{} bytes, sha256 {}", text.len(), digest(&text));
            }
            lines.push(format!("{path} = {text}"));
        }
    }
}

fn is_numbers(value: &Value) -> bool {
    value.as_array().map_or(value.is_number(), |items| items.iter().all(is_numbers))
}

fn digest(text: &str) -> String {
    let mut digest = specgen_toolchain::sha256(text.as_bytes());
    digest.truncate(16);
    digest
}

/// Result of compiling a spec.
struct GoldenOutput {
    ir: Ir,
    /// Margins, demands of the trajectories, stopping distances, noise of the pose.
    figures: Value,
    findings: Vec<Diagnostic>,
}

/// A table without an identified record: uneven, so that no two nodes are equal.
fn table(model: &Model, scale: f64) -> EverettTable {
    let (grid, [min, max]) = (model.hysteresis.grid, model.actuator.voltage);
    let share = |k: usize| k as f64 / grid as f64;
    let node = |up: usize, down: usize| {
        let (u, v) = (share(up), share(down));
        scale * model.actuator.leg_gain() * (max - min) * (u - v) * (0.8 + 0.15 * u + 0.05 * v)
    };
    let nodes = (1..=grid).flat_map(|up| (0..up).map(move |down| node(up, down))).collect();
    EverettTable { grid, drive_min: min, drive_max: max, nodes }
}

fn waveforms(source: &SpecSource, model: &Model, table: Option<&str>) -> Vec<Option<Waveform>> {
    let trajectories = model.task_space.iter().flat_map(|task| &task.trajectories);
    trajectories
        .map(|trajectory| match &trajectory.kind {
            TrajectoryKind::Waveform { file, period, .. } => {
                let read = || std::fs::read_to_string(source.dir.join(file)).ok();
                waveform::parse(&table.map(str::to_owned).or_else(read)?, file, *period, None).ok()
            }
            _ => None,
        })
        .collect()
}

/// The phases of the compiler in this crate, without reading records and without emitting; with a table of poses, if the spec
/// references one.
fn build(source: &SpecSource, table_of_poses: Option<&str>) -> Result<GoldenOutput, Vec<Diagnostic>> {
    let (model, _) = spec::load_as_far(source);
    let Some(model) = model else { return Err(Vec::new()) };
    let mut findings = lint::check(&model);
    findings.extend(lint::estimated(&model));
    lint::allow(&model, &mut findings);
    if findings.iter().any(|finding| finding.severity == Severity::Error) {
        return Err(findings);
    }
    let stability = check_stability(&model).map_err(|found| findings.extend(found));
    let lowered = match &model.task_space {
        None => Ok(None),
        Some(task) => {
            let waveforms = waveforms(source, &model, table_of_poses);
            findings.extend(waveforms.iter().flatten().filter_map(setpoint::step));
            setpoint::lower(&model, task, &waveforms, lower::scalar(&model)).map(Some)
        }
    };
    let lowered = lowered.map_err(|found| findings.extend(found));
    let (Ok((margins, design)), Ok(lowered)) = (stability, lowered) else { return Err(findings) };
    findings.extend(design.iter().flat_map(|design| design.findings.clone()));
    let setpoints = lowered.map(|(setpoints, warnings)| {
        findings.extend(warnings);
        setpoints
    });
    let mut figures = json!({ "margins": margins, "design": design });
    if let (Some(task), Some(setpoints)) = (&model.task_space, &setpoints) {
        let platform = lower::platform(&model)?;
        let paths = setpoint::stretches(&model, task, setpoints)?;
        let (demands, found) = lint::paths::check(&model, task, &platform, &paths);
        findings.extend(found);
        figures["demands"] = json!(demands);
        match setpoint::check_stops(&model, task, setpoints, &platform, model.actuator.stroke) {
            Ok(stops) => figures["stops"] = json!(stops),
            Err(found) => {
                findings.extend(found);
                return Err(findings);
            }
        }
    }
    let scales = (0..model.hysteresis.records.len()).map(|leg| 1.0 - 0.01 * leg as f64);
    let mut tables: Vec<EverettTable> = scales.map(|scale| table(&model, scale)).collect();
    if tables.is_empty() {
        tables.push(EverettTable::straight(model.hysteresis.grid, model.actuator.voltage, model.actuator.stroke));
    }
    let rate_tables = match &model.hysteresis.rate {
        RateDependence::DynamicPreisach(files) => {
            (1..=files.len()).map(|leg| table(&model, 1e-3 / leg as f64)).collect()
        }
        _ => Vec::new(),
    };
    let rest = rest::noise(&model, design.as_ref());
    let task = design.as_ref().zip(setpoints);
    let origin = Origin { digest: "digest", assumed: Assumptions::of(&model, Vec::new()).list() };
    let lowered =
        lower::lower(&model, task, &tables, &rate_tables, &[], origin).map_err(|found| findings.extend(found));
    let Ok(ir) = lowered else { return Err(findings) };
    figures["noise"] = json!(format!("{:?}", lower::pose_noise(&model)));
    if let Ok(rest) = &rest {
        findings.extend(rest::check(&model, rest));
    }
    figures["rest"] = json!(format!("{rest:?}"));
    Ok(GoldenOutput { ir, figures, findings })
}

/// In one test: for a mutant, the first difference is enough.
#[test]
fn specs_compile_to_what_is_committed() {
    boundaries();
    constants();
    slipped();
    refusals();
}

/// Every constant and figure of every spec.
fn constants() {
    let (mut golden, mut known) = (Golden::open("constants.txt"), BTreeSet::new());
    for (index, name) in SPECS.into_iter().enumerate() {
        let source = read(name);
        let built = build(&source, None).unwrap_or_else(|findings| panic!("{name}: {findings:#?}"));
        let mut lines = Vec::new();
        fields("ir", &json!(built.ir), &mut lines);
        fields("figures", &built.figures, &mut lines);
        lines.extend(built.findings.iter().map(|finding| line(&source, finding)));
        golden.line(format!("# {name}"));
        for line in lines {
            if !known.contains(&line) {
                golden.line(line.as_str());
            }
            if index < IN_FULL {
                known.insert(line);
            }
        }
    }
    golden.end();
}

/// A finding with its complete text, and the text of the spec at its place.
fn line(source: &SpecSource, finding: &Diagnostic) -> String {
    assert_numbers(source, finding);
    let Diagnostic { severity, code, key, place, message, help, .. } = finding;
    let place = match place {
        Place::Spec(span) => format!("{:?}", &source.text[span.clone()]),
        place => format!("{place:?}"),
    };
    format!("{severity:?} {code} {key} at {place}: {message}; {help}")
}

/// Errors and warnings.
fn refusals() {
    let (mut golden, mut known) = (Golden::open("refusals.txt"), BTreeSet::new());
    for (case, _) in cases::read(&root().join("tests/cases/changed_specs.txt")) {
        let (base, edits) = (case.one('@').unwrap(), case.all('-').zip(case.all('+')).collect::<Vec<_>>());
        let source = read(base);
        let text = case.edited(&with_trajectories(&source.text, usize::from(case.title == "paths")));
        let source = SpecSource { text, ..source };
        let rows = case.one('t').map(poses);
        golden.line(format!("# {base}: {edits:?}"));
        let mut findings = build(&source, rows.as_deref()).map_or_else(
            |found| found,
            |built| {
                let mut lines = Vec::new();
                fields("ir", &json!(built.ir), &mut lines);
                fields("figures", &built.figures, &mut lines);
                golden.line(format!("accepted: {}", digest(&lines.join("\n"))));
                built.findings
            },
        );
        lint::say_once(&mut findings);
        for line in findings.iter().map(|finding| line(&source, finding)) {
            if !known.contains(&line) {
                golden.line(line.as_str());
            }
            known.insert(line);
        }
    }
    golden.end();
}

/// A table of poses by its name: up and back in x and about y.
fn poses(name: &str) -> String {
    let row = |k: u32| {
        let part = 0.5 * (1.0 - libm::cos(core::f64::consts::TAU * f64::from(k) / 100.0));
        let wave = format!("{:.6},{:.6}", 3.0 * part, 40.0 * part);
        match name {
            "wave" => wave,
            "one_lost" if k == 50 => "-90,0".to_owned(),
            "one_lost" => wave,
            "ramp" => format!("{:.3},0", 0.6 * f64::from(k)),
            "steep" => format!("{:.3},0", 0.4 * f64::from(if k > 50 { 100 - k } else { k })),
            _ => panic!("no table {name}"),
        }
    };
    "x_um,theta_y_urad\n".to_owned() + &(0..=100).map(|k| row(k) + "\n").collect::<String>()
}

/// The text with only the first `count` trajectories.
fn with_trajectories(text: &str, count: usize) -> String {
    const BEGIN: &str = "[[trajectory]]";
    let at: Vec<usize> = text.match_indices(BEGIN).map(|(at, _)| at).collect();
    match at.get(count) {
        Some(&first) => text[..first].to_owned() + &text[text.find("[timing]").unwrap()..],
        None => text.to_owned(),
    }
}

/// Findings of the physical lint at the boundary of each rule.
fn boundaries() {
    let mut golden = Golden::open("boundaries.txt");
    for (rule, _) in cases::read(&root().join("tests/cases/lint_boundaries.txt")) {
        let base = rule.one('@').unwrap_or("reference.toml");
        let source = read(base);
        let (olds, news): (Vec<&str>, Vec<&str>) = (rule.all('-').collect(), rule.all('+').collect());
        let (text, raises) = (olds[olds.len() - 1], news[olds.len() - 1]);
        let with = olds
            .iter()
            .zip(&news)
            .take(olds.len() - 1)
            .fold(source.text.clone(), |text, (from, to)| text.replacen(from, to, 1));
        let known = said(&SpecSource { text: with.clone(), ..source.clone() });
        for to in [raises, rule.one('=').unwrap()] {
            let changed = with.replacen(text, to, 1);
            golden.line(format!("# {base}: {} {text:?} -> {to:?}", &rule.title[..5]));
            for line in said(&SpecSource { text: changed, ..source.clone() }).difference(&known) {
                golden.line(line.as_str());
            }
        }
    }
    golden.end();
}

/// Findings of the physical lint.
fn said(source: &SpecSource) -> BTreeSet<String> {
    let (model, _) = spec::load_as_far(source);
    model.iter().flat_map(lint::check).map(|finding| line(source, &finding)).collect()
}

/// Findings of the physical lint about slips.
fn slipped() {
    let mut golden = Golden::open("slips.txt");
    for name in SLIPPED {
        let source = read(name);
        golden.line(format!("# {name}: line, factor, codes and digest of the findings of the physical lint"));
        for factor in FACTORS {
            for (at, slip) in slips(&source.text, factor) {
                let source = SpecSource { text: slip, ..source.clone() };
                let (model, _) = spec::load_as_far(&source);
                let Some(model) = model else { continue };
                let found = lint::check(&model);
                let codes: Vec<&str> = found.iter().map(|finding| finding.code).collect();
                let said: String = found.iter().map(|finding| line(&source, finding)).collect();
                golden.line(format!("{at} x {factor}: {} {}", codes.join(" "), digest(&said)));
            }
        }
    }
    golden.end();
}

/// The text with the numbers of one line multiplied, for each line that has any.
fn slips(text: &str, factor: f64) -> Vec<(usize, String)> {
    let lines: Vec<&str> = text.lines().collect();
    let slip = |at: usize| {
        let (key, value) = lines[at].split_once('=')?;
        let changed = format!("{key}={}", multiplied(value.split('#').next()?, factor)?);
        let lines = [&lines[..at], &[changed.as_str()], &lines[at + 1..]].concat();
        Some((at + 1, lines.join("\n") + "\n"))
    };
    (0..lines.len()).filter_map(slip).collect()
}

/// Every number in a value multiplied; none if there is no number.
fn multiplied(value: &str, factor: f64) -> Option<String> {
    const ENDS: [char; 5] = [' ', ',', '[', ']', '"'];
    let mut changed = String::new();
    let mut any = false;
    for word in value.split_inclusive(ENDS) {
        let (number, end) = word.split_at(word.trim_end_matches(ENDS).len());
        match number.parse::<f64>() {
            Ok(number) if number != 0.0 => {
                any = true;
                let _ = write!(changed, "{}{end}", number * factor);
            }
            _ => changed.push_str(word),
        }
    }
    any.then_some(changed)
}

/// Whether a word is `NaN`, `inf`, or negative zero, such as `-0.00`.
fn is_no_number(word: &str) -> bool {
    let word = word.trim_matches(|letter: char| !letter.is_alphanumeric() && letter != '-').trim_end_matches('-');
    let number = word.parse::<f64>();
    number.is_ok_and(|number| !number.is_finite() || (number == 0.0 && number.is_sign_negative()))
}

/// Checks that message and help of a finding contain no such word.
fn assert_numbers(source: &SpecSource, finding: &Diagnostic) {
    let text = format!("{} {}", finding.message, finding.help);
    // Words of a message, and its quoted values.
    let mut words = text.split(|letter: char| letter.is_whitespace() || "\"'`[](),;:=/".contains(letter));
    assert!(!words.any(is_no_number), "{}: {finding:?}", source.display_name);
}

#[test]
fn a_word_that_is_no_number_is_known() {
    for word in ["NaN", "inf", "-inf", "-0.00", "-0", "(-0.0)", "inf."] {
        assert!(is_no_number(word), "{word}");
    }
    for word in ["0.00", "-0.01", "in", "-", "1e-9", "information", "x-0"] {
        assert!(!is_no_number(word), "{word}");
    }
}

/// All findings before emission, of specs with the numbers of one line multiplied, also by zero.
#[test]
fn no_finding_says_a_number_that_is_none() {
    let full = std::env::var_os("SPECGEN_FULL").is_some();
    // In the short run, every third line of one spec.
    let (specs, factors, step): (&[&str], &[f64], usize) = if full {
        (&SPECS, &[0.0, -1.0, 1e-9, 1e-3, 0.3, 10.0, 1e3, 1e9], 1)
    } else {
        (&["features/platform-calibration.toml"], &[0.0], 3)
    };
    let mut sources: Vec<SpecSource> = specs.iter().map(|name| read(name)).collect();
    // A gauge with far too wide a range and zero noise, of which nothing is a multiple.
    let silent = read("minimal.toml");
    let wide = silent.text.replacen("[\"-2 um\", \"48 um\"]", "[\"-300 um\", \"300 um\"]", 1);
    assert_ne!(wide, silent.text);
    sources.push(SpecSource { text: wide, ..silent });
    let mut count = 0;
    // Specs share most of their lines: each line is tried with every factor in the first spec that has it.
    let mut tried = BTreeSet::new();
    for source in sources {
        let mut texts = vec![source.text.clone()];
        for (number, factor) in factors.iter().enumerate() {
            for (at, slip) in slips(&source.text, *factor).into_iter().step_by(step) {
                let line = source.text.lines().nth(at - 1).unwrap_or_default().to_owned();
                texts.extend(tried.insert((line, number)).then_some(slip));
            }
        }
        for text in texts {
            let source = SpecSource { text, ..source.clone() };
            let (model, mut found) = spec::load_as_far(&source);
            if let Some(model) = &model {
                found.extend(reach::check_bounds(model));
                found.extend(requirements::check(model).err().unwrap_or_default());
                let declared = setpoint::declared(model, &source.dir);
                let setpoints = declared.as_ref().ok().and_then(|declared| declared.setpoints.as_ref());
                found.extend(demand::check(model, setpoints, &[]).map_or_else(|found| found, |demand| demand.warnings));
                found.extend(declared.map_or_else(|found| found, |declared| declared.warnings));
            }
            found.extend(build(&source, None).map_or_else(|found| found, |built| built.findings));
            found.iter().for_each(|finding| assert_numbers(&source, finding));
            count += found.len();
        }
    }
    println!("{count} findings");
    assert!(count > if full { 1000 } else { 10 }, "{count} findings");
}

#[test]
fn numbers_are_multiplied_and_words_are_not() {
    assert_eq!(multiplied(" [\"40 um\", \"-1e-3 m/s^2\"] ", 10.0).unwrap(), " [\"400 um\", \"-0.01 m/s^2\"] ");
    assert_eq!(multiplied("0.5", 2.0).unwrap(), "1");
    assert_eq!(multiplied(" \"case-1\"", 2.0), None);
    let found = slips("[a]\nb = 1 # 3\nc = \"x\"\nd = [2, 4]\n", 3.0);
    let expected = [(2, "[a]\nb = 3 \nc = \"x\"\nd = [2, 4]\n"), (4, "[a]\nb = 1 # 3\nc = \"x\"\nd = [6, 12]\n")];
    assert_eq!(found, expected.map(|(line, text)| (line, text.to_owned())));
}

#[test]
fn one_ulp_in_any_field_is_a_difference() {
    let built = build(&read("legs.toml"), None).unwrap_or_else(|findings| panic!("{findings:#?}"));
    let text = |value: &Value| {
        let mut lines = Vec::new();
        fields("all", value, &mut lines);
        lines.join("\n")
    };
    let long: Vec<f64> = (1..100).map(|k| 1.0 / f64::from(k)).collect();
    let value =
        json!({ "margins": built.figures, "kinematics": built.ir.kinematics, "bounds": built.ir.bounds, "long": long });
    let committed = text(&value);
    let mut tried = 0;
    let mut wrong = value.clone();
    each_number(&value, &mut String::new(), &mut |at| {
        let number = wrong.pointer_mut(at).unwrap();
        let right = number.clone();
        *number = json!(right.as_f64().unwrap().next_up());
        assert_ne!(text(&wrong), committed, "{at}");
        *wrong.pointer_mut(at).unwrap() = right;
        tried += 1;
    });
    assert!(tried > 100, "{tried} numbers");
}

#[test]
fn a_line_that_is_another_or_missing_or_one_too_many_is_a_difference() {
    let run = |lines: &'static [&str]| {
        std::panic::catch_unwind(|| {
            let committed = vec!["a".to_owned(), "b".to_owned()];
            let mut golden = Golden { file: "none", committed, found: Vec::new(), bless: false };
            lines.iter().for_each(|line| golden.line(*line));
            golden.end();
        })
    };
    assert!(run(&["a", "b"]).is_ok());
    for wrong in [&["a"][..], &["a", "c"], &["b", "b"], &["a", "b", "c"], &[]] {
        assert!(run(wrong).is_err(), "{wrong:?}");
    }
}

/// Every floating-point number, by its JSON pointer.
fn each_number(value: &Value, at: &mut String, act: &mut impl FnMut(&str)) {
    let length = at.len();
    let mut inside = |key: &str, value: &Value| {
        let _ = write!(at, "/{key}");
        each_number(value, at, act);
        at.truncate(length);
    };
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| inside(key, value)),
        Value::Array(items) => items.iter().enumerate().for_each(|(k, value)| inside(&k.to_string(), value)),
        value if value.is_f64() => act(at),
        _ => {}
    }
}
