//! Amplifier and converter.

use super::{Facts, Found, figure, times_beyond};
use specgen_language::diagnostic::codes;
use specgen_language::model::Model;

/// Largest slew rate of a first-order lag is range over time constant: a limit above that never binds.
const LAG_SLACK: f64 = 1.0;
/// Noise of an amplifier, of its range: those for stacks have 0.1 to 10 mV on a hundred volts.
const SOUND_NOISE: core::ops::RangeInclusive<f64> = 2e-7..=3e-4;
/// Above this share, 10 mV on a hundred volts, the motion of a leg counts, too: no amplifier that is bought with care has so
/// much …
const LOUD: f64 = 1e-4;
/// … and this motion of a leg, in noises or steps of its gauge, is then reported.
const LOUDEST: f64 = 25.0;
/// Energy of the blocked leg, k s²/2, over that of its charge, C U²/2: ceramics turn at most half of the one into the other,
/// and levers leave a hundredth of that. Wide, for both figures come from data sheets.
const SOUND_COUPLING: core::ops::RangeInclusive<f64> = 1e-3..=5.0;
/// A converter step of more than this share of the stroke is too coarse for any nanopositioning.
const COARSEST_STEP: f64 = 1e-3;

/// Range of a converter over that of the stacks: amplifiers are bought for their stacks.
const WIDEST_RANGE: f64 = 4.0;

/// An amplifier that is so slow never makes the declared slew rate.
pub(super) fn lag_fits_slew(facts: &Facts, found: &mut Found) {
    let (amplifier, actuator) = (&facts.model.amplifier, &facts.model.actuator);
    let [low, high] = actuator.voltage;
    let off = amplifier.lag * actuator.slew_rate / (LAG_SLACK * (high - low));
    if off <= 1.0 {
        return;
    }
    found.add_off(
        off,
        codes::LAG_AGAINST_SLEW,
        "amplifier.lag",
        format!(
            "with a lag of {} ms a step over {} V begins at {} V/ms, but `actuator.slew_rate` is {} V/ms",
            figure(amplifier.lag * 1e3),
            figure(high - low),
            figure((high - low) / amplifier.lag * 1e-3),
            figure(actuator.slew_rate * 1e-3)
        ),
        "check the units of `amplifier.lag` (ms or us) and `actuator.slew_rate` (V/ms or V/s)",
    );
}

/// What charges a stack: I = C dU/dt.
pub(super) fn current_fits_slew(facts: &Facts, found: &mut Found) {
    let model = facts.model;
    let (Some(capacitance), Some(current)) = (model.actuator.capacitance, model.amplifier.current) else { return };
    let needed = capacitance * model.actuator.slew_rate;
    if needed <= current {
        return;
    }
    found.add_off(
        needed / current,
        codes::CURRENT_AGAINST_SLEW,
        "amplifier.current",
        format!(
            "{} uF at {} V/ms take {} A, but the amplifier gives {} A",
            figure(capacitance * 1e6),
            figure(model.actuator.slew_rate * 1e-3),
            figure(needed),
            figure(current)
        ),
        &format!(
            "the amplifier's own limit is {} V/ms: write that as `actuator.slew_rate`, or check `actuator.capacitance` (of a whole leg) and `amplifier.current` (mA or A)",
            figure(current / capacitance * 1e-3)
        ),
    );
}

/// Noise that would move a leg by much of its stroke, or that no amplifier is free of.
pub(super) fn amplifier_noise(facts: &Facts, found: &mut Found) {
    let (noise, actuator) = (facts.model.amplifier.noise, &facts.model.actuator);
    let [low, high] = actuator.voltage;
    let sensor = &facts.model.sensor;
    let step = sensor.step();
    // Nothing below its step is seen.
    let seen = if sensor.noise > step { sensor.noise } else { step };
    let (share, beside) = (noise / (high - low), noise * actuator.leg_gain() / seen);
    let of_range = times_beyond(share, &SOUND_NOISE);
    if noise == 0.0 || (of_range <= 1.0 && (share <= LOUD || beside <= LOUDEST)) {
        return;
    }
    let moves = format!("moves a leg by {} nm rms", figure(noise * actuator.leg_gain() * 1e9));
    let how = if share < *SOUND_NOISE.start() {
        format!("is quieter than any amplifier; it {moves}")
    } else if share > *SOUND_NOISE.end() {
        format!("is {} of its range; it {moves}", figure(share))
    } else {
        format!("{moves}, {} times the noise or the step of its gauge", figure(beside))
    };
    found.add_off(
        of_range,
        codes::AMPLIFIER_NOISE,
        "amplifier.noise",
        format!("an amplifier noise of {} mV rms on {} V {how}", figure(noise * 1e3), figure(high - low)),
        "amplifiers for stacks have 0.1 to 10 mV rms: check the unit (V, mV or uV), and that it is rms, not peak to peak",
    );
}

