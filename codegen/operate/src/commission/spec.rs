//! The spec with what was found: an edit that keeps comments and layout, and says which record each value is from.

use std::path::{Component, Path};

use specgen_compiler::compile::{self, Compilation};
use specgen_identify::Parameter;
use specgen_language::diagnostic::{Diagnostic, Place, codes};
use specgen_language::model::{StructuralKind, StructuralMode};
use specgen_language::outcome::Failure;
use specgen_language::spec::SpecSource;
use specgen_studies::open_response::OtherMode;
use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, Value};

use super::state::{Response, State, Step};

/// Least size of a figure over its standard error that is written, and the largest damping ratio.
const SURE: f64 = 3.0;
const MOST_DAMPING: f64 = 0.3;
/// Keys of creep and rate that a leg model replaces.
const RATE: [&str; 4] = ["rate", "creep_times", "creep_weights", "rate_tables"];

/// The text of a spec with the findings of `state`, and its compilation. `folder`: of the records, from `dir`, that of the new spec;
/// empty if it is the same. A workspace that weak legs do not reach is narrowed, which `state` notes.
///
/// # Errors
/// The compiler refuses the text.
pub(super) fn edited(
    compiled: &Compilation,
    state: &mut State,
    folder: &str,
    dir: &Path,
) -> Result<(String, Compilation), Failure> {
    let sizes = (compiled.model.actuator.stacks, compiled.model.hysteresis.grid);
    let known = &compiled.model.structural_modes;
    let mut text = with(&compiled.source.text, state, folder, (sizes, (known, compiled.model.timing.period)))
        .map_err(Failure::Gate)?;
    state.narrowed.clear();
    loop {
        let source =
            SpecSource { text: text.clone(), dir: dir.to_owned(), display_name: "the commissioned spec".to_owned() };
        match compile::compile_source(source) {
            Ok(new) => return Ok((text, new)),
            Err(refusal) => match narrowed(&text, &refusal.findings) {
                Some((new, lines)) if state.narrowed.is_empty() => (text, state.narrowed) = (new, lines),
                _ => return Err(refusal.into()),
            },
        }
    }
}

/// The text with the workspace that the measured legs reach, and what has changed; none if that is not what is refused.
fn narrowed(text: &str, findings: &[Diagnostic]) -> Option<(String, Vec<String>)> {
    let (mut text, mut lines) = (text.to_owned(), Vec::new());
    let beyond = findings.iter().rev().filter(|found| found.code == codes::AXIS_UNREACHABLE.id);
    for found in beyond {
        let (Place::Spec(span), Some(new)) = (&found.place, &found.replacement) else { continue };
        lines.insert(0, format!("{} is {new}, not {}: the legs reach no further", found.key, &text[span.clone()]));
        text.replace_range(span.clone(), new);
    }
    (!lines.is_empty()).then_some((text, lines))
}

/// The text of a spec with what was found; `grid`: cells of the tables, `known`: its structural modes.
fn with(
    text: &str,
    state: &State,
    folder: &str,
    ((stacks, grid), known): ((u32, usize), (&[StructuralMode], f64)),
) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|error| format!("{error}"))?;
    let mut measured = Vec::new();
    let date = |step| state.steps.get(&step).map_or("", |passed| passed.date.as_str());
    if !state.legs.is_empty() {
        let hysteresis = section(&mut document, "hysteresis")?;
        let files: Array = (0..state.legs.len()).map(|leg| format!("{folder}leg{leg}.csv")).collect();
        if state.legs.iter().any(|leg| leg.model != "preisach") {
            RATE.iter().for_each(|key| drop(hysteresis.remove(key)));
        }
        hysteresis.entry("grid").or_insert(toml_edit::value(grid as i64));
        let models: Vec<&str> = state.legs.iter().map(|leg| leg.model.as_str()).collect();
        let (first, models) = (&state.legs[0].record, listed(&models));
        let note = format!("measured in place {}, {first} and others; {models}", date(Step::Curves));
        set(hysteresis, "records", Value::Array(files), &note);
        let actuator = section(&mut document, "actuator")?;
        let gain = state.legs.iter().fold(0.0, |sum, leg| sum + leg.gain) / state.legs.len() as f64;
        let value = format!("{:.5} um/V", gain / f64::from(stacks) * 1e6);
        set(actuator, "stack_gain", value.into(), &format!("mean of the legs, measured {}", date(Step::Curves)));
        measured.extend(["hysteresis.records", "actuator.stack_gain"]);
    }
    if let Some(coupling) = &state.cross_talk {
        let actuator = section(&mut document, "actuator")?;
        let rows = coupling.matrix.iter().map(|row| row.iter().map(|entry| rounded(*entry)).collect::<Array>());
        let mut matrix: Array = rows.collect();
        for row in matrix.iter_mut() {
            row.decor_mut().set_prefix("\n    ");
        }
        matrix.set_trailing("\n");
        matrix.set_trailing_comma(true);
        let note = format!("leg0-cross-talk.csv to leg5-cross-talk.csv, measured {}", date(Step::CrossTalk));
        set(actuator, "cross_talk", Value::Array(matrix), &note);
        measured.push("actuator.cross_talk");
    }
    if let Some(response) = &state.response {
        measured.extend(dynamics(&mut document, response, known)?);
    }
    if let Some(assumed) = document.get_mut("assumed").and_then(Item::as_array_mut) {
        assumed.retain(|entry| entry.as_str().is_none_or(|key| !measured.contains(&key)));
    }
    let written = document.to_string();
    // The editor ends every line with `\n`.
    Ok(if text.contains("\r\n") { written.replace("\r\n", "\n").replace('\n', "\r\n") } else { written })
}

