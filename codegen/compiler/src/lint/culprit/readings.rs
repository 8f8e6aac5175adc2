//! What the rest of a spec says a value is: other readings than a power of ten.

use core::f64::consts::TAU;

use specgen_language::model::Model;

/// Two readings within this factor of each other are one.
const ALIKE: f64 = 1.1;
/// One within this factor of what is written is no other.
const OTHER: f64 = 1.2;

/// A value as the rest of the spec says it.
pub struct Reading {
    /// Times what is written.
    pub factor: f64,
    /// Where that comes from.
    pub why: String,
}

/// Other readings of the values at the list or key `list`.
pub fn of(model: &Model, list: &str) -> Vec<Reading> {
    let actuator = &model.actuator;
    let span = actuator.voltage[1] - actuator.voltage[0];
    let travel = actuator.leg_gain() * span;
    let stacks = f64::from(actuator.stacks);
    let said: Vec<(f64, &str)> = match list {
        "actuator.voltage" => vec![
            ((model.dac.range[1] - model.dac.range[0]) / span, "`dac.range`"),
            (actuator.stroke / travel, "what the stroke takes at the gain of a leg"),
        ],
        "actuator.stroke" => vec![
            (travel / actuator.stroke, "what the voltage makes at the gain of a leg"),
            (stacks, "the stroke of all stacks of a leg"),
        ],
        "actuator.stack_gain" => vec![
            (1.0 / stacks, "the gain of a leg over its stacks"),
            (actuator.stroke / travel, "what the stroke is over voltage and stacks"),
        ],
        "actuator.axial_stiffness" => vec![(1.0 / stacks, "the stiffness of a stack over their number")],
        "actuator.resonance" => vec![(1.0 / TAU, "rad/s, in Hz")],
        "control.velocity_cutoff" | "adaptation.level_bandwidth" | "adaptation.drift_bandwidth" => {
            vec![(TAU, "Hz, in rad/s")]
        }
        _ => Vec::new(),
    };
    let mut readings: Vec<Reading> = Vec::new();
    let apart = |a: f64, b: f64| libm::exp(libm::fabs(libm::log(a / b)));
    for (factor, why) in said.into_iter().filter(|(factor, _)| factor.is_finite() && apart(*factor, 1.0) > OTHER) {
        match readings.iter_mut().find(|known| apart(known.factor, factor) < ALIKE) {
            Some(known) => known.why = format!("{} and {why}", known.why),
            None => readings.push(Reading { factor, why: why.to_owned() }),
        }
    }
    readings
}

/// What a value is often taken for, if it is so small.
pub fn hint(model: &Model, list: &str) -> Option<&'static str> {
    let [low, high] = model.actuator.voltage;
    let is_input = list == "actuator.voltage" && low >= -10.0 && high <= 10.0;
    is_input.then_some(
        "up to 10 V are what an amplifier takes at its input; `actuator.voltage` and `dac.range` are at the stack",
    )
}
