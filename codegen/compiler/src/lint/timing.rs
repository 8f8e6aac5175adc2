//! Times against the tick, and the tick against the modes.

use super::{Facts, Found, figure};
use specgen_language::diagnostic::codes;

/// Below this share of a tick a time does nothing.
const NOTHING: f64 = 0.01;
/// Largest lead, in amplifier lags and ticks together: what there is to take out, and a quarter for the modes.
const LARGEST_LEAD: f64 = 1.25;
/// A change of mode that takes longer than this is not meant, s.
const LONGEST_TRANSFER: f64 = 5.0;
/// A velocity filter slower than this share of the lowest mode.
const SLOWEST_FILTER: f64 = 0.1;
/// Ticks in a period of the lowest mode, at least; and at most, by far.
const FEWEST_TICKS: f64 = 4.0;
const MOST_TICKS: f64 = 3000.0;

/// Lag and lead are entered to have an effect.
pub(super) fn times_that_do_nothing(facts: &Facts, found: &mut Found) {
    let model = facts.model;
    let tick = model.timing.period;
    let lead = model.task_space.as_ref().map_or(0.0, |task| task.lead);
    for (key, time) in [
        ("amplifier.lag", model.amplifier.lag),
        ("control.lead", lead),
        ("hysteresis.dead_time", model.hysteresis.dead_time),
    ] {
        if time == 0.0 || time >= NOTHING * tick {
            continue;
        }
        found.add(
            codes::TIME_WITHOUT_EFFECT,
            key,
            format!(
                "`{key}` is {} us, {} of a tick of {} us: it has no effect",
                figure(time * 1e6),
                figure(time / tick),
                figure(tick * 1e6)
            ),
            "check the unit (ms or us), or leave the key out",
        );
    }
}

/// A lead takes out the lag, no more.
pub(super) fn lead_of_the_lag(facts: &Facts, found: &mut Found) {
    let model = facts.model;
    let Some(task) = &model.task_space else { return };
    let lag = model.amplifier.lag + model.timing.period;
    if task.lead <= LARGEST_LEAD * lag {
        return;
    }
    found.add(
        codes::LEAD_TOO_LONG,
        "control.lead",
        format!(
            "legs are asked for {} ms early, but amplifier and tick together lag {} ms",
            figure(task.lead * 1e3),
            figure(lag * 1e3)
        ),
        "about the amplifier's lag less one period takes the lag out: check the units of `control.lead` and `amplifier.lag`",
    );
}

/// The offset of a change of mode fades over some ticks and not for ever.
pub(super) fn transfer(facts: &Facts, found: &mut Found) {
    let Some(task) = &facts.model.task_space else { return };
    let (time, tick) = (task.transfer_time, facts.model.timing.period);
    if time >= tick && time <= LONGEST_TRANSFER {
        return;
    }
    let how = if time < tick {
        "shorter than a tick: modes change with a bump"
    } else {
        "so long that a mode takes a minute to be what it says"
    };
    found.add(
        codes::TRANSFER_ODD,
        "control.transfer_time",
        format!("a transfer time of {} ms is {how}", figure(time * 1e3)),
        "some tens of milliseconds are usual: check the unit (ms or us)",
    );
}

/// A velocity that is filtered below the modes says nothing about them.
pub(super) fn velocity_filter(facts: &Facts, found: &mut Found) {
    let (Some(task), Some(modes)) = (&facts.model.task_space, facts.legs.as_ref().and_then(|legs| legs.modes)) else {
        return;
    };
    let cutoff = task.velocity_cutoff / core::f64::consts::TAU;
    if cutoff >= SLOWEST_FILTER * modes[0] {
        return;
    }
    found.add(
        codes::VELOCITY_FILTER_SLOW,
        "control.velocity_cutoff",
        format!(
            "the velocity is filtered at {} Hz, far below the lowest mode of {} Hz",
            figure(cutoff),
            figure(modes[0])
        ),
        "at least the frequency of the lowest mode: check the unit (rad/s, not Hz)",
    );
}

/// The tick must see the platform move.
pub(super) fn ticks_against_modes(facts: &Facts, found: &mut Found) {
    let tick = facts.model.timing.period;
    let Some(modes) = facts.legs.as_ref().and_then(|legs| legs.modes) else { return };
    let ticks = 1.0 / (modes[0] * tick);
    if (FEWEST_TICKS..=MOST_TICKS).contains(&ticks) {
        return;
    }
    found.add(
        codes::TICKS_AGAINST_MODES,
        "timing.period",
        format!(
            "a period of the platform's lowest mode, {} Hz, has {} ticks of {} us",
            figure(modes[0]),
            figure(ticks),
            figure(tick * 1e6)
        ),
        "ten to a hundred ticks are usual: check `timing.period`, and `actuator.axial_stiffness` and the masses, which make the mode",
    );
}
