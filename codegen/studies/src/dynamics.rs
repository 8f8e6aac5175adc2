//! M, C ḣ, G, J and leg forces of a platform at given states, from the model that its controller uses.

use std::f64::consts::FRAC_PI_4;
use std::path::Path;

use nalgebra::{Rotation3, Vector3};
use serde::Serialize;
use serde_json::{Value, json};
use specgen_compiler::{lower, spec_file};
use specgen_runtime::Motion;

use specgen_identify::{Reading, states};
use specgen_language::files;
use specgen_language::model::Model;
use specgen_language::outcome::{Failure, Outcome, Refusal};
use specgen_language::output::{unread_file, write_file};
use specgen_language::ui::{ControllerForm, Ui};
use specgen_numerics::{coriolis, displacements, gravity, jacobian, leg_forces, mass_matrix};
use specgen_run_time::Dynamics;

/// Valid range of leg lengths relative to those at rest.
const LENGTH_RATIOS: std::ops::RangeInclusive<f64> = 0.7..=1.3;
/// Largest file of states, bytes.
const LARGEST: u64 = 64 << 20;

/// A named state.
struct State {
    id: String,
    given: [[f64; 6]; 3],
}

/// Computes the dynamics of a spec at the states in a file, and shows or writes them. Poses are relative to rest or absolute; computed by
/// the controller in its scalar type, or by the model.
///
/// # Errors
/// A file cannot be read or written, the spec is refused, or a state is out of range.
pub fn run(
    spec: &Path,
    states_file: &Path,
    reading: &Reading,
    from_rest: bool,
    generated: bool,
    output: Option<&Path>,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let states = read_states(states_file, reading)?;
    let compiled = spec_file::compiled(spec, ui)?;
    let platform = lower::platform(&compiled.model)
        .map_err(|findings| Refusal { source: Some(compiled.source.clone()), findings })?;
    let height = if from_rest { 0.0 } else { compiled.model.geometry.height };
    let mut vectors = Vec::with_capacity(states.len());
    for state in &states {
        let [mut pose, rate, acceleration] = state.given;
        pose[2] -= height;
        within_range(&compiled.model, &pose)
            .map_err(|text| Failure::Gate(format!("{}: state {}: {text}", states_file.display(), state.id)))?;
        let motion = Motion { pose, rate, acceleration };
        let result = if generated {
            ui.runs(ControllerForm::RunTime);
            specgen_run_time::dynamics(&compiled.ir, &motion)
        } else {
            Dynamics {
                jacobian: jacobian(&platform, &pose),
                mass: mass_matrix(&platform, &pose),
                coriolis: coriolis(&platform, &pose, &rate),
                gravity: gravity(&platform, &pose),
                leg_forces: leg_forces(&platform, &motion),
                displacements: displacements(&platform, &pose),
            }
        };
        vectors.push(vector(state, &result, &platform.rest_lengths()));
    }
    let document = json!({
        "units": "SI",
        "pose": if from_rest { "from rest" } else { "absolute" },
        "computed_by": if generated { "controller" } else { "model, f64" },
        "vectors": vectors,
    });
    match output {
        Some(path) => {
            write_file(path, document.text().as_bytes())?;
            ui.result(&ResultFile { states: states.len(), file: path.display().to_string() });
        }
        None => ui.result(&document),
    }
    Ok(())
}

#[derive(Serialize)]
struct ResultFile {
    states: usize,
    file: String,
}

impl Outcome for ResultFile {
    fn text(&self) -> String {
        format!("wrote {} states to {}\n", self.states, self.file)
    }
}

