//! The update c ← Q (c + L e), by the Fourier transform of a whole pass.

use std::f64::consts::TAU;
use std::sync::Arc;

use specgen_numerics::fft::{self, Complex64, Fft};

use super::convergence::{Convergence, Learnable, highest, low_pass};
use super::matrix::{Matrix6c, inverse};
use super::motion::Motion;
use specgen_numerics::Matrix6;

/// Fade-in and fade-out time of a correction, s.
pub(super) const FADE: [f64; 2] = [5e-3, 20e-3];
/// Bins with power up to this multiple of the white-noise power count as noise.
const NOISE: f64 = 3.0;

/// Update of a correction between passes of one length.
pub struct Update {
    /// L and Q at the frequencies that Q passes.
    bins: Vec<(Matrix6c, f64)>,
    to_modal: Matrix6,
    from_modal: Matrix6,
    length: usize,
    fade: [usize; 2],
    /// Ticks of rest at the start of a pass.
    rest: usize,
    /// Ticks over which an error is averaged.
    spacing: usize,
    transforms: [Arc<dyn Fft<f64>>; 2],
}

impl Update {
    /// For passes of a motion with errors averaged over `spacing` ticks, which attenuates high frequencies.
    #[must_use]
    pub fn new(learnable: &Learnable, motion: &Motion, convergence: &Convergence, spacing: u32) -> Self {
        let width = f64::from(spacing) * learnable.closed_loop.period;
        Self::of(learnable, motion, convergence.band[1], spacing, |frequencies| {
            let responses = learnable.known(frequencies, convergence.edge);
            responses
                .iter()
                .zip(frequencies)
                .map(|(response, hertz)| {
                    let share = convergence.share(*hertz) / kept(hertz * width);
                    let part = match share {
                        // Where the response is unknown, it may have no inverse.
                        0.0 => [[[0.0; 2]; 6]; 6],
                        _ => inverse(response).map(|row| row.map(|value| value.map(|part| share * part))),
                    };
                    (part, convergence.passed(*hertz))
                })
                .collect()
        })
    }

    /// With L in modal coordinates and Q, at the frequencies (Hz) that Q of f_c passes.
    fn of(
        learnable: &Learnable,
        motion: &Motion,
        bandwidth: f64,
        spacing: u32,
        design: impl FnOnce(&[f64]) -> Vec<(Matrix6c, f64)>,
    ) -> Self {
        let period = learnable.closed_loop.period;
        // Twice the length, so that the end does not wrap around to the beginning.
        let length = (2 * motion.corrected).next_power_of_two();
        let hertz = |bin: usize| bin as f64 / (length as f64 * period);
        let bins = 1 + (highest(bandwidth, period) * length as f64 * period) as usize;
        // The constant term uses half of the lowest frequency.
        let frequencies: Vec<f64> = (0..bins).map(|bin| if bin == 0 { 0.5 * hertz(1) } else { hertz(bin) }).collect();
        Self {
            bins: design(&frequencies),
            to_modal: learnable.closed_loop.basis.to_modal,
            from_modal: learnable.closed_loop.basis.from_modal,
            length,
            fade: FADE.map(|time| libm::round(time / period) as usize),
            rest: motion.scored.start,
            spacing: spacing as usize,
            transforms: [fft::forward(length), fft::inverse(length)],
        }
    }

    /// A correction that compensates lag and modes by the model, before the first pass.
    ///
    /// ```text
    /// c = Q G⁻¹ (x_d − G r)        r = x_d + τ Δx_d/T_s + ẍ_d/ω², per mode: the request to the legs with lead and load
    /// ```
    /// G is the open-loop channel from the request to the gauges, and Q that of f_c (Hz), without phase.
    #[must_use]
    pub fn prepared(learnable: &Learnable, motion: &Motion, bandwidth: f64) -> Vec<[f64; 6]> {
        let closed_loop = &learnable.closed_loop;
        let update = Self::of(learnable, motion, bandwidth, 1, |frequencies| {
            let channel = learnable.open_loop(frequencies);
            channel
                .iter()
                .zip(frequencies)
                .map(|(response, hertz)| (inverse(response), low_pass(*hertz, bandwidth)))
                .collect()
        });
        let start = motion.targets[0].pose;
        let modal = |pose: &[f64; 6]| mapped(&update.to_modal, pose);
        let mut last = [0.0; 6];
        let mut wanted = Vec::with_capacity(motion.corrected);
        let requests: Vec<[f64; 6]> = motion.targets[..motion.corrected]
            .iter()
            .map(|target| {
                let place = modal(&std::array::from_fn(|axis| target.pose[axis] - start[axis]));
                let bend = modal(&target.acceleration);
                let lead = learnable.lead / closed_loop.period;
                let request = std::array::from_fn(|mode| {
                    let frequency = closed_loop.basis.frequencies[mode];
                    place[mode] + lead * (place[mode] - last[mode]) + bend[mode] / (frequency * frequency)
                });
                wanted.push(place);
                last = place;
                request
            })
            .collect();
        let shown = closed_loop.without_feedback(&requests);
        let error: Vec<[f64; 6]> = wanted
            .iter()
            .zip(&shown)
            .map(|(wanted, shown)| mapped(&update.from_modal, &std::array::from_fn(|mode| wanted[mode] - shown[mode])))
            .collect();
        update.next(&vec![[0.0; 6]; motion.corrected], &error)
    }

