//! The platform trajectories of the paper's §4: case 1, case 2, machining; corrected, and as printed.
//!
//! With s = t·tf and tf = 10 f_c/Hz (machining: f_c/Hz), lengths in µm and angles in mrad; the print's rad would need
//! ±4.4 mm from 60 µm legs. A = π/72.
//!
//! | | corrected | as printed, where it differs |
//! |---|---|---|
//! | case 1, s < 5 | x = y = s/2, z = 8s/5 | |
//! | 5 ≤ s < 25 | x = −4.5 + (5 + 2s/5) sin(2π f_c t − π/2), y = (5 + 2s/5) sin(2π f_c (t − 1.918666/tf) − π/2), z = 8 + 8(s−5)/5 | y: 1.918666 unscaled and + π/2; z: 8 + 8(t−5)/5 |
//! | case 2, s < 5 | z = 8s/5 | z = 8t/7 |
//! | 5 ≤ s < 25 | z = 8 + 8(s−5)/7, θx = A sin 2π f_c t, θy = A + A cos 2π f_c t | θy: 0.0436 for the first A |
//! | machining, s ≤ 0.5 | x = y = 5s, z = 12s | x is missing in print: 0; tf = 10 f_c/Hz |
//! | 0.5 ≤ s ≤ 2.5 | x = 2.5 + (5 + 8s/5)(1 + cos 2π f_c t)/2, y = 2.5 + (5 + 8s/5) cos(2π f_c t − π/2), z = 12s, θx = A sin 2π f_c t, θy = A + A cos 2π f_c t, θz = A/2 sin 2π f_c t | θy: 0.0436 for the first A |
//! | 2.5 ≤ s ≤ 3.5 | x = y = 2.5 − 2.5(s−2.5), z = 30 − 30(s−2.5) | |
//!
//! The corrected paths are continuous except for 0.364 nm in y of case 1 at s = 5: the phase 1.918666 is the errata's,
//! the continuous one would be 1.918744. Their *slopes* jump, as the paper's do. 0.0436 means π/72 and is used as that:
//! as printed, θy would jump by −33 nrad.
//!
//! At a joint a piece begins (also where the print of machining ends the one before). Before the start and after the
//! end the platform rests.

use core::f64::consts::{FRAC_PI_2, PI, TAU};

use super::jet::Jet;
use super::{PoseTarget, PoseTrajectory};

/// Which path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PaperPath {
    /// Moving along x, y and z without rotation.
    Case1,
    /// Moving along z and turning about x and y.
    Case2,
    /// The spiral over a work part, and back.
    Machining,
}

/// Corrected or printed form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reading {
    /// Continuous, as in the errata.
    Corrected,
    /// With the jumps of the print.
    AsPrinted,
}

/// One of the paper's platform trajectories.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperPose {
    /// Path.
    pub path: PaperPath,
    /// Form.
    pub reading: Reading,
    /// f_c, Hz; the paper's are 0.1, 1 and 10.
    pub frequency: f64,
}

/// A = π/72, mrad.
const AMPLITUDE: f64 = PI / 72.0;
/// The same as printed by the paper as an offset.
const PRINTED_OFFSET: f64 = 0.0436;
/// Time shift of y in case 1, in s.
const SHIFT: f64 = 1.918_666;
/// Relative slack with which a sample counts as one at a joint, because time is a rounded product.
const SLACK: f64 = 1e-9;
/// µm and mrad.
const UNITS: [f64; 6] = [1e-6, 1e-6, 1e-6, 1e-3, 1e-3, 1e-3];

impl PaperPose {
    /// A path in its corrected form, at f_c (Hz).
    pub fn corrected(path: PaperPath, frequency: f64) -> Self {
        Self { path, reading: Reading::Corrected, frequency }
    }

    /// The paper's time factor t_f.
    fn time_factor(&self) -> f64 {
        match (self.path, self.reading) {
            (PaperPath::Machining, Reading::Corrected) => self.frequency,
            _ => 10.0 * self.frequency,
        }
    }

