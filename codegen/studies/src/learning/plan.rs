//! What a device learns with by itself: the impulse responses of Q and Q T⁻¹ between knots, and the proof that they converge.

use std::f64::consts::TAU;

use specgen_numerics::Matrix6;
use specgen_numerics::fft::{self, Complex64};
use specgen_numerics::nyquist::{Complex, times};
use specgen_runtime::learning::{HEAD, Learning, Settings, plan_rows};
use specgen_runtime::playback::Knot;

use super::convergence::{Convergence, LARGEST_RADIUS, Learnable};
use super::matrix::{Matrix6c, spectral_radius};
use super::motion::Motion;
use super::update::FADE;
use crate::factors::Factors;

/// Knots to both sides at most: what reaches further is what the feedback does.
const REACH: usize = 512;
/// Part of the reach from which on the responses fade out.
const WHOLE: f64 = 0.7;
/// Frequencies of the design in two reaches.
const FINE: usize = 8;
/// f_c of the next trial where one does not converge, and the least that is tried, Hz.
const LOWER: f64 = 0.93;
const LEAST: f64 = 100.0;
/// Frequencies at which the proof looks, evenly from 0 on, besides those about the modes.
const EVEN: u32 = 200;

/// A plan, and what is known of it.
#[derive(Debug, Clone)]
pub struct Plan {
    /// How the device learns with it.
    pub settings: Settings,
    /// Its rows, behind the knots of a pass.
    pub rows: Vec<Knot>,
    /// What it does on every machine: band, and the largest bound of the spectral radius of Q − Q T⁻¹ T_real.
    pub convergence: Convergence,
    /// Ticks from knot to knot.
    pub spacing: u32,
}

/// What the design is for.
struct Grid {
    period: f64,
    spacing: u32,
    reach: usize,
}

/// Responses of a plan in the time of knots.
struct Taps {
    /// h_m of each mode, from −M on.
    learned: Vec<[f64; 6]>,
    /// q_m, from 0 on.
    kept: Vec<f64>,
}

impl Plan {
    /// For passes of a motion on a device that has room for `capacity` knots of corrections and as many of errors; the highest f_c up to that of
    /// `convergence`, and that fits. None if it converges at none on every machine within `factors`.
    #[must_use]
    pub fn new(
        learnable: &Learnable,
        motion: &Motion,
        convergence: &Convergence,
        factors: &Factors,
        capacity: usize,
    ) -> Option<Self> {
        let period = learnable.closed_loop.period;
        let machines = learnable.machines(factors);
        let mut wish = convergence.clone();
        while wish.band[1] >= LEAST {
            let spacing = wish.spacing(period);
            let knots = motion.corrected.div_ceil(spacing as usize);
            if let Some(reach) = reach(knots, capacity) {
                let grid = Grid { period, spacing, reach };
                let taps = grid.taps(learnable, &wish);
                let frequencies = looked_at(learnable, &wish, grid.apart());
                let [mut radius, mut at] = [0.0_f64; 2];
                for (closed_loop, conditions) in &machines {
                    let real = learnable.response(closed_loop, conditions, &frequencies);
                    for (real, hertz) in real.iter().zip(&frequencies) {
                        let found = spectral_radius(&grid.left(&taps, real, *hertz));
                        // A NaN is no convergence, and stays.
                        [radius, at] = if radius.is_nan() || found <= radius { [radius, at] } else { [found, *hertz] };
                    }
                }
                if radius <= LARGEST_RADIUS {
                    let convergence = Convergence { radius, at, ..wish };
                    return Some(grid.plan(&taps, learnable, convergence));
                }
            }
            wish.band[1] *= LOWER;
        }
        None
    }

    /// The correction that a device makes of the one that it played and the errors that it kept, by its own kernel. None if it would refuse.
    #[must_use]
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

/// How far the responses may reach; none if there is no room for the knots.
fn reach(knots: usize, capacity: usize) -> Option<usize> {
    let fits = |reach: usize| knots + plan_rows(reach) <= capacity;
    let others = knots + knots.div_ceil(6) <= capacity;
    let most = if knots < REACH { knots } else { REACH };
    (1..=most).rev().find(|reach| others && fits(*reach))
}

/// Frequencies of the proof, Hz: up to half the rate of knots, beyond which they play and see images of lower ones.
fn looked_at(learnable: &Learnable, wish: &Convergence, apart: f64) -> Vec<f64> {
    let highest = 0.5 / apart;
    let mut all: Vec<f64> = learnable.grid(wish.band[1]).into_iter().filter(|hertz| *hertz < highest).collect();
    all.extend((1..=EVEN).map(|k| highest * f64::from(k) / f64::from(EVEN)));
    all
}

impl Grid {
    /// Time from knot to knot, s.
    fn apart(&self) -> f64 {
        f64::from(self.spacing) * self.period
    }

    /// Of a frequency (Hz), what a device sees and plays of it: the mean of an error over the ticks of a knot, in whose middle it stands, and a spline
    /// through knots.
    fn shown(&self, hertz: f64) -> Complex {
        let angle = 0.5 * TAU * hertz * self.period;
        let ticks = f64::from(self.spacing);
        let below = ticks * libm::sin(angle);
        let mean = if below == 0.0 { 1.0 } else { libm::sin(ticks * angle) / below };
        let spline = (2.0 + libm::cos(TAU * hertz * self.apart())) / 3.0;
        let turn = (ticks - 1.0) * angle;
        [mean * spline * libm::cos(turn), mean * spline * libm::sin(turn)]
    }

    fn taps(&self, learnable: &Learnable, wish: &Convergence) -> Taps {
        let length = (2 * FINE * self.reach).next_power_of_two();
        let hertz: Vec<f64> = (1..=length / 2).map(|bin| bin as f64 / (length as f64 * self.apart())).collect();
        let responses = learnable.nominal(&hertz);
        let mut spectra = vec![vec![Complex64::default(); length]; 7];
        for (bin, (response, hertz)) in (1..).zip(responses.iter().zip(&hertz)) {
            let passed = wish.passed(*hertz);
            let mut put = |channel: usize, value: Complex64| {
                spectra[channel][bin] = value;
                spectra[channel][length - bin] = value.conj();
            };
            let shown = self.shown(*hertz);
            for (mode, row) in response.iter().enumerate() {
                let [re, im] = times(row[mode], shown);
                put(mode, passed * wish.share(*hertz) / Complex64::new(re, im));
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

    /// Q − Q T⁻¹ T_real at a frequency (Hz): what is left of an error after a pass.
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
        let shown = self.shown(hertz);
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
        // Sums are of f32; what a plan holds is rounded once.
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
