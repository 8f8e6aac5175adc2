//! Findings for programs.

use serde_json::{Value, json};

use super::{Diagnostic, Place, Severity};
use crate::SpecSource;
use crate::lines::Lines;

/// An array with one object for each finding: `code`, `severity` ("error", "warning", "note"), `key`, `file`, `line`,
/// `column`, `message`, `help`. Line and column count from 1, columns in characters; fields that do not apply are null.
pub fn to_json(diagnostics: &[Diagnostic], source: &SpecSource) -> Value {
    let lines = Lines::new(&source.text);
    diagnostics
        .iter()
        .map(|d| {
            let (file, line, column) = match &d.place {
                Place::Spec(span) => {
                    let spot = lines.spot(span);
                    (Some(source.display_name.as_str()), Some(spot.line), Some(spot.column))
                }
                Place::File { path, line } => (Some(path.as_str()), *line, None),
                Place::Whole => (None, None, None),
            };
            json!({
                "code": d.code,
                "severity": match d.severity {
                    Severity::Error => "error",
                    Severity::Warning => "warning",
                    Severity::Note => "note",
                },
                "key": (!d.key.is_empty()).then_some(&d.key),
                "file": file,
                "line": line,
                "column": column,
                "message": d.message,
                "help": d.help,
            })
        })
        .collect()
}
