//! Measures T of a running machine: passes of a motion with a sweep as correction, and the response of the gauges.
//!
//! ```text
//! c_k = ± V a H_k s(t)        s: sine of rising frequency, the same time per octave;  H_k: row k of a conference matrix, H Hᵀ = 5 I
//! y_k = T c_k + y₀ + noise    y₀: error of the motion itself, the same in every pass
//! T = Σ y_k c_kᴴ (Σ c_k c_kᴴ)⁻¹       over twelve passes and bins of 2.5 Hz or 2 %;  the residual of y_k gives its standard error
//! ```
//! Each sweep is played with both signs, so y₀ and even-order terms of c cancel. The loop is closed and the machine moves as it does when
//! learning, so T includes hysteresis, delay and stiffness as they are. H1 estimator for several inputs: Bendat and Piersol, Random Data, 7.4.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use specgen_numerics::fft::{self, Complex64};
use specgen_numerics::nyquist::{Complex, plus, times};
use specgen_runtime::playback::Knot;

use super::convergence::{Learnable, spacing};
use super::learner::{ONSET, correction_by_tick};
use super::machine::{LearnError, RepeatableMachine, require_followed, require_unlimited};
use super::motion::Motion;
use super::response::{Bin, Response};
use super::table::knots;
use super::update::kept;
use specgen_numerics::complex6::{Matrix6c, inverse, mapped, multiply};

/// A conference matrix: orthogonal rows of signs with one zero each.
const CONFERENCE: [[i8; 6]; 6] = [
    [0, 1, 1, 1, 1, 1],
    [1, 0, 1, -1, -1, 1],
    [1, 1, 0, 1, -1, -1],
    [1, -1, 1, 0, 1, -1],
    [1, -1, -1, 1, 0, 1],
    [1, 1, -1, -1, 1, 0],
];
/// Number of measured passes.
pub const PASSES: usize = 2 * CONFERENCE.len();
/// Highest frequency of the sweep over that to be learned, and its limit as a share of the table rate.
const BEYOND: f64 = 1.6;
const RATE: f64 = 0.4;
/// Amplitude at the joints over the noise of a gauge, and its limit as a share of the limit of a correction.
const OVER_NOISE: f64 = 50.0;
const WITHIN: f64 = 0.5;
/// Where the loop passes little, the sweep is larger: twice as large at the first frequency, Hz, and in inverse proportion down to the second.
const SLOW: [f64; 2] = [100.0, 10.0];
/// Frequency above which the sweep is limited by the rate of a correction and falls in inverse proportion, Hz.
const FAST: f64 = 1280.0;
/// Fade-in and fade-out time of a sweep, s.
const FADE: f64 = 5e-3;
/// Width of a bin, Hz, and its minimum relative to the frequency: half of the narrowest resonance that feedback leaves on usual platforms.
const WIDTH: [f64; 2] = [2.5, 0.02];
/// The same for modes of a structure.
const NARROW: [f64; 2] = [2.5, 0.005];
/// Significant digits in a file.
const DIGITS: usize = 5;

/// Twelve corrections to be played during passes of a motion.
pub struct Excitation {
    passes: Vec<Vec<Knot>>,
    /// Lowest and highest frequency, Hz.
    pub band: [f64; 2],
    /// Largest value along an axis, with angles at the joints, m.
    pub amplitude: f64,
    /// Ticks between knots.
    pub spacing: u32,
}

