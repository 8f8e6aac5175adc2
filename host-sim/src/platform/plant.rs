//! The whole plant: six amplifiers and stacks that drive the structure.

use super::amplifier::Amplifier;
use super::contact::{WorkPart, Wrench};
use super::linear::Six;
use super::specimen::Specimen;
use super::structure::Structure;
use super::whole_tick::WholeTick;
use crate::closed_loop::Preparation;
use crate::plant::{SmoothLag, Stack, steps_within};

/// Ratio of long steps to the longest small one, and to that of the pre-cycle.
const LONG: f64 = 5.0;

/// Amplifier and stacks of one leg.
#[derive(Debug, Clone, PartialEq)]
struct Actuator {
    amplifier: Amplifier,
    stack: Stack,
    /// Free displacement now and at rest, µm.
    displacement: f64,
    rest: f64,
    /// V.
    peak: f64,
}

impl Actuator {
    fn set_step(&mut self, step: f64) {
        self.amplifier.set_step(step);
        self.stack.set_step(step);
    }

    /// Holds `voltage` for one step, the `first` of an interval or a later one.
    fn advance(&mut self, voltage: f64, first: bool) {
        let before = self.amplifier.voltage;
        let after = self.amplifier.advance(voltage);
        self.displacement =
            if first { self.stack.advance(before, after) } else { self.stack.advance_on(before, after) };
    }

    /// Free displacement from rest, m.
    fn free_displacement(&self) -> f64 {
        (self.displacement - self.rest) * 1e-6
    }
}

/// A platform with six held voltages as inputs.
///
/// Poses count from rest without drive after the pre-cycle of [`PlatformPlant::prepare`].
#[derive(Debug, Clone, PartialEq)]
pub struct PlatformPlant {
    actuators: [Actuator; 6],
    structure: Structure,
    /// Lag of the gauges for each coordinate of the pose; none: no lag.
    gauges: Option<[SmoothLag; 6]>,
    longest_step: f64,
    step: f64,
    /// Whether long steps are requested, see [`PlatformPlant::step_whole_ticks`]; and their state, in place of
    /// actuators and structure, while in use.
    long_steps: bool,
    whole_tick: Option<Box<WholeTick>>,
}

impl PlatformPlant {
    /// A plant as built: legs never driven, at rest.
    #[must_use]
    pub fn new(specimen: &Specimen) -> Self {
        let nominal = &specimen.nominal;
        let slew = nominal.amplifier_current_a / nominal.stack_capacitance_f;
        let actuators = specimen.legs.each_ref().map(|leg| Actuator {
            amplifier: Amplifier::new(leg.tau_amp_s, slew),
            stack: Stack::new(leg),
            displacement: 0.0,
            rest: 0.0,
            peak: leg.u_max,
        });
        let structure = Structure::new(specimen.structure(), nominal.step_s);
        let lag = specimen.legs[0].gauge_lag_s;
        let gauges = (lag > 0.0).then(|| std::array::from_fn(|_| SmoothLag::new(lag)));
        Self {
            actuators,
            structure,
            gauges,
            longest_step: nominal.step_s,
            step: 0.0,
            long_steps: false,
            whole_tick: None,
        }
    }

    /// Sets the longest integration step, s (> 0).
    pub fn set_longest_step(&mut self, step: f64) {
        self.longest_step = step;
    }

    /// From here on steps are five times as long as the longest small one, with the legs in parallel: about ten times
    /// as fast, with other bits. The motion within a step of 100 µs is taken into account. At 56 µm and 10 Hz the pose
    /// stays within 0.02 nm of that of the finest small steps, while small steps of 20 µs are off by 0.13 nm. With
    /// amplifiers faster than a step it stays within 0.3 nm, and at their current limit within 1 nm.
    ///
    /// Small steps remain in use for a contact that may open, for a disturbance, and for legs that differ in the number
    /// of their operators or the class of their hysteresis. `interval` (s) is that of the following holds; others are
    /// possible.
    pub fn step_whole_ticks(&mut self, interval: f64) {
        self.long_steps = true;
        self.lengthen(interval / f64::from(steps_within(interval, LONG * self.longest_step)));
    }

    /// Back to small steps: the plant's own, with which long ones are compared.
    pub fn step_small(&mut self) {
        self.long_steps = false;
        self.shorten();
    }