    /// Scaled times s at which pieces end.
    fn ends(&self) -> &'static [f64] {
        match self.path {
            PaperPath::Case1 | PaperPath::Case2 => &[5.0, 25.0],
            PaperPath::Machining => &[0.5, 2.5, 3.5],
        }
    }

    /// Coordinates in µm and mrad of one piece, extended to all times.
    fn piece(&self, piece: usize, time: f64) -> [Jet; 6] {
        let t = Jet::time(time);
        let s = t * self.time_factor();
        let phase = t * (TAU * self.frequency);
        let printed = self.reading == Reading::AsPrinted;
        match self.path {
            PaperPath::Case1 => self.case_1(piece, t, s, phase),
            PaperPath::Case2 => {
                // The print has 8/7 without tf.
                let first = if printed { t * (8.0 / 7.0) } else { s * 1.6 };
                case_2(piece, first, s, phase, self.offset())
            }
            PaperPath::Machining => machining(piece, s, phase, self.offset(), printed),
        }
    }

    fn offset(&self) -> f64 {
        match self.reading {
            Reading::Corrected => AMPLITUDE,
            Reading::AsPrinted => PRINTED_OFFSET,
        }
    }

    fn case_1(&self, piece: usize, t: Jet, s: Jet, phase: Jet) -> [Jet; 6] {
        let rest = Jet::constant(0.0);
        if piece == 0 {
            return [s * 0.5, s * 0.5, s * 1.6, rest, rest, rest];
        }
        let radius = s * 0.4 + 5.0;
        let (y_phase, z) = match self.reading {
            Reading::Corrected => ((t - SHIFT / self.time_factor()) * (TAU * self.frequency) - FRAC_PI_2, s),
            Reading::AsPrinted => ((t - SHIFT) * (TAU * self.frequency) + FRAC_PI_2, t),
        };
        let x = radius * (phase - FRAC_PI_2).sin() - 4.5;
        [x, radius * y_phase.sin(), (z - 5.0) * 1.6 + 8.0, rest, rest, rest]
    }

    /// Piece at `time`, none at rest before or after.
    fn piece_at(&self, time: f64) -> Option<usize> {
        let s = time * self.time_factor();
        let piece = self.ends().iter().position(|end| s < end * (1.0 - SLACK))?;
        (s >= 0.0).then_some(piece)
    }

    fn target_of(&self, piece: usize, time: f64) -> PoseTarget {
        let jets = self.piece(piece, time);
        let of = |part: fn(Jet) -> f64| core::array::from_fn(|axis| part(jets[axis]) * UNITS[axis]);
        PoseTarget { pose: of(|j| j.value), rate: of(|j| j.rate), acceleration: of(|j| j.acceleration) }
    }
}

fn case_2(piece: usize, first: Jet, s: Jet, phase: Jet, offset: f64) -> [Jet; 6] {
    let rest = Jet::constant(0.0);
    if piece == 0 {
        return [rest, rest, first, rest, rest, rest];
    }
    let z = (s - 5.0) * (8.0 / 7.0) + 8.0;
    [rest, rest, z, phase.sin() * AMPLITUDE, phase.cos() * AMPLITUDE + offset, rest]
}

fn machining(piece: usize, s: Jet, phase: Jet, offset: f64, printed: bool) -> [Jet; 6] {
    let rest = Jet::constant(0.0);
    let radius = s * 1.6 + 5.0;
    let home = (s - 2.5) * -2.5 + 2.5;
    let mut target = match piece {
        0 => [s * 5.0, s * 5.0, s * 12.0, rest, rest, rest],
        1 => [
            radius * (phase.cos() + 1.0) * 0.5 + 2.5,
            radius * (phase - FRAC_PI_2).cos() + 2.5,
            s * 12.0,
            phase.sin() * AMPLITUDE,
            phase.cos() * AMPLITUDE + offset,
            phase.sin() * (AMPLITUDE / 2.0),
        ],
        _ => [home, home, (s - 2.5) * -30.0 + 30.0, rest, rest, rest],
    };
    if printed {
        target[0] = rest;
    }
    target
}

impl PoseTrajectory for PaperPose {
    fn duration(&self) -> f64 {
        self.ends().last().copied().unwrap_or_default() / self.time_factor()
    }

