//! Stacks: stroke, strain, stiffness, resonance, slew.

use core::f64::consts::TAU;

use super::{Facts, Findings, figure, times_beyond};

lints! {
    rules: strain, stiffness_fits_resonance, slew_spares_the_stacks, slew_moves_the_legs, resonance_is_damped,
        grid_shows_the_loop;

    /// # W0802: stroke inconsistent with the leg length
    ///
    /// The stroke should be between a millionth and 0.015 of the length of a leg.
    ///
    /// ## Why it matters
    ///
    /// Piezo stacks stretch by 0.001 to 0.0015 of their own length, and a leg is
    /// longer than its stacks.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [actuator] @@
    /// -stroke          = "60 um"
    /// +stroke          = "6 mm"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the units of `actuator.stroke` and `[geometry]`.
    ///
    /// ```toml
    /// stroke          = "60 um"
    /// ```
    STRAIN_ODD = "W0802";

    /// # W0803: resonance, stiffness and mass are inconsistent
    ///
    /// `actuator.resonance` is compared with sqrt(k_a / m) / 2π, once with the
    /// extensible part alone as m, once with a sixth of the platform added.
    ///
    /// ## Why it matters
    ///
    /// The three are not independent. A resonance far from both values usually comes
    /// from a stiffness in N/um or a mass in the wrong unit.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [actuator] @@
    /// -axial_stiffness = "1e7 N/m"
    /// +axial_stiffness = "1e5 N/m"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check `resonance`, `axial_stiffness`, `leg.extensible_mass` and
    /// `platform.mass`.
    ///
    /// ```toml
    /// axial_stiffness = "1e7 N/m"
    /// ```
    RESONANCE_ODD = "W0803";

    /// # W0804: slew rate too high for the stacks
    ///
    /// At the slew rate, the voltage should take at least a third of a period of the
    /// resonance to cross its range.
    ///
    /// ## Why it matters
    ///
    /// A stack driven faster overshoots into tension, which ceramics do not tolerate.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [actuator] @@
    /// -slew_rate       = "40 V/ms"
    /// +slew_rate       = "400 V/ms"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check V/ms against V/s; otherwise lower the slew rate to the value in the help.
    ///
    /// ```toml
    /// slew_rate       = "40 V/ms"
    /// ```
    SLEW_TOO_FAST = "W0804";

    /// # W0809: slew rate too low to move the legs
    ///
    /// At the slew rate, the voltage should cross its range in less than a second.
    ///
    /// ## Why it matters
    ///
    /// A stack can cross its range in milliseconds. A much lower limit is usually in
    /// V/s where V/ms was intended.
    ///
    /// ## Example
    ///
    /// `specs/legs.toml` with
    ///
    /// ```diff
    /// @@ [actuator] @@
    /// -slew_rate       = "40 V/ms"
    /// +slew_rate       = "0.04 V/ms"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit.
    ///
    /// ```toml
    /// slew_rate       = "40 V/ms"
    /// ```
    SLEW_TOO_SLOW = "W0809";

    /// # W0858: implausible damping ratio
    ///
    /// `actuator.damping_ratio` should be at least 0.0002 and at most 0.6,
    /// `control.modal_damping` between 0.0005 and 0.3.
    ///
    /// ## Why it matters
    ///
    /// Bare ceramic has a damping ratio of 0.0002; glued and loaded stacks have a
    /// hundred times more. Above 0.6 a leg hardly rings. A value that is too large is
    /// often a percentage, or a quality factor Q instead of 1/(2 Q).
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [actuator] @@
    /// -damping_ratio   = 0.1
    /// +damping_ratio   = 0.0001
    /// ```
    ///
    /// ## Fix
    ///
    /// Write ζ: 0.02 for 2 per cent.
    ///
    /// ```toml
    /// damping_ratio   = 0.1
    /// ```
    DAMPING_ODD = "W0858";

    /// # W0859: grid too coarse for a hysteresis loop
    ///
    /// `hysteresis.grid` should be at least 8.
    ///
    /// ## Why it matters
    ///
    /// The branches of a loop are interpolated linearly between nodes. With fewer
    /// nodes the straight segments dominate the error of the inverse.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [hysteresis] @@
    /// -grid    = 32
    /// +grid    = 4
    /// ```
    ///
    /// ## Fix
    ///
    /// Use 16 or more; the table grows with the square of the grid.
    ///
    /// ```toml
    /// grid    = 32
    /// ```
    GRID_COARSE = "W0859";
}

