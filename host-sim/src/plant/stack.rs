//! The piezo stacks of legs, a lane each: from their voltages to the displacements of free, massless legs.
//!
//! A step may be as long as a control interval. After an amplifier that holds its input, the voltage of a leg is
//! monotonic over a step, and neither plays nor Bouc-Wen hysteresis depend on the rate of a monotonic voltage. Their
//! state at the end of a step is therefore exact for any length. The creep of a long step uses the mean voltage of the
//! step instead of the last one.
//!
//! The motion within a step drives a structure, not only its end. A play that starts to move within the step bends that
//! motion. If such bends were neglected, they would make the structure ring by some tenths of a nanometre. They are
//! represented by moments, see [`StepShape`].

use super::LegParameters;
use super::bouc_wen::BoucWen;
use super::shape::{Lane, LateShape, StepShape};

/// Largest deviation of the thresholds from their rate-dependent width: 4 pm for a leg that moves 60 µm.
const WIDENING_TOLERANCE: f64 = 1e-6;

/// A play (backlash) operator of each leg, w · p: p ← max(v − r, min(v + r, p)).
#[derive(Debug, Clone, PartialEq)]
struct Play<const N: usize> {
    /// r at rest, V.
    threshold: Lane<N>,
    weight: Lane<N>,
    /// p, V.
    state: Lane<N>,
}

/// A creep operator of each leg, w · c: ċ = a · dead(v − c, r), where dead(x, r) is x − r above r, x + r below −r and 0
/// between.
#[derive(Debug, Clone, PartialEq)]
struct Creep<const N: usize> {
    /// a, 1/s.
    rate: Lane<N>,
    /// 1 − e^(−a dt).
    gain: Lane<N>,
    weight: Lane<N>,
    /// r, V.
    threshold: Lane<N>,
    /// c, V.
    state: Lane<N>,
}

/// Plays or Bouc-Wen hysteresis, creep and asymmetry of legs: the equations between amplifier and structure.
///
/// The thresholds of the plays are r_i · (1 + κ ln(1 + |v̇| / v0)), where v̇ is the filtered rate of v.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stack<const N: usize> {
    step: f64,
    /// Lag of the rate, s, and e^(−dt/lag).
    rate_lag: Lane<N>,
    rate_decay: Lane<N>,
    /// V/s.
    rate: Lane<N>,
    /// κ.
    rate_sensitivity: Lane<N>,
    /// v0, V/s.
    rate_scale: Lane<N>,
    widening: Lane<N>,
    /// |rate| that the thresholds are widened for.
    widened_for: Lane<N>,
    plays: Vec<Play<N>>,
    /// Legs with Bouc-Wen hysteresis in place of plays.
    bouc_wen: Vec<(usize, BoucWen)>,
    creep: Vec<Creep<N>>,
    asymmetry: Lane<N>,
    drive_max: Lane<N>,
    gain: Lane<N>,
}

