//! The whole plant: six amplifiers and stacks that drive the structure.

use super::amplifier::Amplifier;
use super::contact::{WorkPart, Wrench};
use super::linear::Six;
use super::specimen::Specimen;
use super::structure::Structure;
use super::whole_tick::WholeTick;
use crate::closed_loop::Preparation;
use crate::plant::{SmoothLag, Stack, steps_within};

/// How much longer long steps are than the longest small one, and those of the pre-cycle.
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

/// A platform that takes six held voltages and moves.
///
/// Poses count from where it stands without drive after the pre-cycle of [`PlatformPlant::prepare`].
#[derive(Debug, Clone, PartialEq)]
pub struct PlatformPlant {
    actuators: [Actuator; 6],
    structure: Structure,
    /// What the gauges make of each coordinate of the pose; none: they show it at once.
    gauges: Option<[SmoothLag; 6]>,
    longest_step: f64,
    step: f64,
    /// Whether long steps are wanted, see [`PlatformPlant::step_whole_ticks`], and in use instead of actuators and structure.
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

    /// From here on steps are five times as long as the longest small one, with the legs side by side: some ten times as fast,
    /// and not of the same bits. What happens within a step of 100 µs is taken into account: the pose stays within 0.02 nm of that
    /// of the finest small steps at 56 µm and 10 Hz, where small steps of 20 µs are off by 0.13 nm; behind amplifiers that are faster than
    /// a step within 0.3 nm, and at their current limit within 1 nm.
    ///
    /// A part in touch that may let go and a disturbance are simulated in small steps, and so are legs that differ in the number of their operators or
    /// the class of their hysteresis. `interval` (s) is that of the holds to come; others may follow.
    pub fn step_whole_ticks(&mut self, interval: f64) {
        self.long_steps = true;
        self.lengthen(interval / f64::from(steps_within(interval, LONG * self.longest_step)));
    }

    /// Back to steps of at most the longest small one, of which the plant is made and which long ones are held against.
    pub fn step_small(&mut self) {
        self.long_steps = false;
        self.shorten();
    }

    /// Makes long steps of `step` (s) if they can be had.
    fn lengthen(&mut self, step: f64) {
        self.shorten();
        let amplifiers = self.actuators.each_ref().map(|actuator| &actuator.amplifier);
        let stacks = self.actuators.each_ref().map(|actuator| &actuator.stack);
        let rest = self.actuators.each_ref().map(|actuator| actuator.rest);
        self.whole_tick = WholeTick::of(&amplifiers, &stacks, &rest, &self.structure, step).map(Box::new);
    }

    /// Puts the state of long steps back.
    fn shorten(&mut self) {
        let Some(whole) = self.whole_tick.take() else { return };
        for (leg, actuator) in self.actuators.iter_mut().enumerate() {
            whole.put_leg(leg, &mut actuator.amplifier, &mut actuator.stack);
            actuator.displacement = whole.leg(leg).0;
        }
        whole.put_structure(&mut self.structure);
    }

    /// Pre-cycle of the free legs, all at once, and rest; then the platform stands still at the pose from which poses
    /// count, and goes from there to the drive at which it is to stand. The peak is held to each leg's own full drive.
    ///
    /// Quasi-static for the structure, which follows the legs without error: it is put to rest at the end.
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

    /// The same of all legs at once in long steps, if they can be had and the peaks are equal; whether that is so. A ramp is
    /// monotonic, and what ends in rest does not show how it got there: free displacements are the same within 0.01 nm.
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

    /// The pose that the gauges show: h behind their lag, which differs from the lag of each reading by less than 1e-14 m.
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

    /// d_i: what each leg would have moved without load since rest, m.
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

    /// The structure, as it was when long steps began if these are in use.
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

    /// Puts a wrench on the platform, besides that of a part, until it is changed.
    pub fn disturb(&mut self, wrench: &Wrench) {
        if *wrench != self.structure.disturbance() {
            self.shorten();
            self.structure.disturb(wrench);
        }
    }

    /// What part and disturbance put on the platform.
    #[must_use]
    pub fn wrench(&self) -> Wrench {
        let disturbance = self.structure.disturbance();
        self.structure.contact().map_or(disturbance, |contact| contact.wrench(&self.pose()).and(&disturbance))
    }
}

/// Holds six voltages (V) for so many long steps.
fn hold_long(whole: &mut WholeTick, gauges: &mut Option<[SmoothLag; 6]>, voltages: &Six, steps: u32) {
    for _ in 0..steps {
        let before = [whole.pose(), whole.rate()];
        whole.advance(voltages);
        gauges_follow(gauges, &before, &[whole.pose(), whole.rate()], whole.step());
    }
}

/// Lets gauges with a lag follow a step (s) from one pose and rate to another.
fn gauges_follow(gauges: &mut Option<[SmoothLag; 6]>, before: &[Six; 2], after: &[Six; 2], step: f64) {
    for (k, gauge) in gauges.iter_mut().flatten().enumerate() {
        gauge.set_step(step);
        gauge.advance([before[0][k], before[1][k]], [after[0][k], after[1][k]]);
    }
}

#[cfg(test)]
mod tests;
