//! The trajectories that the controller can play; the tables of waveforms are read later.

use crate::diagnostic::{Code, codes};
use crate::keys::fields::Fields;
use crate::spec::findings::Findings;
use crate::spec::keys::{self, MAX_TABLES};

const OF_PAPER: [&str; 2] = ["frequency", "as_printed"];
const OF_STEP: [&str; 2] = ["to", "time"];
const OF_WAVEFORM: [&str; 4] = ["file", "period", "repeat", "columns"];

pub(super) fn keys_of_kind(f: &Fields, findings: &mut Findings) -> Option<()> {
    for index in 0..f.count("trajectory") {
        let table = format!("trajectory[{index}]");
        let Some(kind) = f.choice(&keys::join(&table, "kind")) else {
            continue;
        };
        let (own, needed): (&[&str], &[&str]) = match kind {
            "waveform" => (&OF_WAVEFORM, &["file", "period"]),
            "step" => (&OF_STEP, &OF_STEP),
            _ => (&OF_PAPER, &["frequency"]),
        };
        let foreign = [&OF_PAPER[..], &OF_STEP, &OF_WAVEFORM].into_iter().filter(|keys| *keys != own).flatten();
        for path in foreign.map(|key| keys::join(&table, key)).filter(|path| f.given(path)) {
            findings.add(
                codes::TRAJECTORY_KEY,
                &path,
                f.span(&path),
                format!("`{path}` has no meaning for a trajectory of kind \"{kind}\""),
                format!("remove it; kind \"{kind}\" takes {}", own.join(", ")),
            );
        }
        for path in needed.iter().map(|key| keys::join(&table, key)) {
            // A mistake within a list is reported at its element.
            if f.given(&path) || findings.mentions_item(&path) {
                continue;
            }
            missing(f, findings, &table, &path, kind)?;
        }
    }
    Some(())
}

pub(super) fn names_differ(f: &Fields, findings: &mut Findings) -> Option<()> {
    differ(f, findings, "trajectory")
}

/// Keys that a table of a repeated section lacks and its kind needs.
pub(super) fn missing(f: &Fields, findings: &mut Findings, table: &str, path: &str, kind: &str) -> Option<()> {
    let key = keys::key(path)?;
    let section = table.split('[').next()?;
    findings.add(
        codes::MISSING_KEY,
        path,
        f.table(table).unwrap_or(0..0),
        format!("`{path}` is missing: kind \"{kind}\" needs it"),
        format!("write, in [[{section}]]: {}. {}", key.line(), key.doc),
    );
    Some(())
}

/// Names in a repeated section are unique.
pub(super) fn differ(f: &Fields, findings: &mut Findings, section: &str) -> Option<()> {
    for index in 0..f.count(section) {
        let path = format!("{section}[{index}].name");
        let Some(name) = f.name(&path) else {
            continue;
        };
        let Some(first) = (0..index).find(|other| f.name(&format!("{section}[{other}].name")) == Some(name)) else {
            continue;
        };
        findings.add(
            codes::NAME_TAKEN,
            &path,
            f.span(&path),
            format!("{section}[{first}] is called \"{name}\" as well"),
            format!("give each {section} a name of its own"),
        );
    }
    Some(())
}

/// A limit applies to an existing trajectory, and limits something.
pub(super) fn limits(f: &Fields, findings: &mut Findings) -> Option<()> {
    // None if a trajectory has no valid name, which is a finding of its own.
    let names: Option<Vec<&str>> =
        (0..f.count("trajectory")).map(|index| f.name(&format!("trajectory[{index}].name"))).collect();
    for index in 0..f.count("requirements.tracking") {
        let table = format!("requirements.tracking[{index}]");
        let path = keys::join(&table, "trajectory");
        if let (Some(names), Some(name)) = (&names, f.name(&path))
            && !names.contains(&name)
        {
            let known = if names.is_empty() { "no [[trajectory]]".to_owned() } else { names.join(", ") };
            findings.add(
                codes::UNKNOWN_CHOICE,
                &path,
                f.span(&path),
                format!("the spec has {known}, but not \"{name}\""),
                "name one of its [[trajectory]] tables, or remove the key: the limit then applies to all of them"
                    .to_owned(),
            );
        }
        let given = |key: &str| f.given(&keys::join(&table, key));
        if !["translation", "rotation", "axes"].iter().any(|key| given(key)) {
            findings.add(
                codes::MISSING_KEY,
                &keys::join(&table, "translation"),
                f.table(&table).unwrap_or(0..0),
                format!("`{table}` limits nothing"),
                "write, in [[requirements.tracking]]: translation = \"<number> nm\", rotation or axes".to_owned(),
            );
        }
    }
    Some(())
}

pub(super) fn not_too_many(f: &Fields, findings: &mut Findings) -> Option<()> {
    let help = "remove some, or join waveforms that are played one after the other";
    at_most(f, findings, codes::TOO_MANY_TRAJECTORIES, ["trajectory", "trajectories", help])
}

/// A repeated section has no more than [`MAX_TABLES`] tables.
pub(super) fn at_most(f: &Fields, findings: &mut Findings, code: Code, of: [&str; 3]) -> Option<()> {
    let ([section, plural, help], count) = (of, f.count(of[0]));
    if count > MAX_TABLES {
        let message = format!("there are {count} {plural}, expected at most {MAX_TABLES}");
        findings.add(code, section, f.table(&format!("{section}[0]")).unwrap_or(0..0), message, help.to_owned());
    }
    Some(())
}
