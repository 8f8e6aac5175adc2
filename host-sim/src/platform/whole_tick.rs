//! The plant in one step per control interval, legs in lanes: for studies of many runs, such as tuning.
//!
//! The same equations as the plant of small steps, with the shape that the amplifiers' lag gives to the free
//! displacements within an interval taken into account ([`StructureLanes`], [`StackLanes`]); without contact. Compared with
//! the small steps by the tests of [`super::PlatformPlant`].
//!
//! The step is compiled a second time for AVX2, of which additions and multiplications have the same bits as any other:
//! nothing is fused, sums keep their written order.
// Unsafe: the call of that second version, behind the question whether the processor has it.
#![allow(unsafe_code)]

use super::amplifier::Amplifier;
use super::linear::Six;
use super::structure::{Structure, StructureLanes};
use crate::plant::Stack;
use crate::plant::lanes::{LANES, Lane, StackLanes, lane};

#[derive(Debug, Clone, PartialEq)]
pub(super) struct WholeTick {
    interval: f64,
    voltage: Lane,
    /// e^(−T/τ), and the part of the way that the voltage has come on average over the interval.
    decay: Lane,
    mean: Lane,
    reach: Lane,
    slew: Lane,
    lag: Lane,
    stacks: StackLanes,
    rest: Lane,
    structure: StructureLanes,
}

impl WholeTick {
    /// The plant as it is, for intervals of `interval` (s). `rest` is the free displacement at rest of each leg, µm.
    /// None if the legs have different numbers of operators, or not of plays.
    pub(super) fn of(
        amplifiers: &[&Amplifier; 6],
        stacks: &[&Stack; 6],
        rest: &Six,
        structure: &Structure,
        interval: f64,
    ) -> Option<Self> {
        let lag: Six = std::array::from_fn(|leg| amplifiers[leg].time_constant);
        let decay = |leg: usize| if lag[leg] > 0.0 { libm::exp(-interval / lag[leg]) } else { 0.0 };
        Some(Self {
            interval,
            voltage: lane(|leg| amplifiers[leg].voltage),
            decay: lane(decay),
            mean: lane(|leg| 1.0 / (1.0 - decay(leg)) - lag[leg] / interval),
            reach: lane(|leg| amplifiers[leg].reach),
            slew: lane(|leg| amplifiers[leg].slew),
            lag: lane(|leg| lag[leg]),
            stacks: StackLanes::of(stacks, interval)?,
            rest: lane(|leg| rest[leg]),
            structure: StructureLanes::of(structure, interval, &lag),
        })
    }

    /// The interval it was made for, s.
    pub(super) fn interval(&self) -> f64 {
        self.interval
    }

    /// Holds six voltages (V) for the interval.
    pub(super) fn hold(&mut self, voltages: &Six) {
        #[cfg(target_arch = "x86_64")]
        if std::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has what the function is compiled for.
            return unsafe { self.hold_avx2(voltages) };
        }
        self.hold_anywhere(voltages);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn hold_avx2(&mut self, voltages: &Six) {
        self.hold_anywhere(voltages);
    }

    #[inline(always)]
    fn hold_anywhere(&mut self, voltages: &Six) {
        let [a, b, c, d, e, f] = *voltages;
        let input: Lane = [a, b, c, d, e, f, 0.0, 0.0];
        let before = self.voltage;
        let mut after = [0.0; LANES];
        let mut mean = [0.0; LANES];
        let mut limited = false;
        for k in 0..LANES {
            let gap = before[k] - input[k];
            after[k] = input[k] + gap * self.decay[k];
            mean[k] = before[k] + (after[k] - before[k]) * self.mean[k];
            limited |= gap.abs() > self.reach[k];
        }
        let mut straight = [false; LANES];
        if limited {
            self.limited(&input, &mut after, &mut mean, &mut straight);
        }
        let free = self.stacks.advance(&before, &mean, &after);
        let mut displacement = [0.0; LANES];
        for k in 0..LANES {
            displacement[k] = (free[k] - self.rest[k]) * 1e-6;
        }
        self.voltage = after;
        self.structure.advance(&displacement, limited.then_some(&straight));
    }

    /// The legs whose amplifiers are at their current limit, see [`Amplifier::advance`].
    fn limited(&self, input: &Lane, after: &mut Lane, mean: &mut Lane, straight: &mut [bool; LANES]) {
        for k in 0..6 {
            let gap = self.voltage[k] - input[k];
            let excess = gap.abs() - self.reach[k];
            if excess <= 0.0 {
                continue;
            }
            let direction = if gap > 0.0 { -1.0 } else { 1.0 };
            let time = excess / self.slew[k];
            // Of an interval in which the limit ends the shape is that of its longer part.
            straight[k] = 2.0 * time > self.interval;
            after[k] = if time >= self.interval {
                self.voltage[k] + direction * self.slew[k] * self.interval
            } else {
                let decay = if self.lag[k] > 0.0 { libm::exp(-(self.interval - time) / self.lag[k]) } else { 0.0 };
                input[k] - direction * self.reach[k] * decay
            };
            mean[k] = 0.5 * (self.voltage[k] + after[k]);
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

    /// [`WholeTick::hold`] as compiled for any processor.
    #[cfg(test)]
    pub(super) fn hold_plainly(&mut self, voltages: &Six) {
        self.hold_anywhere(voltages);
    }
}
