//! The exceptions in `[lint]`: existing keys, each with a reason.

use crate::diagnostic::codes;
use crate::keys::fields::Fields;
use crate::spec::findings::Findings;
use crate::spec::{keys, text};

pub(super) fn reasons(f: &Fields, findings: &mut Findings) -> Option<()> {
    let path = "lint.allow";
    for (index, entry) in f.texts(path)?.iter().enumerate() {
        let (key, reason) = entry.split_once(':').unwrap_or((entry, ""));
        let key = key.trim();
        // `workspace.translation[2]` is an item of a key.
        let list = key.rsplit_once('[').filter(|_| key.ends_with(']')).map_or(key, |(list, _)| list);
        let known = keys::key(list);
        let (what, help, shown) = match known {
            None => ("names no key of a spec", "write the path of the key and why its value is intended:", "<key>"),
            Some(_) if reason.trim().is_empty() => {
                ("gives no reason", "write why the value is intended, after a colon:", key)
            }
            Some(_) => continue,
        };
        findings.add(
            codes::ALLOW_FORM,
            &format!("{path}[{index}]"),
            f.item_span(path, index),
            format!("\"{}\" {what}", text::shorten(entry)),
            format!("{help} \"{shown}: <reason>\""),
        );
    }
    Some(())
}