    fn target(&self, time: f64) -> PoseTarget {
        match self.piece_at(time) {
            Some(piece) => self.target_of(piece, time),
            None if time < 0.0 => PoseTarget { pose: self.target_of(0, 0.0).pose, ..PoseTarget::default() },
            None => {
                let last = self.ends().len() - 1;
                PoseTarget { pose: self.target_of(last, self.duration()).pose, ..PoseTarget::default() }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A smaller pose difference at a joint is rounding, not a jump: 1 pm, 1 prad.
    const ROUNDING: f64 = 1e-12;

    /// Where a trajectory is not smooth.
    #[derive(Debug, Clone, Copy, PartialEq)]
    struct Jump {
        /// s from the start.
        time: f64,
        /// 0 to 5: x, y, z, θx, θy, θz.
        axis: usize,
        /// Pose after less pose before, m or rad.
        pose: f64,
        /// Rate after less rate before, m/s or rad/s.
        rate: f64,
    }

    impl PaperPose {
        /// Every jump of pose or slope, in the order of time and axis, including start and end, where the slope jumps from
        /// and to rest.
        fn jumps(&self) -> Vec<Jump> {
            let ends = self.ends();
            let mut jumps = Vec::new();
            for joint in 0..=ends.len() {
                let time = if joint == 0 { 0.0 } else { ends[joint - 1] / self.time_factor() };
                let before = joint.checked_sub(1).map(|piece| self.target_of(piece, time));
                let after = if joint < ends.len() {
                    self.target_of(joint, time)
                } else {
                    PoseTarget { pose: before.unwrap_or_default().pose, ..PoseTarget::default() }
                };
                let before = before.unwrap_or_default();
                for axis in 0..6 {
                    let (pose, rate) = (after.pose[axis] - before.pose[axis], after.rate[axis] - before.rate[axis]);
                    if pose.abs() > ROUNDING || rate.abs() > ROUNDING * self.time_factor() {
                        jumps.push(Jump { time, axis, pose, rate });
                    }
                }
            }
            jumps
        }
    }

    const PATHS: [PaperPath; 3] = [PaperPath::Case1, PaperPath::Case2, PaperPath::Machining];
    const FREQUENCIES: [f64; 3] = [0.1, 1.0, 10.0];

    fn paper(path: PaperPath, reading: Reading, frequency: f64) -> PaperPose {
        PaperPose { path, reading, frequency }
    }

    #[test]
    fn the_time_spans_are_the_papers() {
        for (path, span) in PATHS.into_iter().zip([2.5, 2.5, 3.5]) {
            for frequency in FREQUENCIES {
                let duration = paper(path, Reading::Corrected, frequency).duration();
                assert!((duration * frequency - span).abs() < 1e-12, "{path:?} {frequency}: {duration}");
            }
        }
    }

    #[test]
    fn the_corrected_paths_are_continuous_but_for_the_rounded_phase_of_case_1() {
        for path in PATHS {
            for frequency in FREQUENCIES {
                for jump in paper(path, Reading::Corrected, frequency).jumps() {
                    if path == PaperPath::Case1 && jump.axis == 1 && jump.pose != 0.0 {
                        assert!((jump.pose - 0.364e-9).abs() < 1e-12, "{jump:?}");
                        assert!((jump.time * frequency - 0.5).abs() < 1e-12, "{jump:?}");
                    } else {
                        assert!(jump.pose.abs() < ROUNDING, "{path:?}: {jump:?}");
                    }
                }
            }
        }
    }

    /// Apart from the pieces: no step between neighbouring samples is more than the fastest slope allows.
    #[test]
    fn sampled_corrected_paths_move_no_faster_than_their_rates() {
        for path in PATHS {
            let trajectory = paper(path, Reading::Corrected, 1.0);
            let step = 1e-5;
            let samples = (trajectory.duration() / step) as u32 + 2;
            let mut last = trajectory.target(0.0);
            for k in 1..=samples {
                let next = trajectory.target(f64::from(k) * step);
                for axis in 0..6 {
                    let fastest = f64::max(last.rate[axis].abs(), next.rate[axis].abs());
                    let moved = (next.pose[axis] - last.pose[axis]).abs();
                    assert!(moved <= fastest * step * 1.001 + 0.4e-9, "{path:?} axis {axis} tick {k}: {moved:e}");
                }
                last = next;
            }
        }
    }

    fn jump_of(trajectory: &PaperPose, axis: usize, scaled: f64) -> Jump {
        let time = scaled / trajectory.time_factor();
        let found = trajectory.jumps().into_iter().find(|j| j.axis == axis && (j.time - time).abs() < 1e-9);
        found.unwrap_or_else(|| panic!("no jump of axis {axis} at {time} s: {:?}", trajectory.jumps()))
    }

    #[test]
    fn the_printed_paths_jump_where_the_errata_says() {
        let um = |value: f64, jump: Jump| assert!((jump.pose * 1e6 - value).abs() < 1e-3, "{value}: {jump:?}");
        // Case 1 at 0.1 Hz: y from +2.5 to −2.5; z's missing tf shows at the other frequencies only.
        let case_1 = paper(PaperPath::Case1, Reading::AsPrinted, 0.1);
        um(-5.000_364, jump_of(&case_1, 1, 5.0));
        um(0.8 - 8.0, jump_of(&paper(PaperPath::Case1, Reading::AsPrinted, 1.0), 2, 5.0));
        // Case 2 at 0.1 Hz: z from 5.714 to 8, and 0.0436 is not π/72.
        let case_2 = paper(PaperPath::Case2, Reading::AsPrinted, 0.1);
        um(8.0 - 40.0 / 7.0, jump_of(&case_2, 2, 5.0));
        assert!((jump_of(&case_2, 4, 5.0).pose * 1e9 + 33.2).abs() < 0.1, "{:?}", jump_of(&case_2, 4, 5.0));
        // Machining with the printed time factor: y and the angles start somewhere in their turn.
        let machining = paper(PaperPath::Machining, Reading::AsPrinted, 1.0);
        assert!((machining.duration() - 0.35).abs() < 1e-12);
        um(5.8 * libm::sin(0.1 * PI), jump_of(&machining, 1, 0.5));
        assert!(jump_of(&machining, 3, 0.5).pose > 10e-6);
    }

    /// From the formulas: 9·2π − 2.5, 12 + 30 µm/s and 2π A at f_c = 1 Hz.
    #[test]
    fn the_corrected_machining_path_changes_slope_as_its_formulas_say() {
        let machining = paper(PaperPath::Machining, Reading::Corrected, 1.0);
        for (axis, expected) in [(1, (9.0 * TAU - 2.5) * 1e-6), (2, 42e-6), (3, TAU * AMPLITUDE * 1e-3)] {
            let worst = machining.jumps().iter().filter(|j| j.axis == axis).fold(0.0, |w: f64, j| w.max(j.rate.abs()));
            assert!((worst - expected).abs() < 1e-12, "axis {axis}: {worst:e}");
        }
    }

    #[test]
    fn rate_and_acceleration_are_the_derivatives_of_the_pose() {
        for path in PATHS {
            for reading in [Reading::Corrected, Reading::AsPrinted] {
                let trajectory = paper(path, reading, 1.0);
                let joints: Vec<f64> = trajectory.jumps().iter().map(|j| j.time).collect();
                let h = 1e-5;
                for k in 1..2000 {
                    let time = trajectory.duration() * f64::from(k) / 2000.0;
                    if joints.iter().any(|joint| (joint - time).abs() < 2.0 * h) {
                        continue;
                    }
                    let [before, here, after] = [time - h, time, time + h].map(|t| trajectory.target(t));
                    for axis in 0..6 {
                        let rate = (after.pose[axis] - before.pose[axis]) / (2.0 * h);
                        let acceleration = (after.rate[axis] - before.rate[axis]) / (2.0 * h);
                        assert!((here.rate[axis] - rate).abs() < 1e-10, "{path:?} {axis} {time}");
                        assert!((here.acceleration[axis] - acceleration).abs() < 1e-9, "{path:?} {axis} {time}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_sample_at_a_joint_belongs_to_the_piece_that_begins() {
        let machining = paper(PaperPath::Machining, Reading::Corrected, 1.0);
        // 0.1 + 0.4 in ticks of 100 µs, each a rounded product.
        let at = machining.target(5000.0 * 100e-6);
        assert!((at.rate[2] - 12e-6).abs() < 1e-15 && at.rate[3] < -1e-6, "{at:?}");
        let end = machining.target(35_000.0 * 100e-6);
        assert_eq!(end.rate, [0.0; 6]);
        assert!(end.pose.iter().all(|p| p.abs() < 1e-18), "{end:?}");
    }
}
