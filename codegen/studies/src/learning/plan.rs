//! Learning plan of a device: the impulse responses of Q and Q T⁻¹ at the knots, and the proof that learning with them converges.

use std::f64::consts::TAU;

use specgen_numerics::Matrix6;
use specgen_numerics::fft::{self, Complex64};
use specgen_numerics::nyquist::{Complex, times};
use specgen_runtime::learning::{HEAD, Learning, Settings, plan_rows};
use specgen_runtime::playback::Knot;

use super::convergence::{Convergence, LARGEST_RADIUS, Learnable};
use super::motion::Motion;
use super::update::FADE;
use crate::factors::Factors;
use specgen_numerics::complex6::{Matrix6c, spectral_radius};

/// Longest response to each side, in knots: the feedback deals with anything slower.
const REACH: usize = 512;
/// Share of the reach after which the responses fade out.
const WHOLE: f64 = 0.7;
/// Frequencies of the design per two reaches.
const FINE: usize = 8;
/// Factor on f_c after a trial that does not converge, and the lowest f_c tried, Hz.
const LOWER: f64 = 0.93;
const LEAST: f64 = 100.0;
/// Number of evenly spaced frequencies in the proof, in addition to those around the modes.
const EVEN: u32 = 200;

/// A plan and its properties.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Learning settings of the device.
    pub settings: Settings,
    /// Rows of the plan, stored after the knots of a pass.
    pub rows: Vec<Knot>,
    /// Band, and largest bound of the spectral radius of Q − Q T⁻¹ T_real over the machines.
    pub convergence: Convergence,
    /// Ticks from knot to knot.
    pub spacing: u32,
}

/// Inputs of the design.
struct Grid {
    period: f64,
    spacing: u32,
    reach: usize,
}

/// Impulse responses of a plan, in knots.
struct Taps {
    /// h_m of each mode, starting at m = −M.
    learned: Vec<[f64; 6]>,
    /// q_m, starting at m = 0.
    kept: Vec<f64>,
}

impl Plan {
    /// A plan for passes of a motion on a device that can store `capacity` knots of corrections and as many of errors.
    /// Uses the highest f_c up to that of `convergence` that fits. `None` if learning converges at no frequency on every machine within
    /// `factors`.
    pub fn new(
        learnable: &Learnable,
        motion: &Motion,
        convergence: &Convergence,
        factors: &Factors,
        capacity: usize,
    ) -> Option<Self> {
        let period = learnable.closed_loop.period;
        let mut machines = learnable.machines(factors);
        machines.extend(learnable.with_a_mode(factors));
        let mut trial = convergence.clone();
        while trial.band[1] >= LEAST {
            let spacing = trial.spacing(period);
            let knots = motion.corrected.div_ceil(spacing as usize);
            if let Some(reach) = reach(knots, capacity) {
                let grid = Grid { period, spacing, reach };
                let taps = grid.taps(learnable, &trial);
                let frequencies = proof_frequencies(learnable, &trial, grid.apart());
                let [mut radius, mut at] = [0.0_f64; 2];
                for (closed_loop, conditions) in &machines {
                    let real = learnable.response(closed_loop, conditions, &frequencies);
                    for (real, hertz) in real.iter().zip(&frequencies) {
                        let found = spectral_radius(&grid.left(&taps, real, *hertz));
                        // NaN means no convergence, and is kept.
                        [radius, at] = if radius.is_nan() || found <= radius { [radius, at] } else { [found, *hertz] };
                    }
                }
                if radius <= LARGEST_RADIUS {
                    let convergence = Convergence { radius, at, ..trial };
                    return Some(grid.plan(&taps, learnable, convergence));
                }
            }
            trial.band[1] *= LOWER;
        }
        None
    }

    /// The device's next correction, computed by its own kernel from the one played and the recorded errors. `None` if it would refuse.
    pub fn next(&self, played: &[Knot], errors: &[Knot]) -> Option<Vec<Knot>> {
        let knots = errors.len();
        let mut table = played.to_vec();
        table.resize(knots, [0; 6]);
        table.extend(&self.rows);
        let mut kept = errors.to_vec();
        kept.resize(knots + knots.div_ceil(6), [0; 6]);
        let mut learning = Learning::new(self.settings, knots, &table, &kept)?;
        while learning.work(u32::MAX, &mut table, &mut kept) {}
        table.truncate(knots);
        Some(table)
    }
}

/// Longest possible response, in knots; `None` if the knots do not fit.
fn reach(knots: usize, capacity: usize) -> Option<usize> {
    let fits = |reach: usize| knots + plan_rows(reach) <= capacity;
    let others = knots + knots.div_ceil(6) <= capacity;
    let most = if knots < REACH { knots } else { REACH };
    (1..=most).rev().find(|reach| others && fits(*reach))
}

/// Frequencies of the proof, Hz: up to half the knot rate, above which only aliases are seen and played.
fn proof_frequencies(learnable: &Learnable, trial: &Convergence, apart: f64) -> Vec<f64> {
    let highest = 0.5 / apart;
    let mut all: Vec<f64> = learnable.grid(trial.band[1]).into_iter().filter(|hertz| *hertz < highest).collect();
    all.extend((1..=EVEN).map(|k| highest * f64::from(k) / f64::from(EVEN)));
    all
}

