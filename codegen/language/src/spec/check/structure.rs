//! Modes of the structure, known and not.

use super::trajectories::at_most;
use crate::diagnostic::codes;
use crate::keys::fields::Fields;
use crate::model::structure::place;
use crate::model::{StructuralKind, StructuralMode};
use crate::spec::findings::Findings;
use crate::spec::keys::{self, MAX_TABLES};
use crate::spec::text::number;

/// A leg has no participation; that of a gauge is above 0, that of the frame below.
pub(super) fn participations(f: &Fields, findings: &mut Findings) -> Option<()> {
    for index in 0..f.count("mode") {
        let table = format!("mode[{index}]");
        let path = keys::join(&table, "participation");
        let (Some((kind, _)), Some(value)) = (place(f, &table), f.number(&path)) else { continue };
        let (code, what, help) = match kind {
            StructuralKind::Leg => (
                codes::MODE_KEY,
                "has no meaning for a mode of a leg, which is in series with it".to_owned(),
                "remove it, or write at = \"gauge\" or at = \"frame\"",
            ),
            StructuralKind::Gauge if value <= 0.0 => (
                codes::OUT_OF_RANGE,
                format!("is {}, expected more than 0 and at most 1 for a gauge", number(value)),
                "write a positive participation, or at = \"frame\"",
            ),
            StructuralKind::Frame if value >= 0.0 => (
                codes::OUT_OF_RANGE,
                format!("is {}, expected at least -1 and less than 0 for the frame", number(value)),
                "write a negative participation, or at = \"gauge\"",
            ),
            _ => continue,
        };
        findings.add(code, &path, f.span(&path), format!("`{path}` {what}"), help.to_owned());
    }
    Some(())
}

/// No mode and no kind is listed twice.
pub(super) fn differ(f: &Fields, findings: &mut Findings) -> Option<()> {
    let mode = |index: usize| {
        let table = format!("mode[{index}]");
        let (kind, at) = place(f, &table)?;
        Some((kind, at, f.number(&keys::join(&table, "frequency"))?))
    };
    for index in 0..f.count("mode").min(MAX_TABLES) {
        let Some(own) = mode(index) else { continue };
        let same = |other: &usize| mode(*other).is_some_and(|other| StructuralMode::coincide(own, other));
        let Some(first) = (0..index).find(same) else { continue };
        let path = format!("mode[{index}].frequency");
        findings.add(
            codes::MODE_TWICE,
            &path,
            f.span(&path),
            format!("mode[{first}] has the same place and nearly the same frequency"),
            "keep one of the two: modes of one place differ by more than 1 %, and a mode of every leg or gauge includes each of them"
                .to_owned(),
        );
    }
    let path = "robust.structure.kinds";
    let kinds = f.texts(path)?;
    for (index, kind) in kinds.iter().enumerate() {
        if kinds[..index].contains(kind) {
            findings.add(
                codes::MODE_TWICE,
                &format!("{path}[{index}]"),
                f.item_span(path, index),
                format!("\"{kind}\" is listed twice"),
                "remove one of the two".to_owned(),
            );
        }
    }
    Some(())
}

pub(super) fn not_too_many(f: &Fields, findings: &mut Findings) -> Option<()> {
    let help = "keep those below half the tick rate that have the least damping";
    at_most(f, findings, codes::TOO_MANY_MODES, ["mode", "structural modes", help])
}
