//! The part of an error that repeats from pass to pass, in each mode and bin. Mains hum on a gauge, for example, has another phase in every
//! pass.
//!
//! ```text
//! N = |E − E'|²/2                              two passes under the same correction; mean of near bins, at least white noise
//! w = max(1 − 3 N/(n |E|²), I/(I + N/n))       share of E that is learned;  E: mean error of n passes
//! I ← (1 − w)² I + w² N/n                      power of the noise that was learned
//! ```
//! The first term learns what exceeds the noise. The second averages: it replaces noise that was learned before by the mean over the passes.

use specgen_numerics::complex6::larger;
use specgen_numerics::fft::Complex64;

/// Bins with power up to this multiple of the noise count as noise.
const NOISE: f64 = 3.0;
/// Bins to each side over which the noise is averaged: about the resolution of a pass, whose spectra have twice its length.
const NEAR: usize = 2;

/// Noise between passes.
#[derive(Debug, Clone)]
pub(super) struct Coherence {
    /// N, up to half the sampling rate.
    noise: [Vec<f64>; 6],
    /// I.
    learned: [Vec<f64>; 6],
}

impl Coherence {
    /// From the modal spectra of the errors of two passes under the same correction.
    pub(super) fn new([one, other]: &[[Vec<Complex64>; 6]; 2]) -> Self {
        let noise: [Vec<f64>; 6] = std::array::from_fn(|mode| {
            let half = one[mode].len() / 2;
            let power = |bin: usize| 0.5 * (one[mode][bin] - other[mode][bin]).norm_sqr();
            (0..=half)
                .map(|bin| {
                    let near = bin.saturating_sub(NEAR)..=half.min(bin + NEAR);
                    let count = near.clone().count() as f64;
                    near.map(power).sum::<f64>() / count
                })
                .collect()
        });
        Self { learned: noise.each_ref().map(|noise| vec![0.0; noise.len()]), noise }
    }

    /// Keeps of spectra what is to be learned; `white` is the power of white noise in each mode. Both are those of the mean of `count` passes.
    pub(super) fn keep(&mut self, missed: &mut [Vec<Complex64>; 6], white: [f64; 6], count: f64) {
        for (mode, spectrum) in missed.iter_mut().enumerate() {
            for ((value, noise), learned) in spectrum.iter_mut().zip(&self.noise[mode]).zip(&mut self.learned[mode]) {
                let noise = larger(noise / count, white[mode]);
                let repeated = share(value.norm_sqr(), noise);
                let mean = if *learned > 0.0 { *learned / (*learned + noise) } else { 0.0 };
                let share = larger(repeated, mean);
                let rest = 1.0 - share;
                *learned = rest * rest * *learned + share * share * noise;
                *value *= share;
            }
        }
    }

    /// The share of the error of one pass that exceeds the noise, in each mode and bin.
    pub(super) fn repeated(&self, missed: &[Vec<Complex64>; 6], white: [f64; 6]) -> [Vec<f64>; 6] {
        std::array::from_fn(|mode| {
            let pairs = missed[mode].iter().zip(&self.noise[mode]);
            pairs.map(|(value, noise)| share(value.norm_sqr(), larger(*noise, white[mode]))).collect()
        })
    }
}

/// Share of a bin that exceeds its noise.
fn share(power: f64, noise: f64) -> f64 {
    let noise = NOISE * noise;
    if power > noise { 1.0 - noise / power } else { 0.0 }
}
