//! Amplifiers and digital-to-analogue converters.

use super::{Facts, Findings, figure, times_beyond};
use specgen_language::model::Model;

lints! {
    rules: lag_fits_slew, current_fits_slew, amplifier_noise, capacitance_of_the_stacks, converter_step,
        converter_range, rest_without_power;

    /// # W0805: amplifier too slow for the slew rate
    ///
    /// A first-order lag slews at most at range / lag. `actuator.slew_rate` should not
    /// exceed that.
    ///
    /// ## Why it matters
    ///
    /// The controller assumes a slew rate that the amplifier does not reach, so its
    /// model of the voltage runs ahead.
    ///
    /// ## Example
    ///
    /// `specs/minimal.toml` with
    ///
    /// ```diff
    /// +[amplifier]
    /// +lag = "3.5 ms"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check `amplifier.lag` (ms or us) and `slew_rate` (V/ms or V/s).
    ///
    /// ```toml
    /// [amplifier]
    /// lag = "0.35 ms"
    /// ```
    LAG_AGAINST_SLEW = "W0805";

    /// # W0806: amplifier current too low for the slew rate
    ///
    /// For one leg, capacitance × slew_rate should not exceed `amplifier.current`.
    ///
    /// ## Why it matters
    ///
    /// I = C dU/dt: at its current limit the amplifier limits the slew rate itself, and
    /// the controller does not know. C is that of all stacks of a leg.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [actuator] @@
    ///  damping_ratio   = 0.1
    /// +capacitance = "1 uF"
    /// @@ [amplifier] @@
    ///  noise = "2 mV"
    /// +current = "20 mA"
    /// ```
    ///
    /// ## Fix
    ///
    /// Write the amplifier's own limit as `slew_rate`, or check the two values.
    ///
    /// ```toml
    /// current = "50 mA"
    /// ```
    CURRENT_AGAINST_SLEW = "W0806";

    /// # W0807: implausible amplifier noise
    ///
    /// `amplifier.noise` (rms) should be between 2e-7 and 3e-4 of the voltage range.
    /// Above 1e-4 it should also move a leg by less than 25 times the noise of its
    /// gauge, or one step of its converter if that is larger.
    ///
    /// ## Why it matters
    ///
    /// Amplifiers for piezo stacks have 0.1 to 10 mV rms. Far more or far less usually
    /// means a wrong unit.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [amplifier] @@
    /// -noise = "2 mV"
    /// +noise = "50 mV"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check mV against uV and V.
    ///
    /// ```toml
    /// noise = "2 mV"
    /// ```
    AMPLIFIER_NOISE = "W0807";

    /// # W0864: capacitance inconsistent with stiffness and stroke
    ///
    /// The electrical energy at full voltage, C V²/2, is compared with the elastic
    /// energy of the blocked leg over its stroke, k d²/2. The elastic energy should be
    /// between 0.001 and 5 times the electrical energy.
    ///
    /// ## Why it matters
    ///
    /// Ceramics convert at most half of the electrical energy into mechanical energy. A
    /// capacitance in nF instead of uF, or of one stack instead of all, makes the
    /// current and the possible slew rate wrong by the same factor.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [actuator] @@
    /// +capacitance = "0.35 uF"
    /// ```
    ///
    /// ## Fix
    ///
    /// Give the capacitance of all stacks of a leg together, in uF.
    ///
    /// ```toml
    /// capacitance = "35 uF"
    /// ```
    CAPACITANCE_ODD = "W0864";

    /// # W0808: converter step too coarse for the stroke
    ///
    /// One code of `dac.bits` over `dac.range` should move a leg by less than a
    /// thousandth of its stroke.
    ///
    /// ## Why it matters
    ///
    /// The platform hunts between two codes by that much. 16 bits are usual.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [dac] @@
    /// -bits  = 16
    /// +bits  = 10
    /// ```
    ///
    /// ## Fix
    ///
    /// Check bits and range; the range is in volts at the stack.
    ///
    /// ```toml
    /// bits  = 16
    /// ```
    CONVERTER_COARSE = "W0808";

    /// # W0849: converter range mostly unused
    ///
    /// `dac.range` should span less than four times `actuator.voltage`.
    ///
    /// ## Why it matters
    ///
    /// Two or more bits are never used, and one code moves the leg at least four times
    /// as far as necessary.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [dac] @@
    /// -range = ["0 V", "150 V"]
    /// +range = ["0 V", "1500 V"]
    /// ```
    ///
    /// ## Fix
    ///
    /// Check both ranges; both are in volts at the stack.
    ///
    /// ```toml
    /// range = ["0 V", "150 V"]
    /// ```
    CONVERTER_WIDE = "W0849";

    /// # W0819: rest voltage differs from amplifiers that are off
    ///
    /// `supervisor.rest_voltage` should be 0 V if `actuator.voltage` includes it.
    ///
    /// ## Why it matters
    ///
    /// A stack whose amplifier is off discharges to 0 V. With another rest voltage the
    /// legs jump when the amplifiers are switched on, and again when they are switched
    /// off.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// +[supervisor]
    /// +rest_voltage = "20 V"
    /// ```
    ///
    /// ## Fix
    ///
    /// Leave the key out, unless the amplifiers themselves ramp slowly when they
    /// switch.
    REST_NOT_ZERO = "W0819";
}

