//! Deviation of one machine from nominal.

use host_sim::closed_loop::LEGS;
use host_sim::plant::LegParameters;
use host_sim::platform::Specimen;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde::{Deserialize, Serialize};

use super::factors::{Factor, Factors};
use crate::machine::{self, StructureRange, StructureShares};
use specgen_language::model::{Model, TaskSpace};
use specgen_numerics::unit_interval as unit;

/// Separates its random numbers from those of noise and tolerances.
const STREAM: u64 = 21;
/// With more damping a structure no longer rings, and the leg plant accepts no ratio of 1.
const MOST_DAMPING: f64 = 0.99;

/// Factors of one leg.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LegDeviation {
    /// Of its axial stiffness.
    pub stiffness: f64,
    /// Of its gain.
    pub gain: f64,
    /// Of the thresholds of its play operators.
    pub hysteresis: f64,
    /// Of its creep.
    pub creep: f64,
    /// Of the lag of its amplifier.
    pub lag: f64,
    /// Of the lag of its gauge; the gauges of a platform have that of the first leg.
    pub gauge_lag: f64,
}

/// Factors of one machine.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Deviation {
    /// Of mass and inertia.
    pub mass: f64,
    /// Of the damping ratio.
    pub damping: f64,
    /// Of all noise.
    pub noise: f64,
    /// Delay of the voltages in control intervals.
    pub delay_ticks: u32,
    /// Of each leg.
    pub legs: [LegDeviation; LEGS],
    /// Structure of a random platform; none: a rigid platform on six ideal legs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub structure: Option<StructureShares>,
}

impl Deviation {
    /// Six equal legs, with the value of each factor from `of`.
    pub fn common(of: impl Fn(Factor) -> f64) -> Self {
        let leg = LegDeviation {
            stiffness: of(Factor::Stiffness),
            gain: of(Factor::Gain),
            hysteresis: of(Factor::Hysteresis),
            creep: of(Factor::Creep),
            lag: of(Factor::Lag),
            gauge_lag: of(Factor::GaugeLag),
        };
        Self {
            mass: of(Factor::Mass),
            damping: of(Factor::Damping),
            noise: of(Factor::Noise),
            // The range check ensures an integer from 0 to 100.
            delay_ticks: of(Factor::DelayTicks) as u32,
            legs: [leg; LEGS],
            // Only random machines have one.
            structure: None,
        }
    }

    /// Uniformly distributed within the ranges, from `seed` only; every leg separately.
    pub fn drawn(factors: &Factors, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(STREAM);
        let mut within = |factor: Factor| {
            let [low, high] = factors.range(factor);
            low + (high - low) * unit(&mut rng)
        };
        let (mass, damping, noise) = (within(Factor::Mass), within(Factor::Damping), within(Factor::Noise));
        let mut legs: [LegDeviation; LEGS] = std::array::from_fn(|_| LegDeviation {
            stiffness: within(Factor::Stiffness),
            gain: within(Factor::Gain),
            hysteresis: within(Factor::Hysteresis),
            creep: within(Factor::Creep),
            lag: within(Factor::Lag),
            gauge_lag: Factor::GaugeLag.nominal(),
        });
        let [low, high] = factors.range(Factor::DelayTicks);
        let delay_ticks = (low + libm::floor(unit(&mut rng) * (high - low + 1.0))) as u32;
        // Drawn last, so that the machine of a seed did not change when this factor was added.
        let [low, high] = factors.range(Factor::GaugeLag);
        for leg in &mut legs {
            leg.gauge_lag = low + (high - low) * unit(&mut rng);
        }
        // After everything else, for the same reason.
        let structure = (factors.range(Factor::Structure)[1] > 0.0).then(|| StructureShares {
            mode: std::array::from_fn(|_| unit(&mut rng)),
            joints: unit(&mut rng),
            mains: std::array::from_fn(|_| unit(&mut rng)),
            drift: std::array::from_fn(|_| unit(&mut rng)),
            cable: std::array::from_fn(|_| unit(&mut rng)),
            jitter: unit(&mut rng),
        });
        Self { mass, damping, noise, delay_ticks, legs, structure }
    }

    /// Six legs with their own gauges. Mass and stiffness act through the resonance.
    pub fn legs_of(&self, leg: &LegParameters) -> [LegParameters; LEGS] {
        self.legs.map(|deviation| {
            let mut own = self.leg_of(leg, &deviation);
            own.fn_hz *= libm::sqrt(deviation.stiffness / self.mass);
            own.zeta = damped(own.zeta, self.damping);
            own
        })
    }

    /// The platform of a spec with this deviation; `leg` gives the shape of the hysteresis.
    pub fn specimen(&self, model: &Model, task: &TaskSpace, leg: &LegParameters) -> Specimen {
        let mut specimen = machine::specimen(model, task, leg, None);
        let structure = self.structure.map(|shares| (shares, StructureRange::of(model, &specimen)));
        for ((leg, stiffness), deviation) in specimen.legs.iter_mut().zip(&mut specimen.stiffness).zip(&self.legs) {
            *leg = self.leg_of(leg, deviation);
            *stiffness *= deviation.stiffness;
        }
        let nominal = &mut specimen.nominal;
        nominal.platform_mass_kg *= self.mass;
        nominal.platform_inertia_kg_m2.as_flattened_mut().iter_mut().for_each(|moment| *moment *= self.mass);
        nominal.modal_damping = damped(nominal.modal_damping, self.damping);
        nominal.force_noise.iter_mut().for_each(|noise| *noise *= self.noise);
        if let Some((shares, range)) = structure {
            shares.add_to(&mut nominal.imperfections, &range);
        }
        specimen
    }

    fn leg_of(&self, leg: &LegParameters, deviation: &LegDeviation) -> LegParameters {
        let mut own = leg.clone();
        own.gain_um_per_v *= deviation.gain;
        own.widen(deviation.hysteresis);
        own.creep_weights.iter_mut().for_each(|weight| *weight *= deviation.creep);
        own.tau_amp_s *= deviation.lag;
        own.gauge_lag_s *= deviation.gauge_lag;
        own.noise.sensor_nm_rms *= self.noise;
        own.noise.amplifier_mv_rms *= self.noise;
        own
    }
}

fn damped(ratio: f64, factor: f64) -> f64 {
    let ratio = ratio * factor;
    if ratio < MOST_DAMPING { ratio } else { MOST_DAMPING }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amplifier_and_gauge_have_separate_lags() {
        let leg = LegParameters { gauge_lag_s: 15e-6, ..LegParameters::reference() };
        for (factor, expected) in [(Factor::Lag, [1.5, 1.0]), (Factor::GaugeLag, [1.0, 1.5])] {
            let longer = Deviation::common(|one| if one == factor { 1.5 } else { one.nominal() }).legs_of(&leg);
            for own in longer {
                let found = [own.tau_amp_s / leg.tau_amp_s, own.gauge_lag_s / 15e-6];
                assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{factor}: {found:?}");
            }
        }
    }
}