impl<const N: usize> Stack<N> {
    /// Stacks as built, from checked parameters of at most N legs. A leg with fewer operators than another gets some
    /// with a weight of 0.
    pub(crate) fn new(legs: &[LegParameters]) -> Self {
        let lane = |of: fn(&LegParameters) -> f64| std::array::from_fn(|k| legs.get(k).map_or(0.0, of));
        let scale = |of: fn(&LegParameters) -> f64| std::array::from_fn(|k| legs.get(k).map_or(1.0, of));
        let number = |of: &[f64], k: usize| of.get(k).copied().unwrap_or_default();
        let play = |k: usize| Play {
            threshold: std::array::from_fn(|leg| legs.get(leg).map_or(0.0, |p| number(&p.play_thresholds_v, k))),
            weight: std::array::from_fn(|leg| legs.get(leg).map_or(0.0, |p| number(&p.play_weights, k))),
            state: [0.0; N],
        };
        // Rate, weight and threshold of each: the weight of a rate is divided equally among its thresholds.
        let creeps = |p: &LegParameters| -> Vec<[f64; 3]> {
            let share = 1.0 / p.creep_thresholds_v.len() as f64;
            let rates = p.creep_rates_per_s.iter().zip(&p.creep_weights);
            let each = |(rate, weight): (&f64, &f64)| {
                let (rate, weight) = (*rate, weight * share);
                p.creep_thresholds_v.iter().map(move |threshold| [rate, weight, *threshold])
            };
            rates.flat_map(each).collect()
        };
        let creeps: Vec<Vec<[f64; 3]>> = legs.iter().map(creeps).collect();
        let creep = |k: usize| {
            let of = |number: usize| {
                std::array::from_fn(|leg| creeps.get(leg).and_then(|of| of.get(k)).map_or(0.0, |of| of[number]))
            };
            Creep { rate: of(0), gain: [0.0; N], weight: of(1), threshold: of(2), state: [0.0; N] }
        };
        let most = |counts: &mut dyn Iterator<Item = usize>| counts.max().unwrap_or_default();
        let hystereses = legs.iter().enumerate().filter_map(|(leg, p)| Some((leg, BoucWen::new(p.bouc_wen?))));
        Self {
            step: 0.0,
            rate_lag: lane(|p| p.tau_rate_s),
            rate_decay: [0.0; N],
            rate: [0.0; N],
            rate_sensitivity: lane(|p| p.kappa),
            rate_scale: scale(|p| p.v0_v_per_s),
            widening: [1.0; N],
            widened_for: [0.0; N],
            plays: (0..most(&mut legs.iter().map(|p| p.play_weights.len()))).map(play).collect(),
            bouc_wen: hystereses.collect(),
            creep: (0..most(&mut creeps.iter().map(Vec::len))).map(creep).collect(),
            asymmetry: lane(|p| p.s2),
            drive_max: scale(|p| p.u_max),
            gain: lane(|p| p.gain_um_per_v),
        }
    }

    /// Sets the length of the following steps, s.
    pub(super) fn set_step(&mut self, step: f64) {
        self.step = step;
        self.rate_decay = self.rate_lag.map(|lag| if lag > 0.0 { libm::exp(-step / lag) } else { 0.0 });
        for creep in &mut self.creep {
            creep.gain = creep.rate.map(|rate| -libm::expm1(-rate * step));
        }
    }

    /// Widens the thresholds for the rates of now.
    pub(super) fn widen(&mut self) {
        for k in 0..N {
            let rate = self.rate[k].abs();
            self.widened_for[k] = rate;
            self.widening[k] = 1.0 + self.rate_sensitivity[k] * libm::log(1.0 + rate / self.rate_scale[k]);
        }
    }

    /// Whether the rates have changed so much that the thresholds must be updated.
    #[inline(always)]
    fn is_stale(&self) -> bool {
        let mut stale = false;
        for k in 0..N {
            let (rate, last) = (self.rate[k].abs(), self.widened_for[k]);
            let lower = if rate < last { rate } else { last };
            stale |= self.rate_sensitivity[k] * (rate - last).abs() > WIDENING_TOLERANCE * (self.rate_scale[k] + lower);
        }
        stale
    }

    #[inline(always)]
    fn filter_rate(&mut self, before: &Lane<N>, after: &Lane<N>) {
        for k in 0..N {
            let speed = (after[k] - before[k]) / self.step;
            self.rate[k] = speed + (self.rate[k] - speed) * self.rate_decay[k];
        }
    }

    /// Moves the voltages from `before` to `after` (V) within one step; free displacements at its end, µm. The rate
    /// that widens the thresholds is filtered over milliseconds, so not every step has to `widen` them.
    pub(super) fn advance(&mut self, before: &Lane<N>, after: &Lane<N>, widen: bool) -> Lane<N> {
        self.filter_rate(before, after);
        if widen {
            self.widen();
        }
        // The shape is not used, so that the compiler leaves it out.
        self.displace(before, &StepShape { end: *after, ..StepShape::REST }, after, &LateShape::NONE).end
    }

