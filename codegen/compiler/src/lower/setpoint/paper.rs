//! The paper's platform trajectories, and steps, as segments: corrected as in the errata, or as printed.
//!
//! With s = t·tf every coordinate of a piece is a line and a sinusoid whose amplitude grows with time:
//! h = (line₀ + line₁ s) + (radius₀ + radius₁ s) sin(2π (f_c t + turns)). Lengths in µm, angles in mrad; A = π/72.
//! The phase of y in case 1 is the errata's, 1.918666; θy's offset, printed as 0.0436, is A where it is corrected.

use core::f64::consts::PI;

use specgen_language::model::{PaperPath, TrajectoryKind};

/// A = π/72, mrad.
const AMPLITUDE: f64 = PI / 72.0;
/// A as printed where it is an offset, mrad.
const PRINTED_OFFSET: f64 = 0.0436;
/// f_c · 1.918666/tf in case 1, turns.
const SHIFT: f64 = 0.191_866_6;
/// The same as printed, s.
const PRINTED_SHIFT: f64 = 1.918_666;
/// µm and mrad.
const UNITS: [f64; 6] = [1e-6, 1e-6, 1e-6, 1e-3, 1e-3, 1e-3];

/// One coordinate of a piece over the time t of the whole trajectory; m or rad, s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Coordinate {
    /// Value at t = 0 and slope.
    pub line: [f64; 2],
    /// Radius at t = 0 and its slope.
    pub radius: [f64; 2],
    /// Phase at t = 0, turns.
    pub turns: f64,
}

/// A piece: its end (s) and coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    pub end: f64,
    pub coordinates: [Coordinate; 6],
}

/// Pieces of a trajectory defined by formulas, with their frequency, Hz; none for a table.
pub(super) fn formula(kind: &TrajectoryKind) -> Option<(Vec<Piece>, f64)> {
    match kind {
        TrajectoryKind::Paper { path, as_printed, frequency } => {
            Some((pieces(*path, *as_printed, *frequency), *frequency))
        }
        TrajectoryKind::Step { to, time } => Some((step(to, *time), 1.0 / time)),
        TrajectoryKind::Waveform { .. } => None,
    }
}

/// The pieces of a path at f_c = `frequency` (Hz), from t = 0.
fn pieces(path: PaperPath, as_printed: bool, frequency: f64) -> Vec<Piece> {
    // tf is f_c/0.1 Hz; the spans and phases of machining match only with tf = f_c/1 Hz.
    let factor = if path == PaperPath::Machining && !as_printed { frequency } else { 10.0 * frequency };
    let scaled = match path {
        PaperPath::Case1 => case_1(as_printed, factor, frequency),
        PaperPath::Case2 => case_2(as_printed, factor),
        PaperPath::Machining => machining(as_printed),
    };
    scaled
        .into_iter()
        .map(|(end, coordinates)| Piece { end: end / factor, coordinates: in_time(coordinates, factor) })
        .collect()
}

/// A step from zero to a pose (m and rad) within a time (s): h = to (t/T − sin(2π t/T)/(2π)), whose sinusoid has the frequency 1/T.
fn step(to: &[f64; 6], time: f64) -> Vec<Piece> {
    let coordinates = to.map(|to| Coordinate { line: [0.0, to / time], radius: [-to / (2.0 * PI), 0.0], turns: 0.0 });
    vec![Piece { end: time, coordinates }]
}

/// From scaled time, µm and mrad to s, m and rad.
fn in_time(coordinates: [Coordinate; 6], factor: f64) -> [Coordinate; 6] {
    let mut coordinates = coordinates;
    for (coordinate, unit) in coordinates.iter_mut().zip(UNITS) {
        for [value, slope] in [&mut coordinate.line, &mut coordinate.radius] {
            *value *= unit;
            *slope *= unit * factor;
        }
    }
    coordinates
}

const REST: Coordinate = Coordinate { line: [0.0; 2], radius: [0.0; 2], turns: 0.0 };

fn line(value: f64, slope: f64) -> Coordinate {
    Coordinate { line: [value, slope], ..REST }
}

fn swing(line: [f64; 2], radius: [f64; 2], turns: f64) -> Coordinate {
    Coordinate { line, radius, turns }
}

type Scaled = Vec<(f64, [Coordinate; 6])>;

fn case_1(as_printed: bool, factor: f64, frequency: f64) -> Scaled {
    let turns = if as_printed { 0.25 - frequency * PRINTED_SHIFT } else { -0.25 - SHIFT };
    // 8 + 8/5 (s − 5); the print has t for s.
    let z = if as_printed { line(0.0, 1.6 / factor) } else { line(0.0, 1.6) };
    let x = swing([-4.5, 0.0], [5.0, 0.4], -0.25);
    let y = swing([0.0; 2], [5.0, 0.4], turns);
    vec![(5.0, [line(0.0, 0.5), line(0.0, 0.5), line(0.0, 1.6), REST, REST, REST]), (25.0, [x, y, z, REST, REST, REST])]
}

fn case_2(as_printed: bool, factor: f64) -> Scaled {
    let first = if as_printed { line(0.0, 8.0 / 7.0 / factor) } else { line(0.0, 1.6) };
    // 8 + 8/7 (s − 5).
    let z = line(16.0 / 7.0, 8.0 / 7.0);
    vec![(5.0, [REST, REST, first, REST, REST, REST]), (25.0, [REST, REST, z, tilt_x(), tilt_y(as_printed), REST])]
}

/// A sin 2π f_c t.
fn tilt_x() -> Coordinate {
    swing([0.0; 2], [AMPLITUDE, 0.0], 0.0)
}

/// A + A cos 2π f_c t.
fn tilt_y(as_printed: bool) -> Coordinate {
    swing([if as_printed { PRINTED_OFFSET } else { AMPLITUDE }, 0.0], [AMPLITUDE, 0.0], 0.25)
}

fn machining(as_printed: bool) -> Scaled {
    // x is missing in print; the corrected version uses an assumption.
    let x = |of_x: Coordinate| if as_printed { REST } else { of_x };
    // 2.5 + (5 + 8s/5)(1 + cos)/2, and 2.5 + (5 + 8s/5) cos(… − π/2).
    let around_x = swing([5.0, 0.8], [2.5, 0.8], 0.25);
    let around_y = swing([2.5, 0.0], [5.0, 1.6], 0.0);
    let turn = swing([0.0; 2], [AMPLITUDE / 2.0, 0.0], 0.0);
    // 2.5 − 2.5 (s − 2.5) and 30 − 30 (s − 2.5).
    let home = line(8.75, -2.5);
    vec![
        (0.5, [x(line(0.0, 5.0)), line(0.0, 5.0), line(0.0, 12.0), REST, REST, REST]),
        (2.5, [x(around_x), around_y, line(0.0, 12.0), tilt_x(), tilt_y(as_printed), turn]),
        (3.5, [x(home), home, line(105.0, -30.0), REST, REST, REST]),
    ]
}
