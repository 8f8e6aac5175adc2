//! The plant in steps as long as a control interval, legs in lanes: what simulations run on.
//!
//! The same equations as the plant of small steps. What a step of 20 µs may leave out is taken into account: the shape that
//! the amplifiers' lag and their current limit give to the free displacements within a step, the plays that start late in it
//! ([`StructureLanes`], [`StackLanes`]). Small steps are the judge: `tests/tests/platform_tables/steps.rs` compares tables.
//!
//! The step is compiled a second time for AVX2, of which additions and multiplications have the same bits as any other:
//! nothing is fused, sums keep their written order.
// Unsafe: the call of that second version, behind the question whether the processor has it.
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
    /// The part of its way that a voltage has come on average over a step, and the first moment of that about the middle.
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
    /// The plant as it is, for steps of `step` (s). `rest` is the free displacement at rest of each leg, µm. None if the legs
    /// have different numbers of operators or classes of hysteresis, or a part is in touch that may let go, or something else pushes.
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
            // SAFETY: the processor has what the function is compiled for.
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

    /// The legs whose amplifiers are at their current limit, see [`Amplifier::advance`]: straight on, and with the lag where
    /// the limit ends.
    fn limited(&self, input: &Lane, way: &mut StepShape, mean: &mut Lane, late: &mut LateShape) {
        for k in 0..6 {
            let before = self.voltage[k];
            let gap = before - input[k];
            let excess = gap.abs() - self.reach[k];
            if excess <= 0.0 {
                continue;
            }
            let climb = if gap > 0.0 { -self.slew[k] } else { self.slew[k] } * self.step;
            // Of the step, as all times here.
            let time = excess / (self.slew[k] * self.step);
            let straight = if time < 1.0 { time } else { 1.0 };
            let left = 1.0 - straight;
            // What is left of the way then, and over the lag.
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
            // Plays start late on the straight part, or on the other where that is longer.
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

    /// Puts the state of one leg back.
    pub(super) fn put_leg(&self, leg: usize, amplifier: &mut Amplifier, stack: &mut Stack) {
        amplifier.voltage = self.voltage[leg];
        self.stacks.put(leg, stack);
    }

    /// Free displacement of one leg, µm, and its voltage, V.
    pub(super) fn leg(&self, leg: usize) -> (f64, f64) {
        (self.structure.displacement(leg) * 1e6 + self.rest[leg], self.voltage[leg])
    }

    /// Puts the state of the structure back.
    pub(super) fn put_structure(&self, structure: &mut Structure) {
        self.structure.put(structure);
    }

    /// [`WholeTick::advance`] as compiled for any processor.
    #[cfg(test)]
    pub(super) fn advance_plainly(&mut self, voltages: &Six) {
        self.advance_anywhere(voltages);
    }
}
