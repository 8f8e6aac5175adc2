//! Alternative values that the rest of a spec implies, other than powers of ten.

use core::f64::consts::TAU;

use specgen_language::model::Model;

/// Two readings within this factor count as one.
const ALIKE: f64 = 1.1;
/// A reading within this factor of the written value is not an alternative.
const OTHER: f64 = 1.2;

/// A value that the rest of the spec implies.
pub struct Reading {
    /// Ratio to the written value.
    pub factor: f64,
    /// Its source.
    pub why: String,
}

/// Other readings of the values at the list or key `list`.
pub fn of(model: &Model, list: &str) -> Vec<Reading> {
    let actuator = &model.actuator;
    let span = actuator.voltage[1] - actuator.voltage[0];
    let travel = actuator.leg_gain() * span;
    let stacks = f64::from(actuator.stacks);
    let implied: Vec<(f64, &str)> = match list {
        "actuator.voltage" => vec![
            ((model.dac.range[1] - model.dac.range[0]) / span, "`dac.range`"),
            (actuator.stroke / travel, "the voltage for the stroke at the gain of a leg"),
        ],
        "actuator.stroke" => vec![
            (travel / actuator.stroke, "the motion for the voltage at the gain of a leg"),
            (stacks, "the stroke of all stacks of a leg"),
        ],
        "actuator.stack_gain" => vec![
            (1.0 / stacks, "the gain of a leg over its stacks"),
            (actuator.stroke / travel, "stroke over voltage and number of stacks"),
        ],
        "actuator.axial_stiffness" => vec![(1.0 / stacks, "the stiffness of one stack over the number of stacks")],
        "actuator.resonance" => vec![(1.0 / TAU, "rad/s, in Hz")],
        "control.velocity_cutoff" | "adaptation.level_bandwidth" | "adaptation.drift_bandwidth" => {
            vec![(TAU, "Hz, in rad/s")]
        }
        _ => Vec::new(),
    };
    let mut readings: Vec<Reading> = Vec::new();
    let apart = |a: f64, b: f64| libm::exp(libm::fabs(libm::log(a / b)));
    for (factor, why) in implied.into_iter().filter(|(factor, _)| factor.is_finite() && apart(*factor, 1.0) > OTHER) {
        match readings.iter_mut().find(|known| apart(known.factor, factor) < ALIKE) {
            Some(known) => known.why = format!("{} and {why}", known.why),
            None => readings.push(Reading { factor, why: why.to_owned() }),
        }
    }
    readings
}

/// A usual misunderstanding of a value that is too small.
pub fn hint(model: &Model, list: &str) -> Option<&'static str> {
    let [low, high] = model.actuator.voltage;
    let is_input = list == "actuator.voltage" && low >= -10.0 && high <= 10.0;
    is_input
        .then_some("10 V is usual at the input of an amplifier; `actuator.voltage` and `dac.range` are at the stack")
}
