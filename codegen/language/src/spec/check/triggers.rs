//! Digital lines: keys of each kind and axis, and permitted positions.

use super::trajectories::{differ, missing};
use crate::diagnostic::codes;
use crate::keys::fields::Fields;
use crate::model::{MAX_OUTPUTS, TriggerKind};
use crate::spec::findings::Findings;
use crate::spec::keys;
use crate::spec::text::number;

/// Keys whose values are lengths, or angles under `KEY_angle`.
const PLACES: [&str; 4] = ["start", "stop", "step", "hysteresis"];
const COUNTS: [&str; 3] = ["first", "every", "last"];

/// Keys that a kind takes besides `name` and `kind`; for those of [`PLACES`] either form.
fn keys_of(kind: &str) -> &'static [&'static str] {
    match kind {
        "position" => &["axis", "direction", "start", "stop", "step", "hysteresis", "width"],
        "level" => &["axis", "start", "stop", "hysteresis"],
        "motion" | "input" => &[],
        _ => &["first", "every", "last", "width"],
    }
}

/// Keys that it requires.
fn needed_by(kind: &str) -> &'static [&'static str] {
    match kind {
        "position" => &["start", "step"],
        "level" => &["start"],
        _ => &[],
    }
}

pub(super) fn keys_of_kind(f: &Fields, findings: &mut Findings) -> Option<()> {
    for index in 0..f.count("trigger") {
        let table = format!("trigger[{index}]");
        let (Some(kind), Some(axis)) = (f.choice(&keys::join(&table, "kind")), f.choice(&keys::join(&table, "axis")))
        else {
            continue;
        };
        let turns = axis.starts_with("theta");
        // Name of a key for this axis, and for the others.
        let forms = |key: &str| {
            if turns { [format!("{key}_angle"), key.to_owned()] } else { [key.to_owned(), format!("{key}_angle")] }
        };
        let mut refuse = |path: &str, message: String, help: String| {
            findings.add(codes::TRIGGER_KEY, path, f.span(path), message, help);
        };
        let others = ["axis", "direction", "width"].into_iter().chain(COUNTS);
        let takes = keys_of(kind);
        for (key, form) in others
            .map(|key| (key, key.to_owned()))
            .chain(PLACES.iter().flat_map(|key| forms(key).map(|form| (*key, form))))
        {
            let path = keys::join(&table, &form);
            if !f.given(&path) {
                continue;
            }
            if !takes.contains(&key) {
                let list = if takes.is_empty() { "no other key".to_owned() } else { takes.join(", ") };
                refuse(
                    &path,
                    format!("`{path}` has no meaning for a trigger of kind \"{kind}\""),
                    format!("remove it; kind \"{kind}\" takes {list}"),
                );
            } else if PLACES.contains(&key) && form != forms(key)[0] {
                let what = if turns { ["a length", "a rotation"] } else { ["an angle", "a translation"] };
                let [right, _] = forms(key);
                refuse(
                    &path,
                    format!("`{path}` is {}, but {axis} is {}", what[0], what[1]),
                    format!("write {}", keys::key(&keys::join("trigger", &right))?.line()),
                );
            }
        }
        for key in needed_by(kind) {
            let paths = forms(key).map(|form| keys::join(&table, &form));
            let mentioned = findings.mentions(&[&paths[0]]) || findings.mentions(&[&paths[1]]);
            if mentioned || paths.iter().any(|path| f.get(path).is_some()) {
                continue;
            }
            missing(f, findings, &table, &paths[0], kind)?;
        }
    }
    Some(())
}

pub(super) fn names_differ(f: &Fields, findings: &mut Findings) -> Option<()> {
    differ(f, findings, "trigger")
}

/// In normal operation, no pose is measured beyond the workspace, so a position there would never be passed.
pub(super) fn inside_workspace(f: &Fields, findings: &mut Findings) -> Option<()> {
    let bounds = [f.list::<3>("workspace.translation")?, f.list::<3>("workspace.rotation")?];
    for index in 0..f.count("trigger") {
        let table = format!("trigger[{index}]");
        let Some(axis) = f.choice(&keys::join(&table, "axis")) else { continue };
        let turns = axis.starts_with("theta");
        let place = usize::from(axis.ends_with('y')) + 2 * usize::from(axis.ends_with('z'));
        let bound = bounds[usize::from(turns)][place];
        let (unit, suffix) = if turns { ("urad", "_angle") } else { ("um", "") };
        let path = |key: &str| keys::join(&table, &format!("{key}{suffix}"));
        let ends = [path("start"), path("stop")];
        for path in &ends {
            if let Some(value) = f.number(path)
                && value.abs() > bound
            {
                let [given, most] = [value * 1e6, bound * 1e6].map(number);
                findings.add(
                    codes::TRIGGER_OUTSIDE,
                    path,
                    f.span(path),
                    format!("{given} {unit} is outside the workspace of {most} {unit} along {axis}"),
                    format!(
                        "positions count from rest, including the bias: write \"{} {unit}\", or widen `workspace.{}`",
                        number(if value < 0.0 { -bound } else { bound } * 1e6),
                        if turns { "rotation" } else { "translation" }
                    ),
                );
            }
        }
        if let (Some(start), Some(stop)) = (f.number(&ends[0]), f.number(&ends[1]))
            && stop < start
        {
            findings.add(
                codes::WRONG_ORDER,
                &ends[1],
                f.span(&ends[1]),
                format!("`{}` is below `{}`: positions are counted upward", ends[1], ends[0]),
                "write the smaller value as start; direction = \"down\" is for passages with the pose falling"
                    .to_owned(),
            );
        }
    }
    Some(())
}

pub(super) fn not_too_many(f: &Fields, findings: &mut Findings) -> Option<()> {
    let (inputs, outputs): (Vec<usize>, Vec<usize>) = (0..f.count("trigger"))
        .partition(|index| f.choice(&format!("trigger[{index}].kind")) == Some(TriggerKind::Input.word()));
    for (lines, most, what, help) in [
        (
            outputs,
            MAX_OUTPUTS,
            "outputs",
            "remove some; the function of a line can be changed while the controller runs",
        ),
        (inputs, 1, "inputs", "keep one of them"),
    ] {
        if let Some(first) = lines.get(most) {
            let path = format!("trigger[{first}]");
            findings.add(
                codes::TOO_MANY_TRIGGERS,
                &path,
                f.table(&path).unwrap_or(0..0),
                format!("{} triggers are {what}, expected at most {most}, the number of pins on a board", lines.len()),
                help.to_owned(),
            );
        }
    }
    Some(())
}
