//! The whole plant: six amplifiers and stacks that drive the structure.

use super::contact::{WorkPart, Wrench};
use super::imperfections::Modes;
use super::linear::{LANES, Lane, Matrix6, Six, apply, inverse, lanes_of};
use super::long_step;
use super::parameters::PlatformParameters;
use super::specimen::Specimen;
use super::structure::{Structure, StructureLanes};
use crate::closed_loop::Preparation;
use crate::plant::{Actuators, SmoothLag, steps_within};

/// Length of a long step over that of the longest small step, or over the update interval of the pre-cycle.
const LONG: f64 = 5.0;

/// A platform with six held voltages as inputs.
///
/// Poses are relative to the pose at rest without drive after the pre-cycle of [`PlatformPlant::prepare`].
#[derive(Debug, Clone, PartialEq)]
pub struct PlatformPlant {
    actuators: Actuators<LANES>,
    /// Full drive of each leg, V.
    peaks: Six,
    /// Free displacements at rest, µm.
    rest: Lane,
    /// Free displacements relative to those at rest, m.
    displacement: Lane,
    /// Displacements that drive the structure, per free displacement of each leg; none if each has its own.
    coupling: Option<Matrix6>,
    structure: Structure,
    /// Lag of the gauges, for each coordinate of the pose; none without lag.
    gauges: Option<[SmoothLag; 6]>,
    /// Structural modes of legs and gauges.
    modes: Option<Box<Modes>>,
    longest_step: f64,
    /// Whether long steps are requested, see [`PlatformPlant::step_whole_ticks`].
    long_steps: bool,
    /// The structure while long steps are in use, in place of `structure`.
    long: Option<Box<StructureLanes>>,
}

impl PlatformPlant {
    /// A plant as built: legs never driven, at rest.
    pub fn new(specimen: &Specimen) -> Self {
        let nominal = &specimen.nominal;
        let lag = specimen.legs[0].gauge_lag_s;
        let mut structure = Structure::new(specimen.structure(), nominal.step_s);
        nominal.imperfections.cable.into_iter().for_each(|cable| structure.attach(cable));
        // The structure assumes linear motion within a step, so a fast mode needs short steps.
        let longest_step = nominal.imperfections.leg_step(nominal.step_s);
        let modes = Modes::of(&nominal.imperfections.modes, readings_near_rest(nominal));
        Self {
            actuators: Actuators::new(&specimen.legs, nominal.amplifier_current_a / nominal.stack_capacitance_f),
            peaks: specimen.legs.each_ref().map(|leg| leg.u_max),
            rest: [0.0; LANES],
            displacement: [0.0; LANES],
            coupling: None,
            structure,
            gauges: (lag > 0.0).then(|| std::array::from_fn(|_| SmoothLag::new(lag))),
            modes,
            longest_step,
            long_steps: false,
            long: None,
        }
    }

    /// Couples the legs by E, their `cross_talk`: free displacements d drive the structure like (I + E)⁻¹ d. Steps then are
    /// small.
    pub fn couple(&mut self, cross_talk: &Matrix6) {
        let unit = |row: usize, column: usize| if row == column { 1.0 } else { 0.0 };
        let whole = std::array::from_fn(|i| std::array::from_fn(|j| cross_talk[i][j] + unit(i, j)));
        self.coupling = Some(inverse(&whole));
        self.shorten();
    }

    /// Sets the longest integration step, s (> 0).
    pub fn set_longest_step(&mut self, step: f64) {
        self.longest_step = step;
    }

    /// Switches to steps that are five times as long, with the legs computed in parallel: about ten times as fast,
    /// but not bit-identical. `interval` (s) is the expected interval of [`PlatformPlant::hold`]; others are possible.
    ///
    /// The motion of the legs within a step is taken into account. At 56 µm and 10 Hz, with steps of 100 µs, the pose is
    /// within 0.02 nm of that with the finest small steps; small steps of 20 µs are off by 0.13 nm. With amplifiers faster
    /// than a step the error is within 0.3 nm, and at their current limit within 1 nm.
    ///
    /// Small steps remain in use under a disturbance, with a cable, and with structural modes of legs.
    pub fn step_whole_ticks(&mut self, interval: f64) {
        self.long_steps = true;
        self.lengthen(interval / f64::from(steps_within(interval, LONG * self.longest_step)));
    }

