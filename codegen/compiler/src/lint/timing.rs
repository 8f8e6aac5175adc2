//! Times against the tick, and the tick against the modes.

use super::{Facts, Found, figure};

lints! {
    rules: times_that_do_nothing, lead_of_the_lag, transfer, velocity_filter, ticks_against_modes, gauges_in_time,
        modes_seen_as_others;

    /// # W0830: a time too short to have an effect
    ///
    /// Lag, lead, dead time and the width of a trigger's pulse should be at least a
    /// hundredth of a tick, or 0.
    ///
    /// ## Why it matters
    ///
    /// A time so short changes no number: it is us written for ms.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [amplifier] @@
    /// -lag   = "0.35 ms"
    /// +lag   = "0.35 us"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit, or take the key out.
    ///
    /// ```toml
    /// lag   = "0.35 ms"
    /// ```
    TIME_WITHOUT_EFFECT = "W0830";

    /// # W0831: a lead longer than what it takes out
    ///
    /// `control.lead`, and `lead` of a trajectory, should not exceed amplifier lag and
    /// tick together by more than a quarter; `hysteresis.dead_time` of six legs not be
    /// more than three times these and a period of the legs' resonance.
    ///
    /// ## Why it matters
    ///
    /// The lead lets the feed-forward run ahead of the set-point by what amplifier
    /// and sampling are late. More, and the legs are early.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [control] @@
    /// +lead            = "1 ms"
    /// ```
    ///
    /// ## Fix
    ///
    /// Leave the key out: the compiler takes the delay from command to pose, which
    /// `specgen check --details` states. Or write at most amplifier lag and tick
    /// together; `specgen sim` shows which lead is best on a path with corners.
    ///
    /// ```toml
    /// lead            = "0.1 ms"
    /// ```
    LEAD_TOO_LONG = "W0831";

    /// # W0832: a transfer time that is no transfer
    ///
    /// `control.transfer_time` should be from a tick to five seconds.
    ///
    /// ## Why it matters
    ///
    /// It is the time constant with which the offset of a change of mode fades.
    /// Shorter it is a step of the voltage; longer, the offset stays.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [control] @@
    /// -transfer_time   = "50 ms"
    /// +transfer_time   = "50 us"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check the unit; 50 ms is usual.
    ///
    /// ```toml
    /// transfer_time   = "50 ms"
    /// ```
    TRANSFER_ODD = "W0832";

    /// # W0833: a velocity filter far below the modes
    ///
    /// `control.velocity_cutoff` should be above a tenth of the lowest mode.
    ///
    /// ## Why it matters
    ///
    /// The derivative term of (7) would act on a velocity that is late by the filter.
    ///
    /// ## Example
    ///
    /// `specs/reference.toml` with
    ///
    /// ```diff
    /// @@ [control] @@
    /// -velocity_cutoff = "1.9e4 rad/s"
    /// +velocity_cutoff = "19 rad/s"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check rad/s against Hz: 1 Hz is 2 pi rad/s.
    ///
    /// ```toml
    /// velocity_cutoff = "1.9e4 rad/s"
    /// ```
    VELOCITY_FILTER_SLOW = "W0833";

    /// # W0834: tick and modes do not fit
    ///
    /// A period of the platform's lowest mode should have between four and three
    /// thousand ticks.
    ///
    /// ## Why it matters
    ///
    /// With fewer the loop hardly sees the mode; with more the tick is far faster
    /// than anything there is to control. Period, stiffness or masses are in another
    /// unit.
    ///
    /// ## Example
    ///
    /// `specs/minimal.toml` with
    ///
    /// ```diff
    /// @@ [timing] @@
    /// -period = "200 us"
    /// +period = "2 ms"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check `timing.period`, `actuator.axial_stiffness` and the masses.
    ///
    /// ```toml
    /// period = "200 us"
    /// ```
    TICKS_AGAINST_MODES = "W0834";

    /// # W0862: gauges far slower than the tick
    ///
    /// `sensor.lag` should not exceed five ticks.
    ///
    /// ## Why it matters
    ///
    /// What the controller does is seen only after the lag of the gauges. A tick
    /// that is much faster than that costs computation and gains nothing, and the
    /// stability check allows small gains. Mostly the unit is another one.
    ///
    /// ## Example
    ///
    /// `specs/minimal.toml` with
    ///
    /// ```diff
    /// @@ [sensor] @@
    /// +lag = "2 ms"
    /// ```
    ///
    /// ## Fix
    ///
    /// Check `sensor.lag` (us or ms): for a gauge or filter of first order it is
    /// 1/(2 pi bandwidth), and several in a row add.
    ///
    /// ```toml
    /// lag = "0.2 ms"
    /// ```
    GAUGE_LATE = "W0862";

    /// # W0869: a mode above half the tick rate
    ///
    /// The tick samples a mode of the platform that lies above half the tick rate,
    /// and the gauges pass more than a third of it.
    ///
    /// ## Why it matters
    ///
    /// Such a mode appears as another, lower frequency, and the loop answers to that.
    /// The stability check contains it as it is; what it cannot contain are the
    /// changes of a mode by a few hertz, which move its alias by as much in the
    /// other direction.
    ///
    /// ## Example
    ///
    /// `specs/minimal.toml` with
    ///
    /// ```diff
    /// @@ [timing] @@
    /// -period = "200 us"
    /// +period = "0.68 ms"
    /// ```
    ///
    /// ## Fix
    ///
    /// Sample faster than twice the highest mode, or filter the gauges and say so in
    /// `sensor.lag`.
    ///
    /// ```toml
    /// period = "200 us"
    /// ```
    MODE_ALIASED = "W0869";
}

