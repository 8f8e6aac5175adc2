//! A second set of slips, by other operators and in other specs than the rules were tuned on: rows in each other's place, a
//! whole group of lengths in another unit, degrees for radians, grams for kilograms, moments of another axis, gains the wrong
//! way round, legs in another order.

use super::mutants::{Mutant, Value, shown, values};

/// Changes a text in several places; edits are `(start, end, new)` in any order.
fn edited(text: &str, mut edits: Vec<(usize, usize, String)>) -> String {
    edits.sort_by_key(|edit| core::cmp::Reverse(edit.0));
    let mut text = text.to_owned();
    for (start, end, new) in edits {
        text.replace_range(start..end, &new);
    }
    text
}

/// A number times a factor as decimal arithmetic would have it.
fn scaled(value: &Value, factor: f64) -> (usize, usize, String) {
    let number = if factor < 1.0 { value.number / (1.0 / factor) } else { value.number * factor };
    (value.start, value.end, shown(number))
}

fn mutant(kind: &'static str, value: &Value, change: String, text: String) -> Mutant {
    Mutant { kind, key: value.path(), change, text }
}

/// Values whose unit begins so.
fn in_unit<'a>(values: &'a [Value], units: &'a [&str]) -> impl Iterator<Item = &'a Value> {
    values.iter().filter(move |value| value.unit.as_deref().is_some_and(|unit| units.contains(&unit.trim())))
}

/// The value's unit, replaced.
fn unit_of(text: &str, value: &Value, unit: &str) -> (usize, usize, String) {
    let old = value.unit.as_deref().unwrap_or("");
    debug_assert!(text[value.end..].starts_with(old));
    (value.end, value.end + old.len(), format!(" {unit}"))
}