/// Lag, damping and structural modes, as found in the response at rest; returns the keys that are written.
fn dynamics(
    document: &mut DocumentMut,
    response: &Response,
    (known, period): (&[StructuralMode], f64),
) -> Result<Vec<&'static str>, String> {
    let Response { found, date, .. } = response;
    let is_sure = |of: &Parameter| of.value > SURE * of.error;
    let mut measured = Vec::new();
    let (lag, what) = response.lag_of_spec(period);
    if is_sure(&lag) {
        let amplifier = document.entry("amplifier").or_insert_with(toml_edit::table);
        let amplifier = amplifier.as_table_mut().ok_or("`amplifier` is not written as a section [amplifier]")?;
        let [value, error] = [lag.value, lag.error].map(|time| time * 1e3);
        let note = format!("± {error:.4}, {what}, mean of the legs, response-leg0.rec and others, measured {date}");
        set(amplifier, "lag", format!("{value:.4} ms").into(), &note);
        measured.push("amplifier.lag");
    }
    let lowest = found.modes.first().filter(|mode| is_sure(&mode.zeta) && mode.zeta.value < MOST_DAMPING);
    if let Some(lowest) = lowest {
        let note =
            format!("± {:.5}, of the mode at {:.1} Hz, measured {date}", lowest.zeta.error, lowest.frequency.value);
        set(section(document, "control")?, "modal_damping", digits(lowest.zeta.value, 1e5).into(), &note);
        measured.push("control.modal_damping");
    }
    let mut listed: Vec<_> = known.iter().map(|mode| (mode.kind, mode.place, mode.frequency)).collect();
    for mode in found.others.iter().filter(|mode| !mode.known) {
        let OtherMode { frequency, zeta, place, participation, .. } = mode;
        let (kind, number) = StructuralMode::place_of(place);
        let here = (kind, number, digits(frequency.value, 10.0));
        // A gauge that moves against its leg would become one of the frame, which acts on all gauges: the page names it.
        if kind == StructuralKind::Frame || listed.iter().any(|other| StructuralMode::coincide(here, *other)) {
            continue;
        }
        listed.push(here);
        let all = document.entry("mode").or_insert_with(|| Item::ArrayOfTables(ArrayOfTables::new()));
        let all = all.as_array_of_tables_mut().ok_or("`mode` is not written as [[mode]]")?;
        let mut table = Table::new();
        let note = format!("± {:.1}, response-leg0.rec and others, measured {date}", frequency.error);
        set(&mut table, "frequency", format!("{:.1} Hz", here.2).into(), &note);
        set(&mut table, "damping_ratio", digits(zeta.value, 1e4).into(), &format!("± {:.4}", zeta.error));
        table.insert("at", toml_edit::value(place.as_str()));
        if kind != StructuralKind::Leg {
            let note = format!("± {:.3}", participation.error);
            set(&mut table, "participation", digits(participation.value, 1e3).into(), &note);
        }
        all.push(table);
    }
    Ok(measured)
}

/// Each word once, in order.
fn listed(words: &[&str]) -> String {
    let mut once: Vec<&str> = Vec::new();
    for word in words {
        if !once.contains(word) {
            once.push(word);
        }
    }
    once.join(" / ")
}

/// To seven digits behind the point: 0.1 nm of a stroke of a millimetre.
fn rounded(entry: f64) -> f64 {
    digits(entry, 1e7)
}

fn digits(value: f64, unit: f64) -> f64 {
    libm::round(value * unit) / unit
}

fn section<'a>(document: &'a mut DocumentMut, name: &str) -> Result<&'a mut Table, String> {
    let table = document.get_mut(name).and_then(Item::as_table_mut);
    table.ok_or_else(|| format!("`{name}` is not written as a section [{name}]: write it so, and repeat the step"))
}