impl Excitation {
    /// For learning up to a frequency (Hz), within the `limit` of a correction; `noise` is that of a gauge, rms. Both in m.
    pub fn new(learnable: &Learnable, motion: &Motion, bandwidth: f64, [limit, noise]: [f64; 2]) -> Self {
        let period = learnable.closed_loop.period;
        let spacing = spacing(bandwidth, period);
        let time = motion.scored.end as f64 * period;
        let [requested, fastest] = [BEYOND * bandwidth, RATE / (f64::from(spacing) * period)];
        let band = [1.0 / time, if requested < fastest { requested } else { fastest }];
        // Its rate is largest at its end, or at FAST; its size at the beginning.
        let steepest = if band[1] < FAST { band[1] } else { FAST };
        let rate = limit / (TAU * (steepest + SLOW[0]) * ONSET);
        let size = limit / relative_amplitude(0.0);
        let bearable = WITHIN * if size < rate { size } else { rate };
        let wanted = OVER_NOISE * noise;
        let amplitude = if wanted > 0.0 && wanted < bearable { wanted } else { bearable };
        // Equal amplitudes of the modes at the joints, and their sum on the axis with the largest.
        let from_modal = &learnable.closed_loop.basis.from_modal;
        let at_joints =
            |axis: usize, mode: usize| from_modal[axis][mode].abs() * if axis < 3 { 1.0 } else { motion.radius };
        let largest = |values: &mut dyn Iterator<Item = f64>| {
            values.fold(0.0, |most, value| if value > most { value } else { most })
        };
        let modes: [f64; 6] = std::array::from_fn(|mode| 1.0 / largest(&mut (0..6).map(|axis| at_joints(axis, mode))));
        let sum = largest(&mut (0..6).map(|axis| (0..6).map(|mode| modes[mode] * at_joints(axis, mode)).sum()));
        let sweep = sweep(motion.scored.end, motion.corrected, period, band);
        let mut passes = Vec::with_capacity(PASSES);
        for row in CONFERENCE {
            for sign in [1.0, -1.0] {
                let modal: [f64; 6] =
                    std::array::from_fn(|mode| sign * f64::from(row[mode]) * modes[mode] * amplitude / sum);
                let pose = mapped(from_modal, &modal);
                let signal: Vec<[f64; 6]> = sweep.iter().map(|value| pose.map(|axis| axis * value)).collect();
                passes.push(knots(&signal, spacing));
            }
        }
        Self { passes, band, amplitude, spacing }
    }

    /// Runs the passes, after one that is discarded. `watch` is called before each pass and may stop.
    ///
    /// # Errors
    /// If the machine fails to make a pass, limits restrict the excitation, or it was stopped.
    pub fn measure(
        &self,
        machine: &mut dyn RepeatableMachine,
        learnable: &Learnable,
        motion: &Motion,
        mut watch: impl FnMut(usize) -> ControlFlow<()>,
    ) -> Result<SweepSpectra, LearnError> {
        let period = learnable.closed_loop.period;
        let to_modal = &learnable.closed_loop.basis.to_modal;
        let length = (2 * motion.corrected).next_power_of_two();
        let transform = fft::forward(length);
        let spectra = |signal: &mut dyn Iterator<Item = [f64; 6]>| -> [Vec<Complex64>; 6] {
            let modal: Vec<[f64; 6]> = signal.map(|pose| mapped(to_modal, &pose)).collect();
            std::array::from_fn(|mode| {
                let mut values: Vec<Complex64> = modal.iter().map(|value| Complex64::new(value[mode], 0.0)).collect();
                values.resize(length, Complex64::default());
                transform.process(&mut values);
                values
            })
        };
        require_followed(machine.pass(motion, &[], self.spacing)?)?;
        let mut pairs = Vec::with_capacity(PASSES);
        for (number, knots) in self.passes.iter().enumerate() {
            if watch(number).is_break() {
                return Err(LearnError::PassEnded);
            }
            let seen = require_unlimited(require_followed(machine.pass(motion, knots, self.spacing)?)?)?;
            let correction = correction_by_tick(knots, motion, self.spacing).into_iter();
            let shown = seen.measured[..motion.corrected].iter().map(|error| error.map(|axis| -axis));
            pairs.push([spectra(&mut { correction }), spectra(&mut { shown })]);
        }
        // Zero padding correlates neighbouring lines.
        let tied = length as f64 / motion.corrected as f64;
        Ok(SweepSpectra {
            pairs,
            line: 1.0 / (length as f64 * period),
            tied,
            band: self.band,
            held: f64::from(self.spacing) * period,
        })
    }
}

/// Spectra of the corrections and the gauges of each pass.
pub struct SweepSpectra {
    pairs: Vec<[[Vec<Complex64>; 6]; 2]>,
    /// Spacing of the lines, Hz.
    line: f64,
    /// Number of lines per independent one.
    tied: f64,
    /// Lowest and highest frequency, Hz.
    band: [f64; 2],
    /// Time from knot to knot, s.
    held: f64,
}

impl SweepSpectra {
    /// T with its standard error, for learning; `names` are the digest of the spec and the machine.
    pub fn response(&self, names: [&str; 2]) -> Response {
        Response::new(names, self.bins(WIDTH))
    }

    /// The same in bins as narrow as lightly damped modes of a structure.
    pub fn narrow(&self) -> Vec<Bin> {
        self.bins(NARROW)
    }

