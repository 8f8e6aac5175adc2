//! The stacks of six legs in parallel: the equations of [`Stack`], a lane each, in steps of a control interval.
//!
//! After an amplifier that holds its input, the voltage of a leg is monotonic over a step, and neither plays nor
//! Bouc-Wen hysteresis depend on the rate of a monotonic voltage. Their state at the end of a step is therefore exact
//! for any length. The creep uses the mean voltage of the step instead of the last one.
//!
//! The motion within a step drives a structure, not only its end. A play that starts to move within the step bends that
//! motion. If such bends were neglected, they would make the structure ring by some tenths of a nanometre. They are
//! represented by moments, see [`StepShape`].

use super::Stack;
use super::bouc_wen::BoucWen;

/// Lanes: six legs, and two idle ones, to fill vector registers.
pub(crate) const LANES: usize = 8;
/// A number of each leg.
pub(crate) type Lane = [f64; LANES];
/// Largest deviation of the thresholds from their rate-dependent width: 4 pm for a leg that moves 60 µm.
const WIDENING_TOLERANCE: f64 = 1e-6;
/// Number of lags in a step above which all moving plays start at once.
const AT_ONCE: f64 = 5.0;

/// A motion over a step of length 1, a lane per leg: its `end`, and its deviation from the shape of the amplifier's
/// lag, as a `mean` and as `skew`, the first moment about the middle of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StepShape {
    pub(crate) end: Lane,
    pub(crate) mean: Lane,
    pub(crate) skew: Lane,
}

/// Shape of plays that move only during the last part f of a motion, and so miss 1 − f: their mean is `mean[0]` (1 − f)
/// + `mean[1]` (1 − f²) times their displacement, and likewise the skew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LateShape {
    mean: [Lane; 2],
    skew: [Lane; 2],
}

impl LateShape {
    /// For amplifiers with this number of lags in a step.
    pub(crate) fn behind(lags: &[f64; 6]) -> Self {
        // With r lags in a step, the last fraction z of the voltage's change takes ln(1 + z (e^r − 1))/r of the step.
        // This is approximated by z + bend z (1 − z), exact at 0, 1/2 and 1. With very many lags the change is
        // immediate.
        let late = |r: f64| if r < AT_ONCE { 1.0 } else { 0.0 };
        let bend = |r: f64| if r < AT_ONCE { 4.0 * libm::log1p(0.5 * libm::expm1(r)) / r - 2.0 } else { 0.0 };
        Self {
            mean: [lane(|leg| -0.5 * (late(lags[leg]) + bend(lags[leg]))), lane(|leg| bend(lags[leg]) / 3.0)],
            skew: [lane(|leg| -0.25 * late(lags[leg])), lane(|leg| late(lags[leg]) / 6.0)],
        }
    }

    /// One leg moves linearly for this fraction of the step, and then rests.
    pub(crate) fn straight(&mut self, leg: usize, part: f64) {
        let square = part * part;
        self.mean[0][leg] = -0.5 * part;
        self.mean[1][leg] = 0.0;
        self.skew[0][leg] = 0.25 * part - 0.5 * square;
        self.skew[1][leg] = square * (1.0 / 6.0);
    }
}