/// Below this share of a tick a time does nothing.
const NOTHING: f64 = 0.01;
/// Largest lead, in amplifier lags and ticks together: what there is to take out, and a quarter for the modes.
const LARGEST_LEAD: f64 = 1.25;
/// The same of six legs, their resonance included: a record's dead time has it all.
const LONGEST_DEAD_TIME: f64 = 3.0;
/// A change of mode that takes longer than this is not meant, s.
const LONGEST_TRANSFER: f64 = 5.0;
/// A velocity filter slower than this share of the lowest mode.
const SLOWEST_FILTER: f64 = 0.1;
/// Ticks that gauges may lag: beyond that the tick is faster than anything that it sees.
const SLOWEST_GAUGE: f64 = 5.0;
/// Part of a mode above half the tick rate that gauges may show.
const LARGEST_ALIAS: f64 = 1.0 / 3.0;
/// Ticks in a period of the lowest mode, at least; and at most, by far.
const FEWEST_TICKS: f64 = 4.0;
const MOST_TICKS: f64 = 3000.0;

/// Lag and lead are entered to have an effect.
fn times_that_do_nothing(facts: &Facts, found: &mut Found) {
    let model = facts.model;
    let tick = model.timing.period;
    let lead = model.task_space.as_ref().and_then(|task| task.lead).unwrap_or(0.0);
    let triggers = model.task_space.iter().flat_map(|task| task.triggers.iter().enumerate());
    let widths = triggers.filter_map(|(index, trigger)| Some((format!("trigger[{index}].width"), trigger.width?)));
    let times = [
        ("amplifier.lag", model.amplifier.lag),
        ("sensor.lag", model.sensor.lag),
        ("control.lead", lead),
        ("hysteresis.dead_time", model.hysteresis.dead_time),
    ];
    for (key, time) in times.into_iter().map(|(key, time)| (key.to_owned(), time)).chain(widths) {
        if time == 0.0 || time >= NOTHING * tick {
            continue;
        }
        found.add(
            TIME_WITHOUT_EFFECT,
            &key,
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
fn lead_of_the_lag(facts: &Facts, found: &mut Found) {
    let model = facts.model;
    let lag = model.amplifier.lag + model.timing.period;
    // The legs' own resonance delays them by a part of its period.
    let (dead_time, most) = (model.hysteresis.dead_time, LONGEST_DEAD_TIME * (lag + 1.0 / model.actuator.resonance));
    if dead_time > most {
        found.add(
            LEAD_TOO_LONG,
            "hysteresis.dead_time",
            format!(
                "legs are asked for {} ms early, but amplifier, tick and a period of their resonance together are {} ms",
                figure(dead_time * 1e3),
                figure((lag + 1.0 / model.actuator.resonance) * 1e3)
            ),
            "check the unit (ms or us); `specgen identify rate` measures it",
        );
    }
    let Some(task) = &model.task_space else { return };
    let of_paths =
        task.trajectories.iter().enumerate().map(|(index, one)| (format!("trajectory[{index}].lead"), one.lead));
    for (key, lead) in std::iter::once(("control.lead".to_owned(), task.lead)).chain(of_paths) {
        let Some(lead) = lead.filter(|lead| *lead > LARGEST_LEAD * lag) else { continue };
        found.add(
            LEAD_TOO_LONG,
            &key,
            format!(
                "legs are asked for {} ms early, but amplifier and tick together lag {} ms",
                figure(lead * 1e3),
                figure(lag * 1e3)
            ),
            &format!(
                "leave `{key}` out, and the compiler takes the lag out; or check its unit and that of `amplifier.lag`"
            ),
        );
    }
}

/// The offset of a change of mode fades over some ticks and not for ever.
fn transfer(facts: &Facts, found: &mut Found) {
    let Some(task) = &facts.model.task_space else { return };
    let (time, tick) = (task.transfer_time, facts.model.timing.period);
    if time >= tick && time <= LONGEST_TRANSFER {
        return;
    }
    let how = if time < tick {
        "shorter than a tick: modes change with a bump"
    } else {
        "so long that the offset of the previous mode remains for many seconds"
    };
    found.add(
        TRANSFER_ODD,
        "control.transfer_time",
        format!("a transfer time of {} ms is {how}", figure(time * 1e3)),
        "some tens of milliseconds are usual: check the unit (ms or us)",
    );
}

/// A velocity that is filtered below the modes says nothing about them.
fn velocity_filter(facts: &Facts, found: &mut Found) {
    let (Some(task), Some(modes)) = (&facts.model.task_space, facts.legs.as_ref().and_then(|legs| legs.modes)) else {
        return;
    };
    let cutoff = task.velocity_cutoff / core::f64::consts::TAU;
    if cutoff >= SLOWEST_FILTER * modes[0] {
        return;
    }
    found.add(
        VELOCITY_FILTER_SLOW,
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
fn ticks_against_modes(facts: &Facts, found: &mut Found) {
    let tick = facts.model.timing.period;
    let Some(modes) = facts.legs.as_ref().and_then(|legs| legs.modes) else { return };
    let ticks = 1.0 / (modes[0] * tick);
    if (FEWEST_TICKS..=MOST_TICKS).contains(&ticks) {
        return;
    }
    found.add(
        TICKS_AGAINST_MODES,
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

/// Gauges see what a tick does within some ticks.
fn gauges_in_time(facts: &Facts, found: &mut Found) {
    let (lag, tick) = (facts.model.sensor.lag, facts.model.timing.period);
    let off = lag / (SLOWEST_GAUGE * tick);
    if off <= 1.0 {
        return;
    }
    found.add_off(
        off,
        GAUGE_LATE,
        "sensor.lag",
        format!(
            "the gauges lag {} us, {} ticks of {} us: what a tick does is seen long after",
            figure(lag * 1e6),
            figure(lag / tick),
            figure(tick * 1e6)
        ),
        "check the unit (us or ms); a tick this much faster than its gauges gains nothing: lengthen `timing.period` or let the gauges pass more",
    );
}

/// A mode above half the tick rate is sampled as another frequency, unless the gauges keep it out.
fn modes_seen_as_others(facts: &Facts, found: &mut Found) {
    let (lag, tick) = (facts.model.sensor.lag, facts.model.timing.period);
    let Some(modes) = facts.legs.as_ref().and_then(|legs| legs.modes) else { return };
    let share = |mode: f64| 1.0 / libm::hypot(1.0, core::f64::consts::TAU * mode * lag);
    let seen = |mode: &&f64| **mode * tick > 0.5 && share(**mode) > LARGEST_ALIAS;
    let Some(mode) = modes.iter().find(seen) else { return };
    let alias = (mode - libm::rint(mode * tick) / tick).abs();
    found.add(
        MODE_ALIASED,
        "timing.period",
        format!(
            "a mode of the platform of {} Hz lies above half the tick rate, {} Hz: the gauges show it as {} Hz, with {} of its amplitude",
            figure(*mode),
            figure(0.5 / tick),
            figure(alias),
            figure(share(*mode))
        ),
        &format!(
            "a period below {} us samples all modes as what they are; or filter the gauges before they are sampled, with a lag above {} us, and write that as `sensor.lag`",
            figure(0.5e6 / modes[5]),
            figure(libm::sqrt(1.0 / (LARGEST_ALIAS * LARGEST_ALIAS) - 1.0) / (core::f64::consts::TAU * mode) * 1e6)
        ),
    );
}