    /// Starts long steps of `step` (s) if possible.
    fn lengthen(&mut self, step: f64) {
        self.shorten();
        let amplifiers = self.actuators.each_ref().map(|actuator| &actuator.amplifier);
        let stacks = self.actuators.each_ref().map(|actuator| &actuator.stack);
        let rest = self.actuators.each_ref().map(|actuator| actuator.rest);
        self.whole_tick = WholeTick::of(&amplifiers, &stacks, &rest, &self.structure, step).map(Box::new);
    }

    /// Copies the state of long steps back.
    fn shorten(&mut self) {
        let Some(whole) = self.whole_tick.take() else { return };
        for (leg, actuator) in self.actuators.iter_mut().enumerate() {
            whole.put_leg(leg, &mut actuator.amplifier, &mut actuator.stack);
            actuator.displacement = whole.leg(leg).0;
        }
        whole.put_structure(&mut self.structure);
    }

    /// Pre-cycle of all free legs at once, and rest. Then the platform rests at the pose from which poses count, and
    /// moves from there to its rest drive. The peak is limited to each leg's full drive.
    ///
    /// Quasi-static for the structure, which follows the legs without error: it is set to rest at the end.
    pub fn prepare(&mut self, preparation: &Preparation) {
        let Preparation { rate, settle, update, rest, .. } = *preparation;
        self.shorten();
        self.structure.release();
        if !self.cycle_long(&Preparation { update: LONG * update, ..*preparation }) {
            self.cycle_small(preparation);
        }
        for actuator in &mut self.actuators {
            actuator.rest = actuator.displacement;
        }
        self.step = 0.0;
        self.structure.set_state(&[0.0; 6], &[0.0; 6], &[0.0; 6]);
        self.gauges.iter_mut().flatten().for_each(|gauge| gauge.rest_at(0.0));
        if rest > 0.0 {
            let steps = steps_within(rest / rate, update);
            for step in 1..=steps {
                self.hold(&[rest * f64::from(step) / f64::from(steps); 6], rest / rate / f64::from(steps));
            }
            for _ in 0..steps_within(settle, update) {
                self.hold(&[rest; 6], update);
            }
        }
    }

    /// Pre-cycle and rest of the legs, one by one in small steps.
    fn cycle_small(&mut self, &Preparation { peak, rate, settle, update, .. }: &Preparation) {
        for actuator in &mut self.actuators {
            let peak = if peak < actuator.peak { peak } else { actuator.peak };
            let steps = steps_within(peak / rate, update);
            actuator.set_step(peak / rate / f64::from(steps));
            for step in (1..=steps).chain((0..steps).rev()) {
                actuator.advance(peak * f64::from(step) / f64::from(steps), true);
            }
            if settle > 0.0 {
                let steps = steps_within(settle, update);
                actuator.set_step(settle / f64::from(steps));
                for _ in 0..steps {
                    actuator.advance(0.0, true);
                }
            }
        }
    }

    /// The same for all legs at once in long steps, if possible and if the peaks are equal; returns whether it was
    /// done. A ramp is monotonic, and the final rest hides how it was reached: free displacements are equal within 0.01
    /// nm.
    fn cycle_long(&mut self, &Preparation { peak, rate, settle, update, .. }: &Preparation) -> bool {
        let own = self.actuators[0].peak;
        if self.actuators.iter().any(|actuator| actuator.peak != own) {
            return false;
        }
        let peak = if peak < own { peak } else { own };
        let ramp = steps_within(peak / rate, update);
        self.lengthen(peak / rate / f64::from(ramp));
        let Some(whole) = &mut self.whole_tick else { return false };
        for step in (1..=ramp).chain((0..ramp).rev()) {
            whole.advance(&[peak * f64::from(step) / f64::from(ramp); 6]);
        }
        if settle > 0.0 {
            let steps = steps_within(settle, update);
            self.lengthen(settle / f64::from(steps));
            for _ in 0..steps {
                self.whole_tick.iter_mut().for_each(|whole| whole.advance(&[0.0; 6]));
            }
        }
        self.shorten();
        true
    }