/// The largest slew rate of a first-order lag is range over time constant; a higher limit has no effect.
const LAG_SLACK: f64 = 1.0;
/// Noise of an amplifier over its range: those for stacks have 0.1 to 10 mV on a hundred volts.
const SOUND_NOISE: core::ops::RangeInclusive<f64> = 2e-7..=3e-4;
/// Above this share, 10 mV on a hundred volts, the noise is also compared with the gauges …
const LOUD: f64 = 1e-4;
/// … and the motion of a leg must stay below this multiple of the noise or step of its gauge.
const LOUDEST: f64 = 25.0;
/// Energy of the blocked leg, k s²/2, over that of its charge, C U²/2: ceramics convert at most half, and a leg with levers a
/// hundredth of that. The range is wide because both figures come from data sheets.
const SOUND_COUPLING: core::ops::RangeInclusive<f64> = 1e-3..=5.0;
/// Largest converter step, as a share of the stroke, that allows nanopositioning.
const COARSEST_STEP: f64 = 1e-3;

/// Largest range of a converter over that of the stacks: amplifiers are matched to their stacks.
const WIDEST_RANGE: f64 = 4.0;

/// Checks that the lag of the amplifier allows the slew rate.
fn lag_fits_slew(facts: &Facts, found: &mut Findings) {
    let (amplifier, actuator) = (&facts.model.amplifier, &facts.model.actuator);
    let [low, high] = actuator.voltage;
    let off = amplifier.lag * actuator.slew_rate / (LAG_SLACK * (high - low));
    if off <= 1.0 {
        return;
    }
    let [lag, volts, starts] = [amplifier.lag * 1e3, high - low, (high - low) / amplifier.lag * 1e-3].map(figure);
    let slew = figure(actuator.slew_rate * 1e-3);
    found.add_off(
        off,
        LAG_AGAINST_SLEW,
        "amplifier.lag",
        format!(
            "with a lag of {lag} ms a step of {volts} V starts at {starts} V/ms, but `actuator.slew_rate` is {slew} V/ms"
        ),
        "check the units of `amplifier.lag` (ms or us) and `actuator.slew_rate` (V/ms or V/s)",
    );
}

/// Checks the charging current of a leg: I = C dU/dt.
fn current_fits_slew(facts: &Facts, found: &mut Findings) {
    let model = facts.model;
    let (Some(capacitance), Some(current)) = (model.actuator.capacitance, model.amplifier.current) else { return };
    let needed = capacitance * model.actuator.slew_rate;
    if needed <= current {
        return;
    }
    let [microfarads, slew, amperes] = [capacitance * 1e6, model.actuator.slew_rate * 1e-3, needed].map(figure);
    let supplied = figure(current);
    found.add_off(
        needed / current,
        CURRENT_AGAINST_SLEW,
        "amplifier.current",
        format!(
            "{microfarads} uF at {slew} V/ms need {amperes} A, but the amplifier supplies {supplied} A"
        ),
        &format!(
            "the amplifier can slew at {} V/ms: write that as `actuator.slew_rate`, or check `actuator.capacitance` (of a whole leg) and `amplifier.current` (mA or A)",
            figure(current / capacitance * 1e-3)
        ),
    );
}