/// Checks the range in which the dynamics are exact, see [`specgen_runtime::dynamics`]. Uses the textbook formula for lengths, because
/// the kernel's lengths are wrong outside that range.
fn within_range(model: &Model, pose: &[f64; 6]) -> Result<(), String> {
    let [x, y, z, a, b, c] = *pose;
    if [a, b, c].iter().any(|angle| angle.abs() > FRAC_PI_4) {
        return Err(format!("an angle exceeds ±{FRAC_PI_4:.4} rad, the range of the dynamics"));
    }
    let turn = Rotation3::from_euler_angles(a, b, c);
    let geometry = &model.geometry;
    for (leg, (base, joint)) in geometry.base_joints.iter().zip(&geometry.platform_joints).enumerate() {
        let (base, joint) = (Vector3::from(*base), Vector3::from(*joint));
        let rest = (Vector3::new(0.0, 0.0, geometry.height) + joint - base).norm();
        let ratio = (Vector3::new(x, y, geometry.height + z) + turn * joint - base).norm() / rest;
        if !LENGTH_RATIOS.contains(&ratio) {
            return Err(format!(
                "the length of leg {leg} is {ratio:.3} of that at rest, outside {} to {}, the range of the dynamics; is the pose absolute or \
                 relative to rest (--from-rest)?",
                LENGTH_RATIOS.start(),
                LENGTH_RATIOS.end()
            ));
        }
    }
    Ok(())
}

/// One state in the layout of the reference vectors.
fn vector(state: &State, result: &Dynamics, rest_lengths: &[f64; 6]) -> Value {
    let [pose, rate, acceleration] = &state.given;
    let lengths: Vec<f64> = rest_lengths.iter().zip(result.displacements).map(|(l, d)| l + d).collect();
    let force: Vec<f64> = result
        .mass
        .iter()
        .zip(result.coriolis.iter().zip(result.gravity))
        .map(|(row, (c, g))| row.iter().zip(acceleration).fold(0.0, |sum, (m, a)| sum + m * a) + c + g)
        .collect();
    json!({
        "id": state.id,
        "h": pose, "hd": rate, "hdd": acceleration,
        "leg_lengths": lengths,
        "leg_displacements": result.displacements,
        "J": result.jacobian, "M": result.mass, "Cv": result.coriolis, "G": result.gravity, "F": force,
        "leg_forces": result.leg_forces,
    })
}

fn read_states(path: &Path, reading: &Reading) -> Result<Vec<State>, Failure> {
    let shown = path.display();
    let refuse = |text: String| Failure::Gate(format!("{shown}: {text}"));
    let text = files::text_of(path, LARGEST).map_err(|unread| unread_file(path, &unread))?;
    let states = if text.trim_start().starts_with(['{', '[']) {
        from_json(&text).map_err(refuse)?
    } else {
        let given =
            states::parse(&text, &shown.to_string(), reading).map_err(|findings| Refusal { source: None, findings })?;
        given.into_iter().enumerate().map(|(k, given)| State { id: k.to_string(), given }).collect()
    };
    if states.is_empty() {
        return Err(refuse("the file has no states".to_owned()));
    }
    Ok(states)
}

fn from_json(text: &str) -> Result<Vec<State>, String> {
    let document: Value = serde_json::from_str(text).map_err(|error| format!("not JSON: {error}"))?;
    let list = document.get("vectors").unwrap_or(&document).as_array();
    let list = list.ok_or("expected a list of states, or an object with a list `vectors`")?;
    let state = |(index, value): (usize, &Value)| {
        let id = value.get("id").and_then(Value::as_str).map_or_else(|| index.to_string(), str::to_owned);
        let six = |key: &str| -> Result<[f64; 6], String> {
            let numbers = value.get(key).and_then(Value::as_array);
            let numbers: Option<Vec<f64>> = numbers.and_then(|list| list.iter().map(Value::as_f64).collect());
            let numbers = numbers.and_then(|list| <[f64; 6]>::try_from(list).ok());
            numbers.ok_or_else(|| format!("state {id}: `{key}` must be six numbers"))
        };
        Ok(State { given: [six("h")?, six("hd")?, six("hdd")?], id })
    };
    list.iter().enumerate().map(state).collect()
}