/// Stroke of a leg, in leg lengths. Stacks give 0.0015 of their own length; levers in a leg amplify that tenfold.
const LARGEST_STRAIN: f64 = 0.015;
/// Below this strain a leg moves less than its thermal expansion over a tenth of a kelvin.
const SMALLEST_STRAIN: f64 = 1e-6;
/// Factor by which the compliance of the mounting lowers a resonance: a factor of four in stiffness.
const MOUNTING: f64 = 2.0;
/// A rod fixed at one end resonates at π/2 times sqrt(k/m); a fifth more for tolerances.
const FREE_ROD: f64 = 1.9;
/// Usual stiffness of piezo legs, N/m, and their resonance as mounted, Hz.
const STIFFNESSES: core::ops::RangeInclusive<f64> = 2e5..=2e9;
const RESONANCES: core::ops::RangeInclusive<f64> = 20.0..=5e4;
/// Shortest time to drive a stack over its range, in periods of its resonance: makers of stacks specify a third.
const FASTEST: f64 = 1.0 / 3.0;
/// Longest plausible time over the range, s.
const SLOWEST: f64 = 1.0;

/// Damping ratio of a bare ceramic with a mechanical quality of 2,500. Any mounted stack has more.
const LEAST_DAMPED: f64 = 2e-4;
/// Above this a leg does not ring.
const MOST_DAMPED: f64 = 0.6;
/// The same for the platform on its legs, whose joints and flexures damp little; and their least damping.
const MOST_DAMPED_MODE: f64 = 0.3;
const LEAST_DAMPED_MODE: f64 = 5e-4;
/// Fewest cells per axis that resolve the curvature of a branch.
const COARSEST_GRID: usize = 8;

/// Checks the stroke against the leg length.
fn strain(facts: &Facts, found: &mut Findings) {
    let Some(legs) = &facts.legs else { return };
    let (stroke, length) = (facts.model.actuator.stroke, legs.shortest());
    let off = times_beyond(stroke / length, &(SMALLEST_STRAIN..=LARGEST_STRAIN));
    if off <= 1.0 {
        return;
    }
    let [travel, share, length] = [stroke * 1e6, stroke / length, length * 1e3].map(figure);
    found.add_off(
        off,
        STRAIN_ODD,
        "actuator.stroke",
        format!("a stroke of {travel} um is {share} of a leg of {length} mm"),
        "stacks give 0.001 to 0.0015 of their own length: check the units of `actuator.stroke` and of [geometry]",
    );
}

/// Checks the resonance against stiffness and mass: between the bare extensible part and that with its share of the platform.
fn stiffness_fits_resonance(facts: &Facts, found: &mut Findings) {
    let model = facts.model;
    let own = model.leg.extensible_mass;
    let of = |mass: f64| libm::sqrt(model.actuator.axial_stiffness / mass) / TAU;
    let (loaded, bare) = (of(own + model.platform.mass / 6.0), of(own));
    let resonance = model.actuator.resonance;
    let off = times_beyond(resonance, &(loaded / MOUNTING..=bare * FREE_ROD));
    if off <= 1.0 {
        return;
    }
    // If only one of the two is in the usual range, the other is suspected.
    let leg_like = (STIFFNESSES.contains(&model.actuator.axial_stiffness), RESONANCES.contains(&resonance));
    let key = if leg_like == (false, true) { "actuator.axial_stiffness" } else { "actuator.resonance" };
    let [stiffness, alone, own_mass] = [model.actuator.axial_stiffness, bare, own * 1e3].map(figure);
    let with_platform = figure(loaded);
    let sizes = format!(
        "a leg of {stiffness} N/m resonates at {alone} Hz with only its extensible part of {own_mass} g, and at {with_platform} Hz with a sixth of the platform added"
    );
    found.add_off(
        off,
        RESONANCE_ODD,
        key,
        format!("{sizes}; the spec says {} Hz", figure(resonance)),
        "check the units of `actuator.axial_stiffness` (N/m or N/um), `actuator.resonance` (Hz or kHz), `leg.extensible_mass` and `platform.mass`",
    );
}

