//! Signal path between leg and controller: gauge noise and quantisation, amplifier noise.
//!
//! The drive converter belongs to the controller: its voltages are already exact codes.

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::plant::NoiseParameters;

/// Seeded white Gaussian noise.
#[derive(Debug, Clone)]
pub struct Gaussian {
    rng: ChaCha8Rng,
    deviation: f64,
    /// The second number of a Box–Muller pair.
    spare: Option<f64>,
    /// Numbers drawn in advance, shared by clones, and how many of them are used.
    ahead: Arc<[f64]>,
    given: usize,
}

impl Gaussian {
    /// `deviation` in any unit (≥ 0); `stream` distinguishes generators of one seed.
    pub fn new(deviation: f64, seed: u64, stream: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        Self { rng, deviation, spare: None, ahead: Arc::from([]), given: 0 }
    }

    /// Draws the next `count` numbers now, so that later clones share them: runs with the same noise pay for it once.
    /// The numbers are those that [`Gaussian::draw`] would return.
    pub fn draw_ahead(&mut self, count: usize) {
        if self.deviation != 0.0 {
            let numbers = (0..count).map(|_| self.draw()).collect();
            self.ahead = numbers;
            self.given = 0;
        }
    }

    /// The next number. Draws nothing when the deviation is 0.
    ///
    /// Box–Muller with `libm` instead of a library's sampler: those call the platform's `log`, whose last bit differs
    /// between hosts, and a trace must be reproducible on any host.
    pub fn draw(&mut self) -> f64 {
        if self.deviation == 0.0 {
            return 0.0;
        }
        if let Some(number) = self.ahead.get(self.given) {
            self.given += 1;
            return *number;
        }
        if let Some(spare) = self.spare.take() {
            return self.deviation * spare;
        }
        // 1 − [0, 1) is never 0.
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - unit(&mut self.rng)));
        let (sin, cos) = libm::sincos(core::f64::consts::TAU * unit(&mut self.rng));
        self.spare = Some(radius * sin);
        self.deviation * radius * cos
    }
}