    /// One long step, over which the voltages go from `before` along `voltage` (V) with mean `mean`, with plays that
    /// start `late`; free displacements over it, µm.
    // Inlined into functions that are compiled for several instruction sets.
    #[inline(always)]
    pub(super) fn advance_long(
        &mut self,
        before: &Lane<N>,
        voltage: &StepShape<N>,
        mean: &Lane<N>,
        late: &LateShape<N>,
    ) -> StepShape<N> {
        self.filter_rate(before, &voltage.end);
        if self.is_stale() {
            self.widen();
        }
        self.displace(before, voltage, mean, late)
    }

    #[inline(always)]
    fn displace(
        &mut self,
        before: &Lane<N>,
        voltage: &StepShape<N>,
        creeping: &Lane<N>,
        late: &LateShape<N>,
    ) -> StepShape<N> {
        let after = voltage.end;
        let mut way = [0.0; N];
        let mut per_way = [0.0; N];
        for k in 0..N {
            way[k] = after[k] - before[k];
            // Too short to determine when a play started to move.
            per_way[k] = if way[k].abs() > 1e-100 { 1.0 / way[k] } else { 0.0 };
        }
        let mut sum = [0.0; N];
        let mut moved = [0.0; N];
        // Sums over moved plays: displacement times the missed fraction, and times its square.
        let (mut missed, mut squared) = ([0.0; N], [0.0; N]);
        let widening = self.widening;
        for play in &mut self.plays {
            // Short loops over local values, which compilers vectorise.
            let (threshold, weight, last) = (play.threshold, play.weight, play.state);
            let mut next = [0.0; N];
            for k in 0..N {
                let r = threshold[k] * widening[k];
                let (low, high) = (after[k] - r, after[k] + r);
                let raised = if last[k] < low { low } else { last[k] };
                next[k] = if raised > high { high } else { raised };
            }
            play.state = next;
            let mut part = [0.0; N];
            for k in 0..N {
                let of_way = (next[k] - last[k]) * per_way[k];
                let above = if of_way > 0.0 { of_way } else { 0.0 };
                part[k] = if above < 1.0 { above } else { 1.0 };
            }
            for k in 0..N {
                let change = weight[k] * (next[k] - last[k]);
                let short = change * (1.0 - part[k]);
                sum[k] += weight[k] * next[k];
                moved[k] += change;
                missed[k] += short;
                squared[k] += short + short * part[k];
            }
        }
        let mut mean_off = [0.0; N];
        let mut skew_off = [0.0; N];
        for k in 0..N {
            mean_off[k] = late.mean[0][k] * missed[k] + late.mean[1][k] * squared[k];
            skew_off[k] = late.skew[0][k] * missed[k] + late.skew[1][k] * squared[k];
        }
        for (k, leg) in &mut self.bouc_wen {
            let k = *k;
            // A parabola between the slopes at both ends, while the voltage changes.
            let under_way = -2.0 * late.mean[0][k] - 3.0 * late.mean[1][k];
            let (last, first) = (leg.output(), leg.slope(way[k]));
            sum[k] = leg.advance(after[k]);
            moved[k] = sum[k] - last;
            mean_off[k] = under_way * (first - leg.slope(way[k])) * way[k] * (1.0 / 12.0);
        }
        let mut crept = [0.0; N];
        for Creep { gain, weight, threshold, state, .. } in &mut self.creep {
            for k in 0..N {
                // The dead zone without a branch: x less x limited to ± r.
                let x = creeping[k] - state[k];
                let held = if x > threshold[k] { threshold[k] } else { x };
                let held = if held < -threshold[k] { -threshold[k] } else { held };
                state[k] += gain[k] * (x - held);
                crept[k] += weight[k] * state[k];
            }
        }
        let mut out = StepShape::REST;
        for k in 0..N {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Gain 1 µm/V, no asymmetry, and only the given operators.
    fn leg(plays: (&[f64], &[f64]), creep: (f64, f64, &[f64])) -> LegParameters {
        LegParameters {
            gain_um_per_v: 1.0,
            s2: 0.0,
            kappa: 0.0,
            play_thresholds_v: plays.0.to_vec(),
            play_weights: plays.1.to_vec(),
            creep_rates_per_s: vec![creep.0],
            creep_weights: vec![creep.1],
            creep_thresholds_v: creep.2.to_vec(),
            ..LegParameters::reference()
        }
    }

    fn stack(leg: &LegParameters, step: f64) -> Stack<1> {
        let mut stack = Stack::new(std::slice::from_ref(leg));
        stack.set_step(step);
        stack
    }

    #[test]
    fn a_play_moves_only_beyond_its_threshold_and_keeps_its_place_inside() {
        let mut stack = stack(&leg((&[2.0], &[0.5]), (1.0, 0.0, &[0.0])), 1.0);
        for (volts, expected) in [(1.5, 0.0), (10.0, 4.0), (6.5, 4.0), (5.0, 3.5)] {
            assert_eq!(stack.advance(&[0.0], &[volts], true), [expected]);
        }
    }

    #[test]
    fn the_threshold_widens_with_the_rate() {
        let leg = leg((&[2.0], &[1.0]), (1.0, 0.0, &[0.0]));
        let mut stack = stack(&LegParameters { kappa: 0.5, v0_v_per_s: 20.0, tau_rate_s: 0.0, ..leg }, 1.0);
        // 1 + 0.5 ln(1 + 20(e − 1)/20) = 1.5, for a voltage that falls.
        let before = 10.0 + 20.0 * (core::f64::consts::E - 1.0);
        assert!((stack.advance(&[before], &[10.0], true)[0] - 7.0).abs() < 1e-12);
    }

    #[test]
    fn a_held_voltage_is_approached_to_within_the_threshold_at_the_stated_rate() {
        let mut stack = stack(&leg((&[0.0], &[0.0]), (2.0, 1.0, &[6.0])), 0.01);
        let mut last = 0.0;
        for _ in 0..50 {
            [last] = stack.advance(&[16.0], &[16.0], true);
        }
        // Exact: 10 (1 − e^(−2 · 0.5)).
        assert!((last - 10.0 * (1.0 - libm::exp(-1.0))).abs() < 1e-12, "{last}");
        assert_eq!(stack.advance(&[16.0], &[last + 5.0], true), [last]);
    }

    #[test]
    fn the_weight_of_a_rate_is_shared_by_its_thresholds() {
        let mut stack = stack(&leg((&[0.0], &[0.0]), (1e9, 0.5, &[0.0, 6.0])), 1.0);
        assert!((stack.advance(&[10.0], &[10.0], true)[0] - 0.5 * (10.0 + 4.0) / 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_lane_has_the_bits_of_a_leg_alone_whatever_stands_beside_it() {
        let few = leg((&[2.0], &[0.5]), (1.0, 0.1, &[3.0]));
        let legs = [LegParameters::reference(), few, LegParameters::bouc_wen()];
        let mut together = Stack::<4>::new(&legs);
        let mut alone = legs.each_ref().map(|leg| stack(leg, 1e-4));
        together.set_step(1e-4);
        let mut before = [0.0; 4];
        for tick in 0..2000_u32 {
            let after = std::array::from_fn(|leg| f64::from(tick % (50 + 7 * leg as u32)));
            let found = together.advance(&before, &after, true);
            for (k, leg) in alone.iter_mut().enumerate() {
                let [expected] = leg.advance(&[before[k]], &[after[k]], true);
                assert_eq!(found[k].to_bits(), expected.to_bits(), "tick {tick}, leg {k}");
            }
            before = after;
        }
    }
}
