//! The stacks of six legs side by side: the equations of [`Stack`], a lane each, one step per control interval.
//!
//! Behind an amplifier that holds its input the voltage of a leg is monotonic over the interval, and plays do not depend
//! on the rate of a monotonic voltage: their state at its end is exact however long the interval is. The creep takes the
//! mean voltage of the interval instead of the last one. The thresholds are widened anew every [`WIDENED`] steps, for the
//! rate that widens them is filtered over milliseconds.

use super::Stack;

/// Lanes: six legs, and two that idle, for the width of vector registers.
pub(crate) const LANES: usize = 8;
/// A number of each leg.
pub(crate) type Lane = [f64; LANES];
/// Steps between two looks at the rate that widens the thresholds.
const WIDENED: u32 = 10;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct StackLanes {
    step: f64,
    rate_decay: Lane,
    rate: Lane,
    rate_sensitivity: Lane,
    rate_scale: Lane,
    widening: Lane,
    /// Steps since the thresholds were widened.
    age: u32,
    /// Threshold, weight and state of every play.
    plays: Vec<[Lane; 3]>,
    /// Gain per step, weight, threshold and state of every creep operator.
    creep: Vec<[Lane; 4]>,
    asymmetry: Lane,
    drive_max: Lane,
    gain: Lane,
}

/// A number of each leg, 0 in the idle lanes.
pub(crate) fn lane(of: impl Fn(usize) -> f64) -> Lane {
    std::array::from_fn(|leg| if leg < 6 { of(leg) } else { 0.0 })
}

impl StackLanes {
    /// Six stacks as they are, for steps of `step` (s). None if they have different numbers of operators, or not of plays.
    pub(crate) fn of(stacks: &[&Stack; 6], step: f64) -> Option<Self> {
        let first = stacks[0];
        let operators = |s: &Stack| [s.plays.states.len(), s.creep.rates.len(), s.creep.thresholds.len()];
        let [plays, rates, thresholds] = operators(first);
        if !stacks.iter().all(|stack| stack.bouc_wen.is_none() && operators(stack) == operators(first)) {
            return None;
        }
        let play = |k: usize| {
            [
                lane(|leg| stacks[leg].plays.thresholds[k]),
                lane(|leg| stacks[leg].plays.weights[k]),
                lane(|leg| stacks[leg].plays.states[k]),
            ]
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
        Some(Self {
            step,
            rate_decay: lane(|leg| stacks[leg].rate.decay_over(step)),
            rate: lane(|leg| stacks[leg].rate.output),
            rate_sensitivity: lane(|leg| stacks[leg].plays.rate_sensitivity),
            rate_scale: lane(|leg| stacks[leg].plays.rate_scale),
            widening: lane(|leg| stacks[leg].widening),
            age: 0,
            plays: (0..plays).map(play).collect(),
            creep: (0..rates * thresholds).map(creep).collect(),
            asymmetry: lane(|leg| stacks[leg].asymmetry),
            drive_max: std::array::from_fn(|leg| if leg < 6 { stacks[leg].drive_max } else { 1.0 }),
            gain: lane(|leg| stacks[leg].gain),
        })
    }

    /// Puts the states back into stacks of the same legs.
    pub(crate) fn put(&self, leg: usize, stack: &mut Stack) {
        stack.rate.output = self.rate[leg];
        stack.widening = self.widening[leg];
        for (k, play) in self.plays.iter().enumerate() {
            stack.plays.states[k] = play[2][leg];
        }
        for (k, operator) in self.creep.iter().enumerate() {
            stack.creep.states[k] = operator[3][leg];
        }
    }

    fn widen(&mut self) {
        for leg in 0..6 {
            if self.rate_sensitivity[leg] != 0.0 {
                self.widening[leg] =
                    1.0 + self.rate_sensitivity[leg] * libm::log(1.0 + self.rate[leg].abs() / self.rate_scale[leg]);
            }
        }
    }

    /// One step, over which the voltages go from `before` to `after`, `mean` on the way; free displacements at its end, µm.
    // Inlined into functions that are compiled for several instruction sets.
    #[inline(always)]
    pub(crate) fn advance(&mut self, before: &Lane, mean: &Lane, after: &Lane) -> Lane {
        for k in 0..LANES {
            let speed = (after[k] - before[k]) / self.step;
            self.rate[k] = speed + (self.rate[k] - speed) * self.rate_decay[k];
        }
        if self.age == 0 {
            self.widen();
            self.age = WIDENED;
        }
        self.age -= 1;
        let mut sum = [0.0; LANES];
        for [threshold, weight, state] in &mut self.plays {
            for k in 0..LANES {
                let r = threshold[k] * self.widening[k];
                let (low, high) = (after[k] - r, after[k] + r);
                let raised = if state[k] < low { low } else { state[k] };
                state[k] = if raised > high { high } else { raised };
                sum[k] += weight[k] * state[k];
            }
        }
        let mut crept = [0.0; LANES];
        for [gain, weight, threshold, state] in &mut self.creep {
            for k in 0..LANES {
                // The dead zone without a branch: x less x held to ± r.
                let x = mean[k] - state[k];
                let held = if x > threshold[k] { threshold[k] } else { x };
                let held = if held < -threshold[k] { -threshold[k] } else { held };
                state[k] += gain[k] * (x - held);
                crept[k] += weight[k] * state[k];
            }
        }
        let mut out = [0.0; LANES];
        for k in 0..LANES {
            let bent = sum[k] + self.asymmetry[k] * sum[k] * (1.0 - sum[k] / self.drive_max[k]);
            out[k] = self.gain[k] * (bent + crept[k]);
        }
        out
    }
}