    fn bins(&self, least: [f64; 2]) -> Vec<Bin> {
        let hertz = |bin: usize| bin as f64 * self.line;
        let [first, end] = self.band.map(|edge| libm::ceil(edge / self.line) as usize);
        let width = |low: usize| {
            let [least, part] = [least[0], least[1] * hertz(low)].map(|width| libm::floor(width / hertz(1)));
            let width = if part > least { part } else { least };
            if width > 1.0 { width as usize } else { 1 }
        };
        let mut bins = Vec::new();
        let mut low = first;
        while low < end {
            let above = low + width(low);
            let group = low..if above < end { above } else { end };
            low = group.end;
            let middle = 0.5 * (hertz(group.start) + hertz(group.end - 1));
            let (response, error) = regression(&self.pairs, group, self.tied);
            let scale = 1.0 / kept(middle * self.held);
            bins.push(Bin {
                hertz: rounded(middle),
                response: response.map(|row| row.map(|value| value.map(|part| rounded(scale * part)))),
                error: error.map(|row| row.map(|value| rounded(scale * value))),
            });
        }
        bins
    }
}

/// Relative amplitude of the sweep at a frequency, Hz.
fn relative_amplitude(hertz: f64) -> f64 {
    let fast = if hertz > FAST { FAST / hertz } else { 1.0 };
    fast * (1.0 + SLOW[0] / if hertz > SLOW[1] { hertz } else { SLOW[1] })
}

/// A sine whose frequency rises exponentially from the lower end of a band (Hz) to the upper in the given ticks; 0 afterwards.
fn sweep(ticks: usize, all: usize, period: f64, [low, high]: [f64; 2]) -> Vec<f64> {
    let time = ticks as f64 * period;
    let growth = libm::log(high / low) / time;
    let fade = |inward: f64| if inward < FADE { 0.5 - 0.5 * libm::cos(0.5 * TAU * inward / FADE) } else { 1.0 };
    (0..all)
        .map(|tick| {
            let t = tick as f64 * period;
            if tick >= ticks {
                return 0.0;
            }
            let hertz = low * libm::exp(growth * t);
            relative_amplitude(hertz)
                * fade(t)
                * fade(time - t)
                * libm::sin(TAU * low / growth * libm::expm1(growth * t))
        })
        .collect()
}

/// T and its standard errors for a group of lines, over passes of (input, output) spectra; one of `tied` lines is independent.
fn regression(
    pairs: &[[[Vec<Complex64>; 6]; 2]],
    group: std::ops::Range<usize>,
    tied: f64,
) -> (Matrix6c, [[f64; 6]; 6]) {
    let at = |signal: &[Vec<Complex64>; 6], bin: usize| -> [Complex; 6] {
        std::array::from_fn(|mode| [signal[mode][bin].re, signal[mode][bin].im])
    };
    let conjugate = |value: Complex| [value[0], -value[1]];
    let mut given_given = [[[0.0; 2]; 6]; 6];
    let mut shown_given = [[[0.0; 2]; 6]; 6];
    for bin in group.clone() {
        for [given, shown] in pairs {
            let (given, shown) = (at(given, bin), at(shown, bin));
            for i in 0..6 {
                for j in 0..6 {
                    given_given[i][j] = plus(given_given[i][j], times(given[i], conjugate(given[j])));
                    shown_given[i][j] = plus(shown_given[i][j], times(shown[i], conjugate(given[j])));
                }
            }
        }
    }
    let inverse = inverse(&given_given);
    let response = multiply(&shown_given, &inverse);
    let mut left = [0.0; 6];
    for bin in group.clone() {
        // The mean over all passes is the response to the motion itself.
        let mut mean = [[0.0; 2]; 6];
        for [_, shown] in pairs {
            for (mean, value) in mean.iter_mut().zip(at(shown, bin)) {
                *mean = plus(*mean, value.map(|part| part / pairs.len() as f64));
            }
        }
        for [given, shown] in pairs {
            let (given, shown) = (at(given, bin), at(shown, bin));
            for (mode, left) in left.iter_mut().enumerate() {
                let row = response[mode].iter().zip(&given);
                let expected = row.fold(mean[mode], |sum, (factor, value)| plus(sum, times(*factor, *value)));
                let off = [shown[mode][0] - expected[0], shown[mode][1] - expected[1]];
                *left += off[0] * off[0] + off[1] * off[1];
            }
        }
    }
    // Degrees of freedom: one mean per bin and one response per group are removed.
    let free = (group.len() * (pairs.len() - 1)) as f64 - 6.0;
    let error = std::array::from_fn(|i| std::array::from_fn(|j| libm::sqrt(tied * left[i] / free * inverse[j][j][0])));
    (response, error)
}

/// Rounds to the digits of a file.
fn rounded(value: f64) -> f64 {
    format!("{value:.DIGITS$e}").parse().unwrap_or(value)
}
