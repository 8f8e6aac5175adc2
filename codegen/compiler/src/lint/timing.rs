//! Times compared with the tick, and the tick compared with the modes.

use super::{Facts, Findings, figure};

lints! {
    rules: times_too_short, lead_too_long, transfer, velocity_filter, ticks_against_modes, gauges_in_time,
        aliased_modes;

    /// # W0830: a time too short to have an effect
    ///
    /// Lag, lead, dead time and the width of a trigger's pulse should be at least a
    /// hundredth of a tick, or 0.
    ///
    /// ## Why it matters
    ///
    /// A shorter time has no effect. It is usually us written for ms.
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
    /// Check the unit, or leave the key out.
    ///
    /// ```toml
    /// lag   = "0.35 ms"
    /// ```
    TIME_WITHOUT_EFFECT = "W0830";

    /// # W0831: lead longer than the delay
    ///
    /// `control.lead`, and `lead` of a trajectory, should be at most 1.25 times the sum
    /// of amplifier lag and tick. `hysteresis.dead_time` of six legs should be at most
    /// three times the sum of these and a period of the legs' resonance.
    ///
    /// ## Why it matters
    ///
    /// The lead makes the feed-forward run ahead of the set-point by the delay of
    /// amplifier and sampling. With a longer lead the legs are early.
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
    /// Leave the key out: the compiler then uses the delay from command to pose, which
    /// `specgen check --details` states. Or write at most the sum of amplifier lag and
    /// tick; `specgen sim` shows which lead is best on a path with corners.
    ///
    /// ```toml
    /// lead            = "0.1 ms"
    /// ```
    LEAD_TOO_LONG = "W0831";

    /// # W0832: implausible transfer time
    ///
    /// `control.transfer_time` should be from a tick to five seconds.
    ///
    /// ## Why it matters
    ///
    /// It is the time constant with which the offset after a change of mode decays. A
    /// shorter time makes a step in the voltage; with a longer time the offset remains.
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
    /// The filter would delay the velocity in the derivative term of (7).
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

    /// # W0834: period and modes are inconsistent
    ///
    /// One period of the platform's lowest mode should have between four and three
    /// thousand ticks.
    ///
    /// ## Why it matters
    ///
    /// With fewer ticks the loop hardly samples the mode. With more, the tick is far
    /// faster than anything to control. Period, stiffness or masses are usually in the
    /// wrong unit.
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
    /// The gauges show the effect of a tick only after their lag. A much faster tick
    /// costs computation and gains nothing, and the stability check allows only small
    /// gains. Usually the unit is wrong.
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
    /// 1/(2 pi bandwidth), and the lags of several in series add up.
    ///
    /// ```toml
    /// lag = "0.2 ms"
    /// ```
    GAUGE_LATE = "W0862";

    /// # W0869: a mode above half the tick rate
    ///
    /// No mode of the platform should be above half the tick rate, unless the gauges
    /// attenuate it to less than a third.
    ///
    /// ## Why it matters
    ///
    /// Such a mode is aliased to a lower frequency, and the loop responds to the alias.
    /// The stability check includes it at its nominal frequency only. If the mode
    /// shifts by a few hertz, its alias shifts by as much in the other direction.
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
    /// Sample faster than twice the highest mode, or filter the gauges and include the
    /// filter in `sensor.lag`.
    ///
    /// ```toml
    /// period = "200 us"
    /// ```
    MODE_ALIASED = "W0869";
}

/// Below this share of a tick a time has no effect.
const NOTHING: f64 = 0.01;
/// Largest lead over the sum of amplifier lag and tick: a quarter more for the modes.
const LARGEST_LEAD: f64 = 1.25;
/// The same for the dead time of six legs over that sum and a period of their resonance.
const LONGEST_DEAD_TIME: f64 = 3.0;
/// Longest plausible transfer time, s.
const LONGEST_TRANSFER: f64 = 5.0;
/// Lowest cut-off of the velocity filter, as a share of the lowest mode.
const SLOWEST_FILTER: f64 = 0.1;
/// Longest lag of the gauges, in ticks.
const SLOWEST_GAUGE: f64 = 5.0;
/// Largest transmission of the gauges for a mode above half the tick rate.
const LARGEST_ALIAS: f64 = 1.0 / 3.0;
/// Fewest and most ticks in a period of the lowest mode.
const FEWEST_TICKS: f64 = 4.0;
const MOST_TICKS: f64 = 3000.0;

/// Checks for times that are too short to have an effect.
fn times_too_short(facts: &Facts, found: &mut Findings) {
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
        let [given, share, whole] = [time * 1e6, time / tick, tick * 1e6].map(figure);
        found.add(
            TIME_WITHOUT_EFFECT,
            &key,
            format!("`{key}` is {given} us, {share} of a tick of {whole} us: it has no effect"),
            "check the unit (ms or us), or leave the key out",
        );
    }
}

