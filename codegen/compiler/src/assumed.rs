//! Assumptions of a controller: values that the spec lists as assumed, and simulated records.

use serde::Serialize;

use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::Model;

/// Values and records that were not measured.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Assumptions {
    /// Paths of keys and repeated sections, as the spec's `assumed` names them.
    pub values: Vec<String>,
    /// Files of the spec's `[hysteresis]` that are marked as simulated.
    pub simulated: Vec<String>,
    /// The legs are not identified, and each is taken as a straight line. A real machine needs no consent for that: its law
    /// does not run.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub unidentified: bool,
}

/// The section that counts as assumed if a platform's spec lacks it.
const STRUCTURE: &str = "robust.structure";

impl Assumptions {
    /// Those of `model`, whose files `simulated` are marked as simulated.
    pub fn of(model: &Model, simulated: Vec<String>) -> Self {
        let mut values = model.assumed.clone();
        // The range of structural modes is a default until the spec gives it.
        if model.task_space.is_some() && !model.structure.given {
            values.push(STRUCTURE.to_owned());
        }
        Self { values, simulated, unidentified: !model.hysteresis.is_identified() }
    }

    /// Whether every value is measured or known; those of legs that are not identified do not count.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.is_empty() && self.simulated.is_empty()
    }

    /// The number of values, such as `13 assumed values`; none if there are none.
    pub fn count(&self) -> Option<String> {
        counted(&self.values, |count| format!("{count} assumed values"), "1 assumed value")
    }

    /// The records, such as `simulated leg record`; none if all are measured.
    #[must_use]
    pub fn records(&self) -> Option<String> {
        if self.unidentified {
            return Some("unidentified legs".to_owned());
        }
        counted(&self.simulated, |count| format!("{count} simulated leg records"), "simulated leg record")
    }

    /// A summary such as `13 assumed values, simulated leg record`; empty if there are none.
    pub fn summary(&self) -> String {
        self.count().into_iter().chain(self.records()).collect::<Vec<_>>().join(", ")
    }

    /// Each as the path of a key in the spec, or as a file.
    pub fn list(&self) -> Vec<String> {
        let files = self.simulated.iter().map(|file| format!("hysteresis: {file} (simulated)"));
        self.values.iter().cloned().chain(files).collect()
    }

    /// The finding that refuses the controller of `model` for a real machine, at the list in the spec.
    pub fn refusal(&self, model: &Model) -> Diagnostic {
        let structure = self.values.iter().any(|value| value == STRUCTURE);
        let clear = [
            (self.values.len() > usize::from(structure))
                .then_some("measure or look up these values, write them, and remove their entries from `assumed`"),
            structure.then_some(
                "write [robust.structure] with what your structure has, or the f0 that `specgen learn --excite` prints",
            ),
            (!self.simulated.is_empty()).then_some("name a record of the real legs in `hysteresis.records`"),
        ];
        let clear: Vec<&str> = clear.into_iter().flatten().collect();
        Diagnostic::at(
            &model.spans,
            if self.values.is_empty() { &["hysteresis.records"] } else { &["assumed", "control", "sensor"] },
            codes::ASSUMED_ON_BOARD,
            format!("the controller of a real machine would rely on {}: {}", self.summary(), self.list().join(", ")),
            format!("{}; or accept them with --assumed-ok", clear.join(", and ")),
        )
    }
}

/// A list in words; none if it is empty.
fn counted(list: &[String], many: impl Fn(usize) -> String, one: &str) -> Option<String> {
    match list.len() {
        0 => None,
        1 => Some(one.to_owned()),
        count => Some(many(count)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_counted_in_words() {
        let of = |values: usize, records: usize| Assumptions {
            values: vec!["sensor.noise".to_owned(); values],
            simulated: vec!["leg.csv".to_owned(); records],
            unidentified: false,
        };
        for (values, records, expected) in [
            (13, 1, "13 assumed values, simulated leg record"),
            (1, 0, "1 assumed value"),
            (0, 6, "6 simulated leg records"),
            (0, 0, ""),
        ] {
            assert_eq!(of(values, records).summary(), expected);
            assert_eq!(of(values, records).is_empty(), expected.is_empty());
        }
        let unidentified = Assumptions { unidentified: true, ..of(1, 0) };
        assert_eq!(unidentified.summary(), "1 assumed value, unidentified legs");
        assert_eq!(unidentified.list(), ["sensor.noise"], "a real machine takes it");
    }
}
