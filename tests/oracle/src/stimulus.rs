//! Input recordings that exercise a controller's bits: a host and a target get the same ones for the bit-identity
//! check.
//!
//! Not a plausible machine: smooth motion, white steps, demands beyond both limits, reversals on grid thresholds, and
//! numbers that no sensor gives (±0, subnormals, NaN with several payloads, ±∞, the largest finite ones).

mod draw;
pub mod platform;

use draw::RandomSource;

use host_sim::closed_loop::LEGS;
use host_sim::description::{Description, DescriptionError};

/// Meaning of the six set-point words.
#[derive(Debug, Clone, PartialEq)]
pub enum Setpoints {
    /// Leg displacements.
    Leg {
        /// Displacement at full drive E(u_max, 0), m.
        stroke: f64,
        /// E(u_i, u_j) in m on the grid's thresholds: row i = 0..=N, in each the columns j = 0..=i. A demand composed
        /// of them reverses on thresholds, in loops within loops. Empty for a controller without a table.
        everett: Vec<Vec<f64>>,
    },
    /// A pose from rest.
    Pose {
        /// Bounds on x, y, z (m) and θx, θy, θz (rad).
        bounds: [f64; LEGS],
        /// Displacement range of the gauges, m.
        stroke: f64,
    },
}

/// Rows of input words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputRecording {
    /// Words per row.
    pub width: usize,
    /// Row after row.
    pub words: Vec<u64>,
}

impl InputRecording {
    /// Rows in order of time.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[u64]> {
        self.words.chunks_exact(self.width)
    }

    /// The words in little-endian, as a target reads them, without header.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }
}

/// Kind of a stretch of rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Smooth,
    White,
    Saturating,
    Thresholds,
    Hold,
    Special,
}

/// Order of the stretches. Rows that no sensor gives are one stretch in seven, so that a controller that faults on them
/// is also tested while running and recovering.
const CYCLE: [Kind; 7] =
    [Kind::Smooth, Kind::White, Kind::Thresholds, Kind::Saturating, Kind::Hold, Kind::Special, Kind::White];

/// Makes `rows` rows for a controller from `seed`.
///
/// # Errors
/// If the controller lacks the words `setpoint[0..6]` or `displacement[0..6]`.
pub fn record(
    description: &Description,
    setpoints: &Setpoints,
    rows: usize,
    seed: u64,
) -> Result<InputRecording, DescriptionError> {
    let places = [description.inputs("setpoint")?, description.inputs("displacement")?];
    let mut generator = Generator::new(setpoints, seed);
    Ok(in_stretches(description, rows, &CYCLE, &mut generator, Generator::begin, |generator, kind, row| {
        let (setpoint, displacement) = generator.row(kind);
        for leg in 0..LEGS {
            row[places[0][leg]] = generator.draw.word(description.scalar, kind == Kind::Special, setpoint[leg]);
            row[places[1][leg]] = generator.draw.word(description.scalar, kind == Kind::Special, displacement[leg]);
        }
    }))
}

/// Rows in stretches, whose kinds follow `cycle`: `begin` returns the number of rows of a stretch, `fill` makes them.
fn in_stretches<G, K: Copy>(
    description: &Description,
    rows: usize,
    cycle: &[K],
    generator: &mut G,
    begin: impl Fn(&mut G, K) -> u64,
    fill: impl Fn(&mut G, K, &mut [u64]),
) -> InputRecording {
    let width = description.input_names.len();
    let mut words = vec![0; rows * width];
    let mut rows = words.chunks_exact_mut(width.max(1));
    for kind in cycle.iter().cycle() {
        if rows.len() == 0 {
            break;
        }
        let length = begin(generator, *kind);
        for row in rows.by_ref().take(length as usize) {
            fill(generator, *kind, row);
        }
    }
    InputRecording { width, words }
}

/// State of the generator within and between stretches.
struct Generator<'a> {
    draw: RandomSource,
    setpoints: &'a Setpoints,
    /// Centre and half-width of each set-point word.
    center: [f64; LEGS],
    half: [f64; LEGS],
    /// Half the stroke: scale of displacement readings.
    half_stroke: f64,
    /// Phase and step of the smooth motion.
    phase: [f64; LEGS],
    speed: [f64; LEGS],
    last: [f64; LEGS],
    /// Drive of each leg on the grid.
    walks: [ReversalStack; LEGS],
}

