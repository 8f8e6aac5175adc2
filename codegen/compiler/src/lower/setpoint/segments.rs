//! Lowers analytic pieces to segments in ticks, and checks for jumps between them.

use core::f64::consts::TAU;

use super::check::Excesses;
use super::paper::{Coordinate, Piece};
use super::{AXES, LONGEST, User, amount};
use crate::ir::{Path, Segment, SegmentAxis};
use specgen_language::diagnostic::{Code, Diagnostic, Place, codes};
use specgen_language::model::{Model, TaskSpace};

/// Steps at a joint below the resolution of a gauge do not count, m and rad.
const NO_JUMP: [f64; 6] = [1e-9, 1e-9, 1e-9, 10e-9, 10e-9, 10e-9];
/// Changes of slope below these do not count, per s.
const NO_CORNER: [f64; 6] = [1e-9, 1e-9, 1e-9, 10e-9, 10e-9, 10e-9];
/// Tolerance, as a share of a tick, within which a joint is at a tick: its time is a rounded quotient.
const AT_TICK: f64 = 1e-6;

/// Segments of trajectory `index` and warnings about its corners.
pub(super) fn lower(
    model: &Model,
    task: &TaskSpace,
    user: &User,
    index: usize,
    pieces: Vec<Piece>,
    frequency: f64,
) -> Result<(Path, Vec<Diagnostic>), Vec<Diagnostic>> {
    let period = model.timing.period;
    let (rate, _) = task.trajectories[index].kind.rate();
    let (steps, key) = (rate == "time", format!("trajectory[{index}].{rate}"));
    let refuse = |code: Code, message: String, help: &str| {
        let message = format!("trajectory \"{}\": {message}", task.trajectories[index].name);
        Diagnostic::at(&model.spans, &[&key], code, message, help)
    };
    let firsts: Vec<f64> =
        core::iter::once(0.0).chain(pieces.iter().map(|piece| libm::ceil(piece.end / period - AT_TICK))).collect();
    let ticks = firsts.last().copied().unwrap_or_default();
    if firsts.windows(2).any(|pair| pair[1] - pair[0] < 1.0) || frequency * period >= 0.5 || ticks > LONGEST {
        let [message, help] = if steps {
            let time = 1e3 / frequency;
            [
                format!("{time} ms is too short or too long for ticks of {:.3} us", period * 1e6),
                "choose from three ticks to some minutes".to_owned(),
            ]
        } else {
            let help = "choose a frequency whose pieces last from a tick to some minutes";
            [format!("{frequency} Hz is too high or too low for ticks of {:.3} us", period * 1e6), help.to_owned()]
        };
        return Err(vec![refuse(codes::TRAJECTORY_TICKS, message, &help)]);
    }
    let mut findings = Vec::new();
    let joints = joints(&pieces, frequency);
    for jump in joints.iter().filter(|joint| joint.pose.abs() > NO_JUMP[joint.axis]) {
        let message = format!("{} jumps by {} after {:.6} s", AXES[jump.axis], amount(jump.axis, jump.pose), jump.time);
        let help = "the formulas as printed have a jump: leave as_printed out to use the corrected ones";
        let mut found = refuse(codes::TRAJECTORY_JUMPS, message, help);
        let printed = format!("trajectory[{index}].as_printed");
        if let Some(span) = model.spans.get(&printed) {
            (found.key, found.place) = (printed, Place::Spec(span.clone()));
        }
        findings.push(found);
    }
    let excesses = excesses(model, task, user, &pieces, &firsts, frequency);
    let [place, speed] = excesses.messages(model, user, &task.setpoint);
    if let Some((_, message)) = place {
        let help = excesses.fix_of_place(user).unwrap_or_default();
        findings.push(refuse(codes::TRAJECTORY_OUTSIDE, message, &help));
    }
    if let Some((_, message)) = speed {
        let slower = excesses.fix_of_frequency(frequency, period).unwrap_or_default();
        let enough = if steps {
            format!("at least {} ms is slow enough", libm::ceil(1e6 / slower) * 1e-3)
        } else {
            format!("at most {slower} Hz is slow enough")
        };
        let help = format!("{enough}; or {}", excesses.fix_of_speed().unwrap_or_default());
        findings.push(refuse(codes::TRAJECTORY_TOO_FAST, message, &help));
    }
    if !findings.is_empty() {
        return Err(findings);
    }
    let mut begin = 0.0;
    let mut segments = Vec::new();
    for (piece, first) in pieces.iter().zip(&firsts) {
        segments.push(segment(piece, piece.end - begin, *first, period, frequency));
        begin = piece.end;
    }
    let start = pieces.first().map_or([0.0; 6], |piece| piece.at(0.0, frequency).0);
    let end = pieces.last().map_or([0.0; 6], |piece| piece.at(piece.end, frequency).0);
    let warnings = corner(&joints)
        .map(|worst| {
            let (name, time, axis) = (&task.trajectories[index].name, worst.time, AXES[worst.axis]);
            let change = amount(worst.axis, worst.rate);
            let message = format!(
                "trajectory \"{name}\" has corners, the sharpest after {time:.6} s, where the speed of {axis} changes by {change}/s"
            );
            let help = "each corner makes the platform ring: expect errors there, or use a smoothed path as a waveform";
            Diagnostic::at(&model.spans, &[&key], codes::TRAJECTORY_CORNERS, message, help)
        })
        .into_iter()
        .collect();
    Ok((Path::Segments { start, segments, ticks: ticks as u32, end }, warnings))
}

