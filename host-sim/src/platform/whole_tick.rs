//! The plant in steps of a control interval, legs in lanes: used by simulations.
//!
//! The same equations as the plant of small steps. Effects that a step of 20 µs may neglect are included: the shape of
//! free displacements within a step from the amplifiers' lag and current limit, and plays that start late in it
//! ([`StructureLanes`], [`StackLanes`]). `tests/tests/platform_tables/steps.rs` compares the tables with those of small
//! steps.
//!
//! The step is compiled a second time for AVX2, whose additions and multiplications give the same bits: nothing is
//! fused, sums keep their written order.
// Unsafe: the call of that second version, after a check that the processor supports it.
#![allow(unsafe_code)]

use super::amplifier::Amplifier;
use super::contact::Wrench;
use super::linear::Six;
use super::structure::{Structure, StructureLanes};
use crate::plant::Stack;
use crate::plant::lanes::{LANES, Lane, LateShape, StackLanes, StepShape, lane};

#[derive(Debug, Clone, PartialEq)]
pub(super) struct WholeTick {
    step: f64,
    voltage: Lane,
    /// e^(−T/τ).
    decay: Lane,
    /// Mean of the voltage over a step as a fraction of its change, and its first moment about the middle.
    mean: Lane,
    skew: Lane,
    reach: Lane,
    slew: Lane,
    lag: Lane,
    late: LateShape,
    stacks: StackLanes,
    rest: Lane,
    structure: StructureLanes,
}

/// First moment about the middle of (1 − e^(−r s))/(1 − e^(−r)) for s from 0 to 1.
fn skew_of(r: f64) -> f64 {
    if r < 1e-2 {
        // Off by r²/720.
        return 1.0 / 12.0;
    }
    let decay = libm::exp(-r);
    let first = 0.5 - (1.0 - decay * (1.0 + r)) / (r * r);
    let mean = 1.0 - (1.0 - decay) / r;
    (first - 0.5 * mean) / (1.0 - decay)
}

impl WholeTick {
    /// Copies the plant, for steps of `step` (s). `rest` is the free displacement at rest of each leg, µm. None if the
    /// legs differ in the number of operators or the class of hysteresis, if a contact may open, or if there is a
    /// disturbance.
    pub(super) fn of(
        amplifiers: &[&Amplifier; 6],
        stacks: &[&Stack; 6],
        rest: &Six,
        structure: &Structure,
        step: f64,
    ) -> Option<Self> {
        let disturbed = structure.disturbance() != Wrench::default();
        if disturbed || structure.contact().is_some_and(|contact| contact.part.one_sided) {
            return None;
        }
        let lag: Six = std::array::from_fn(|leg| amplifiers[leg].time_constant);
        let decay = |leg: usize| if lag[leg] > 0.0 { libm::exp(-step / lag[leg]) } else { 0.0 };
        Some(Self {
            step,
            voltage: lane(|leg| amplifiers[leg].voltage),
            decay: lane(decay),
            mean: lane(|leg| 1.0 / (1.0 - decay(leg)) - lag[leg] / step),
            skew: lane(|leg| if lag[leg] > 0.0 { skew_of(step / lag[leg]) } else { 0.0 }),
            reach: lane(|leg| amplifiers[leg].reach),
            slew: lane(|leg| amplifiers[leg].slew),
            lag: lane(|leg| lag[leg]),
            late: LateShape::behind(&lag.map(|lag| if lag > 0.0 { step / lag } else { f64::INFINITY })),
            stacks: StackLanes::of(stacks, step)?,
            rest: lane(|leg| rest[leg]),
            structure: StructureLanes::of(structure, step, &lag),
        })
    }

    /// The step that it was made for, s.
    pub(super) fn step(&self) -> f64 {
        self.step
    }

    /// Holds six voltages (V) for a step.
    pub(super) fn advance(&mut self, voltages: &Six) {
        #[cfg(target_arch = "x86_64")]
        if std::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor supports the instructions of the function.
            return unsafe { self.advance_avx2(voltages) };
        }
        self.advance_anywhere(voltages);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn advance_avx2(&mut self, voltages: &Six) {
        self.advance_anywhere(voltages);
    }