    /// Holds six voltages (V, at the amplifier inputs) for `interval` (s, > 0).
    pub fn hold(&mut self, voltages: &Six, interval: f64) {
        if self.long_steps {
            let steps = steps_within(interval, LONG * self.longest_step);
            let step = interval / f64::from(steps);
            if self.whole_tick.as_ref().is_none_or(|whole| whole.step().to_bits() != step.to_bits()) {
                self.lengthen(step);
            }
            if let Some(whole) = &mut self.whole_tick {
                return hold_long(whole, &mut self.gauges, voltages, steps);
            }
        }
        let steps = steps_within(interval, self.longest_step);
        let step = interval / f64::from(steps);
        if step.to_bits() != self.step.to_bits() {
            self.step = step;
            self.structure.set_step(step);
            for actuator in &mut self.actuators {
                actuator.set_step(step);
            }
        }
        for tick in 0..steps {
            for (actuator, voltage) in self.actuators.iter_mut().zip(voltages) {
                actuator.advance(*voltage, tick == 0);
            }
            let displacement = self.free_displacements();
            let before = [self.structure.pose(), self.structure.rate()];
            self.structure.advance(&displacement);
            gauges_follow(&mut self.gauges, &before, &[self.structure.pose(), self.structure.rate()], step);
        }
    }

    /// The pose of the gauges: h with their lag, which differs from the lag of each reading by less than 1e-14 m.
    #[must_use]
    pub fn seen(&self) -> Six {
        self.gauges.as_ref().map_or_else(|| self.pose(), |gauges| gauges.each_ref().map(SmoothLag::output))
    }

    /// h, from rest, m and rad.
    #[must_use]
    pub fn pose(&self) -> Six {
        self.whole_tick.as_ref().map_or_else(|| self.structure.pose(), |whole| whole.pose())
    }

    /// ḣ, m/s and rad/s.
    #[must_use]
    pub fn rate(&self) -> Six {
        self.whole_tick.as_ref().map_or_else(|| self.structure.rate(), |whole| whole.rate())
    }

    /// d_i: displacement of each leg without load since rest, m.
    #[must_use]
    pub fn free_displacements(&self) -> Six {
        match &self.whole_tick {
            None => self.actuators.each_ref().map(Actuator::free_displacement),
            Some(whole) => std::array::from_fn(|leg| (whole.leg(leg).0 - self.actuators[leg].rest) * 1e-6),
        }
    }

    /// Voltages of the stacks, V.
    #[must_use]
    pub fn stack_voltages(&self) -> Six {
        match &self.whole_tick {
            None => self.actuators.each_ref().map(|actuator| actuator.amplifier.voltage),
            Some(whole) => std::array::from_fn(|leg| whole.leg(leg).1),
        }
    }

    /// The structure; while long steps are in use, its state when they began.
    #[must_use]
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// Makes contact at the present pose, unloaded.
    pub fn touch(&mut self, part: WorkPart) {
        self.shorten();
        self.structure.touch(part);
    }

    /// Takes the part away.
    pub fn release(&mut self) {
        self.shorten();
        self.structure.release();
    }

    /// Applies a wrench to the platform, in addition to that of a part, until it is changed.
    pub fn disturb(&mut self, wrench: &Wrench) {
        if *wrench != self.structure.disturbance() {
            self.shorten();
            self.structure.disturb(wrench);
        }
    }

    /// Wrench of part and disturbance on the platform.
    #[must_use]
    pub fn wrench(&self) -> Wrench {
        let disturbance = self.structure.disturbance();
        self.structure.contact().map_or(disturbance, |contact| contact.wrench(&self.pose()).and(&disturbance))
    }
}

/// Holds six voltages (V) for a number of long steps.
fn hold_long(whole: &mut WholeTick, gauges: &mut Option<[SmoothLag; 6]>, voltages: &Six, steps: u32) {
    for _ in 0..steps {
        let before = [whole.pose(), whole.rate()];
        whole.advance(voltages);
        gauges_follow(gauges, &before, &[whole.pose(), whole.rate()], whole.step());
    }
}

/// Gauges with a lag follow a step (s) from one pose and rate to another.
fn gauges_follow(gauges: &mut Option<[SmoothLag; 6]>, before: &[Six; 2], after: &[Six; 2], step: f64) {
    for (k, gauge) in gauges.iter_mut().flatten().enumerate() {
        gauge.set_step(step);
        gauge.advance([before[0][k], before[1][k]], [after[0][k], after[1][k]]);
    }
}

#[cfg(test)]
mod tests;