/// Every slip of these kinds.
pub fn all(text: &str) -> Vec<Mutant> {
    let values = values(text);
    let mut mutants = Vec::new();
    // One unit for another of the same dimension, the number left as it is.
    let pairs: [(&str, &str, &'static str); 12] = [
        ("mm", "cm", "mm for cm"),
        ("mm", "m", "mm for m"),
        ("um", "mm", "um for mm"),
        ("um", "nm", "um for nm"),
        ("rad", "deg", "degrees for radians"),
        ("mrad", "deg", "degrees for radians"),
        ("urad", "arcsec", "degrees for radians"),
        ("pi rad", "rad", "degrees for radians"),
        ("g", "kg", "g for kg"),
        ("kg", "g", "g for kg"),
        ("g mm^2", "kg mm^2", "g for kg"),
        ("g mm^2", "g m^2", "mm for m"),
    ];
    for (from, to, kind) in pairs {
        for value in in_unit(&values, &[from]).filter(|value| value.number != 0.0) {
            mutants.push(mutant(kind, value, format!("{from} -> {to}"), edited(text, vec![unit_of(text, value, to)])));
        }
    }
    let others: [(&str, &str); 6] =
        [("V/ms", "V/us"), ("V/ms", "V/s"), ("Hz", "kHz"), ("Hz", "mHz"), ("us", "s"), ("N/m", "N/mm")];
    for (from, to) in others {
        for value in in_unit(&values, &[from]).filter(|value| value.number != 0.0) {
            let text = edited(text, vec![unit_of(text, value, to)]);
            mutants.push(mutant("other unit", value, format!("{from} -> {to}"), text));
        }
    }
    groups(text, &values, &mut mutants);
    rows(text, &values, &mut mutants);
    for value in &values {
        // µm per V written as V per µm.
        if value.key == "actuator.stack_gain" {
            let edits = vec![(value.start, value.end, shown(1.0 / value.number))];
            mutants.push(mutant("gain upside down", value, "1/x".to_owned(), edited(text, edits)));
        }
        if value.key == "actuator.stacks" && value.number > 1.0 {
            let edits = vec![(value.start, value.end, "1".to_owned())];
            mutants.push(mutant("gain upside down", value, "one stack".to_owned(), edited(text, edits)));
        }
        // A digit too many, or too few.
        if value.number.abs() >= 10.0 || value.unit.is_some() {
            for factor in [10.0, 0.1] {
                if value.number != 0.0 && !(value.unit.is_none() && value.number < 20.0) {
                    let change = format!("x {factor}");
                    mutants.push(mutant("digit", value, change, edited(text, vec![scaled(value, factor)])));
                }
            }
        }
    }
    mutants
}

/// All values of one key, or of one section, off by the same factor.
fn groups(text: &str, values: &[Value], mutants: &mut Vec<Mutant>) {
    let sections: [(&str, &[&str]); 6] = [
        ("geometry", &["mm"]),
        ("workspace", &["um"]),
        ("workspace", &["mrad", "urad"]),
        ("leg", &["g mm^2"]),
        ("leg", &["g"]),
        ("sensor", &["um"]),
    ];
    for (section, units) in sections {
        let of: Vec<&Value> =
            in_unit(values, units).filter(|value| value.key.starts_with(&format!("{section}."))).collect();
        let Some(first) = of.first() else { continue };
        for factor in [1e3, 1e-3] {
            let edits = of.iter().map(|value| scaled(value, factor)).collect();
            mutants.push(mutant("group", first, format!("all {} x {factor}", units[0]), edited(text, edits)));
        }
    }
    let mut keys: Vec<&str> = values.iter().filter(|value| value.of > 1).map(|value| value.key.as_str()).collect();
    keys.dedup();
    for key in keys {
        let of: Vec<&Value> =
            values.iter().filter(|value| value.key == key && value.unit.is_some() && value.number != 0.0).collect();
        let Some(first) = of.first() else { continue };
        for factor in [1e3, 1e-3, -1.0] {
            let edits = of.iter().map(|value| scaled(value, factor)).collect();
            mutants.push(mutant("group", first, format!("whole list x {factor}"), edited(text, edits)));
        }
    }
}

/// Lists in another order, gauges with each other's points, keys with each other's values.
fn rows(text: &str, values: &[Value], mutants: &mut Vec<Mutant>) {
    let shown = |value: &Value| text[value.start..value.end + value.unit.as_ref().map_or(0, String::len)].to_owned();
    let end = |value: &Value| value.end + value.unit.as_ref().map_or(0, String::len);
    // The values of two keys of one dimension in each other's place.
    let twins = [
        ("leg.fixed_mass", "leg.extensible_mass"),
        ("leg.fixed_inertia", "leg.extensible_inertia"),
        ("geometry.platform_radius", "geometry.height"),
        ("geometry.base_radius", "geometry.height"),
        ("geometry.base_radius", "geometry.platform_radius"),
        ("platform.mass", "leg.fixed_mass"),
        ("control.lead", "amplifier.lag"),
        ("control.lead", "control.transfer_time"),
        ("timing.period", "amplifier.lag"),
        ("target.budget.flash", "target.budget.ram"),
        ("dac.bits", "sensor.bits"),
        ("hysteresis.grid", "hysteresis.memory"),
    ];
    for (a, b) in twins {
        let find = |key: &str| values.iter().find(|value| value.key == key);
        if let (Some(a), Some(b)) = (find(a), find(b))
            && (a.number != b.number || a.unit != b.unit)
        {
            let edits = vec![(a.start, end(a), shown(b)), (b.start, end(b), shown(a))];
            let change = format!("{} <-> {}", a.key, b.key);
            mutants.push(mutant("keys swapped", a, change, edited(text, edits)));
        }
    }
    // Lists turned by one place: x y z → y z x; legs begin elsewhere.
    let mut keys: Vec<&str> =
        values.iter().filter(|value| value.of == 3 || value.of == 6).map(|v| v.key.as_str()).collect();
    keys.dedup();
    for key in keys {
        let of: Vec<&Value> = values.iter().filter(|value| value.key == key).collect();
        let n = of.len();
        // Within the translations and within the rotations: across them the units would not fit.
        let groups: Vec<&[&Value]> = if n == 6 { of.chunks(3).collect() } else { vec![&of[..]] };
        for group in groups {
            let turned: Vec<(usize, usize, String)> = (0..group.len())
                .map(|k| (group[k].start, end(group[k]), shown(group[(k + 1) % group.len()])))
                .collect();
            let text_after = edited(text, turned);
            if group.len() == 3 && text_after != *text {
                mutants.push(mutant("rows turned", group[0], "turned by one place".to_owned(), text_after));
            }
        }
    }
    // Joints listed one by one, a line each: neighbours in each other's place on one body only.
    for list in ["base_joints", "platform_joints"] {
        let Some(start) = text.find(&format!("{list} = [")) else { continue };
        let lines: Vec<&str> = text[start..].lines().skip(1).take(6).collect();
        for (leg, pair) in lines.windows(2).enumerate() {
            let both = format!("{}\n{}", pair[0], pair[1]);
            mutants.push(Mutant {
                kind: "leg order",
                key: format!("geometry.{list}[{leg}]"),
                change: format!("legs {leg} and {} of one body", leg + 1),
                text: text.replacen(&both, &format!("{}\n{}", pair[1], pair[0]), 1),
            });
        }
    }
}
