//! The corpus of bad specs with the text that a user sees, and what is wrong with a file as a whole.

// Clippy sees the helpers of an integration test as production code.
use std::fs;

use crate::support::specs::{errors, every_key, folder_with_records, source};
use specgen::compile::compile_source;
use specgen::diagnostic::{Diagnostic, Place, codes, render, to_json};
use specgen::spec::{self, SpecSource};
use specgen_tests::repository;

/// The text that a user sees, against the committed one; SPECGEN_BLESS=1 writes it.
#[test]
fn the_corpus_is_rendered_as_committed() {
    let corpus = repository().join("tests/corpus");
    let mut files: Vec<_> = fs::read_dir(&corpus).expect("tests/corpus").map(|e| e.expect("readable").path()).collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "toml"));
    files.sort();
    assert!(files.len() >= 20, "{} files in the corpus", files.len());
    let bless = std::env::var_os("SPECGEN_BLESS").is_some();
    let mut stale = Vec::new();
    for path in files {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        let mut source = SpecSource::read(&path).expect("the corpus is UTF-8");
        source.display_name.clone_from(&name);
        source.dir = repository().join("specs");
        let (accepted, findings) = match compile_source(source.clone()) {
            Ok(compiled) => (true, compiled.findings),
            Err(refused) => (false, refused.findings),
        };
        // "ok-…" must pass, everything else be refused.
        assert_eq!(accepted, name.starts_with("ok-"), "{name}:\n{}", render(&findings, &source, false));
        let text = render(&findings, &source, false);
        let expected = path.with_extension("txt");
        if bless {
            fs::write(&expected, &text).expect("written");
        } else if fs::read_to_string(&expected).unwrap_or_default() != text {
            stale.push(format!("{name}, now:\n{text}"));
        }
    }
    assert!(stale.is_empty(), "SPECGEN_BLESS=1 cargo test -p specgen-tests spec_corpus accepts:\n{}", stale.join("\n"));
}

#[test]
fn json_names_file_line_and_column() {
    let folder = folder_with_records();
    let text = every_key().replace("height = \"180 mm\"", "height = \"180 V\"");
    let source = source(&text, "my.toml", &folder);
    let (_, findings) = spec::load(&source);
    let json = to_json(&findings, &source);
    let line = 1 + text.lines().position(|l| l.starts_with("height")).expect("there");
    assert_eq!(json[0]["code"], codes::WRONG_DIMENSION.id);
    assert_eq!(json[0]["severity"], "error");
    assert_eq!(json[0]["key"], "geometry.height");
    assert_eq!(json[0]["file"], "my.toml");
    assert_eq!(json[0]["line"], line);
    assert_eq!(json[0]["column"], 10);
    assert!(json[0]["help"].as_str().is_some_and(|help| help.contains("\"<number> mm\"")));
}

/// The text with every section as an inline table or as dotted keys; sections with double brackets become arrays.
fn flattened(text: &str, inline: bool) -> String {
    let (mut top, mut sections): (String, Vec<(String, String)>) = (String::new(), Vec::new());
    for line in text.lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|l| l.strip_suffix(']')) {
            sections.push((name.to_owned(), String::new()));
        } else if let Some((_, keys)) = sections.last_mut() {
            keys.push_str(&format!("{}{line}", if keys.is_empty() { "" } else { ", " }));
        } else {
            top.push_str(&format!("{line}\n"));
        }
    }
    let mut repeated: std::collections::BTreeMap<String, Vec<String>> = std::collections::BTreeMap::new();
    for (name, keys) in &sections {
        // An inline table is closed: one that holds sections can only be written with dots.
        let holds_sections =
            sections.iter().any(|(other, _)| other.trim_start_matches('[').starts_with(&format!("{name}.")));
        if let Some(name) = name.strip_prefix('[').and_then(|n| n.strip_suffix(']')) {
            repeated.entry(name.to_owned()).or_default().push(format!("{{ {keys} }}"));
        } else if inline && !holds_sections && !name.contains('.') {
            top.push_str(&format!("{name} = {{ {keys} }}\n"));
        }
    }
    for (name, tables) in repeated {
        top.push_str(&format!("{name} = [{}]\n", tables.join(", ")));
    }
    // Line by line, as the keys of an inline table are hard to tell apart again.
    let mut section = None;
    for line in text.lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|l| l.strip_suffix(']')) {
            section = Some(name);
        } else if let Some(name) = section.filter(|name| !name.starts_with('[')) {
            let written = format!("{name} = {{");
            if !top.lines().any(|done| done.starts_with(&written)) {
                top.push_str(&format!("{name}.{line}\n"));
            }
        }
    }
    top
}

