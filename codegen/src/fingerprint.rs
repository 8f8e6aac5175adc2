//! What specs compile to, in a few lines that can be kept and compared: every constant, every margin, and what is said about slips.
//!
//! A golden (`tests/golden/fingerprints.txt`) that a test of this module compares, so that a change of any number of `lower`,
//! `stability` and `lint` shows where it was made.

use std::fmt::Write as _;
use std::path::Path;

use crate::compile::{check_stability, compile_source};
use crate::diagnostic::{Diagnostic, Severity, render};
use crate::spec::{self, SpecSource};
use crate::{lint, workspace};

/// Below the folder of specs: both kinds of controller and what most of their options change.
const SPECS: [&str; 11] = [
    "legs.toml",
    "reference.toml",
    "features/ewma-bandwidth.toml",
    "features/offset-load.toml",
    "features/platform-calibration.toml",
    "features/platform-environment.toml",
    "features/platform-frames.toml",
    "features/platform-gains.toml",
    "features/platform-joints.toml",
    "features/platform-no-notch.toml",
    "features/six-records.toml",
];
/// Specs that slips are made in, and by what each number of them is then multiplied.
const SLIPPED: [&str; 3] = ["legs.toml", "reference.toml", "features/platform-calibration.toml"];
const FACTORS: [f64; 6] = [1e-3, 0.1, 0.5, 2.0, 10.0, 1e3];

/// The lines for the specs below the folder `specs`.
///
/// # Errors
/// A spec that cannot be read, or is refused.
pub fn fingerprints(specs: &Path) -> Result<String, String> {
    let mut text = String::new();
    for name in SPECS {
        let source = read(specs, name)?;
        let compiled = compile_source(source.clone()).map_err(|refused| format!("{name}: {:?}", refused.findings))?;
        let mut line = |what: &str, of: String| {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{name}: {what} {}", digest(&of));
        };
        line("constants", workspace::ir_text(&compiled.ir));
        line("margins", format!("{:?} {:?}", compiled.margins, compiled.design));
        line("travel", format!("{:?} {:?} {:?}", compiled.reach, compiled.demands, compiled.stops));
        line("noise", format!("{:?}", compiled.pose_noise));
        line("findings", render(&compiled.findings, &source, false));
    }
    for name in SLIPPED {
        let source = read(specs, name)?;
        for factor in FACTORS {
            let said: String = slips(&source, factor).iter().map(said).collect();
            let _ = writeln!(text, "{name}: slips by {factor} {}", digest(&said));
        }
    }
    Ok(text)
}

fn read(specs: &Path, name: &str) -> Result<SpecSource, String> {
    let mut source = SpecSource::read(&specs.join(name)).map_err(|finding| finding.message)?;
    name.clone_into(&mut source.display_name);
    Ok(source)
}

fn digest(text: &str) -> String {
    let mut digest = workspace::sha256(text.as_bytes());
    digest.truncate(16);
    digest
}

/// The spec with the numbers of one line multiplied, for each line that has any.
fn slips(source: &SpecSource, factor: f64) -> Vec<SpecSource> {
    let lines: Vec<&str> = source.text.lines().collect();
    let slip = |at: usize| {
        let (key, value) = lines[at].split_once('=')?;
        let changed = format!("{key}={}", multiplied(value.split('#').next()?, factor)?);
        let text = lines[..at].iter().chain([&changed.as_str()]).chain(&lines[at + 1..]);
        let text = text.flat_map(|line| [*line, "\n"]).collect();
        Some(SpecSource { text, ..source.clone() })
    };
    (0..lines.len()).filter_map(slip).collect()
}

/// Every number in a value multiplied; none if there is no number.
fn multiplied(value: &str, factor: f64) -> Option<String> {
    let mut changed = String::new();
    let mut any = false;
    for word in value.split_inclusive([' ', ',', '[', ']', '"']) {
        let (number, end) = word.split_at(word.trim_end_matches([' ', ',', '[', ']', '"']).len());
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

/// Findings of reading, of the physical lint, and of stability where nothing is wrong before it.
fn said(source: &SpecSource) -> String {
    let (model, mut findings) = spec::load_as_far(source);
    findings.extend(model.as_ref().map(lint::check).unwrap_or_default());
    let mut text = String::new();
    let control = source.text.contains("[control]");
    if let Some(model) = model.filter(|_| !control && findings.iter().all(is_no_error)) {
        match check_stability(&model) {
            Ok(margins) => text = format!("{margins:?}"),
            Err(refused) => findings.extend(refused),
        }
    }
    for Diagnostic { code, key, message, help, .. } in &findings {
        let _ = writeln!(text, "{code} {key}: {message}; {help}");
    }
    text
}

fn is_no_error(finding: &Diagnostic) -> bool {
    finding.severity < Severity::Error
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn specs_compile_to_what_is_committed() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let committed = std::fs::read_to_string(root.join("tests/golden/fingerprints.txt")).unwrap();
        let found = fingerprints(&root.join("specs")).unwrap();
        for (committed, found) in committed.lines().zip(found.lines()) {
            assert_eq!(found, committed, "`cargo xtask bless` if that is meant");
        }
        assert_eq!(found.lines().count(), committed.lines().count());
    }

    #[test]
    fn numbers_are_multiplied_and_words_are_not() {
        assert_eq!(multiplied(" [\"40 um\", \"-1e-3 m/s^2\"] ", 10.0).unwrap(), " [\"400 um\", \"-0.01 m/s^2\"] ");
        assert_eq!(multiplied("0.5", 2.0).unwrap(), "1");
        assert_eq!(multiplied(" \"case-1\"", 2.0), None);
        let source = SpecSource { text: "[a]\nb = 1 # 3\nc = \"x\"\nd = [2, 4]\n".to_owned(), ..read_any() };
        let texts: Vec<String> = slips(&source, 3.0).into_iter().map(|slip| slip.text).collect();
        assert_eq!(
            texts,
            ["[a]\nb = 3 \nc = \"x\"\nd = [2, 4]\n", "[a]\nb = 1 # 3\nc = \"x\"\nd = [6, 12]\n"]
                .map(|text| { text.to_owned() })
        );
    }

    fn read_any() -> SpecSource {
        read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../specs"), "minimal.toml").unwrap()
    }
}
