//! What the tests of the spec language share: the specs of the repository, and a folder with the records they name.

use std::fs;
use std::path::PathBuf;

use specgen::diagnostic::{Diagnostic, Place, Severity};
use specgen::spec::SpecSource;
use specgen::spec::keys::{Key, Kind, Presence, SECTIONS, Section};
use specgen_tests::repository;

/// Every spec of the repository, sorted.
pub fn spec_files() -> Vec<PathBuf> {
    let mut files = Vec::new();
    for folder in [repository().join("specs"), repository().join("specs/features")] {
        for entry in fs::read_dir(&folder).expect("specs/ is there") {
            let path = entry.expect("readable").path();
            // The paper's data as printed are there to be refused.
            let refused = path.file_stem().is_some_and(|stem| stem == "as-printed");
            if path.extension().is_some_and(|e| e == "toml") && !refused {
                files.push(path);
            }
        }
    }
    files.sort();
    assert!(files.len() >= 10, "only {} specs found", files.len());
    files
}

/// A folder in which every record that the specs name is there, empty: this is about the spec alone, and must not
/// depend on whether the records are generated yet.
pub fn folder_with_records() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir_all(dir.path().join("specs")).expect("created");
    fs::create_dir_all(dir.path().join("records")).expect("created");
    fs::create_dir_all(dir.path().join("specs/records")).expect("created");
    fs::copy(repository().join("specs/features/joints.csv"), dir.path().join("specs/joints.csv")).expect("copied");
    for place in ["records", "specs/records"] {
        for name in ["reference-forc", "leg1", "leg2", "leg3", "leg4", "leg5", "leg6", "leg-mu1"] {
            fs::write(dir.path().join(place).join(format!("{name}.csv")), "").expect("written");
        }
    }
    dir
}

/// `text` as if it stood in `folder`/specs/`name`; "../records" and "records" both exist there.
pub fn source(text: &str, name: &str, folder: &tempfile::TempDir) -> SpecSource {
    SpecSource { display_name: name.to_owned(), text: text.to_owned(), dir: folder.path().join("specs") }
}

/// Sections whose keys can stand beside each other. Those of a trigger exclude each other by its kind and axis: the examples of its findings
/// try them.
pub fn sections() -> impl Iterator<Item = &'static Section> {
    SECTIONS.iter().filter(|section| section.name != "trigger")
}

/// Sections that a spec without `[control]` does not have.
pub fn is_task_space(section: &Section) -> bool {
    section.name.starts_with("control") && section.name != "controller"
        || matches!(
            section.name,
            "gains" | "position_gains" | "gauge" | "trajectory" | "requirements.tracking" | "mode" | "robust.structure"
        )
}

const CIRCLES: &str = "joint circles";

/// What a spec with every key leaves out: one of two keys, all forms but one, and what the other kind of spec has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Choice {
    /// With `[control]` and all that belongs to it.
    pub control: bool,
    /// Weights per run instead of bandwidths; without `[control]` only.
    pub weights: bool,
    /// The form of the joints.
    pub form: &'static str,
    /// The first trajectory is a waveform instead of a path of the paper.
    pub waveform: bool,
    /// It is a step.
    pub step: bool,
    /// Dynamic Preisach instead of creep.
    pub dynamic: bool,
}

/// The task-space controller, with joint circles and a path of the paper.
pub const PLATFORM: Choice =
    Choice { control: true, weights: false, form: CIRCLES, waveform: false, step: false, dynamic: false };

/// The leg feed-forward, with weights per run.
pub const LEGS: Choice =
    Choice { control: false, weights: true, form: CIRCLES, waveform: false, step: false, dynamic: false };

impl Choice {
    /// Whether the key stands in the text.
    fn takes(self, section: &Section, key: &Key) -> bool {
        let of_waveform = matches!(key.name, "file" | "period" | "repeat" | "columns");
        let of_step = matches!(key.name, "to" | "time");
        match (section.name, key.presence) {
            (_, Presence::InsteadOf(_)) => key.name.ends_with("_weight") == self.weights,
            (_, Presence::Form(forms)) => forms.contains(&self.form),
            ("hysteresis", _) if key.name == "rate_tables" => self.dynamic,
            ("hysteresis", _) if key.name.starts_with("creep_") => !self.dynamic,
            ("hysteresis", _) if key.name == "dead_time" => !self.control,
            ("actuator", _) if key.name == "cross_talk" => self.control,
            ("sensor", _) if matches!(key.name, "calibration" | "input_range") => self.control,
            ("trajectory", Presence::Rule(_)) if key.name != "lead" => {
                (of_waveform, of_step) == (self.waveform, self.step)
            }
            _ => true,
        }
    }

    /// One table of a section, its header first.
    fn table(self, section: &Section) -> String {
        let header = section.header();
        let mut text = if header.is_empty() { header } else { header + "\n" };
        for key in section.keys.iter().filter(|key| self.takes(section, key)) {
            let kind = section.name == "trajectory" && key.name == "kind";
            let dynamic = section.name == "hysteresis" && key.name == "rate" && self.dynamic;
            let value = match (kind, dynamic) {
                (true, _) if self.waveform => "\"waveform\"",
                (true, _) if self.step => "\"step\"",
                (_, true) => "\"dynamic-preisach\"",
                _ => key.example,
            };
            text.push_str(&format!("{} = {value}\n", key.name));
        }
        text
    }

    /// A spec with every key of the key table that can stand beside the others, each on a line of its own.
    pub fn text(self) -> String {
        let sections = sections().filter(|section| self.control || !is_task_space(section));
        let tables = |section: &Section| match section.kind {
            Kind::Repeated(least, _) => self.table(section).repeat(least.max(1)),
            Kind::Plain | Kind::Optional => self.table(section),
        };
        sections.map(tables).collect()
    }
}

/// The spec of the task-space controller with every key.
pub fn every_key() -> String {
    PLATFORM.text()
}

/// Line of a finding, from 1.
pub fn line_of(diagnostic: &Diagnostic, text: &str) -> usize {
    match &diagnostic.place {
        Place::Spec(span) => 1 + text[..span.start].bytes().filter(|b| *b == b'\n').count(),
        Place::File { line, .. } => line.expect("a line"),
        Place::Whole => panic!("no place: {diagnostic:?}"),
    }
}

/// The errors among `diagnostics`.
pub fn errors(diagnostics: &[Diagnostic]) -> Vec<&Diagnostic> {
    diagnostics.iter().filter(|d| d.severity == Severity::Error).collect()
}