#[test]
fn sections_dotted_keys_and_inline_tables_mean_the_same() {
    let folder = folder_with_records();
    let load = |text: &str| {
        let source = source(text, "spec.toml", &folder);
        let (model, findings) = spec::load(&source);
        let mut model = model.unwrap_or_else(|| panic!("{text}\n{}", render(&findings, &source, false)));
        model.spans.clear();
        model
    };
    let plain = load(&every_key());
    assert_eq!(load(&flattened(&every_key(), false)), plain);
    assert_eq!(load(&flattened(&every_key(), true)), plain);
}

/// A megabyte made to hurt: many findings, deep nesting, long lines, long numbers.
#[test]
fn hostile_files_are_refused_in_good_time() {
    let folder = folder_with_records();
    let fill = |piece: &str| piece.repeat(spec::MAX_BYTES / piece.len());
    let numbered: String = (0..60_000).map(|i| format!("k{i} = 1\n")).collect();
    let texts = [
        fill("a=1\n"),
        fill("[geometry]\n"),
        fill("[[gauge]]\n"),
        fill("[[gauge]]\npoint = 1\npoint = 2\n"),
        format!("gauge = [{}]", fill("{},")),
        format!("[geometry]\nbase_joints = [{}]", fill("[1],")),
        fill("mass = 1 kg\n"),
        fill("["),
        format!("a={}", fill("[")),
        fill("a={"),
        format!("{}b=1", fill("a.")[..spec::MAX_BYTES - 4].to_owned()),
        fill("\""),
        format!("[platform]\nmass = \"{}\"", "9".repeat(spec::MAX_BYTES - 40)),
        format!("[platform]\nmass = {}", "9".repeat(spec::MAX_BYTES - 40)),
        format!("[hysteresis]\nrecords = [{}]", "\"x\",".repeat(200_000)),
        format!("[geometry]\n{}", numbered),
        format!("[geometry]\n{}", numbered.replace(" = 1", " = 1 m")),
        format!("{} = 1", "x".repeat(spec::MAX_BYTES - 10)),
        format!("{}\u{b5} = \u{b5} x", "\u{b5}".repeat(spec::MAX_BYTES / 2 - 10)),
    ];
    for text in texts {
        let start = std::time::Instant::now();
        let source = source(&text, "hostile.toml", &folder);
        let (model, findings) = spec::load(&source);
        let shown = render(&findings, &source, false);
        assert!(model.is_none());
        assert!((1..=101).contains(&findings.len()), "{} findings", findings.len());
        assert!(shown.len() < 100_000, "{} characters shown", shown.len());
        // Generous: it takes a tenth of a second in release; a quadratic reader would take minutes.
        let seconds = start.elapsed().as_secs_f64();
        assert!(seconds < 20.0, "{seconds} s for {}", &text[..20.min(text.len())].escape_debug());
        println!(
            "{seconds:.3} s, {} findings: {}",
            findings.len(),
            text.chars().take(24).collect::<String>().escape_debug()
        );
    }
}

mod files {
    //! What is wrong with the file itself.

    use super::*;
    use std::path::Path;

    fn refusal(path: &Path) -> Diagnostic {
        let finding = SpecSource::read(path).expect_err("refused");
        assert!(!finding.help.is_empty());
        let source = SpecSource { display_name: "x".into(), text: String::new(), dir: ".".into() };
        let shown = render(std::slice::from_ref(&finding), &source, false);
        assert!(shown.contains(finding.code) && shown.contains("help"), "{shown}");
        finding
    }