/// Uniform in [0, 1) with 53 bits.
pub fn unit(rng: &mut impl Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

/// Displacement gauge of one leg: zero, noise, converter.
#[derive(Debug, Clone)]
pub struct Gauge {
    noise: Gaussian,
    lsb: f64,
    zero: f64,
}

impl Gauge {
    /// Gauge of leg `leg` (0 to 5); each leg has its own noise.
    pub fn new(noise: &NoiseParameters, seed: u64, leg: u64) -> Self {
        Self {
            noise: Gaussian::new(noise.sensor_nm_rms * 1e-9, seed, 2 * leg),
            lsb: noise.adc_lsb_nm * 1e-9,
            zero: 0.0,
        }
    }

    /// See [`Gaussian::draw_ahead`].
    pub fn draw_ahead(&mut self, count: usize) {
        self.noise.draw_ahead(count);
    }

    /// Makes `displacement` (m) read 0. Exact: zeroing averages many readings, so it adds no noise.
    pub fn zero_at(&mut self, displacement: f64) {
        self.zero = displacement;
    }

    /// `displacement` (m) from the zero, without noise and steps.
    pub fn from_zero(&self, displacement: f64) -> f64 {
        displacement - self.zero
    }

    /// Reading (m) of `displacement` (m).
    pub fn read(&mut self, displacement: f64) -> f64 {
        let analogue = self.from_zero(displacement) + self.noise.draw();
        if self.lsb > 0.0 { nearest(analogue / self.lsb) * self.lsb } else { analogue }
    }
}

/// The nearest whole number, halves away from 0: [`libm::round`], to the bit, in a third of its time.
fn nearest(x: f64) -> f64 {
    if x.abs() < (1_u64 << 51) as f64 {
        // The largest double below a half: added to a number just below a half, it does not reach one.
        let half = 0.499_999_999_999_999_94_f64.copysign(x);
        return ((x + half) as i64 as f64).copysign(x);
    }
    libm::round(x)
}

/// Noise of one leg's amplifier, V, drawn once per held voltage.
pub fn amplifier(noise: &NoiseParameters, seed: u64, leg: u64) -> Gaussian {
    Gaussian::new(noise.amplifier_mv_rms * 1e-3, seed, 2 * leg + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: NoiseParameters =
        NoiseParameters { sensor_nm_rms: 2.2, adc_lsb_nm: 0.76, dac_lsb_mv: 2.29, amplifier_mv_rms: 2.0 };

    #[test]
    fn the_noise_has_the_stated_deviation_and_no_mean() {
        let mut noise = Gaussian::new(2.0, 1, 0);
        let count = 100_000;
        let draws: Vec<f64> = (0..count).map(|_| noise.draw()).collect();
        let mean = draws.iter().sum::<f64>() / f64::from(count);
        let square = draws.iter().map(|x| x * x).sum::<f64>() / f64::from(count);
        let beyond = draws.iter().filter(|x| x.abs() > 4.0).count() as f64 / f64::from(count);
        assert!(mean.abs() < 0.02, "{mean}");
        assert!((square.sqrt() - 2.0).abs() < 0.02, "{square}");
        // 4.55 % of a normal distribution are beyond two deviations, none of a uniform one.
        assert!((beyond - 0.0455).abs() < 0.003, "{beyond}");
    }

    #[test]
    fn numbers_drawn_ahead_are_the_numbers_that_would_have_come() {
        let mut plain = Gaussian::new(2.0, 5, 1);
        let mut ahead = plain.clone();
        plain.draw();
        ahead.draw();
        ahead.draw_ahead(7);
        let mut clone = ahead.clone();
        for k in 0..20 {
            let expected = plain.draw().to_bits();
            assert_eq!(ahead.draw().to_bits(), expected, "{k}");
            assert_eq!(clone.draw().to_bits(), expected, "{k}");
            if k == 9 {
                ahead.draw_ahead(4);
            }
        }
    }

    #[test]
    fn a_seed_repeats_and_legs_differ() {
        let readings = |seed, leg| {
            let mut gauge = Gauge::new(&NOISE, seed, leg);
            (0..50).map(|_| gauge.read(1e-6).to_bits()).collect::<Vec<_>>()
        };
        assert_eq!(readings(7, 2), readings(7, 2));
        assert_ne!(readings(7, 2), readings(7, 3));
        assert_ne!(readings(7, 2), readings(8, 2));
    }

    #[test]
    fn the_nearest_whole_number_is_that_of_libm() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let halves = (-9..9).map(|n| f64::from(n) + 0.5);
        let beside = halves.flat_map(|half| [half, half.next_up(), half.next_down()]);
        let edges = [0.0, -0.0, 4.4e15, -2.3e15, 1e300, f64::INFINITY, f64::NAN];
        let spread = (0..10_000).map(|k| (unit(&mut rng) - 0.5) * libm::exp2(f64::from(k % 60)));
        for x in beside.chain(edges).chain(spread) {
            assert_eq!(nearest(x).to_bits(), libm::round(x).to_bits(), "{x:e}");
        }
    }

    #[test]
    fn a_gauge_reads_whole_codes_from_its_zero() {
        let mut gauge = Gauge::new(&NoiseParameters { sensor_nm_rms: 0.0, ..NOISE }, 1, 0);
        gauge.zero_at(5e-6);
        assert_eq!(gauge.read(5e-6), 0.0);
        assert!((gauge.read(5e-6 + 1.1e-9) - 0.76e-9).abs() < 1e-18);
        assert!((gauge.read(5e-6 - 1.2e-9) + 1.52e-9).abs() < 1e-18);
    }

    #[test]
    fn without_noise_a_gauge_is_exact() {
        let mut gauge = Gauge::new(&NoiseParameters::NONE, 1, 0);
        assert_eq!(gauge.read(1.234_567e-6), 1.234_567e-6);
        assert_eq!(amplifier(&NoiseParameters::NONE, 1, 0).draw(), 0.0);
    }
}