    #[inline(always)]
    fn advance_anywhere(&mut self, voltages: &Six) {
        let [a, b, c, d, e, f] = *voltages;
        let input: Lane = [a, b, c, d, e, f, 0.0, 0.0];
        let before = self.voltage;
        let mut way = StepShape { end: [0.0; LANES], mean: [0.0; LANES], skew: [0.0; LANES] };
        let mut mean = [0.0; LANES];
        let mut limited = false;
        for k in 0..LANES {
            let gap = before[k] - input[k];
            way.end[k] = input[k] + gap * self.decay[k];
            mean[k] = before[k] + (way.end[k] - before[k]) * self.mean[k];
            limited |= gap.abs() > self.reach[k];
        }
        let mut late = self.late;
        if limited {
            self.limited(&input, &mut way, &mut mean, &mut late);
        }
        let mut free = self.stacks.advance(&before, &way, &mean, &late);
        for k in 0..LANES {
            free.end[k] = (free.end[k] - self.rest[k]) * 1e-6;
            free.mean[k] *= 1e-6;
            free.skew[k] *= 1e-6;
        }
        self.voltage = way.end;
        self.structure.advance(&free);
    }

    /// Legs whose amplifiers are at their current limit, see [`Amplifier::advance`]: linear, then with the lag after
    /// the limit.
    fn limited(&self, input: &Lane, way: &mut StepShape, mean: &mut Lane, late: &mut LateShape) {
        for k in 0..6 {
            let before = self.voltage[k];
            let gap = before - input[k];
            let excess = gap.abs() - self.reach[k];
            if excess <= 0.0 {
                continue;
            }
            let climb = if gap > 0.0 { -self.slew[k] } else { self.slew[k] } * self.step;
            // As a fraction of the step, as all times here.
            let time = excess / (self.slew[k] * self.step);
            let straight = if time < 1.0 { time } else { 1.0 };
            let left = 1.0 - straight;
            // The remaining change then, and after the lag.
            let (rest, lag) = (before + climb * straight - input[k], self.lag[k] / self.step);
            let decay = if lag > 0.0 { libm::exp(-left / lag) } else { 0.0 };
            let settled = left * straight * 0.5 + left * 0.5;
            let area =
                before * straight + climb * straight * straight * 0.5 + input[k] * left + rest * lag * (1.0 - decay);
            let moment = straight * straight * (before * 0.5 + climb * straight * (1.0 / 3.0))
                + input[k] * settled
                + rest * lag * (straight * (1.0 - decay) + lag * (1.0 - decay) - left * decay);
            way.end[k] = input[k] + rest * decay;
            if time >= 1.0 {
                way.end[k] = before + climb;
            }
            // Plays start late on the linear part, or on the other if that is longer.
            if lag == 0.0 || straight > 0.5 {
                late.straight(k, if lag == 0.0 { straight } else { 1.0 });
            }
            let change = way.end[k] - before;
            mean[k] = area;
            way.mean[k] = area - before - change * self.mean[k];
            way.skew[k] = moment - 0.5 * area - change * self.skew[k];
        }
    }

    /// h, from rest, m and rad.
    pub(super) fn pose(&self) -> Six {
        self.structure.pose()
    }

    /// ḣ, m/s and rad/s.
    pub(super) fn rate(&self) -> Six {
        self.structure.rate()
    }

    /// Copies the state of one leg back.
    pub(super) fn put_leg(&self, leg: usize, amplifier: &mut Amplifier, stack: &mut Stack) {
        amplifier.voltage = self.voltage[leg];
        self.stacks.put(leg, stack);
    }

    /// Free displacement of one leg, µm, and its voltage, V.
    pub(super) fn leg(&self, leg: usize) -> (f64, f64) {
        (self.structure.displacement(leg) * 1e6 + self.rest[leg], self.voltage[leg])
    }

    /// Copies the state of the structure back.
    pub(super) fn put_structure(&self, structure: &mut Structure) {
        self.structure.put(structure);
    }

    /// [`WholeTick::advance`] as compiled for any processor.
    #[cfg(test)]
    pub(super) fn advance_plainly(&mut self, voltages: &Six) {
        self.advance_anywhere(voltages);
    }
}
