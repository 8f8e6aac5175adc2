//! Stacks: stroke, strain, stiffness, resonance, slew.

use core::f64::consts::TAU;

use super::{Facts, Found, figure, times_beyond};

lints! {
    rules: strain, stiffness_fits_resonance, slew_spares_the_stacks, slew_moves_the_legs, resonance_is_damped,
        grid_shows_the_loop;

    /// # W0802: a stroke that does not fit the length of a leg
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

    /// # W0803: resonance, stiffness and mass do not fit
    ///
    /// `actuator.resonance` is compared with sqrt(k_a / m) / 2π of the extensible
    /// part alone and with a sixth of the platform.
    ///
    /// ## Why it matters
    ///
    /// The three are not independent; a value far from both is most often a stiffness
    /// in N/um or a mass in the wrong unit.
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

    /// # W0804: a slew rate that does not spare the stacks
    ///
    /// The voltage should not be able to cross its range within a third of a period
    /// of the resonance.
    ///
    /// ## Why it matters
    ///
    /// A stack that is driven so fast overshoots into tension, which ceramics do not
    /// tolerate.
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
    /// Check V/ms against V/s; otherwise lower the slew rate to what the help names.
    ///
    /// ```toml
    /// slew_rate       = "40 V/ms"
    /// ```
    SLEW_TOO_FAST = "W0804";

    /// # W0809: a slew rate that leaves the legs standing
    ///
    /// The voltage should take less than a second over its range.
    ///
    /// ## Why it matters
    ///
    /// A stack can be driven over its range in milliseconds; a slower limit is most
    /// often V/s where V/ms is meant.
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

    /// # W0858: a damping ratio that cannot be
    ///
    /// `actuator.damping_ratio` should be at least 0.0002 and at most 0.6,
    /// `control.modal_damping` between 0.0005 and 0.3.
    ///
    /// ## Why it matters
    ///
    /// Bare ceramic has a damping ratio of 0.0002; glued and loaded stacks have a
    /// hundred times more. With more than 0.6 a leg hardly rings. A value that is too
    /// large is often a percentage, or a quality factor Q in place of 1/(2 Q).
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

    /// # W0859: a grid too coarse for a hysteresis loop
    ///
    /// `hysteresis.grid` should be at least 8.
    ///
    /// ## Why it matters
    ///
    /// The branches of a loop are interpolated between nodes: with fewer each is a
    /// few straight pieces, and the error of the inverse is that of the pieces.
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
    /// Take 16 or more; the table grows with the square.
    ///
    /// ```toml
    /// grid    = 32
    /// ```
    GRID_COARSE = "W0859";
}

/// Stroke of a leg, in leg lengths. Stacks give 0.0015 of their own length; levers in a leg make ten times that.
const LARGEST_STRAIN: f64 = 0.015;
/// A leg of this strain or less moves by less than its own thermal expansion over a tenth of a kelvin.
const SMALLEST_STRAIN: f64 = 1e-6;
/// What compliance of the mounting takes off a resonance: a factor of four in stiffness.
const MOUNTING: f64 = 2.0;
/// A rod fixed at one end resonates at π/2 of what stiffness and mass make; a fifth more for tolerances.
const FREE_ROD: f64 = 1.9;
/// What legs of stacks have, N/m, and Hz as mounted.
const STIFFNESSES: core::ops::RangeInclusive<f64> = 2e5..=2e9;
const RESONANCES: core::ops::RangeInclusive<f64> = 20.0..=5e4;
/// Share of the resonance's period in which a stack may be driven over its range: makers of stacks give a third as the least.
const FASTEST: f64 = 1.0 / 3.0;
/// A stack that takes longer over its range, s, follows nothing.
const SLOWEST: f64 = 1.0;

/// Damping ratio of a bare ceramic of a mechanical quality of 2,500. Whatever it is mounted in has more.
const LEAST_DAMPED: f64 = 2e-4;
/// More than this a leg does not ring at all.
const MOST_DAMPED: f64 = 0.6;
/// The same of the platform on its legs, whose joints and flexures damp little; and the least that they have.
const MOST_DAMPED_MODE: f64 = 0.3;
const LEAST_DAMPED_MODE: f64 = 5e-4;
/// Fewer cells to an axis do not show the bend of a branch.
const COARSEST_GRID: usize = 8;

/// No piezo leg moves by more than a hundredth of its length.
fn strain(facts: &Facts, found: &mut Found) {
    let Some(legs) = &facts.legs else { return };
    let (stroke, length) = (facts.model.actuator.stroke, legs.shortest());
    let off = times_beyond(stroke / length, &(SMALLEST_STRAIN..=LARGEST_STRAIN));
    if off <= 1.0 {
        return;
    }
    found.add_off(
        off,
        STRAIN_ODD,
        "actuator.stroke",
        format!(
            "a stroke of {} um is {} of a leg of {} mm",
            figure(stroke * 1e6),
            figure(stroke / length),
            figure(length * 1e3)
        ),
        "stacks give 0.001 to 0.0015 of their own length: check the units of `actuator.stroke` and of [geometry]",
    );
}