    /// The next correction, from the one played and the measured error, tick by tick, m and rad.
    #[must_use]
    pub fn next(&self, correction: &[[f64; 6]], error: &[[f64; 6]]) -> Vec<[f64; 6]> {
        let ticks = correction.len();
        let [played, mut missed] = [correction, error].map(|signal| self.spectra(signal));
        for (spectrum, variance) in missed.iter_mut().zip(self.noise(error)) {
            let noise = NOISE * variance * ticks as f64;
            for value in spectrum.iter_mut() {
                let power = value.norm_sqr();
                *value *= if power > noise { 1.0 - noise / power } else { 0.0 };
            }
        }
        let mut spectra = vec![vec![Complex64::default(); self.length]; 6];
        for (bin, (inverse, filter)) in self.bins.iter().enumerate() {
            for (mode, row) in inverse.iter().enumerate() {
                let learned: Complex64 =
                    row.iter().zip(&missed).map(|([re, im], missed)| Complex64::new(*re, *im) * missed[bin]).sum();
                let value = (played[mode][bin] + learned) * *filter;
                spectra[mode][bin] = value;
                if bin > 0 {
                    spectra[mode][self.length - bin] = value.conj();
                }
            }
        }
        for spectrum in &mut spectra {
            self.transforms[1].process(spectrum);
        }
        let scale = 1.0 / self.length as f64;
        (0..ticks)
            .map(|tick| {
                let share = self.share(tick, ticks) * scale;
                let modal: [f64; 6] = std::array::from_fn(|mode| spectra[mode][tick].re * share);
                mapped(&self.from_modal, &modal)
            })
            .collect()
    }

    /// Variance of white noise in each mode per tick, from the rest at the start of a pass: half of the mean square of the differences
    /// between averages there, times the ticks per average.
    fn noise(&self, error: &[[f64; 6]]) -> [f64; 6] {
        let rest: Vec<[f64; 6]> =
            error.iter().take(self.rest).step_by(self.spacing).map(|pose| mapped(&self.to_modal, pose)).collect();
        std::array::from_fn(|mode| {
            let sum: f64 = rest.windows(2).map(|pair| libm::pow(pair[1][mode] - pair[0][mode], 2.0)).sum();
            0.5 * sum * self.spacing as f64 / rest.len() as f64
        })
    }

    /// Modal spectra of a signal in pose coordinates.
    fn spectra(&self, signal: &[[f64; 6]]) -> [Vec<Complex64>; 6] {
        let modal: Vec<[f64; 6]> = signal.iter().map(|pose| mapped(&self.to_modal, pose)).collect();
        std::array::from_fn(|mode| {
            let mut values: Vec<Complex64> = modal.iter().map(|value| Complex64::new(value[mode], 0.0)).collect();
            values.resize(self.length, Complex64::default());
            self.transforms[0].process(&mut values);
            values
        })
    }

    /// The fade window: 0 at both ends, 1 between the fades.
    fn share(&self, tick: usize, ticks: usize) -> f64 {
        let part = |inward: usize, fade: usize| {
            if inward >= fade { 1.0 } else { 0.5 - 0.5 * libm::cos(0.5 * TAU * inward as f64 / fade as f64) }
        };
        part(tick, self.fade[0]) * part(ticks - 1 - tick, self.fade[1])
    }
}

/// Attenuation by averaging and holding over `cycles` periods: sinc², but at least one half, since little of higher frequencies
/// is passed.
pub(super) fn kept(cycles: f64) -> f64 {
    let angle = 0.5 * TAU * cycles;
    let part = if angle > 0.0 { libm::sin(angle) / angle } else { 1.0 };
    let square = part * part;
    if square > 0.5 { square } else { 0.5 }
}

pub(super) fn mapped(matrix: &Matrix6, vector: &[f64; 6]) -> [f64; 6] {
    matrix.map(|row| row.iter().zip(vector).map(|(factor, value)| factor * value).sum())
}