/// Checks that leads do not exceed the delays that they compensate.
fn lead_too_long(facts: &Facts, found: &mut Findings) {
    let model = facts.model;
    let lag = model.amplifier.lag + model.timing.period;
    // The legs' own resonance delays them by a part of its period.
    let (dead_time, most) = (model.hysteresis.dead_time, LONGEST_DEAD_TIME * (lag + 1.0 / model.actuator.resonance));
    if dead_time > most {
        let [ahead, delay] = [dead_time * 1e3, (lag + 1.0 / model.actuator.resonance) * 1e3].map(figure);
        found.add(
            LEAD_TOO_LONG,
            "hysteresis.dead_time",
            format!(
                "the feed-forward runs {ahead} ms ahead, but amplifier, tick and a period of the legs' resonance together delay by {delay} ms"
            ),
            "check the unit (ms or us); `specgen identify rate` measures it",
        );
    }
    let Some(task) = &model.task_space else { return };
    let of_paths =
        task.trajectories.iter().enumerate().map(|(index, one)| (format!("trajectory[{index}].lead"), one.lead));
    for (key, lead) in std::iter::once(("control.lead".to_owned(), task.lead)).chain(of_paths) {
        let Some(lead) = lead.filter(|lead| *lead > LARGEST_LEAD * lag) else { continue };
        let [ahead, delay] = [lead * 1e3, lag * 1e3].map(figure);
        found.add(
            LEAD_TOO_LONG,
            &key,
            format!(
                "the feed-forward runs {ahead} ms ahead, but amplifier and tick together delay by {delay} ms"
            ),
            &format!(
                "leave `{key}` out, and the compiler compensates the delay; or check its unit and that of `amplifier.lag`"
            ),
        );
    }
}

/// Checks the time in which the offset after a change of mode decays.
fn transfer(facts: &Facts, found: &mut Findings) {
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

/// Checks that the velocity filter passes the lowest mode.
fn velocity_filter(facts: &Facts, found: &mut Findings) {
    let (Some(task), Some(modes)) = (&facts.model.task_space, facts.legs.as_ref().and_then(|legs| legs.modes)) else {
        return;
    };
    let cutoff = task.velocity_cutoff / core::f64::consts::TAU;
    if cutoff >= SLOWEST_FILTER * modes[0] {
        return;
    }
    let [hertz, lowest] = [cutoff, modes[0]].map(figure);
    found.add(
        VELOCITY_FILTER_SLOW,
        "control.velocity_cutoff",
        format!("the velocity is filtered at {hertz} Hz, far below the lowest mode of {lowest} Hz"),
        "usual is at least the frequency of the lowest mode: check the unit (rad/s, not Hz)",
    );
}

/// Checks the number of ticks in a period of the lowest mode.
fn ticks_against_modes(facts: &Facts, found: &mut Findings) {
    let tick = facts.model.timing.period;
    let Some(modes) = facts.legs.as_ref().and_then(|legs| legs.modes) else { return };
    let ticks = 1.0 / (modes[0] * tick);
    if (FEWEST_TICKS..=MOST_TICKS).contains(&ticks) {
        return;
    }
    let [hertz, ticks, microseconds] = [modes[0], ticks, tick * 1e6].map(figure);
    found.add(
        TICKS_AGAINST_MODES,
        "timing.period",
        format!(
            "one period of the platform's lowest mode, {hertz} Hz, has {ticks} ticks of {microseconds} us"
        ),
        "ten to a hundred ticks are usual: check `timing.period`, and `actuator.axial_stiffness` and the masses, which determine the mode",
    );
}

/// Checks the lag of the gauges against the tick.
fn gauges_in_time(facts: &Facts, found: &mut Findings) {
    let (lag, tick) = (facts.model.sensor.lag, facts.model.timing.period);
    let off = lag / (SLOWEST_GAUGE * tick);
    if off <= 1.0 {
        return;
    }
    let [late, ticks, tick] = [lag * 1e6, lag / tick, tick * 1e6].map(figure);
    found.add_off(
        off,
        GAUGE_LATE,
        "sensor.lag",
        format!(
            "the gauges lag by {late} us, {ticks} ticks of {tick} us: the effect of a tick is measured long after it"
        ),
        "check the unit (us or ms); a tick this much faster than its gauges gains nothing: lengthen `timing.period` or increase the bandwidth of the gauges",
    );
}

/// Checks for aliased modes that the gauges do not filter out.
fn aliased_modes(facts: &Facts, found: &mut Findings) {
    let (lag, tick) = (facts.model.sensor.lag, facts.model.timing.period);
    let Some(modes) = facts.legs.as_ref().and_then(|legs| legs.modes) else { return };
    let share = |mode: f64| 1.0 / libm::hypot(1.0, core::f64::consts::TAU * mode * lag);
    let seen = |mode: &&f64| **mode * tick > 0.5 && share(**mode) > LARGEST_ALIAS;
    let Some(mode) = modes.iter().find(seen) else { return };
    let alias = (mode - libm::rint(mode * tick) / tick).abs();
    let [hertz, half, alias, amplitude] = [*mode, 0.5 / tick, alias, share(*mode)].map(figure);
    found.add(
        MODE_ALIASED,
        "timing.period",
        format!(
            "the platform's mode at {hertz} Hz is above half the tick rate, {half} Hz: it is aliased to {alias} Hz with {amplitude} times its amplitude"
        ),
        &format!(
            "a period below {} us samples all modes without aliasing; or filter the gauges before sampling with a lag above {} us, and write that as `sensor.lag`",
            figure(0.5e6 / modes[5]),
            figure(libm::sqrt(1.0 / (LARGEST_ALIAS * LARGEST_ALIAS) - 1.0) / (core::f64::consts::TAU * mode) * 1e6)
        ),
    );
}
