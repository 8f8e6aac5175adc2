//! Findings about stops that leave workspace or strokes, with the speed or limits that would avoid it.

use super::super::{AXES, amount, stop};
use super::{Leaves, Stopping};
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::{Model, TrajectoryKind};

/// If less than this share of a stop is inside, the stop begins at the bound or beyond it.
const LEAST_SHARE: f64 = 1e-6;

/// A stop that is longer than the room of its axis. An axis without any room is locked and needs none.
pub(super) fn too_long(
    model: &Model,
    stop: &Stopping,
    room: &[f64; 6],
    name: &str,
    limits: &stop::Limits,
) -> Option<Diagnostic> {
    let excess = |axis: usize| if room[axis] > 0.0 { stop.distance(axis) / room[axis] } else { 0.0 };
    let worst = (0..6).fold(0, |worst, axis| if excess(axis) > excess(worst) { axis } else { worst });
    if excess(worst) <= 1.0 {
        return None;
    }
    let to_standstill = format!("{} to standstill", amount(worst, stop.way[worst] + stop.overshoot[worst]));
    let coasted = if stop.coasted[worst] > 0.0 {
        format!("{} until it counts as stale and {to_standstill}", amount(worst, stop.coasted[worst]))
    } else {
        to_standstill
    };
    let (what, axis, speed) = (&stop.what, AXES[worst], amount(worst, stop.speed[worst]));
    let end = amount(worst, room[worst]);
    let message = format!(
        "a {what} along {axis} that is stopped at {speed}/s continues for {coasted}, but workspace and strokes end at most {end} from the bias pose"
    );
    let slower = down(stop.speed[worst] / excess(worst) * 1e6);
    let unit = if worst < 3 { "um" } else { "urad" };
    let mut help = format!("at most {slower} {unit}/s stops in time");
    help += &harder(model, stop, room, limits);
    if stop.coasted[worst] > 0.0 {
        help += "; or lower control.setpoint.stale_ticks";
    }
    let keys = [format!("control.setpoint.{name}[{worst}]"), format!("control.setpoint.{name}")];
    let keys: Vec<&str> = keys.iter().map(String::as_str).chain(["control.setpoint", "control"]).collect();
    Some(Diagnostic::at(&model.spans, &keys, codes::STOP_LEAVES, message, help))
}

/// The least limits with which the stop fits on every axis, as lines of a spec; empty if the distance before the stop is too long.
fn harder(model: &Model, stop: &Stopping, room: &[f64; 6], limits: &stop::Limits) -> String {
    let period = model.timing.period;
    let moving = |axis: &usize| room[*axis] > 0.0;
    // All axes stop together.
    let time = (0..6).filter(moving).fold(stop.time, |time, axis| {
        let left = 2.0 * (room[axis] - stop.fixed(axis)) / stop.speed[axis];
        if left < time { left } else { time }
    });
    let time = libm::floor(time / period) * period;
    if time < period {
        return String::new();
    }
    let least = limits.at_least(&stop.speed, time);
    let list = |values: [f64; 6], [length, angle]: [&str; 2]| {
        let each = values
            .iter()
            .enumerate()
            .map(|(axis, value)| format!("\"{} {}\"", up(*value), if axis < 3 { length } else { angle }));
        each.collect::<Vec<_>>().join(", ")
    };
    format!(
        "; or set stop_acceleration = [{}] and stop_jerk = [{}] or more, as far as legs and amplifiers follow",
        list(least.acceleration, ["m/s^2", "rad/s^2"]),
        list(least.jerk, ["m/s^3", "rad/s^3"])
    )
}

/// A stop during trajectory `index` that ends outside.
pub(super) fn leaves(model: &Model, index: usize, name: &str, kind: &TrajectoryKind, leaves: &Leaves) -> Diagnostic {
    let (key, rate) = kind.rate();
    let fix = match key {
        "frequency" => format!("at most {} Hz stops in time", down(rate * leaves.share)),
        time => format!("a {time} of at least {} ms stops in time", up(rate / leaves.share * 1e3)),
    };
    // If the path itself is outside, more time does not help.
    let fix =
        if leaves.share > LEAST_SHARE { fix } else { "the path itself goes that far: make it smaller".to_owned() };
    let message =
        format!("trajectory \"{name}\": a command that interrupts it would bring it to rest with {}", leaves.end);
    let help = format!("{fix}; or raise control.setpoint.stop_acceleration and stop_jerk");
    Diagnostic::at(&model.spans, &[&format!("trajectory[{index}].{key}")], codes::STOP_LEAVES, message, help)
}

/// Three digits, rounded down.
fn down(value: f64) -> f64 {
    three_digits(value, libm::floor)
}

/// Three digits, rounded up.
fn up(value: f64) -> f64 {
    three_digits(value, libm::ceil)
}

fn three_digits(value: f64, whole: fn(f64) -> f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    // Uses whole powers of ten, so that the printed number is exact.
    let places = 2.0 - libm::floor(libm::log10(value));
    let step = libm::pow(10.0, places.abs());
    if places < 0.0 { whole(value / step) * step } else { whole(value * step) / step }
}