impl Coordinate {
    /// Value and rate at `time` (s).
    fn at(&self, time: f64, frequency: f64) -> (f64, f64) {
        let [value, slope] = self.line;
        let [radius, growth] = self.radius;
        let line = value + slope * time;
        if radius == 0.0 && growth == 0.0 {
            return (line, slope);
        }
        let phase = TAU * (frequency * time + self.turns);
        let (s, c) = (libm::sin(phase), libm::cos(phase));
        let radius = radius + growth * time;
        (line + radius * s, slope + growth * s + TAU * frequency * radius * c)
    }
}

impl Piece {
    /// Pose and rate at `time` (s).
    pub(super) fn at(&self, time: f64, frequency: f64) -> ([f64; 6], [f64; 6]) {
        let both = self.coordinates.map(|coordinate| coordinate.at(time, frequency));
        (both.map(|(value, _)| value), both.map(|(_, rate)| rate))
    }
}

/// The discontinuity between two pieces, at the start from rest, or at the end to rest.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Joint {
    time: f64,
    axis: usize,
    pose: f64,
    rate: f64,
}

fn joints(pieces: &[Piece], frequency: f64) -> Vec<Joint> {
    let mut joints = Vec::new();
    let mut time = 0.0;
    for index in 0..=pieces.len() {
        let after = pieces.get(index).map(|piece| piece.at(time, frequency));
        let before = index.checked_sub(1).and_then(|index| pieces.get(index)).map(|piece| piece.at(time, frequency));
        let pose = |side: Option<([f64; 6], [f64; 6])>| side.map(|(pose, _)| pose);
        let rate = |side: Option<([f64; 6], [f64; 6])>| side.map_or([0.0; 6], |(_, rate)| rate);
        // At rest before the start and after the end: there only the rate changes.
        let poses = (pose(before).or(pose(after)), pose(after).or(pose(before)));
        let (from, to) = (poses.0.unwrap_or([0.0; 6]), poses.1.unwrap_or([0.0; 6]));
        for axis in 0..6 {
            let joint = Joint { time, axis, pose: to[axis] - from[axis], rate: rate(after)[axis] - rate(before)[axis] };
            joints.push(joint);
        }
        time = pieces.get(index).map_or(time, |piece| piece.end);
    }
    joints
}