/// The plays of six legs, or another hysteresis model.
#[derive(Debug, Clone, PartialEq)]
enum Hysteresis {
    /// Threshold, weight and state of every play.
    Plays(Vec<[Lane; 3]>),
    BoucWen(Box<[BoucWen; 6]>),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StackLanes {
    step: f64,
    rate_decay: Lane,
    rate: Lane,
    rate_sensitivity: Lane,
    rate_scale: Lane,
    widening: Lane,
    /// |rate| that the thresholds are widened for.
    widened_for: Lane,
    hysteresis: Hysteresis,
    /// Gain per step, weight, threshold and state of every creep operator.
    creep: Vec<[Lane; 4]>,
    asymmetry: Lane,
    drive_max: Lane,
    gain: Lane,
}

/// A number for each leg, 0 in the idle lanes.
pub(crate) fn lane(of: impl Fn(usize) -> f64) -> Lane {
    std::array::from_fn(|leg| if leg < 6 { of(leg) } else { 0.0 })
}

impl StackLanes {
    /// Copies six stacks, for steps of `step` (s). None if their numbers of operators differ, or some have plays and
    /// others Bouc-Wen hysteresis.
    pub(crate) fn of(stacks: &[&Stack; 6], step: f64) -> Option<Self> {
        let first = stacks[0];
        let operators = |s: &Stack| [s.plays.states.len(), s.creep.rates.len(), s.creep.thresholds.len()];
        let [plays, rates, thresholds] = operators(first);
        if !stacks.iter().all(|stack| operators(stack) == operators(first)) {
            return None;
        }
        let play = |k: usize| {
            [
                lane(|leg| stacks[leg].plays.thresholds[k]),
                lane(|leg| stacks[leg].plays.weights[k]),
                lane(|leg| stacks[leg].plays.states[k]),
            ]
        };
        let bouc_wen = stacks.each_ref().map(|stack| stack.bouc_wen.clone());
        let hysteresis = if bouc_wen.iter().all(Option::is_none) {
            Hysteresis::Plays((0..plays).map(play).collect())
        } else {
            let [Some(a), Some(b), Some(c), Some(d), Some(e), Some(f)] = bouc_wen else { return None };
            Hysteresis::BoucWen(Box::new([a, b, c, d, e, f]))
        };
        let creep = |k: usize| {
            let (rate, threshold) = (k / thresholds, k % thresholds);
            [
                lane(|leg| -libm::expm1(-stacks[leg].creep.rates[rate] * step)),
                lane(|leg| stacks[leg].creep.weights[rate] / thresholds as f64),
                lane(|leg| stacks[leg].creep.thresholds[threshold]),
                lane(|leg| stacks[leg].creep.states[k]),
            ]
        };
        let mut out = Self {
            step,
            rate_decay: lane(|leg| stacks[leg].rate.decay_over(step)),
            rate: lane(|leg| stacks[leg].rate.output),
            rate_sensitivity: lane(|leg| stacks[leg].plays.rate_sensitivity),
            rate_scale: std::array::from_fn(|leg| if leg < 6 { stacks[leg].plays.rate_scale } else { 1.0 }),
            widening: lane(|leg| stacks[leg].widening),
            widened_for: lane(|_| 0.0),
            hysteresis,
            creep: (0..rates * thresholds).map(creep).collect(),
            asymmetry: lane(|leg| stacks[leg].asymmetry),
            drive_max: std::array::from_fn(|leg| if leg < 6 { stacks[leg].drive_max } else { 1.0 }),
            gain: lane(|leg| stacks[leg].gain),
        };
        out.widen();
        Some(out)
    }

    /// Copies the states back into stacks of the same legs.
    pub(crate) fn put(&self, leg: usize, stack: &mut Stack) {
        stack.rate.output = self.rate[leg];
        stack.widening = self.widening[leg];
        match &self.hysteresis {
            Hysteresis::Plays(plays) => {
                for (k, play) in plays.iter().enumerate() {
                    stack.plays.states[k] = play[2][leg];
                }
            }
            Hysteresis::BoucWen(legs) => stack.bouc_wen = Some(legs[leg].clone()),
        }
        for (k, operator) in self.creep.iter().enumerate() {
            stack.creep.states[k] = operator[3][leg];
        }
    }

    /// Whether the rates have changed so much that the thresholds must be updated.
    #[inline(always)]
    fn stale(&self) -> bool {
        let mut stale = false;
        for k in 0..LANES {
            let (rate, last) = (self.rate[k].abs(), self.widened_for[k]);
            let lower = if rate < last { rate } else { last };
            stale |= self.rate_sensitivity[k] * (rate - last).abs() > WIDENING_TOLERANCE * (self.rate_scale[k] + lower);
        }
        stale
    }

    fn widen(&mut self) {
        for leg in 0..6 {
            let rate = self.rate[leg].abs();
            self.widened_for[leg] = rate;
            self.widening[leg] = 1.0 + self.rate_sensitivity[leg] * libm::log(1.0 + rate / self.rate_scale[leg]);
        }
    }

