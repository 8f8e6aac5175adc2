//! The measurement files in a spec: number, paths, and whether they can be opened.

use std::path::Path;

use super::control;
use crate::diagnostic::codes;
use crate::files;
use crate::keys::fields::Fields;
use crate::spec::findings::Findings;
use crate::spec::{messages, text};

const KEYS: [&str; 2] = ["hysteresis.records", "hysteresis.rate_tables"];

pub(in crate::spec) fn readable(f: &Fields, dir: &Path, findings: &mut Findings) -> Option<()> {
    for key in KEYS {
        let _ = readable_of(f, dir, findings, key);
    }
    Some(())
}

fn readable_of(f: &Fields, dir: &Path, findings: &mut Findings, key: &str) -> Option<()> {
    let records = f.texts(key)?;
    // Without records there is only the open drive, which six legs with their own gauges do not have.
    let none = key == KEYS[0] && records.is_empty();
    if none && control::there(f).is_none() {
        findings.add(
            codes::RECORD_COUNT,
            key,
            f.span(key),
            format!("`{key}` names no file, and without [control] there is no open drive"),
            "name one file for all legs, or six: one for each leg, in the order of the joints".to_owned(),
        );
    } else if !none && !matches!(records.len(), 1 | 6) {
        findings.add(
            codes::RECORD_COUNT,
            key,
            f.span(key),
            format!("`{key}` names {} files, expected 1 or 6", records.len()),
            "name one file for all legs, or six: one for each leg, in the order of the joints".to_owned(),
        );
    }
    for (i, record) in records.iter().enumerate() {
        let finding = if text::is_relative_path(record) {
            cannot_open(&dir.join(record)).map(|reason| {
                (
                    codes::RECORD_UNREADABLE,
                    format!("the record \"{}\" cannot be read: {reason}", text::shorten(record)),
                    "name a CSV file relative to the folder of the spec, with forward slashes".to_owned(),
                )
            })
        } else {
            Some((
                codes::RECORD_PATH,
                format!("\"{}\" is not a path relative to the spec", text::shorten(record)),
                messages::beside_the_spec(record),
            ))
        };
        if let Some((code, message, help)) = finding {
            findings.add(code, &format!("{key}[{i}]"), f.item_span(key, i), message, help);
        }
    }
    Some(())
}

fn cannot_open(path: &Path) -> Option<String> {
    files::open_file(path).err().map(|unread| unread.to_string())
}