impl Grid {
    /// Time between knots, s.
    fn apart(&self) -> f64 {
        f64::from(self.spacing) * self.period
    }

    /// Response of the device itself at a frequency (Hz): it averages the error over the ticks around a knot, and plays a spline
    /// through knots.
    fn device_response(&self, hertz: f64) -> Complex {
        let angle = 0.5 * TAU * hertz * self.period;
        let ticks = f64::from(self.spacing);
        let below = ticks * libm::sin(angle);
        let mean = if below == 0.0 { 1.0 } else { libm::sin(ticks * angle) / below };
        let spline = (2.0 + libm::cos(TAU * hertz * self.apart())) / 3.0;
        let turn = (ticks - 1.0) * angle;
        [mean * spline * libm::cos(turn), mean * spline * libm::sin(turn)]
    }

    fn taps(&self, learnable: &Learnable, trial: &Convergence) -> Taps {
        let length = (2 * FINE * self.reach).next_power_of_two();
        let hertz: Vec<f64> = (1..=length / 2).map(|bin| bin as f64 / (length as f64 * self.apart())).collect();
        let responses = learnable.expected(&hertz, trial.delay);
        let mut spectra = vec![vec![Complex64::default(); length]; 7];
        for (bin, (response, hertz)) in (1..).zip(responses.iter().zip(&hertz)) {
            let passed = trial.passed(*hertz);
            let mut put = |channel: usize, value: Complex64| {
                spectra[channel][bin] = value;
                spectra[channel][length - bin] = value.conj();
            };
            let shown = self.device_response(*hertz);
            for (mode, row) in response.iter().enumerate() {
                let [re, im] = times(row[mode], shown);
                put(mode, passed * trial.share(*hertz) / Complex64::new(re, im));
            }
            put(6, Complex64::new(passed, 0.0));
        }
        let inverse = fft::inverse(length);
        for spectrum in &mut spectra {
            inverse.process(spectrum);
        }
        let tap = |channel: usize, knot: isize| {
            let at = knot.rem_euclid(length as isize) as usize;
            spectra[channel][at].re / length as f64 * self.window(knot)
        };
        let reach = self.reach as isize;
        Taps {
            learned: (-reach..=reach).map(|knot| std::array::from_fn(|mode| tap(mode, knot))).collect(),
            kept: (0..=reach).map(|knot| tap(6, knot)).collect(),
        }
    }

    /// 1 in the middle, 0 beyond the reach.
    fn window(&self, knot: isize) -> f64 {
        let far = knot.unsigned_abs() as f64 / (self.reach + 1) as f64;
        if far <= WHOLE { 1.0 } else { 0.5 + 0.5 * libm::cos(0.5 * TAU * (far - WHOLE) / (1.0 - WHOLE)) }
    }

    /// Q − Q T⁻¹ T_real at a frequency (Hz): the part of an error that remains after a pass.
    fn left(&self, taps: &Taps, real: &Matrix6c, hertz: f64) -> Matrix6c {
        let angle = TAU * hertz * self.apart();
        let [mut learned, mut kept] = [[[0.0; 2]; 6], [[taps.kept[0], 0.0]; 6]];
        for (number, row) in taps.learned.iter().enumerate() {
            let turn = angle * (number as f64 - self.reach as f64);
            let (sine, cosine) = (libm::sin(turn), libm::cos(turn));
            for (sum, tap) in learned.iter_mut().zip(row) {
                *sum = [sum[0] + tap * cosine, sum[1] - tap * sine];
            }
        }
        for (number, tap) in taps.kept.iter().enumerate().skip(1) {
            kept[0][0] += 2.0 * tap * libm::cos(angle * number as f64);
        }
        kept = [kept[0]; 6];
        let shown = self.device_response(hertz);
        std::array::from_fn(|i| {
            let part = times(learned[i], shown);
            std::array::from_fn(|j| {
                let taken = times(part, real[i][j]);
                let stays = if i == j { kept[i] } else { [0.0; 2] };
                [stays[0] - taken[0], stays[1] - taken[1]]
            })
        })
    }

    fn plan(&self, taps: &Taps, learnable: &Learnable, convergence: Convergence) -> Plan {
        let basis = &learnable.closed_loop.basis;
        let mut rows: Vec<[f64; 6]> = Vec::with_capacity(plan_rows(self.reach));
        let matrix = |matrix: &Matrix6| (*matrix).into_iter();
        rows.extend(matrix(&basis.to_modal).chain(matrix(&basis.from_modal)));
        debug_assert_eq!(rows.len(), HEAD);
        rows.extend(&taps.learned);
        rows.extend(taps.kept.chunks(6).map(|part| std::array::from_fn(|k| part.get(k).copied().unwrap_or(0.0))));
        // The device sums in f32, so the plan is rounded once, here.
        let rows = rows.iter().map(|row| row.map(|value| (value as f32).to_bits().cast_signed())).collect();
        let knot = |time: f64| libm::ceil(time / self.apart()) as u32;
        Plan {
            settings: Settings { reach: self.reach as u32, fade: FADE.map(knot) },
            rows,
            convergence,
            spacing: self.spacing,
        }
    }
}
