//! Actuator, amplifier, converter and gauge.

use super::in_order;
use crate::diagnostic::codes;
use crate::keys::fields::Fields;
use crate::spec::findings::Findings;
use crate::spec::text::number;

/// Largest ratio of stroke to travel.
const LARGEST_MISMATCH: f64 = 4.0;
/// Largest noise of a gauge, relative to its signal: strain gauges have a thousandth, capacitive ones a hundred times
/// less.
const LARGEST_NOISE: f64 = 2e-3;

pub(super) fn limits_in_order(f: &Fields, findings: &mut Findings) -> Option<()> {
    for path in ["actuator.voltage", "dac.range", "sensor.range", "sensor.input_range"] {
        // A missing list has its own finding; the others are still checked.
        let _ = in_order(f, findings, path, false);
    }
    Some(())
}

pub(super) fn voltage_inside_dac(f: &Fields, findings: &mut Findings) -> Option<()> {
    let limits = f.list::<2>("actuator.voltage")?;
    let [low, high] = f.list::<2>("dac.range")?;
    for (i, limit) in limits.into_iter().enumerate() {
        if low < high && (limit < low || limit > high) {
            findings.add(
                codes::VOLTAGE_OUTSIDE_DAC,
                &format!("actuator.voltage[{i}]"),
                f.item_span("actuator.voltage", i),
                format!("{} V is outside the converter's range of {} V to {} V", number(limit), number(low), number(high)),
                "narrow `actuator.voltage`, or widen `dac.range` if the amplifier's gain is not in it yet: it is in volts at the stack".to_owned(),
            );
        }
    }
    Some(())
}

pub(super) fn slew_moves_a_code(f: &Fields, findings: &mut Findings) -> Option<()> {
    let bits: u32 = f.whole("dac.bits")?;
    let [low, high] = f.list::<2>("dac.range")?;
    let (slew, period) = (f.number("actuator.slew_rate")?, f.number("timing.period")?);
    let code = (high - low) / (libm::ldexp(1.0, bits as i32) - 1.0);
    if low < high && slew * period < code {
        let [seconds, change, step] = [period, slew * period, code].map(number);
        findings.add(
            codes::SLEW_BELOW_CODE,
            "actuator.slew_rate",
            f.span("actuator.slew_rate"),
            format!(
                "in one period of {seconds} s the voltage may change by {change} V, less than one converter code of {step} V"
            ),
            format!("at least {} V/s moves one code per tick; check the unit (V/ms or V/s)", number(code / period)),
        );
    }
    Some(())
}

pub(super) fn stroke_fits_gain(f: &Fields, findings: &mut Findings) -> Option<()> {
    let stacks = f.integer("actuator.stacks")? as f64;
    let (gain, stroke) = (f.number("actuator.stack_gain")?, f.number("actuator.stroke")?);
    let [low, high] = f.list::<2>("actuator.voltage")?;
    let travel = stacks * gain * (high - low);
    let ratio = travel / stroke;
    if low >= high || (0.5..=2.0).contains(&ratio) {
        return Some(());
    }
    let (key, span) = ("actuator.stroke", f.span("actuator.stroke"));
    let [count, per_volt, volts, sum] = [stacks, gain * 1e6, high - low, travel * 1e6].map(number);
    let declared = number(stroke * 1e6);
    let message =
        format!("{count} stacks of {per_volt} um/V over {volts} V give {sum} um, but the stroke is {declared} um");
    let check = "check figures and units of `actuator.stacks`, `actuator.stack_gain` (of one stack, not of the leg), `actuator.voltage` and `actuator.stroke`";
    if (1.0 / LARGEST_MISMATCH..=LARGEST_MISMATCH).contains(&ratio) {
        findings.add(codes::STROKE_MISMATCH, key, span, message, check.to_owned());
    } else {
        let how = if ratio > 1.0 { "the legs would exceed it by far" } else { "the legs never come near it" };
        findings.add(codes::STROKE_IMPOSSIBLE, key, span, format!("{message}: {how}"), check.to_owned());
    }
    Some(())
}

pub(super) fn resonance_below_tick_rate(f: &Fields, findings: &mut Findings) -> Option<()> {
    let period = f.number("timing.period")?;
    let modes = (0..f.count("mode")).map(|index| format!("mode[{index}].frequency"));
    for path in ["actuator.resonance".to_owned()].into_iter().chain(modes) {
        let Some(resonance) = f.number(&path).filter(|resonance| resonance * period > 0.5) else { continue };
        let [hertz, half] = [resonance, 1.0 / period].map(number);
        findings.add(
            codes::RESONANCE_ALIASED,
            &path,
            f.span(&path),
            format!("the resonance at {hertz} Hz is above half the tick rate of {half} Hz"),
            format!("with a period below {} us the gauges could measure it", number(0.5e6 / resonance)),
        );
    }
    Some(())
}

pub(super) fn sensor_fits(f: &Fields, findings: &mut Findings) -> Option<()> {
    let [low, high] = f.list::<2>("sensor.range")?;
    let span = high - low;
    if span <= 0.0 {
        return None;
    }
    let path = "sensor.range";
    if low > 0.0 || high < 0.0 {
        let [from, to] = [low * 1e6, high * 1e6].map(number);
        findings.add(
            codes::SENSOR_RANGE,
            path,
            f.span(path),
            format!("the gauge's range of {from} um to {to} um leaves out 0, the displacement at rest"),
            "give the range as displacement of the leg from rest".to_owned(),
        );
    }
    if let Some(stroke) = f.number("actuator.stroke")
        && !(0.05..=100.0).contains(&(span / stroke))
    {
        findings.add(
            codes::SENSOR_RANGE,
            path,
            f.span(path),
            format!("the gauge spans {} um, but the stroke is {} um", number(span * 1e6), number(stroke * 1e6)),
            "check the units of `sensor.range` and `actuator.stroke`".to_owned(),
        );
    }
    let noise = f.number("sensor.noise")?;
    let seen = f.number("actuator.stroke").filter(|stroke| *stroke < span).unwrap_or(span);
    if noise > LARGEST_NOISE * seen {
        let [rms, share, signal] = [noise * 1e9, noise / seen, seen * 1e6].map(number);
        findings.add(
            codes::SENSOR_NOISE,
            "sensor.noise",
            f.span("sensor.noise"),
            format!("a noise of {rms} nm rms is {share} of the signal of {signal} um"),
            "check the unit, nm or um: gauges of piezo platforms have 0.1 nm to about 10 nm".to_owned(),
        );
    }
    Some(())
}