    /// One step, over which the voltages go from `before` along `voltage` (V) with mean `mean`, with plays that start
    /// `late`; free displacements over it, µm.
    // Inlined into functions that are compiled for several instruction sets.
    #[inline(always)]
    pub(crate) fn advance(&mut self, before: &Lane, voltage: &StepShape, mean: &Lane, late: &LateShape) -> StepShape {
        let after = &voltage.end;
        for k in 0..LANES {
            let speed = (after[k] - before[k]) / self.step;
            self.rate[k] = speed + (self.rate[k] - speed) * self.rate_decay[k];
        }
        if self.stale() {
            self.widen();
        }
        let mut way = [0.0; LANES];
        let mut per_way = [0.0; LANES];
        for k in 0..LANES {
            way[k] = after[k] - before[k];
            // Too short to determine when a play started to move.
            per_way[k] = if way[k].abs() > 1e-100 { 1.0 / way[k] } else { 0.0 };
        }
        let mut sum = [0.0; LANES];
        let mut moved = [0.0; LANES];
        let mut mean_off = [0.0; LANES];
        let mut skew_off = [0.0; LANES];
        match &mut self.hysteresis {
            Hysteresis::Plays(plays) => {
                // Sums over moved plays: displacement times the missed fraction, and times its square.
                let (mut missed, mut squared) = ([0.0; LANES], [0.0; LANES]);
                let (widening, after) = (self.widening, *after);
                for [threshold, weight, state] in plays {
                    // Short loops over local values, which compilers vectorise.
                    let (threshold, weight, last) = (*threshold, *weight, *state);
                    let mut next = [0.0; LANES];
                    for k in 0..LANES {
                        let r = threshold[k] * widening[k];
                        let (low, high) = (after[k] - r, after[k] + r);
                        let raised = if last[k] < low { low } else { last[k] };
                        next[k] = if raised > high { high } else { raised };
                    }
                    *state = next;
                    let mut part = [0.0; LANES];
                    for k in 0..LANES {
                        let of_way = (next[k] - last[k]) * per_way[k];
                        let above = if of_way > 0.0 { of_way } else { 0.0 };
                        part[k] = if above < 1.0 { above } else { 1.0 };
                    }
                    for k in 0..LANES {
                        let change = weight[k] * (next[k] - last[k]);
                        let short = change * (1.0 - part[k]);
                        sum[k] += weight[k] * next[k];
                        moved[k] += change;
                        missed[k] += short;
                        squared[k] += short + short * part[k];
                    }
                }
                for k in 0..LANES {
                    mean_off[k] = late.mean[0][k] * missed[k] + late.mean[1][k] * squared[k];
                    skew_off[k] = late.skew[0][k] * missed[k] + late.skew[1][k] * squared[k];
                }
            }
            Hysteresis::BoucWen(legs) => {
                for (k, leg) in legs.iter_mut().enumerate() {
                    // A parabola between the slopes at both ends, while the voltage changes.
                    let under_way = -2.0 * late.mean[0][k] - 3.0 * late.mean[1][k];
                    let (last, first) = (leg.output(), leg.slope(way[k]));
                    sum[k] = leg.advance(after[k]);
                    moved[k] = sum[k] - last;
                    mean_off[k] = under_way * (first - leg.slope(way[k])) * way[k] * (1.0 / 12.0);
                }
            }
        }
        let mut crept = [0.0; LANES];
        for [gain, weight, threshold, state] in &mut self.creep {
            for k in 0..LANES {
                // The dead zone without a branch: x less x limited to ± r.
                let x = mean[k] - state[k];
                let held = if x > threshold[k] { threshold[k] } else { x };
                let held = if held < -threshold[k] { -threshold[k] } else { held };
                state[k] += gain[k] * (x - held);
                crept[k] += weight[k] * state[k];
            }
        }
        let mut out = StepShape { end: [0.0; LANES], mean: [0.0; LANES], skew: [0.0; LANES] };
        for k in 0..LANES {
            let share = sum[k] / self.drive_max[k];
            let bent = sum[k] + self.asymmetry[k] * sum[k] * (1.0 - share);
            out.end[k] = self.gain[k] * (bent + crept[k]);
            let slope = self.gain[k] * (1.0 + self.asymmetry[k] * (1.0 - 2.0 * share));
            let chord = moved[k] * per_way[k];
            out.mean[k] = slope * (mean_off[k] + chord * voltage.mean[k]);
            out.skew[k] = slope * (skew_off[k] + chord * voltage.skew[k]);
        }
        out
    }
}