/// Replaces a value and the comment behind it, or adds it.
fn set(table: &mut Table, key: &str, mut value: Value, note: &str) {
    value.decor_mut().set_prefix(" ");
    value.decor_mut().set_suffix(format!("  # {note}"));
    match table.get_mut(key) {
        Some(old) => *old = Item::Value(value),
        None => drop(table.insert(key, Item::Value(value))),
    }
}

/// Whether a spec names files beside its records: a copy in another folder would not find them.
pub(super) fn names_files(text: &str) -> bool {
    let Ok(document) = text.parse::<DocumentMut>() else { return false };
    let trajectories = document.get("trajectory").and_then(Item::as_array_of_tables);
    let joints = document.get("geometry").and_then(|geometry| geometry.get("joints"));
    joints.is_some() || trajectories.is_some_and(|all| all.iter().any(|one| one.contains_key("file")))
}

/// The folder of the records from that of the spec, such as `commission/`.
///
/// # Errors
/// It is not within the folder of the spec.
pub(super) fn from_spec(spec: &Path, folder: &Path) -> Result<String, Failure> {
    let dir = spec.parent().filter(|dir| !dir.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let whole = |path: &Path| path.canonicalize().unwrap_or_default();
    let relative = whole(folder).strip_prefix(whole(dir)).map(Path::to_owned).ok();
    let plain = |path: &Path| path.components().all(|part| matches!(part, Component::Normal(_)));
    let text = relative.filter(|path| plain(path)).and_then(|path| path.to_str().map(str::to_owned));
    match text.filter(|text| !text.contains('\\')) {
        Some(text) if text.is_empty() => Ok(text),
        Some(text) => Ok(text + "/"),
        None => Err(Failure::Usage(format!(
            "--write needs the records within the folder of the spec: give -o a folder in `{}`",
            dir.display()
        ))),
    }
}

#[cfg(test)]
mod tests {
    use specgen_studies::open_response::{FoundMode, OpenResponse};

    use super::super::state::{Coupling, Leg};
    use super::*;

    fn state() -> State {
        let leg = |gain: f64| Leg {
            model: "plays".to_owned(),
            gain,
            fit_rms: 1e-9,
            arbitrary_rms: None,
            record: "leg0-curves-156.csv".to_owned(),
        };
        let mut state = State { legs: vec![leg(6.0e-7), leg(6.2e-7)], ..State::default() };
        let mut matrix = [[0.0; 6]; 6];
        matrix[0][1] = 0.012_345_678_9;
        state.cross_talk = Some(Coupling { matrix, error: 1e-5 });
        state.pass(Step::Curves, None);
        state.pass(Step::CrossTalk, None);
        state
    }

    #[test]
    fn what_was_found_is_written_with_its_record_and_nothing_else_changes() {
        let text = "# head\nassumed = [\"actuator.stack_gain\", \"sensor.noise\"]\n\n[actuator]   # legs\nstacks = 5\n\
            stack_gain = \"0.1 um/V\"   # guess\n\n[hysteresis]\ngrid = 32 # N\nrecords = [\"a.csv\"]\nrate = \"creep\"\n\
            creep_times = [\"1 s\"]\ncreep_weights = [0.1]\n\n[timing]\nperiod = \"100 us\"\n";
        for text in [text.to_owned(), text.replace('\n', "\r\n")] {
            let new = with(&text, &state(), "commission/", ((5, 32), (&[], 1e-4))).unwrap();
            let lines: Vec<&str> = new.lines().collect();
            assert_eq!(new.contains("\r\n"), text.contains("\r\n"));
            let line = |start: &str| *lines.iter().find(|line| line.starts_with(start)).unwrap_or(&"");
            let records = line("records");
            assert!(records.starts_with("records = [\"commission/leg0.csv\", \"commission/leg1.csv\"]"), "{new}");
            assert!(records.contains("  # measured in place 20") && records.ends_with("others; plays"), "{new}");
            assert!(
                line("stack_gain").starts_with("stack_gain = \"0.12200 um/V\"  # mean of the legs, measured 20"),
                "{new}"
            );
            assert!(
                !line("    [0.0, 0.0123457,").is_empty() && line("assumed").ends_with("\"sensor.noise\"]"),
                "{new}"
            );
            for kept in ["# head", "[actuator]   # legs", "grid = 32 # N", "[timing]", "period = \"100 us\""] {
                assert!(lines.contains(&kept), "{kept}: {new}");
            }
            assert!(!new.contains("creep") && !new.contains("rate"), "{new}");
            // Again, as after a repeated step.
            assert_eq!(with(&new, &state(), "commission/", ((5, 32), (&[], 1e-4))).unwrap(), new);
        }
        assert!(
            with("actuator = 1\n", &state(), "", ((5, 32), (&[], 1e-4)))
                .unwrap_err()
                .contains("not written as a section [hysteresis]")
        );
    }

    #[test]
    fn lag_damping_and_new_modes_are_written_once() {
        let of = |value: f64, error: f64| Parameter { value, error };
        let mode = |frequency: f64, place: &str, participation: f64| OtherMode {
            frequency: of(frequency, 0.2),
            zeta: of(0.012_34, 1e-4),
            place: place.to_owned(),
            participation: of(participation, 0.01),
            known: false,
        };
        let lowest = FoundMode { frequency: of(355.0, 0.1), zeta: of(0.021_234_5, 2e-5), spec: [361.0, 0.02] };
        let found = OpenResponse {
            modes: vec![lowest],
            others: vec![mode(1107.18, "gauge 4", 0.2), mode(1300.0, "leg 2", 1.0)],
            delay: of(352.4e-6, 1.4e-6),
            ..OpenResponse::default()
        };
        let response = Response { found, strokes: [0.0; 6], date: "2026-11-29".to_owned(), agreement: Vec::new() };
        let state = State { response: Some(response), ..State::default() };
        let text = "assumed = [\"amplifier.lag\", \"control.modal_damping\", \"gauge\"]\n\n[control]\nmodal_damping = 0.02 # guess\n";
        let new = with(text, &state, "", ((5, 32), (&[], 1e-4))).unwrap();
        for part in [
            "assumed = [ \"gauge\"]\n",
            "modal_damping = 0.02123  # ± 0.00002, of the mode at 355.0 Hz, measured 2026-11-29",
            "[amplifier]\nlag = \"0.3524 ms\"  # ± 0.0014, lag and dead time, mean of the legs",
            "[[mode]]\nfrequency = \"1107.2 Hz\"  # ± 0.2, response-leg0.rec and others, measured 2026-11-29\ndamping_ratio = 0.0123",
            "at = \"gauge 4\"\nparticipation = 0.2  # ± 0.010\n",
            "at = \"leg 2\"\n",
        ] {
            assert!(new.contains(part), "{part}: {new}");
        }
        assert_eq!(new.matches("participation").count(), 1, "{new}");
        let own =
            |kind, place, frequency| StructuralMode { frequency, damping_ratio: 0.01, kind, place, participation: 0.2 };
        let known = [own(StructuralKind::Gauge, Some(3), 1110.0), own(StructuralKind::Leg, Some(1), 1200.0)];
        let again = with(text, &state, "", ((5, 32), (&known, 1e-4))).unwrap();
        assert!(!again.contains("gauge 4") && again.contains("at = \"leg 2\""), "{again}");
    }

    #[test]
    fn a_workspace_beyond_weak_legs_is_narrowed() {
        let text = "[workspace]\ntranslation = [\"50 um\", \"50 um\", \"52 um\"]\n";
        let at = |value: &str, from: usize| text[from..].find(value).map(|start| from + start).unwrap();
        let finding = |key: &str, start: usize, new: &str| {
            let mut one = Diagnostic::new(codes::AXIS_UNREACHABLE, key, Place::Spec(start..start + 7), "", "");
            one.replacement = Some(new.to_owned());
            one
        };
        let findings = [
            finding("workspace.translation[0]", at("\"50 um\"", 0), "\"47.95 um\""),
            finding("workspace.translation[2]", at("\"52 um\"", 0), "\"49.1 um\""),
        ];
        let (new, lines) = narrowed(text, &findings).unwrap();
        assert_eq!(new, "[workspace]\ntranslation = [\"47.95 um\", \"50 um\", \"49.1 um\"]\n");
        assert_eq!(lines[0], "workspace.translation[0] is \"47.95 um\", not \"50 um\": the legs reach no further");
        assert!(lines[1].starts_with("workspace.translation[2]"), "{lines:?}");
        assert!(narrowed(text, &[]).is_none());
    }

    #[test]
    fn records_are_named_from_the_folder_of_the_spec() {
        let folder = tempfile::tempdir().unwrap();
        let spec = folder.path().join("platform.toml");
        let records = folder.path().join("runs/one");
        std::fs::create_dir_all(&records).unwrap();
        assert_eq!(from_spec(&spec, &records).unwrap(), "runs/one/");
        assert_eq!(from_spec(&records.join("platform.toml"), &records).unwrap(), "");
        assert!(
            from_spec(&records.join("platform.toml"), folder.path()).unwrap_err().message().contains("--write needs")
        );
    }
}
