//! Writes tuned parameters into the spec's text; comments, order and layout of everything else are preserved.

use diffy::DiffOptions;
use toml_edit::{Array, DocumentMut, Item, Table, Value};

use super::Setting;
use super::space::{Role, Space};
use specgen_compiler::compile::Compilation;
use specgen_compiler::stability::platform::{LoopKind, start_mode};

/// Units of gains along and about an axis.
const UNITS: [(&str, [&str; 2]); 3] = [
    ("proportional", ["N/m", "N m/rad"]),
    ("integral", ["N/(m s)", "N m/(rad s)"]),
    ("derivative", ["N s/m", "N m s/rad"]),
];

/// The text of the spec with `setting`. Only parameters tuned in `space` change; they are removed from `assumed`. `note` becomes a
/// comment above a new table.
///
/// # Errors
/// The editor's error on a text that the compiler accepted, or a section that is not a table.
pub fn edited(compiled: &Compilation, space: &Space, setting: &Setting, note: &str) -> Result<String, String> {
    // The editor would end every line with `\n`.
    let windows = compiled.source.text.contains("\r\n");
    let mut document: DocumentMut = compiled.source.text.parse().map_err(|error| format!("{error}"))?;
    let mut written: Vec<String> = Vec::new();
    let tunes = |wanted: fn(Role) -> bool| space.parameters.iter().any(|parameter| wanted(parameter.role));
    match setting {
        Setting::Legs { level, drift } => {
            let run = compiled.model.timing.period * f64::from(compiled.model.adaptation.run_interval);
            let table = section(&mut document, "adaptation", note)?;
            for (stem, value, tuned) in [
                ("level", *level, tunes(|role| role == Role::Level)),
                ("drift", *drift, tunes(|role| role == Role::Drift)),
            ] {
                let bandwidth = format!("{stem}_bandwidth");
                if !tuned {
                    continue;
                }
                // Rounded down: for a weight of 1 a bandwidth rounded up would be refused.
                let (key, value) = if table.contains_key(&bandwidth) {
                    (bandwidth, format!("{:.3e} rad/s", floor4(value / run)).into())
                } else {
                    (format!("{stem}_weight"), value.into())
                };
                set(table, &key, value);
                written.push(format!("adaptation.{key}"));
            }
        }
        Setting::Platform { combined, position, .. } => {
            // For P/F the compiler derives missing values from given ones. So both are written; otherwise the
            // compiled values would differ from the scored ones.
            let (gains_given, bandwidths_given) = compiled
                .model
                .task_space
                .as_ref()
                .filter(|task| LoopKind::of(start_mode(&compiled.model, task)) == LoopKind::Combined)
                .map_or((true, true), |task| (task.gains.is_some(), task.adaptation.is_some()));
            if !gains_given || tunes(|role| matches!(role, Role::Proportional(_) | Role::Integral(_))) {
                let (name, gains) = if space.alone { ("position_gains", position) } else { ("gains", combined) };
                let table = section(&mut document, name, note)?;
                let groups = [&gains.proportional, &gains.integral, &gains.derivative];
                for ((key, units), values) in UNITS.iter().zip(groups) {
                    let mut list = Array::new();
                    for (axis, value) in values.iter().enumerate() {
                        list.push(format!("{} {}", plain(*value), units[axis / 3]));
                    }
                    set(table, key, Value::Array(list));
                    written.push(format!("{name}.{key}"));
                }
            }
            if !bandwidths_given || tunes(|role| matches!(role, Role::Level | Role::Drift)) {
                let table = section(&mut document, "adaptation", note)?;
                set(table, "level_bandwidth", format!("{} rad/s", plain(combined.level_bandwidth)).into());
                set(table, "drift_bandwidth", format!("{} rad/s", plain(combined.drift_bandwidth)).into());
                written.extend(["level", "drift"].map(|stem| format!("adaptation.{stem}_bandwidth")));
            }
        }
    }
    forget(&mut document, &written);
    let text = document.to_string();
    Ok(if windows { text.replace("\r\n", "\n").replace('\n', "\r\n") } else { text })
}

/// Removes keys from the list of assumed values.
fn forget(document: &mut DocumentMut, keys: &[String]) {
    if let Some(assumed) = document.get_mut("assumed").and_then(Item::as_array_mut) {
        assumed.retain(|entry| entry.as_str().is_none_or(|path| !keys.iter().any(|key| key == path)));
    }
}

/// The shortest text that reads back to the same value, in the style of specs.
fn plain(value: f64) -> String {
    if value == 0.0 || (1e-2..1e5).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}

fn floor4(value: f64) -> f64 {
    let scale = libm::pow(10.0, 3.0 - libm::floor(libm::log10(value)));
    libm::floor(value * scale) / scale
}

fn section<'a>(document: &'a mut DocumentMut, name: &str, note: &str) -> Result<&'a mut Table, String> {
    if !document.contains_key(name) {
        let mut table = Table::new();
        table.decor_mut().set_prefix(format!("\n# {note}\n"));
        document.insert(name, Item::Table(table));
    }
    document[name].as_table_mut().ok_or_else(|| format!("`{name}` is not written as a section [{name}]"))
}

/// Replaces a value but not its surrounding whitespace and comments, or adds it.
fn set(table: &mut Table, key: &str, mut value: Value) {
    if let Some(old) = table.get(key).and_then(Item::as_value) {
        *value.decor_mut() = old.decor().clone();
        table[key] = Item::Value(value);
    } else {
        table.insert(key, Item::Value(value));
    }
}

/// The change as a patch for `patch -p0` and `git apply -p0`.
pub fn patch(name: &str, old: &str, new: &str) -> String {
    let mut options = DiffOptions::new();
    options.set_original_filename(name.to_owned()).set_modified_filename(name.to_owned());
    options.create_patch(old, new).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_keeps_its_comment_and_its_place() {
        let text =
            "# head\n[adaptation]\nmode         = \"pcc\"\nlevel_weight = 0.252              # omega_1\n\n[timing]\n";
        let mut document: DocumentMut = text.parse().unwrap();
        set(section(&mut document, "adaptation", "x").unwrap(), "level_weight", 0.15.into());
        assert_eq!(document.to_string(), text.replace("0.252", "0.15"));
    }

    #[test]
    fn a_new_section_is_added_at_the_end_with_its_note() {
        let mut document: DocumentMut = "a = 1 # one\n\n[[b]]\nc = 2\n".parse().unwrap();
        set(section(&mut document, "gains", "tuned").unwrap(), "k", 1.5.into());
        assert_eq!(document.to_string(), "a = 1 # one\n\n[[b]]\nc = 2\n\n# tuned\n[gains]\nk = 1.5\n");
    }

    #[test]
    fn tuned_parameters_are_no_longer_assumed() {
        let text = "assumed = [ # why\n    \"gains.integral\", \"sensor.noise\",\n]\n";
        let mut document: DocumentMut = text.parse().unwrap();
        forget(&mut document, &["gains.integral".to_owned(), "gains.derivative".to_owned()]);
        let assumed: Vec<_> = document["assumed"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
        assert_eq!(assumed, ["sensor.noise"]);
        let mut without: DocumentMut = "a = 1\n".parse().unwrap();
        forget(&mut without, &["a".to_owned()]);
        assert_eq!(without.to_string(), "a = 1\n");
    }

    #[test]
    fn numbers_read_back() {
        for value in [0.0, 1.836e9, 5.068e5, 45.67, 1.5e-6, 0.02, 99_990.0] {
            assert_eq!(plain(value).parse::<f64>().unwrap(), value);
        }
        assert!(floor4(4999.96) <= 4999.96);
    }
}
