//! One machine out of its tolerances: six different legs on a platform.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::linear::Six;
use super::parameters::PlatformParameters;
use super::structure::StructureParameters;
use crate::noise::unit;
use crate::plant::LegParameters;

/// Relative tolerance of each parameter of a leg.
const LEG_TOLERANCE: f64 = 0.1;

/// Relative tolerance of the axial stiffness of a leg.
const STIFFNESS_TOLERANCE: f64 = 0.05;

/// Stream of random numbers, apart from those of gauges, amplifiers and sensors.
const TOLERANCE_STREAM: u64 = 1 << 32;

/// A machine: its nominal data, and the actual legs.
#[derive(Debug, Clone, PartialEq)]
pub struct Specimen {
    /// Values of a spec for this machine: `axial_stiffness_n_per_m` and `modal_damping` are its nominal values.
    pub nominal: PlatformParameters,
    /// The legs.
    pub legs: [LegParameters; 6],
    /// Axial stiffness of each leg, N/m.
    pub stiffness: Six,
}

impl Specimen {
    /// Six equal legs, no tolerances.
    pub fn ideal(nominal: &PlatformParameters, leg: &LegParameters) -> Self {
        Self {
            nominal: nominal.clone(),
            legs: std::array::from_fn(|_| leg.clone()),
            stiffness: [nominal.axial_stiffness_n_per_m; 6],
        }
    }

    /// Gain, asymmetry, width of hysteresis, creep and amplifier lag of every leg within ±10 %, independently; its
    /// stiffness within ±5 %.
    pub fn within_tolerances(nominal: &PlatformParameters, leg: &LegParameters, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(TOLERANCE_STREAM);
        let mut factor = |tolerance: f64| 1.0 + tolerance * (2.0 * unit(&mut rng) - 1.0);
        let legs = std::array::from_fn(|_| {
            let mut own = leg.clone();
            own.gain_um_per_v *= factor(LEG_TOLERANCE);
            own.s2 *= factor(LEG_TOLERANCE);
            own.tau_amp_s *= factor(LEG_TOLERANCE);
            let (thresholds, creep) = (factor(LEG_TOLERANCE), factor(LEG_TOLERANCE));
            own.widen(thresholds);
            own.creep_weights.iter_mut().for_each(|w| *w *= creep);
            own
        });
        let stiffness = std::array::from_fn(|_| nominal.axial_stiffness_n_per_m * factor(STIFFNESS_TOLERANCE));
        Self { nominal: nominal.clone(), legs, stiffness }
    }

    /// The reference machine: the shipped parameter files, tolerances of seed 1.
    pub fn reference() -> Self {
        Self::within_tolerances(&PlatformParameters::reference(), &LegParameters::reference(), 1)
    }

    /// Its structure: c_i = β k_i with β = 2ζ/ω_1 of the nominal platform.
    pub fn structure(&self) -> StructureParameters {
        let mut parameters = StructureParameters {
            geometry: self.nominal.geometry(),
            masses: self.nominal.masses(),
            stiffness: [self.nominal.axial_stiffness_n_per_m; 6],
            damping: [0.0; 6],
            transverse: [0.0; 6],
        };
        let lowest = parameters.modes().0[0];
        parameters.stiffness = self.stiffness;
        parameters.damping = self.stiffness.map(|k| 2.0 * self.nominal.modal_damping / lowest * k);
        parameters.transverse = self.stiffness.map(|k| self.nominal.imperfections.joint_stiffness_share * k);
        parameters
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_are_kept_used_and_repeat() {
        let reference = LegParameters::reference();
        let specimen = Specimen::reference();
        assert_eq!(specimen, Specimen::reference());
        let gains = specimen.legs.each_ref().map(|leg| leg.gain_um_per_v / reference.gain_um_per_v - 1.0);
        assert!(gains.iter().all(|g| g.abs() <= 0.1) && gains.iter().any(|g| g.abs() > 0.05), "{gains:?}");
        assert!(specimen.stiffness.iter().all(|k| (k / 1e7 - 1.0).abs() <= 0.05));
        assert!(specimen.legs.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