/// What a stack makes of its charge.
pub(super) fn capacitance_of_the_stacks(facts: &Facts, found: &mut Found) {
    let actuator = &facts.model.actuator;
    let Some(capacitance) = actuator.capacitance else { return };
    let [low, high] = actuator.voltage;
    let volts = high - low;
    let (blocked, charged) =
        (actuator.axial_stiffness * actuator.stroke * actuator.stroke, capacitance * volts * volts);
    let off = times_beyond(blocked / charged, &SOUND_COUPLING);
    if off <= 1.0 {
        return;
    }
    found.add_off(
        off,
        codes::CAPACITANCE_ODD,
        "actuator.capacitance",
        format!(
            "charging {} uF to {} V takes {} J, and the blocked leg holds {} J (stiffness x stroke^2 / 2)",
            figure(capacitance * 1e6),
            figure(volts),
            figure(charged / 2.0),
            figure(blocked / 2.0)
        ),
        "ceramics turn at most half of the one into the other: check the unit of `actuator.capacitance` (uF or nF; of a whole leg), and `actuator.axial_stiffness`",
    );
}

/// One code of the converter in nanometres.
pub(super) fn converter_step(facts: &Facts, found: &mut Found) {
    let (dac, actuator) = (&facts.model.dac, &facts.model.actuator);
    let [low, high] = dac.range;
    let volts = (high - low) / (libm::exp2(f64::from(dac.bits)) - 1.0);
    let step = volts * actuator.leg_gain();
    if step <= COARSEST_STEP * actuator.stroke {
        return;
    }
    found.add_off(
        step / (COARSEST_STEP * actuator.stroke),
        codes::CONVERTER_COARSE,
        "dac.bits",
        format!(
            "one code of {} mV moves a leg by {} nm, {} of its stroke of {} um",
            figure(volts * 1e3),
            figure(step * 1e9),
            figure(step / actuator.stroke),
            figure(actuator.stroke * 1e6)
        ),
        "a converter of 16 bits or more is usual; check `dac.range` and `dac.bits` too: the range is in volts at the stack",
    );
}

/// A converter is not spread over many times what the stacks take.
pub(super) fn converter_range(facts: &Facts, found: &mut Found) {
    let ([low, high], [from, to]) = (facts.model.dac.range, facts.model.actuator.voltage);
    if high - low <= WIDEST_RANGE * (to - from) {
        return;
    }
    let item = usize::from(high - to >= from - low);
    found.add(
        codes::CONVERTER_WIDE,
        &format!("dac.range[{item}]"),
        format!(
            "the converter spans {} V, the stacks take {} V of it",
            figure(high - low),
            figure(to - from)
        ),
        "two bits and more of the converter are never used: check `dac.range`, in volts at the stack, and `actuator.voltage`",
    );
}

/// Amplifiers that are off leave the stacks at 0 V.
pub(super) fn rest_without_power(facts: &Facts, found: &mut Found) {
    let model = facts.model;
    let [low, high] = model.actuator.voltage;
    let rest = model.rest_voltage();
    let off = Model::nearest_to_zero(low, high);
    if rest == off {
        return;
    }
    found.add(
        codes::REST_NOT_ZERO,
        "supervisor.rest_voltage",
        format!(
            "the legs rest at {} V, but stacks whose amplifiers are off stand at 0 V: {} um that a leg jumps when they are switched on",
            figure(rest),
            figure((rest - off).abs() * model.actuator.leg_gain() * 1e6)
        ),
        "leave `supervisor.rest_voltage` out, unless the amplifiers switch on and off slowly by themselves",
    );
}