    #[test]
    fn missing_file_and_folder() {
        let folder = tempfile::tempdir().expect("temporary folder");
        assert_eq!(refusal(&folder.path().join("none.toml")).code, codes::UNREADABLE);
        let finding = refusal(folder.path());
        assert_eq!(finding.code, codes::UNREADABLE);
        assert!(finding.message.contains("folder"));
    }

    #[test]
    fn binary_names_byte_and_line() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("binary.toml");
        fs::write(&path, b"schema = 1\nname = \"gr\xf6\xdfe\"\n").expect("written");
        let finding = refusal(&path);
        assert_eq!(finding.code, codes::NOT_TEXT);
        assert!(finding.message.contains("byte 21 (line 2) is 0xf6"), "{}", finding.message);
        assert!(matches!(finding.place, Place::File { line: Some(2), .. }));
    }

    #[test]
    fn huge_file_is_refused_and_just_fitting_one_is_read() {
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join("huge.toml");
        fs::write(&path, vec![b'#'; spec::MAX_BYTES + 1]).expect("written");
        assert_eq!(refusal(&path).code, codes::TOO_LARGE);
        fs::write(&path, vec![b'#'; spec::MAX_BYTES]).expect("written");
        let source = SpecSource::read(&path).expect("fits");
        let (model, findings) = spec::load(&source);
        assert!(model.is_none());
        assert_eq!(findings[0].code, codes::EMPTY);
    }

    #[cfg(unix)]
    #[test]
    fn a_name_that_is_not_utf8_is_read_and_shown() {
        use std::os::unix::ffi::OsStrExt as _;
        let folder = tempfile::tempdir().expect("temporary folder");
        let path = folder.path().join(std::ffi::OsStr::from_bytes(b"pl\xffatform.toml"));
        fs::write(&path, "schema = 2\n").expect("written");
        let source = SpecSource::read(&path).expect("read");
        let (_, findings) = spec::load(&source);
        assert!(render(&findings, &source, true).contains("pl\u{fffd}atform.toml"));
    }

    #[test]
    fn byte_order_mark_line_ends_and_tabs_change_nothing() {
        let folder = folder_with_records();
        let path = folder.path().join("specs/windows.toml");
        let plain = every_key();
        fs::write(&path, format!("\u{feff}{}", plain.replace('\n', "\r\n").replace(" = ", "\t=\t"))).expect("written");
        let (windows, findings) = spec::load(&SpecSource::read(&path).expect("read"));
        assert!(errors(&findings).is_empty(), "{findings:#?}");
        fs::write(&path, plain).expect("written");
        let (unix, _) = spec::load(&SpecSource::read(&path).expect("read"));
        let (mut windows, mut unix) = (windows.expect("model"), unix.expect("model"));
        assert_ne!(windows.spans, unix.spans);
        windows.spans.clear();
        unix.spans.clear();
        assert_eq!(windows, unix);
    }

    #[test]
    fn records_are_looked_for_beside_the_spec() {
        let folder = folder_with_records();
        for (record, code) in [
            ("records/none.csv", codes::RECORD_UNREADABLE),
            ("records", codes::RECORD_UNREADABLE),
            ("records/leg1.csv\\u0000", codes::RECORD_UNREADABLE),
            ("", codes::RECORD_PATH),
            ("/etc/hosts", codes::RECORD_PATH),
            ("C:/leg.csv", codes::RECORD_PATH),
            ("records\\\\leg1.csv", codes::RECORD_PATH),
        ] {
            let text = every_key().replace("records/reference-forc.csv", record);
            let (_, findings) = spec::load(&source(&text, "spec.toml", &folder));
            let errors = errors(&findings);
            assert_eq!(errors.len(), 1, "{record}: {findings:#?}");
            assert_eq!((errors[0].code, errors[0].key.as_str()), (code.id, "hysteresis.records[0]"));
        }
    }
}