impl<'a> Generator<'a> {
    fn new(setpoints: &'a Setpoints, seed: u64) -> Self {
        let (center, half, half_stroke) = match setpoints {
            Setpoints::Leg { stroke, .. } => ([0.5 * stroke; LEGS], [0.5 * stroke; LEGS], 0.5 * stroke),
            Setpoints::Pose { bounds, stroke } => ([0.0; LEGS], *bounds, 0.5 * stroke),
        };
        Self {
            draw: RandomSource::new(seed),
            setpoints,
            center,
            half,
            half_stroke,
            phase: [0.0; LEGS],
            speed: [0.0; LEGS],
            last: center,
            walks: std::array::from_fn(|_| ReversalStack::default()),
        }
    }

    fn begin(&mut self, kind: Kind) -> u64 {
        let length = self.draw.stretch();
        if kind == Kind::Smooth {
            for leg in 0..LEGS {
                // 10 to 1000 rows per period.
                self.speed[leg] = core::f64::consts::TAU / libm::exp(2.3 + 4.6 * self.draw.unit());
            }
        }
        if kind == Kind::Thresholds {
            self.walks = std::array::from_fn(|_| ReversalStack::default());
        }
        length
    }

    fn row(&mut self, kind: Kind) -> ([f64; LEGS], [f64; LEGS]) {
        let before = self.last;
        for leg in 0..LEGS {
            self.last[leg] = match kind {
                Kind::Smooth => {
                    self.phase[leg] += self.speed[leg];
                    self.center[leg] + 0.9 * self.half[leg] * libm::sin(self.phase[leg])
                }
                Kind::White | Kind::Special => self.center[leg] + self.half[leg] * self.draw.symmetric(),
                Kind::Saturating => self.center[leg] + 4.0 * self.half[leg] * self.draw.symmetric(),
                Kind::Thresholds => self.threshold(leg),
                Kind::Hold => self.last[leg],
            };
        }
        // A reading near the demand one row ago, as from a real leg, so that the adaptation stays small.
        let reading = match self.setpoints {
            Setpoints::Leg { .. } if kind == Kind::Thresholds => before,
            Setpoints::Leg { .. } => before.map(|q| q + 0.01 * self.half_stroke * self.draw.symmetric()),
            Setpoints::Pose { .. } => std::array::from_fn(|_| self.half_stroke * (1.0 + 0.9 * self.draw.symmetric())),
        };
        (self.last, reading)
    }

    /// The next reversal on the grid: with readings equal to the demand and no adaptation, the drive reverses on a
    /// threshold. The first demand of a stretch is 0, which wipes out the history.
    fn threshold(&mut self, leg: usize) -> f64 {
        let grid = match self.setpoints {
            Setpoints::Leg { everett, .. } => everett.len().saturating_sub(1),
            Setpoints::Pose { .. } => 0,
        };
        if grid == 0 {
            // A pose meets no threshold exactly: its bounds and centre are used instead.
            return self.center[leg] + self.half[leg] * (self.draw.below(3) as f64 - 1.0);
        }
        let pick = self.draw.below(grid as u64) as usize;
        match self.setpoints {
            Setpoints::Leg { everett, .. } => self.walks[leg].reverse(pick, everett),
            Setpoints::Pose { .. } => 0.0,
        }
    }
}

/// Reversals of one leg's drive that are not wiped out, as grid levels: minimum 0, maximum, minimum, ... Empty before
/// the first row of a stretch.
#[derive(Debug, Clone, Default)]
struct ReversalStack {
    extrema: Vec<usize>,
}