    /// Switches back to small steps, the reference for long ones.
    pub fn step_small(&mut self) {
        self.long_steps = false;
        self.shorten();
    }

    /// Starts long steps of `step` (s) if possible.
    fn lengthen(&mut self, step: f64) {
        self.shorten();
        if self.coupling.is_some() || self.modes.as_ref().is_some_and(|modes| modes.in_legs()) {
            return;
        }
        self.long = StructureLanes::of(&self.structure, step, self.actuators.lags()).map(Box::new);
        if self.long.is_some() {
            self.actuators.set_long_step(step);
        }
    }

    /// Ends long steps: copies their state back to `structure`.
    fn shorten(&mut self) {
        if let Some(long) = self.long.take() {
            long.put(&mut self.structure);
        }
    }

    /// Drives all legs, without load, to the peak and back, and waits. The pose then is the origin of all poses. Finally
    /// the platform moves to its rest drive. The peak is limited to each leg's full drive.
    ///
    /// The structure is not simulated during the pre-cycle, which is quasi-static: it is set to rest at the end.
    pub fn prepare(&mut self, preparation: &Preparation) {
        let Preparation { rate, settle, update, rest, .. } = *preparation;
        self.shorten();
        self.structure.release();
        self.cycle(preparation);
        self.displacement = [0.0; LANES];
        self.structure.set_state(&[0.0; 6], &[0.0; 6], &[0.0; 6]);
        self.gauges.iter_mut().flatten().for_each(|gauge| gauge.rest_at(0.0));
        self.modes.iter_mut().for_each(|modes| modes.rest());
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

    /// Pre-cycle and rest of the legs, in long steps. Hysteresis depends only on the extrema of the ramps, and creep settles
    /// in the final rest: free displacements are within 0.01 nm of those with small steps.
    fn cycle(&mut self, &Preparation { peak, rate, settle, update, .. }: &Preparation) {
        let peaks = lanes_of(&self.peaks.map(|own| if peak < own { peak } else { own }));
        let highest = peaks.into_iter().fold(0.0, |highest, peak| if peak > highest { peak } else { highest });
        let ramp = steps_within(highest / rate, LONG * update);
        self.actuators.set_long_step(highest / rate / f64::from(ramp));
        let mut free = self.rest;
        for step in (1..=ramp).chain((0..ramp).rev()) {
            let voltages = peaks.map(|peak| peak * f64::from(step) / f64::from(ramp));
            free = self.actuators.advance_long(&voltages).end;
        }
        if settle > 0.0 {
            let steps = steps_within(settle, LONG * update);
            self.actuators.set_long_step(settle / f64::from(steps));
            for _ in 0..steps {
                free = self.actuators.advance_long(&[0.0; LANES]).end;
            }
        }
        for (rest, free) in self.rest.iter_mut().zip(free) {
            // To m and back, as the structure converts it: all bits of a run depend on this rounding.
            *rest += (free - *rest) * 1e-6 * 1e6;
        }
    }

    /// Holds six voltages (V, at the amplifier inputs) for `interval` (s, > 0).
    pub fn hold(&mut self, voltages: &Six, interval: f64) {
        if self.long_steps {
            let steps = steps_within(interval, LONG * self.longest_step);
            let step = interval / f64::from(steps);
            if self.long.is_none() || self.actuators.step().to_bits() != step.to_bits() {
                self.lengthen(step);
            }
            if let Some(structure) = &mut self.long {
                for _ in 0..steps {
                    let before = [structure.pose(), structure.rate()];
                    self.displacement = long_step::advance(&mut self.actuators, structure, &self.rest, voltages);
                    let after = [structure.pose(), structure.rate()];
                    gauges_follow(&mut self.gauges, &mut self.modes, &before, &after, step);
                }
                return;
            }
        }
        let steps = steps_within(interval, self.longest_step);
        let step = interval / f64::from(steps);
        self.structure.set_step(step);
        self.actuators.set_step(step);
        for tick in 0..steps {
            let free = self.actuators.advance(&lanes_of(voltages), tick == 0);
            let earlier = self.free_displacements();
            self.displacement = std::array::from_fn(|k| (free[k] - self.rest[k]) * 1e-6);
            let before = [self.structure.pose(), self.structure.rate()];
            let mut driven = self.free_displacements();
            if let Some(modes) = self.modes.as_mut().filter(|modes| modes.in_legs()) {
                driven = modes.legs_follow(&earlier, &driven, step);
            }
            if let Some(coupling) = &self.coupling {
                driven = apply(coupling, &driven);
            }
            self.structure.advance(&driven);
            let after = [self.structure.pose(), self.structure.rate()];
            gauges_follow(&mut self.gauges, &mut self.modes, &before, &after, step);
        }
    }

    /// The pose that the gauges see: h with their lag. A lag on each reading instead differs by less than 1e-14 m.
    pub fn seen(&self) -> Six {
        self.seen_motion()[0]
    }

    /// The pose that the gauges see and its rate, m/s and rad/s.
    pub(super) fn seen_motion(&self) -> [Six; 2] {
        seen(self.gauges.as_ref(), &[self.pose(), self.rate()])
    }

    /// Contribution of structural modes to the gauge readings, m, and its rate, m/s; none without modes.
    pub(super) fn added(&self) -> Option<&[Six; 2]> {
        self.modes.as_ref().map(|modes| modes.added())
    }

    /// h, from rest, m and rad.
    pub fn pose(&self) -> Six {
        self.long.as_ref().map_or_else(|| self.structure.pose(), |long| long.pose())
    }

    /// ḣ, m/s and rad/s.
    pub fn rate(&self) -> Six {
        self.long.as_ref().map_or_else(|| self.structure.rate(), |long| long.rate())
    }

    /// d_i: displacement of each leg without load since rest, m.
    pub fn free_displacements(&self) -> Six {
        std::array::from_fn(|leg| self.displacement[leg])
    }

    /// Voltages of the stacks, V.
    pub fn stack_voltages(&self) -> Six {
        std::array::from_fn(|leg| self.actuators.voltages()[leg])
    }

    /// The structure; while long steps are in use, its state when they began.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// Brings a work part into contact at the present pose, without load.
    pub fn touch(&mut self, part: WorkPart) {
        self.shorten();
        self.structure.touch(part);
    }

    /// Removes the work part.
    pub fn release(&mut self) {
        self.shorten();
        self.structure.release();
    }

    /// Applies a constant wrench to the platform, in addition to that of a work part.
    pub fn disturb(&mut self, wrench: &Wrench) {
        if *wrench != self.structure.disturbance() {
            self.shorten();
            self.structure.disturb(wrench);
        }
    }

    /// Total wrench of work part and disturbance on the platform.
    pub fn wrench(&self) -> Wrench {
        let disturbance = self.structure.disturbance();
        self.structure.contact().map_or(disturbance, |contact| contact.wrench(&self.pose()).and(&disturbance))
    }
}

/// Jacobian of the gauge readings at rest, by central differences.
fn readings_near_rest(nominal: &PlatformParameters) -> Matrix6 {
    const STEP: f64 = 1e-6;
    nominal.probes.map(|probe| {
        std::array::from_fn(|k| {
            let [up, down] = [STEP, -STEP].map(|step| {
                let mut pose = [0.0; 6];
                pose[k] = step;
                probe.reading(nominal.height_m, &pose)
            });
            (up - down) / (2.0 * STEP)
        })
    })
}

/// A pose and its rate behind the lag of the gauges.
fn seen(gauges: Option<&[SmoothLag; 6]>, motion: &[Six; 2]) -> [Six; 2] {
    gauges.map_or(*motion, |gauges| {
        [gauges.each_ref().map(SmoothLag::output), std::array::from_fn(|k| gauges[k].rate(motion[0][k]))]
    })
}

/// Advances the gauges' lag, and the structural modes of the gauges, by a step (s) from one pose and rate to another.
fn gauges_follow(
    gauges: &mut Option<[SmoothLag; 6]>,
    modes: &mut Option<Box<Modes>>,
    before: &[Six; 2],
    after: &[Six; 2],
    step: f64,
) {
    let start = modes.as_ref().map(|_| seen(gauges.as_ref(), before));
    for (k, gauge) in gauges.iter_mut().flatten().enumerate() {
        gauge.set_step(step);
        gauge.advance([before[0][k], before[1][k]], [after[0][k], after[1][k]]);
    }
    if let (Some(modes), Some(start)) = (modes, start) {
        modes.gauges_follow(&start, &seen(gauges.as_ref(), after), step);
    }
}

#[cfg(test)]
mod tests;
