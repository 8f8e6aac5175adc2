//! Random numbers and machines for tests.

use host_sim::noise::unit;
use host_sim::plant::LegParameters;
use host_sim::platform::{PlatformParameters, Specimen};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Range of the nominal axial stiffness of random plants, relative to the parameter file's.
const STIFFNESS_RANGE: [f64; 2] = [0.7, 1.4];

/// Range of the damping ratio of the lowest mode of random plants.
const DAMPING_RANGE: [f64; 2] = [0.01, 0.05];

/// Stream of random numbers, apart from those of a machine.
const NOMINAL_STREAM: u64 = 2 << 32;

/// Random machine `number` of `seed`: nominal stiffness 0.7 to 1.4 times the reference platform's, damping ratio 1
/// to 5 %, and tolerances as usual.
pub fn machine(seed: u64, number: u32) -> Specimen {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(NOMINAL_STREAM + u64::from(number));
    let mut within = |[low, high]: [f64; 2]| low + (high - low) * unit(&mut rng);
    let mut nominal = PlatformParameters::reference();
    nominal.axial_stiffness_n_per_m *= within(STIFFNESS_RANGE);
    nominal.modal_damping = within(DAMPING_RANGE);
    nominal.name = format!("random-{seed}-{number}");
    // Far from the seeds in common use.
    let tolerances = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(u64::from(number));
    Specimen::within_tolerances(&nominal, &LegParameters::reference(), tolerances)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_machines_fill_their_ranges() {
        let machines: Vec<Specimen> = (0..50).map(|n| machine(7, n)).collect();
        let ks: Vec<f64> = machines.iter().map(|m| m.nominal.axial_stiffness_n_per_m).collect();
        let zetas: Vec<f64> = machines.iter().map(|m| m.nominal.modal_damping).collect();
        assert!(ks.iter().all(|k| (0.7e7..=1.4e7).contains(k)) && zetas.iter().all(|z| (0.01..=0.05).contains(z)));
        assert!(ks.iter().any(|k| *k < 0.8e7) && ks.iter().any(|k| *k > 1.3e7));
        assert!(zetas.iter().any(|z| *z < 0.015) && zetas.iter().any(|z| *z > 0.045));
        assert_eq!(machines[3], machine(7, 3));
        assert_ne!(machines[3].legs, machines[4].legs);
        assert_ne!(machines[3], machine(8, 3));
    }
}
