//! A smooth motion unlike any case of the paper: controllers are tuned on it, so that the cases can score them.

use core::f64::consts::{PI, TAU};

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::{LegTrajectory, PoseTarget, PoseTrajectory};
use crate::noise::unit;

/// Frequencies relative to the highest. No two have a ratio of small whole numbers, so that nothing repeats within a
/// run.
const RATIOS: [f64; 5] = [0.083, 0.217, 0.393, 0.641, 1.0];
/// Part of the run over which the motion fades in.
const FADE: f64 = 0.1;
/// Stream of the phases.
const PHASES: u64 = 3 << 32;

/// Six coordinates, each a sum of five sines with individual phases, faded in from rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Multisine {
    duration: f64,
    /// Mean of each coordinate after the fade, in its unit.
    center: [f64; 6],
    /// Angular frequency (rad/s), amplitude and phase of each sine.
    sines: [[[f64; 3]; 5]; 6],
    /// Whether the fastest is a zigzag.
    corners: bool,
}

impl Multisine {
    /// `duration` in s. The fastest sine has `frequency` (Hz). Each coordinate stays within `center` ± `reach` (m or
    /// rad) after the fade. Amplitudes fall with frequency; phases come from `seed`.
    pub fn new(duration: f64, frequency: f64, center: [f64; 6], reach: [f64; 6], seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(PHASES);
        // Shares of 1, 1/2 … for the slowest would be a drift: half to the slow ones, half to the fast ones.
        let shares = [0.3, 0.2, 0.15, 0.15, 0.2];
        let sines = reach.map(|reach| {
            core::array::from_fn(|k| [TAU * frequency * RATIOS[k], reach * shares[k], TAU * unit(&mut rng)])
        });
        Self { duration, center, sines, corners: false }
    }

    /// The same with a zigzag in place of the fastest sine, with the same frequency and half of the total amplitude:
    /// its slope jumps, as in the paper's platform trajectories.
    #[must_use]
    pub fn with_corners(mut self) -> Self {
        for sines in &mut self.sines {
            let whole: f64 = sines.iter().map(|[_, amplitude, _]| amplitude).sum();
            let [.., fastest] = sines;
            let others = whole - fastest[1];
            fastest[1] = 0.5 * whole;
            for [_, amplitude, _] in &mut sines[..4] {
                *amplitude *= 0.5 * whole / others;
            }
        }
        self.corners = true;
        self
    }

    /// Value, rate and acceleration of a coordinate.
    fn coordinate(&self, axis: usize, time: f64) -> [f64; 3] {
        let mut sum = [self.center[axis], 0.0, 0.0];
        for (k, [speed, amplitude, phase]) in self.sines[axis].into_iter().enumerate() {
            if self.corners && k == 4 {
                let turns = (speed * time + phase) / TAU;
                let turn = turns - libm::floor(turns);
                let slope = if turn < 0.5 { 4.0 } else { -4.0 };
                sum[0] += amplitude * if turn < 0.5 { 4.0 * turn - 1.0 } else { 3.0 - 4.0 * turn };
                sum[1] += amplitude * slope * speed / TAU;
                continue;
            }
            let (sin, cos) = libm::sincos(speed * time + phase);
            sum[0] += amplitude * sin;
            sum[1] += amplitude * speed * cos;
            sum[2] -= amplitude * speed * speed * sin;
        }
        let fade = FADE * self.duration;
        if time >= fade {
            return sum;
        }
        // s − sin(2πs)/2π: at rest and not accelerated at both ends.
        let s = time / fade;
        let (sin, cos) = libm::sincos(TAU * s);
        let w = [s - sin / TAU, (1.0 - cos) / fade, 2.0 * PI * sin / (fade * fade)];
        [w[0] * sum[0], w[1] * sum[0] + w[0] * sum[1], w[2] * sum[0] + 2.0 * w[1] * sum[1] + w[0] * sum[2]]
    }
}

impl PoseTrajectory for Multisine {
    fn duration(&self) -> f64 {
        self.duration
    }

    fn target(&self, time: f64) -> PoseTarget {
        let mut target = PoseTarget::default();
        for axis in 0..6 {
            [target.pose[axis], target.rate[axis], target.acceleration[axis]] = self.coordinate(axis, time);
        }
        target
    }
}

impl LegTrajectory for Multisine {
    fn duration(&self) -> f64 {
        self.duration
    }

    fn displacements(&self, time: f64) -> [f64; 6] {
        core::array::from_fn(|leg| self.coordinate(leg, time)[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Multisine {
        let center = [0.0, 1e-6, 5e-6, 0.0, 0.0, 1e-5];
        Multisine::new(2.0, 10.0, center, [1e-5, 1e-5, 1e-5, 3e-5, 3e-5, 3e-5], 4)
    }

    #[test]
    fn it_starts_at_rest_stays_in_reach_and_its_derivatives_are_its_own() {
        let motion = sample();
        assert_eq!(motion.target(0.0), PoseTarget::default());
        let h = 1e-6;
        for k in 1..4000 {
            let time = f64::from(k) * 5e-4 - 1.3e-4;
            let [before, here, after] = [time - h, time, time + h].map(|t| motion.target(t));
            for axis in 0..6 {
                let (center, reach) = (motion.center[axis], motion.sines[axis].iter().map(|s| s[1]).sum::<f64>());
                assert!(here.pose[axis] <= center + reach && here.pose[axis] >= (center - reach).min(-reach));
                let rate = (after.pose[axis] - before.pose[axis]) / (2.0 * h);
                let acceleration = (after.rate[axis] - before.rate[axis]) / (2.0 * h);
                assert!((here.rate[axis] - rate).abs() < 1e-4 * reach * 100.0, "{axis} {time}");
                assert!((here.acceleration[axis] - acceleration).abs() < 1e-4 * reach * 1e4, "{axis} {time}");
            }
        }
    }

    #[test]
    fn a_zigzag_keeps_the_reach_and_its_slope_jumps_but_not_its_place() {
        let (smooth, motion) = (sample(), sample().with_corners());
        let whole = |motion: &Multisine| motion.sines[0].iter().map(|s| s[1]).sum::<f64>();
        assert!((whole(&motion) / whole(&smooth) - 1.0).abs() < 1e-12);
        let (mut last, mut jumps) = (motion.target(0.3), 0);
        for k in 1..17_000 {
            let next = motion.target(0.3 + f64::from(k) * 1e-4);
            assert!((next.pose[0] - last.pose[0]).abs() < 1.01e-4 * last.rate[0].abs().max(next.rate[0].abs()) + 1e-12);
            // 2 × 4 × 5 µm × 10 Hz.
            jumps += i32::from((next.rate[0] - last.rate[0]).abs() > 350e-6);
            last = next;
        }
        assert!((33..=35).contains(&jumps), "{jumps}");
    }

    #[test]
    fn another_seed_is_another_motion_and_the_same_seed_the_same() {
        let motion = |seed| Multisine::new(2.0, 10.0, [0.0; 6], [1e-5; 6], seed);
        assert_eq!(motion(1), motion(1));
        assert_ne!(motion(1), motion(2));
    }
}
