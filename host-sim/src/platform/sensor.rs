//! Force/torque sensor between platform and work part.

use super::contact::Wrench;
use super::linear::Six;
use crate::noise::Gaussian;

/// First noise stream of the sensor; those below belong to gauges and amplifiers.
const FIRST_STREAM: u64 = 12;

/// Reads the wrench of the part on the platform, in base axes at P_C.
#[derive(Debug, Clone)]
pub struct ForceSensor {
    noise: [Gaussian; 6],
    range: Six,
}

impl ForceSensor {
    /// `noise` is N and N m rms per reading, `range` the largest reading of each component, N and N m.
    pub fn new(noise: &Six, range: &Six, seed: u64) -> Self {
        Self { noise: std::array::from_fn(|k| Gaussian::new(noise[k], seed, FIRST_STREAM + k as u64)), range: *range }
    }

    /// See [`Gaussian::draw_ahead`].
    pub fn draw_ahead(&mut self, count: usize) {
        self.noise.iter_mut().for_each(|noise| noise.draw_ahead(count));
    }

    /// Reading of `wrench`: force, torque; limited to the range.
    pub fn read(&mut self, wrench: &Wrench) -> Six {
        let truth = wrench.numbers();
        std::array::from_fn(|k| {
            let reading = truth[k] + self.noise[k].draw();
            reading.clamp(-self.range[k], self.range[k])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_is_the_wrench_on_the_platform_and_ends_at_the_range() {
        let mut sensor = ForceSensor::new(&[0.0; 6], &[300.0, 300.0, 2000.0, 15.0, 15.0, 10.0], 1);
        let wrench = Wrench { force: [-24.0, 400.0, -3000.0], torque: [0.5, -20.0, 9.0] };
        assert_eq!(sensor.read(&wrench), [-24.0, 300.0, -2000.0, 0.5, -15.0, 9.0]);
    }

    #[test]
    fn components_have_their_own_noise_and_seeds_repeat() {
        let readings = |seed| {
            let mut sensor = ForceSensor::new(&[0.02, 0.02, 0.05, 1e-3, 1e-3, 1e-3], &[1e3; 6], seed);
            (0..4).map(|_| sensor.read(&Wrench::default())).collect::<Vec<_>>()
        };
        assert_eq!(readings(1), readings(1));
        assert_ne!(readings(1), readings(2));
        assert!(readings(1)[0][0] != readings(1)[0][1]);
    }
}
