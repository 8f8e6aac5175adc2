//! Set-points over time.

mod jet;
mod multisine;
mod paper;
mod step;

pub use multisine::Multisine;
pub use paper::{PaperPath, PaperPose, Reading};
pub use step::Step;

/// A motion of the six legs from time 0.
pub trait LegTrajectory {
    /// Length in s.
    fn duration(&self) -> f64;

    /// Length of the whole path, s.
    fn whole(&self) -> f64 {
        self.duration()
    }

    /// Leg displacements in m at `time` (s, 0 to the duration).
    fn displacements(&self, time: f64) -> [f64; 6];
}

/// A motion of the platform from time 0.
pub trait PoseTrajectory {
    /// Length in s.
    fn duration(&self) -> f64;

    /// Length of the whole path, s.
    fn whole(&self) -> f64 {
        self.duration()
    }

    /// Pose with its derivatives at `time` (s, 0 to the duration).
    ///
    /// Poses are user poses: a rig adds them to the bias pose of the controller.
    fn target(&self, time: f64) -> PoseTarget;
}

/// Set-point of the platform with its derivatives.
///
/// Coordinates h = [x, y, z, θx, θy, θz]: P_C from its rest place in the base frame (m), and the angles of
/// R = Rz Ry Rx (rad).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PoseTarget {
    /// h, m and rad.
    pub pose: [f64; 6],
    /// ḣ, m/s and rad/s: rates of the six numbers, not angular velocity.
    pub rate: [f64; 6],
    /// ḧ, m/s² and rad/s².
    pub acceleration: [f64; 6],
}

/// The leg trajectory of the paper's §3, the same on all six legs, as printed:
///
/// ```text
/// q(t) = 1.95 t tf                          0 ≤ t ≤ 2/tf
/// q(t) = 24 + 20 sin(2π fc t − 8π/9)        2/tf < t ≤ 22/tf        µm, tf = 10 fc / Hz
/// ```
/// At t = 2/tf it jumps from 3.9 to 4.0122 µm (+112.2 nm) and its slope falls from 1.95 tf to 0.4386 tf µm/s;
/// kept, as Table 2 was measured with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperLeg {
    /// fc in Hz.
    pub frequency: f64,
}

impl PaperLeg {
    /// Scaled time t·tf at which the sine begins.
    const RAMP_END: f64 = 2.0;
    /// Scaled time t·tf of the end: two periods after the ramp.
    const END: f64 = 22.0;
    /// Relative slack with which a sample at the jump counts as the ramp's last, because t is a rounded product.
    const SLACK: f64 = 1e-9;
    /// Mean and amplitude of the sine, µm.
    const CENTER: f64 = 24.0;
    const AMPLITUDE: f64 = 20.0;

    fn scaled(&self, time: f64) -> f64 {
        time * (10.0 * self.frequency)
    }

    /// Displacement in m at `time` (s).
    pub fn displacement(&self, time: f64) -> f64 {
        let scaled = self.scaled(time);
        let um = if scaled <= Self::RAMP_END * (1.0 + Self::SLACK) {
            1.95 * scaled
        } else {
            let phase = core::f64::consts::TAU * self.frequency * time - 8.0 * core::f64::consts::PI / 9.0;
            Self::CENTER + Self::AMPLITUDE * libm::sin(phase)
        };
        um * 1e-6
    }
}

impl LegTrajectory for PaperLeg {
    fn duration(&self) -> f64 {
        Self::END / (10.0 * self.frequency)
    }

    fn displacements(&self, time: f64) -> [f64; 6] {
        [self.displacement(time); 6]
    }
}

/// Six legs from the lower to the upper end of a range and back, without a corner; they begin and end at the lower end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegSweep {
    /// Lowest and highest displacement, m.
    pub range: [f64; 2],
    /// Hz.
    pub frequency: f64,
    /// How often.
    pub periods: f64,
}

impl LegTrajectory for LegSweep {
    fn duration(&self) -> f64 {
        self.periods / self.frequency
    }

    fn displacements(&self, time: f64) -> [f64; 6] {
        let [low, high] = self.range;
        let phase = core::f64::consts::TAU * self.frequency * time;
        [low + (high - low) * 0.5 * (1.0 - libm::cos(phase)); 6]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_jumps_by_112_nm_at_the_end_of_the_ramp_and_ends_where_the_sine_began() {
        for frequency in [0.1, 1.0, 10.0] {
            let leg = PaperLeg { frequency };
            let switch = 0.2 / frequency;
            let before = leg.displacement(switch);
            let after = leg.displacement(switch * (1.0 + 1e-8));
            assert!((before - 3.9e-6).abs() < 1e-15, "{before}");
            assert!(((after - before) - 112.2e-9).abs() < 0.1e-9, "{}", after - before);
            assert!((leg.displacement(leg.duration()) - after).abs() < 1e-11);
        }
    }

    #[test]
    fn the_sample_at_the_jump_belongs_to_the_ramp_at_every_rate() {
        for frequency in [0.1, 1.0, 10.0, 20.0, 40.0, 50.0] {
            let leg = PaperLeg { frequency };
            let period = 1.0 / frequency / 500.0;
            assert!(leg.displacement(100.0 * period) < 3.91e-6);
            assert!(leg.displacement(101.0 * period) > 4.01e-6);
        }
    }

    #[test]
    fn a_sweep_goes_over_its_range_and_comes_back() {
        let sweep = LegSweep { range: [5e-6, 45e-6], frequency: 2.0, periods: 3.0 };
        let at = |time: f64| sweep.displacements(time)[5] * 1e6;
        assert_eq!((sweep.duration(), at(0.0)), (1.5, 5.0));
        assert!((at(0.25) - 45.0).abs() < 1e-9 && (at(0.125) - 25.0).abs() < 1e-9 && (at(1.5) - 5.0).abs() < 1e-9);
    }

    #[test]
    fn it_stays_within_4_and_44_um_after_the_ramp() {
        let leg = PaperLeg { frequency: 1.0 };
        let values: Vec<f64> = (101..=1100).map(|n| leg.displacement(f64::from(n) * 2e-3)).collect();
        assert!(values.iter().all(|q| (3.99e-6..44.01e-6).contains(q)));
        assert!(values.iter().any(|q| *q > 43.99e-6));
    }
}