impl ReversalStack {
    /// Reverses and moves by 1 + `pick` levels, or to the end of the grid; returns the displacement there, m.
    ///
    /// Ending exactly on an earlier extremum is frequent: there the smallest change decides whether it is wiped out.
    fn reverse(&mut self, pick: usize, everett: &[Vec<f64>]) -> f64 {
        let Some(&last) = self.extrema.last() else {
            self.extrema.push(0);
            return 0.0;
        };
        let rising = self.extrema.len() % 2 == 1;
        let level = if rising { (last + 1 + pick).min(everett.len() - 1) } else { last.saturating_sub(1 + pick) };
        while self.extrema.len() >= 3 {
            let outer = self.extrema[self.extrema.len() - 2];
            if (rising && level < outer) || (!rising && level > outer) {
                break;
            }
            self.extrema.truncate(self.extrema.len() - 2);
        }
        if level == 0 {
            self.extrema.clear();
        }
        self.extrema.push(level);
        let between = |up: usize, down: usize| everett.get(up).and_then(|row| row.get(down)).copied().unwrap_or(0.0);
        self.extrema.windows(2).fold(0.0, |sum, pair| {
            if pair[1] > pair[0] { sum + between(pair[1], pair[0]) } else { sum - between(pair[0], pair[1]) }
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::draw::specials;
    use super::*;
    use host_sim::word::Scalar;

    fn six_legs(scalar: Scalar) -> Description {
        Description { scalar, ..crate::description() }
    }

    /// N = 32; E depends on d = i − j alone: d (32 + d)/2048 of 60 µm.
    fn everett() -> Vec<Vec<f64>> {
        let stroke = |levels: f64| levels * (32.0 + levels) * 60e-6 / 2048.0;
        (0..=32).map(|up| (0..=up).map(|down| stroke(f64::from(up - down))).collect()).collect()
    }

    fn leg_setpoints() -> Setpoints {
        Setpoints::Leg { stroke: 60e-6, everett: everett() }
    }

    fn pose_setpoints() -> Setpoints {
        Setpoints::Pose { bounds: [40e-6, 40e-6, 40e-6, 6e-4, 6e-4, 6e-4], stroke: 60e-6 }
    }

    #[test]
    fn a_seed_repeats_and_another_differs() {
        let description = six_legs(Scalar::F64);
        let make = |seed| record(&description, &leg_setpoints(), 5000, seed).unwrap();
        assert_eq!(make(1), make(1));
        assert_ne!(make(1), make(2));
        assert_eq!(make(1).to_bytes().len(), 5000 * 12 * 8);
        assert_eq!(make(1).rows().len(), 5000);
    }

    #[test]
    fn every_special_pattern_occurs_in_both_types_and_is_what_it_says() {
        for scalar in [Scalar::F32, Scalar::F64] {
            let recording = record(&six_legs(scalar), &pose_setpoints(), 100_000, 1).unwrap();
            let seen: BTreeSet<u64> = recording.words.iter().copied().collect();
            let patterns = specials(scalar);
            assert!(patterns.iter().all(|word| seen.contains(word)), "{scalar:?}");
            assert_eq!(patterns.iter().collect::<BTreeSet<_>>().len(), patterns.len());
            let values = patterns.map(|word| scalar.decode(word));
            assert_eq!(values.iter().filter(|x| x.is_nan()).count(), 6);
            assert_eq!(values.iter().filter(|x| x.is_infinite()).count(), 2);
            assert_eq!(values.iter().filter(|x| **x == 0.0).count(), 2);
            if scalar == Scalar::F32 {
                assert!(recording.words.iter().all(|word| word >> 32 == 0));
                assert_eq!(values[11], f64::from(f32::MAX));
            } else {
                assert_eq!(values[11], f64::MAX);
            }
        }
    }

    #[test]
    fn demands_leave_both_limits_and_reverse_on_every_node() {
        let setpoints = leg_setpoints();
        let recording = record(&six_legs(Scalar::F64), &setpoints, 100_000, 1).unwrap();
        let Setpoints::Leg { stroke, everett } = setpoints else { panic!() };
        let leg: Vec<f64> = recording.rows().map(|row| f64::from_bits(row[2])).collect();
        assert!(leg.iter().filter(|q| **q > stroke && **q < 1.0).count() > 1000);
        assert!(leg.iter().filter(|q| **q < 0.0 && **q > -1.0).count() > 1000);
        for (level, row) in everett.iter().enumerate().skip(1) {
            // Up from rest onto the threshold, and down again.
            let node = row[0];
            let reversals = leg.windows(3).filter(|w| w[0] == 0.0 && w[1].to_bits() == node.to_bits() && w[2] < node);
            assert!(reversals.count() > 5, "{level}");
        }
        // Most rows have no special number, so that a controller with a fault latch is seen to run.
        let finite = recording.rows().filter(|row| row.iter().all(|word| f64::from_bits(*word).is_finite()));
        assert!(finite.count() > 85_000);
    }

    #[test]
    fn a_walk_reverses_within_loops_and_wipes_them_out() {
        let everett = everett();
        let mut walk = ReversalStack::default();
        let mut go = |pick| {
            let q = walk.reverse(pick, &everett);
            (walk.extrema.clone(), q)
        };
        assert_eq!(go(9), (vec![0], 0.0));
        assert_eq!(go(19), (vec![0, 20], everett[20][0]));
        assert_eq!(go(9), (vec![0, 20, 10], everett[20][0] - everett[20][10]));
        assert_eq!(go(4).0, [0, 20, 10, 15]);
        // Exactly onto the earlier minimum: the inner loop closes.
        assert_eq!(go(4).0, [0, 20, 10]);
        // Onto the earlier maximum, and beyond the grid.
        assert_eq!(go(9), (vec![0, 20], everett[20][0]));
        assert_eq!(go(99).0, [0]);
        assert_eq!(go(99).0, [0, 32]);
    }

    #[test]
    fn a_controller_without_setpoints_is_refused() {
        let mut description = six_legs(Scalar::F64);
        description.input_names.truncate(3);
        assert!(record(&description, &leg_setpoints(), 10, 1).unwrap_err().to_string().contains("`setpoint[3]`"));
    }
}