/// Checks the amplifier noise against the voltage range and the gauges.
fn amplifier_noise(facts: &Facts, found: &mut Findings) {
    let (noise, actuator) = (facts.model.amplifier.noise, &facts.model.actuator);
    let [low, high] = actuator.voltage;
    let sensor = &facts.model.sensor;
    let step = sensor.step();
    // The gauge does not resolve less than its step.
    let seen = if sensor.noise > step { sensor.noise } else { step };
    let (share, beside) = (noise / (high - low), noise * actuator.leg_gain() / seen);
    let of_range = times_beyond(share, &SOUND_NOISE);
    if noise == 0.0 || (of_range <= 1.0 && (share <= LOUD || beside <= LOUDEST)) {
        return;
    }
    let moves = format!("moves a leg by {} nm rms", figure(noise * actuator.leg_gain() * 1e9));
    let how = if share < *SOUND_NOISE.start() {
        format!("is less than any real amplifier has; it {moves}")
    } else if share > *SOUND_NOISE.end() {
        format!("is {} of its range; it {moves}", figure(share))
    } else {
        format!("{moves}, {} times the noise or the step of its gauge", figure(beside))
    };
    found.add_off(
        of_range,
        AMPLIFIER_NOISE,
        "amplifier.noise",
        format!("an amplifier noise of {} mV rms on {} V {how}", figure(noise * 1e3), figure(high - low)),
        "amplifiers for stacks have 0.1 to 10 mV rms: check the unit (V, mV or uV), and that the value is rms, not peak to peak",
    );
}

/// Checks electrical against elastic energy.
fn capacitance_of_the_stacks(facts: &Facts, found: &mut Findings) {
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
    let [microfarads, volts, taken, stored] = [capacitance * 1e6, volts, charged / 2.0, blocked / 2.0].map(figure);
    found.add_off(
        off,
        CAPACITANCE_ODD,
        "actuator.capacitance",
        format!(
            "charging {microfarads} uF to {volts} V takes {taken} J, but the blocked leg stores {stored} J (stiffness x stroke^2 / 2)"
        ),
        "ceramics convert at most half of the electrical energy: check the unit of `actuator.capacitance` (uF or nF; of a whole leg), and `actuator.axial_stiffness`",
    );
}

/// Checks one code of the converter against the stroke.
fn converter_step(facts: &Facts, found: &mut Findings) {
    let (dac, actuator) = (&facts.model.dac, &facts.model.actuator);
    let [low, high] = dac.range;
    let volts = (high - low) / (libm::exp2(f64::from(dac.bits)) - 1.0);
    let step = volts * actuator.leg_gain();
    if step <= COARSEST_STEP * actuator.stroke {
        return;
    }
    let [code, motion, share] = [volts * 1e3, step * 1e9, step / actuator.stroke].map(figure);
    let stroke = figure(actuator.stroke * 1e6);
    found.add_off(
        step / (COARSEST_STEP * actuator.stroke),
        CONVERTER_COARSE,
        "dac.bits",
        format!("one code of {code} mV moves a leg by {motion} nm, {share} of its stroke of {stroke} um"),
        "16 bits or more are usual; check `dac.bits` and `dac.range`, which is in volts at the stack",
    );
}

/// Checks the range of the converter against that of the stacks.
fn converter_range(facts: &Facts, found: &mut Findings) {
    let ([low, high], [from, to]) = (facts.model.dac.range, facts.model.actuator.voltage);
    if high - low <= WIDEST_RANGE * (to - from) {
        return;
    }
    let item = usize::from(high - to >= from - low);
    let [span, used] = [high - low, to - from].map(figure);
    found.add(
        CONVERTER_WIDE,
        &format!("dac.range[{item}]"),
        format!(
            "the converter spans {span} V, but the stacks use only {used} V of it"
        ),
        "two or more bits of the converter are never used: check `dac.range`, in volts at the stack, and `actuator.voltage`",
    );
}

/// Checks that the rest voltage is that of amplifiers that are off.
fn rest_without_power(facts: &Facts, found: &mut Findings) {
    let model = facts.model;
    let [low, high] = model.actuator.voltage;
    let rest = model.rest_voltage();
    let off = Model::nearest_to_zero(low, high);
    if rest == off {
        return;
    }
    let [volts, jump] = [rest, (rest - off).abs() * model.actuator.leg_gain() * 1e6].map(figure);
    found.add(
        REST_NOT_ZERO,
        "supervisor.rest_voltage",
        format!(
            "the legs rest at {volts} V, but stacks discharge to 0 V when their amplifiers are off: a leg jumps by {jump} um when they are switched on"
        ),
        "leave `supervisor.rest_voltage` out, unless the amplifiers themselves ramp slowly when they switch",
    );
}