/// The sharpest corner, if there is one; a radian weighs as much as 0.1 m, its lever arm at a leg.
fn corner(joints: &[Joint]) -> Option<Joint> {
    let weight = |joint: &Joint| joint.rate.abs() * if joint.axis < 3 { 1.0 } else { 0.1 };
    joints
        .iter()
        .filter(|joint| joint.rate.abs() > NO_CORNER[joint.axis])
        .copied()
        .reduce(|worst, joint| if weight(&joint) > weight(&worst) { joint } else { worst })
}

fn excesses(
    model: &Model,
    task: &TaskSpace,
    user: &User,
    pieces: &[Piece],
    firsts: &[f64],
    frequency: f64,
) -> Excesses {
    let mut excesses = Excesses::default();
    for (piece, span) in pieces.iter().zip(firsts.windows(2)) {
        // The tick after the last one belongs to the next piece; checking it, too, covers the joint.
        for tick in span[0] as u32..=span[1] as u32 {
            let time = f64::from(tick) * model.timing.period;
            let time = if time > piece.end { piece.end } else { time };
            let (pose, rate) = piece.at(time, frequency);
            excesses.look(user, &task.setpoint, time, pose, rate);
        }
    }
    excesses
}

/// A piece of `duration` (s) whose own time w = 0..1 starts at the tick `first`.
fn segment(piece: &Piece, duration: f64, first: f64, period: f64, frequency: f64) -> Segment {
    let start = first * period;
    let swings = piece.coordinates.iter().any(|coordinate| coordinate.radius != [0.0; 2]);
    let axis = |coordinate: Coordinate| {
        let [value, slope] = coordinate.line;
        let [radius, growth] = coordinate.radius;
        let (here, grown) = (radius + growth * start, growth * duration);
        let (s, c) = turned(coordinate.turns);
        SegmentAxis {
            place: value + slope * start,
            slope: slope * duration,
            sine: [here * c, grown * c],
            cosine: [here * s, grown * s],
        }
    };
    Segment {
        first: first as u32,
        per_tick: period / duration,
        per_second: 1.0 / duration,
        phase: if swings { turns_to_phase(frequency * start) } else { 0 },
        phase_step: if swings { turns_to_phase(frequency * period) } else { 0 },
        angular: if swings { TAU * frequency } else { 0.0 },
        axes: piece.coordinates.map(axis),
    }
}

/// sin and cos of a phase in turns, exact at quarters.
fn turned(turns: f64) -> (f64, f64) {
    let quarters = 4.0 * turns;
    if quarters == libm::rint(quarters) {
        return match (quarters as i64).rem_euclid(4) {
            0 => (0.0, 1.0),
            1 => (1.0, 0.0),
            2 => (0.0, -1.0),
            _ => (-1.0, 0.0),
        };
    }
    (libm::sin(TAU * turns), libm::cos(TAU * turns))
}

/// The fraction of `turns` ≥ 0, in turn/2⁶⁴.
fn turns_to_phase(turns: f64) -> u64 {
    let fraction = turns - libm::floor(turns);
    (fraction * 18_446_744_073_709_551_616.0) as u64
}

#[cfg(test)]
mod tests {
    use super::{TAU, turned, turns_to_phase};

    #[test]
    fn quarters_of_a_turn_are_exact_and_others_are_sine_and_cosine() {
        for eighths in -20_i32..=20 {
            let turns = 0.125 * f64::from(eighths);
            let (s, c) = turned(turns);
            assert!((s - libm::sin(TAU * turns)).abs() < 1e-14, "sin of {turns}: {s}");
            assert!((c - libm::cos(TAU * turns)).abs() < 1e-14, "cos of {turns}: {c}");
            assert!(eighths % 2 != 0 || [s, c].iter().all(|part| [-1.0, 0.0, 1.0].contains(part)), "{turns}: {s}, {c}");
        }
    }

    #[test]
    fn a_phase_is_the_fraction_of_the_turns() {
        for (turns, phase) in [(0.0, 0), (0.5, 1 << 63), (3.25, 1 << 62), (7.0, 0)] {
            assert_eq!(turns_to_phase(turns), phase, "{turns}");
        }
    }
}