/// Checks that the slew limit protects the stacks from being driven over their range in a fraction of a period.
fn slew_spares_the_stacks(facts: &Facts, found: &mut Findings) {
    let actuator = &facts.model.actuator;
    let [low, high] = actuator.voltage;
    let time = (high - low) / actuator.slew_rate;
    if time * actuator.resonance >= FASTEST {
        return;
    }
    let [slew, volts, crossing] = [actuator.slew_rate * 1e-3, high - low, time * 1e6].map(figure);
    let resonance = figure(1e6 / actuator.resonance);
    found.add_off(
        FASTEST / (time * actuator.resonance),
        SLEW_TOO_FAST,
        "actuator.slew_rate",
        format!(
            "at {slew} V/ms a stack crosses its range of {volts} V in {crossing} us; one period of its resonance is {resonance} us"
        ),
        &format!(
            "a stack that crosses its range in less than a third of a period overshoots into tension: at most \"{} V/ms\" is usual; check the unit (V/ms or V/s)",
            figure((high - low) * 3.0 * actuator.resonance * 1e-3)
        ),
    );
}

/// Checks for a limit so low that nothing moves.
fn slew_moves_the_legs(facts: &Facts, found: &mut Findings) {
    let actuator = &facts.model.actuator;
    let [low, high] = actuator.voltage;
    let time = (high - low) / actuator.slew_rate;
    if time <= SLOWEST {
        return;
    }
    let [slew, seconds] = [actuator.slew_rate * 1e-3, time].map(figure);
    let speed = figure(actuator.slew_rate * actuator.leg_gain() * 1e6);
    found.add_off(
        time / SLOWEST,
        SLEW_TOO_SLOW,
        "actuator.slew_rate",
        format!("at {slew} V/ms a leg takes {seconds} s for its stroke: it moves at {speed} um/s at most"),
        "check the unit: V/ms or V/s",
    );
}

/// Checks both damping ratios against those of real structures.
fn resonance_is_damped(facts: &Facts, found: &mut Findings) {
    let actuator = &facts.model.actuator;
    let structure = facts.model.task_space.as_ref().map_or(0.02, |task| task.modal_damping);
    for (key, damping) in [("actuator.damping_ratio", actuator.damping_ratio), ("control.modal_damping", structure)] {
        let of_structure = key.starts_with("control");
        let most = if of_structure { MOST_DAMPED_MODE } else { MOST_DAMPED };
        if damping <= most && (damping >= LEAST_DAMPED_MODE || !of_structure) {
            continue;
        }
        found.add(
            DAMPING_ODD,
            key,
            format!(
                "a damping ratio of {} is {}",
                figure(damping),
                if damping > most {
                    "so large that the resonance would hardly ring"
                } else {
                    "as low as that of a tuning fork; flexures and joints have more"
                }
            ),
            "usual are 0.005 to 0.05 for a platform on its legs, 0.01 to 0.2 for a leg: check that the value is a ratio (critical damping is 1), not a percentage or a quality factor Q; the ratio is 1/(2 Q)",
        );
    }
    if actuator.damping_ratio >= LEAST_DAMPED {
        return;
    }
    found.add_off(
        LEAST_DAMPED / actuator.damping_ratio,
        DAMPING_ODD,
        "actuator.damping_ratio",
        format!(
            "with a damping ratio of {} a leg rings for {} s (to a hundredth); a bare ceramic has at least {}",
            figure(actuator.damping_ratio),
            figure(libm::log(100.0) / (actuator.damping_ratio * TAU * actuator.resonance)),
            figure(LEAST_DAMPED)
        ),
        "0.01 to 0.2 is usual: measure it with `specgen identify response`; check that the value is a ratio (critical damping is 1)",
    );
}

/// Checks that the table has enough cells for a hysteresis loop.
fn grid_shows_the_loop(facts: &Facts, found: &mut Findings) {
    let grid = facts.model.hysteresis.grid;
    if grid >= COARSEST_GRID {
        return;
    }
    let [low, high] = facts.model.actuator.voltage;
    found.add(
        GRID_COARSE,
        "hysteresis.grid",
        format!(
            "{grid} intervals of {} V each: within an interval the model of a leg is a straight line",
            figure((high - low) / grid as f64)
        ),
        "the error of the inverse falls with the square of `hysteresis.grid`: 16 to 32 is usual, and `specgen identify` chooses it from the record",
    );
}