/// Stiffness and masses bound the resonance of a leg: as bare as its extensible part, or with its share of the platform.
fn stiffness_fits_resonance(facts: &Facts, found: &mut Found) {
    let model = facts.model;
    let own = model.leg.extensible_mass;
    let of = |mass: f64| libm::sqrt(model.actuator.axial_stiffness / mass) / TAU;
    let (loaded, bare) = (of(own + model.platform.mass / 6.0), of(own));
    let resonance = model.actuator.resonance;
    let off = times_beyond(resonance, &(loaded / MOUNTING..=bare * FREE_ROD));
    if off <= 1.0 {
        return;
    }
    // Where only one of the two is what legs have, the other is suspected.
    let leg_like = (STIFFNESSES.contains(&model.actuator.axial_stiffness), RESONANCES.contains(&resonance));
    let key = if leg_like == (false, true) { "actuator.axial_stiffness" } else { "actuator.resonance" };
    let sizes = format!(
        "a leg of {} N/m resonates at {} Hz with its extensible part of {} g alone and at {} Hz with a sixth of the platform",
        figure(model.actuator.axial_stiffness),
        figure(bare),
        figure(own * 1e3),
        figure(loaded)
    );
    found.add_off(
        off,
        RESONANCE_ODD,
        key,
        format!("{sizes}; the spec says {} Hz", figure(resonance)),
        "check the units of `actuator.axial_stiffness` (N/m or N/um), `actuator.resonance` (Hz or kHz), `leg.extensible_mass` and `platform.mass`",
    );
}

/// A slew limit protects the stacks if they are not driven over their range within a fraction of their own period.
fn slew_spares_the_stacks(facts: &Facts, found: &mut Found) {
    let actuator = &facts.model.actuator;
    let [low, high] = actuator.voltage;
    let time = (high - low) / actuator.slew_rate;
    if time * actuator.resonance >= FASTEST {
        return;
    }
    found.add_off(
        FASTEST / (time * actuator.resonance),
        SLEW_TOO_FAST,
        "actuator.slew_rate",
        format!(
            "at {} V/ms a stack goes over its range of {} V in {} us; one period of its resonance is {} us",
            figure(actuator.slew_rate * 1e-3),
            figure(high - low),
            figure(time * 1e6),
            figure(1e6 / actuator.resonance)
        ),
        &format!(
            "a stack that is driven faster than a third of its period overshoots into tension: at most \"{} V/ms\" is usual; check the unit (V/ms or V/s)",
            figure((high - low) * 3.0 * actuator.resonance * 1e-3)
        ),
    );
}

/// A limit so low that nothing moves.
fn slew_moves_the_legs(facts: &Facts, found: &mut Found) {
    let actuator = &facts.model.actuator;
    let [low, high] = actuator.voltage;
    let time = (high - low) / actuator.slew_rate;
    if time <= SLOWEST {
        return;
    }
    found.add_off(
        time / SLOWEST,
        SLEW_TOO_SLOW,
        "actuator.slew_rate",
        format!(
            "at {} V/ms a leg takes {} s over its stroke: it moves at {} um/s at most",
            figure(actuator.slew_rate * 1e-3),
            figure(time),
            figure(actuator.slew_rate * actuator.leg_gain() * 1e6)
        ),
        "check the unit: V/ms or V/s",
    );
}

/// Everything that is built is damped.
fn resonance_is_damped(facts: &Facts, found: &mut Found) {
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
                    "too large for a resonance, which would hardly ring"
                } else {
                    "that of a tuning fork; flexures and joints have more"
                }
            ),
            "0.005 to 0.05 is usual of a platform on its legs, 0.01 to 0.2 of a leg: check that it is a ratio, with critical damping as 1, and neither percent nor a quality factor (1/(2 Q))",
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
            "with a damping ratio of {} a leg that is pushed rings for {} s (to a hundredth); a bare ceramic has {} and more",
            figure(actuator.damping_ratio),
            figure(libm::log(100.0) / (actuator.damping_ratio * TAU * actuator.resonance)),
            figure(LEAST_DAMPED)
        ),
        "0.01 to 0.2 is usual: measure it with `specgen identify response`; check that it is a ratio, with critical damping as 1",
    );
}

/// A table of a few cells is no model of a hysteresis loop.
fn grid_shows_the_loop(facts: &Facts, found: &mut Found) {
    let grid = facts.model.hysteresis.grid;
    if grid >= COARSEST_GRID {
        return;
    }
    let [low, high] = facts.model.actuator.voltage;
    found.add(
        GRID_COARSE,
        "hysteresis.grid",
        format!(
            "{grid} intervals of {} V each: within one the model of a leg is a straight line",
            figure((high - low) / grid as f64)
        ),
        "the error of the inverse falls with the square of `hysteresis.grid`: 16 to 32 is usual, and `specgen identify` chooses it by the record",
    );
}
