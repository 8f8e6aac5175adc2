//! A machine under a controller, tick by tick.
//!
//! At tick n (time t_n) the controller gets the set-point for the end of the coming interval, the gauge readings and the
//! wrench of t_n; its voltages are held until t_{n+1}, where the pose is scored. With latency they are held one or more
//! intervals later.

use std::collections::VecDeque;
use std::fmt::Write as _;

use super::contact::{WorkPart, Wrench};
use super::frames::UserFrames;
use super::gauge::{GaugeSignal, Probe};
use super::geometry::{angles, rotation};
use super::linear::Six;
use super::machine::Machine;
use super::sensor::ForceSensor;
use super::specimen::Specimen;
use super::study::pose_of;
use super::table::PoseErrors;
use crate::closed_loop::{Preparation, RunError, ticks_within};
use crate::controller::TickController;
use crate::description::DescriptionError;
use crate::noise::{Gauge, Gaussian, amplifier};
use crate::plant::NoiseParameters;
use crate::trace::Trace;
use crate::trajectory::{PoseTarget, PoseTrajectory};
use crate::word::Scalar;

/// Status bit of a generator that is busy with bias, move or trajectory.
pub const BUSY: u32 = 1 << 18;

/// Noise around a machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Gauges and amplifiers; the gauge's figures are per reading of each of the six.
    pub channels: NoiseParameters,
    /// Force sensor, N and N m rms.
    pub force: Six,
}

impl Noise {
    /// No noise, no quantisation.
    pub const NONE: Self = Self { channels: NoiseParameters::NONE, force: [0.0; 6] };

    /// That of the parameter files.
    #[must_use]
    pub fn of(specimen: &Specimen) -> Self {
        Self { channels: specimen.legs[0].noise, force: specimen.nominal.force_noise }
    }
}

/// What is wrong with a gauge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GaugeFault {
    /// It repeats its last reading.
    Stuck,
    /// It gives this number, in m or V as the controller expects; any bits.
    Reading(f64),
}

/// A machine with gauges, converters, force sensor and noise.
#[derive(Debug, Clone)]
pub struct PlatformRig {
    machine: Machine,
    height: f64,
    /// Voltage at which the legs rest, V.
    rest_voltage: f64,
    probes: [Probe; 6],
    /// Distance of each probe from its plane at rest, m.
    rest_distances: Six,
    gauges: [Gauge; 6],
    range: [f64; 2],
    signal: GaugeSignal,
    faults: [Option<GaugeFault>; 6],
    last_readings: Six,
    force_sensor: ForceSensor,
    amplifiers: [Gaussian; 6],
}

impl PlatformRig {
    /// A machine as built, with noise from one seed. Gauges give metres.
    #[must_use]
    pub fn new(specimen: &Specimen, noise: &Noise, seed: u64) -> Self {
        let nominal = &specimen.nominal;
        Self {
            machine: Machine::new(specimen),
            height: nominal.height_m,
            rest_voltage: nominal.rest_voltage_v,
            probes: nominal.probes,
            rest_distances: nominal.probes.map(|probe| probe.distance(nominal.height_m, &[0.0; 6])),
            gauges: std::array::from_fn(|k| Gauge::new(&noise.channels, seed, k as u64)),
            range: nominal.gauge_range_m,
            signal: GaugeSignal::Metres,
            faults: [None; 6],
            last_readings: [0.0; 6],
            force_sensor: ForceSensor::new(&noise.force, &nominal.force_range, seed),
            amplifiers: std::array::from_fn(|k| amplifier(&noise.channels, seed, k as u64)),
        }
    }

    /// Makes the gauges speak volts, or metres again.
    #[must_use]
    pub fn with_signal(mut self, signal: GaugeSignal) -> Self {
        self.signal = signal;
        self
    }

    /// Replaces the gauges' places.
    #[must_use]
    pub fn with_probes(mut self, probes: [Probe; 6]) -> Self {
        self.probes = probes;
        self.rest_distances = probes.map(|probe| probe.distance(self.height, &[0.0; 6]));
        self
    }

    /// Pre-cycle, rest and zero of the gauges, see [`Machine::prepare`].
    pub fn prepare(&mut self, preparation: &Preparation) {
        self.machine.prepare(preparation);
    }

    /// Draws the noise of the next `ticks` ticks now: clones made after this share it. The bits of a run stay as they are.
    pub fn draw_ahead(&mut self, ticks: usize) {
        self.gauges.iter_mut().for_each(|gauge| gauge.draw_ahead(ticks));
        self.amplifiers.iter_mut().for_each(|noise| noise.draw_ahead(ticks));
        self.force_sensor.draw_ahead(ticks);
    }

    /// The machine.
    #[must_use]
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The machine, to touch work parts or to change its step.
    pub fn machine_mut(&mut self) -> &mut Machine {
        &mut self.machine
    }

    /// Makes gauge `index` faulty, or whole again.
    pub fn set_fault(&mut self, index: usize, fault: Option<GaugeFault>) {
        if let Some(slot) = self.faults.get_mut(index) {
            *slot = fault;
        }
    }

    /// Reads the six gauges, in m or V.
    pub fn read_gauges(&mut self) -> Six {
        let pose = self.machine.pose();
        let turn = rotation(angles(&pose));
        let [low, high] = self.range;
        for k in 0..6 {
            // Drawn whatever the fault, so that a fault does not shift the noise of a run.
            let moved = self.probes[k].distance_turned(self.height, &pose, &turn) - self.rest_distances[k];
            let reading = self.gauges[k].read(moved);
            let held = if reading > high {
                high
            } else if reading < low {
                low
            } else {
                reading
            };
            match self.faults[k] {
                None => self.last_readings[k] = self.signal.of(k, held),
                Some(GaugeFault::Stuck) => {}
                Some(GaugeFault::Reading(number)) => self.last_readings[k] = number,
            }
        }
        self.last_readings
    }

    /// Reads the force sensor: force and torque on the platform, N and N m.
    pub fn read_wrench(&mut self) -> Six {
        let wrench = self.machine.wrench();
        self.force_sensor.read(&wrench)
    }

    /// Holds six voltages (V) for `interval` (s), each with the noise of its amplifier.
    pub fn hold(&mut self, voltages: &Six, interval: f64) {
        let mut inputs = *voltages;
        for (input, noise) in inputs.iter_mut().zip(&mut self.amplifiers) {
            *input += noise.draw() - self.rest_voltage;
        }
        self.machine.hold(&inputs, interval);
    }
}

/// What the controller is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Command {
    /// Stay.
    #[default]
    Hold,
    /// Follow the set-points of the words.
    Stream,
    /// Go to the set-point.
    Move,
    /// Run the trajectory of the selector.
    Trajectory,
}

impl Command {
    /// Its word.
    #[must_use]
    pub fn word(self) -> u64 {
        match self {
            Self::Hold => 0,
            Self::Stream => 1,
            Self::Move => 2,
            Self::Trajectory => 3,
        }
    }
}

/// The command words of one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Request {
    /// What is asked for.
    pub command: Command,
    /// Number of the trajectory.
    pub selector: u32,
    /// Whether the set-point is a new one: the stream counter then moves on.
    pub fresh: bool,
    /// The set-point.
    pub target: PoseTarget,
}

impl Request {
    /// The next set-point of a stream.
    #[must_use]
    pub fn stream(target: PoseTarget) -> Self {
        Self { command: Command::Stream, selector: 0, fresh: true, target }
    }
}

/// One tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick {
    /// Status word.
    pub status: u32,
    /// The controller's target at the end of the tick, with the bias.
    pub target: Six,
    /// The pose that the controller found at the beginning of the tick.
    pub measured: Six,
    /// Its voltages, V.
    pub voltage: Six,
    /// True pose at the end of the tick, from rest.
    pub pose: Six,
    /// True wrench on the platform at the end of the tick.
    pub wrench: Wrench,
}

/// Where a bench stopped: what [`Bench::resume`] needs besides rig and controller.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Paused {
    sequence: u64,
    ticks: usize,
    underway: VecDeque<Six>,
}

/// A rig and a controller that run together.
pub struct Bench<'a> {
    rig: &'a mut PlatformRig,
    controller: &'a mut dyn TickController,
    interval: f64,
    wiring: Wiring,
    scalar: Scalar,
    input: Vec<u64>,
    output: Vec<u64>,
    sequence: u64,
    ticks: usize,
    /// Voltages on their way to the amplifiers.
    underway: VecDeque<Six>,
    trace: Option<Trace>,
}

impl<'a> Bench<'a> {
    /// Resets `controller` to power-up. Voltages reach the amplifiers `latency` intervals (s) late.
    ///
    /// # Errors
    /// If the controller lacks a word of the platform interface.
    pub fn new(
        rig: &'a mut PlatformRig,
        controller: &'a mut dyn TickController,
        interval: f64,
        latency: usize,
    ) -> Result<Self, RunError> {
        controller.reset();
        let underway = VecDeque::from(vec![[rig.rest_voltage; 6]; latency]);
        Self::resume(rig, controller, interval, &Paused { sequence: 0, ticks: 0, underway })
    }

    /// Goes on from where a bench stopped, with clones of its rig and controller.
    pub(super) fn resume(
        rig: &'a mut PlatformRig,
        controller: &'a mut dyn TickController,
        interval: f64,
        paused: &Paused,
    ) -> Result<Self, RunError> {
        let wiring = Wiring::of(controller)?;
        let description = controller.description();
        Ok(Self {
            wiring,
            scalar: description.scalar,
            input: vec![0; description.input_names.len()],
            output: vec![0; description.output_names.len()],
            rig,
            controller,
            interval,
            sequence: paused.sequence,
            ticks: paused.ticks,
            underway: paused.underway.clone(),
            trace: None,
        })
    }

    /// Where it stands.
    pub(super) fn pause(self) -> Paused {
        Paused { sequence: self.sequence, ticks: self.ticks, underway: self.underway }
    }

    /// Keeps every word from here on.
    pub fn record(&mut self) {
        self.trace = Some(Trace::new(self.controller.description().clone()));
    }

    /// The words kept.
    #[must_use]
    pub fn into_trace(self) -> Option<Trace> {
        self.trace
    }

    /// The rig.
    pub fn rig(&mut self) -> &mut PlatformRig {
        self.rig
    }

    /// The output words of the last tick.
    #[must_use]
    pub fn output(&self) -> &[u64] {
        &self.output
    }

    /// Changes the settings, from the next tick on.
    ///
    /// # Errors
    /// If the controller refuses them.
    pub fn configure(&mut self, words: &[u64]) -> Result<(), RunError> {
        Ok(self.controller.configure(words)?)
    }

    /// Runs one tick.
    ///
    /// # Errors
    /// If a voltage is not finite.
    pub fn tick(&mut self, request: &Request) -> Result<Tick, RunError> {
        let scalar = self.scalar;
        if request.fresh {
            self.sequence = (self.sequence + 1) & u64::from(u32::MAX);
        }
        let (gauge, wrench) = (self.rig.read_gauges(), self.rig.read_wrench());
        self.input[self.wiring.command] = request.command.word();
        self.input[self.wiring.selector] = u64::from(request.selector);
        self.input[self.wiring.sequence] = self.sequence;
        for k in 0..6 {
            self.input[self.wiring.pose[k]] = scalar.encode(request.target.pose[k]);
            self.input[self.wiring.rate[k]] = scalar.encode(request.target.rate[k]);
            self.input[self.wiring.acceleration[k]] = scalar.encode(request.target.acceleration[k]);
            self.input[self.wiring.gauge[k]] = scalar.encode(gauge[k]);
            self.input[self.wiring.wrench[k]] = scalar.encode(wrench[k]);
        }
        self.controller.step(&self.input, &mut self.output);
        if let Some(trace) = &mut self.trace {
            trace.push(&self.input, &self.output, self.controller.state_digest());
        }
        let six = |places: &[usize; 6]| places.map(|place| scalar.decode(self.output[place]));
        let voltage = six(&self.wiring.voltage);
        if let Some(leg) = voltage.iter().position(|v| !v.is_finite()) {
            return Err(RunError::NotFinite { tick: self.ticks, leg });
        }
        let (target, measured) = (six(&self.wiring.target), six(&self.wiring.measured));
        self.underway.push_back(voltage);
        let held = self.underway.pop_front().unwrap_or(voltage);
        self.rig.hold(&held, self.interval);
        self.ticks += 1;
        Ok(Tick {
            status: self.output[self.wiring.status] as u32,
            target,
            measured,
            voltage,
            pose: self.rig.machine.pose(),
            wrench: self.rig.machine.wrench(),
        })
    }

    /// Holds until the controller is at its bias pose, at most `limit` (s); returns how long that took, s.
    ///
    /// # Errors
    /// If it takes longer, or as [`Bench::tick`].
    pub fn arm(&mut self, limit: f64) -> Result<f64, RunError> {
        let ticks = ticks_within(limit, self.interval)?;
        let mut status = 0;
        for tick in 1..=ticks {
            status = self.tick(&Request::default())?.status;
            if status & BUSY == 0 {
                return Ok(tick as f64 * self.interval);
            }
        }
        Err(RunError::NotReady { limit, status })
    }
}

/// What a run keeps besides its errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Record {
    /// Nothing.
    #[default]
    Errors,
    /// A sample per tick of the trajectory.
    Samples,
    /// Samples, and every word from power-up on.
    Trace,
}

/// How a trajectory is run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunOptions {
    /// Control interval, s.
    pub interval: f64,
    /// Bias pose of the controller: true poses are scored against this plus the trajectory.
    pub bias: Six,
    /// Frames of the controller, in which the trajectory is given; none: parallel to {B}, about P_C.
    pub frames: Option<UserFrames>,
    /// How long the controller may take to its bias pose, s.
    pub arming: f64,
    /// Rest between that and the trajectory, s.
    pub settle: f64,
    /// Intervals by which voltages come late.
    pub latency: usize,
    /// Touched, unloaded, when the trajectory starts.
    pub part: Option<WorkPart>,
    /// Gauge faults: gauge, from and to time of the trajectory (s), kind.
    pub faults: Vec<(usize, f64, f64, GaugeFault)>,
    /// What is kept.
    pub record: Record,
}

impl RunOptions {
    /// Free motion at a control interval (s) with a bias pose.
    #[must_use]
    pub fn new(interval: f64, bias: Six) -> Self {
        Self {
            interval,
            bias,
            frames: None,
            arming: 60.0,
            settle: 0.2,
            latency: 0,
            part: None,
            faults: Vec::new(),
            record: Record::Errors,
        }
    }
}

/// The end of one tick of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseSample {
    /// Since the start of the trajectory, s.
    pub time: f64,
    /// Bias and trajectory.
    pub target: Six,
    /// The tick.
    pub tick: Tick,
}

/// A run of a platform.
#[derive(Debug, Clone, PartialEq)]
pub struct PlatformRun {
    /// True pose against bias and trajectory.
    pub errors: PoseErrors,
    /// One per tick of the trajectory, if they are kept.
    pub samples: Vec<PoseSample>,
    /// Every word, if it is kept.
    pub trace: Option<Trace>,
    /// Status bits seen during the trajectory.
    pub status: u32,
    /// How long the way to the bias pose took, s.
    pub arming: f64,
}

impl PlatformRig {
    /// Runs `controller`, reset to power-up: way to the bias pose, rest, contact, then `trajectory` as a stream.
    ///
    /// # Errors
    /// If the controller lacks a word, does not come to its bias pose, gives a voltage that is not finite, or there would
    /// be no tick.
    pub fn run(
        &mut self,
        controller: &mut dyn TickController,
        trajectory: &dyn PoseTrajectory,
        options: &RunOptions,
    ) -> Result<PlatformRun, RunError> {
        let interval = options.interval;
        let ticks = ticks_within(trajectory.duration(), interval)?;
        let (mut bench, arming) = self.ready(controller, options)?;
        let mut errors = PoseErrors::default();
        let mut samples = Vec::new();
        let mut seen = 0;
        for tick in 0..ticks {
            for &(gauge, from, to, fault) in &options.faults {
                let now = tick as f64 * interval;
                bench.rig.set_fault(gauge, (now >= from && now < to).then_some(fault));
            }
            let time = (tick + 1) as f64 * interval;
            let wanted = trajectory.target(time);
            let tick = bench.tick(&Request::stream(wanted))?;
            let target = pose_of(options, &wanted);
            errors.add(&std::array::from_fn(|k| target[k] - tick.pose[k]));
            seen |= tick.status;
            if options.record != Record::Errors {
                samples.push(PoseSample { time, target, tick });
            }
        }
        Ok(PlatformRun { errors, samples, trace: bench.into_trace(), status: seen, arming })
    }

    /// Runs `controller` likewise, but lets it play its own trajectory `selector`, move to the start included, until it
    /// stands or for `limit` (s). True poses are scored against its own targets.
    ///
    /// # Errors
    /// As [`PlatformRig::run`].
    pub fn play(
        &mut self,
        controller: &mut dyn TickController,
        selector: u32,
        options: &RunOptions,
        limit: f64,
    ) -> Result<PlatformRun, RunError> {
        let interval = options.interval;
        let ticks = ticks_within(limit, interval)?;
        let (mut bench, arming) = self.ready(controller, options)?;
        let request = Request { command: Command::Trajectory, selector, ..Request::default() };
        let mut errors = PoseErrors::default();
        let mut samples = Vec::new();
        let mut seen = 0;
        for tick in 0..ticks {
            let time = (tick + 1) as f64 * interval;
            let tick = bench.tick(&request)?;
            seen |= tick.status & !BUSY;
            if tick.status & BUSY == 0 {
                break;
            }
            errors.add(&std::array::from_fn(|k| tick.target[k] - tick.pose[k]));
            if options.record != Record::Errors {
                samples.push(PoseSample { time, target: tick.target, tick });
            }
        }
        Ok(PlatformRun { errors, samples, trace: bench.into_trace(), status: seen, arming })
    }

    /// A bench with the controller at its bias pose, rested, in contact; and how long the way took, s.
    pub(super) fn ready<'a>(
        &'a mut self,
        controller: &'a mut dyn TickController,
        options: &RunOptions,
    ) -> Result<(Bench<'a>, f64), RunError> {
        let mut bench = Bench::new(self, controller, options.interval, options.latency)?;
        if options.record == Record::Trace {
            bench.record();
        }
        let arming = bench.arm(options.arming)?;
        if options.settle >= options.interval {
            for _ in 0..ticks_within(options.settle, options.interval)? {
                bench.tick(&Request::default())?;
            }
        }
        if let Some(part) = options.part {
            bench.rig.machine.touch(part);
        }
        Ok((bench, arming))
    }
}

impl PlatformRun {
    /// CSV, one line per tick that was kept: what was wanted, where it was, what the controller saw and did. SI units.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let six = |stem: &str| (0..6).map(|k| format!(",{stem}[{k}]")).collect::<String>();
        let mut out = String::from("time_s");
        for stem in ["target", "pose", "measured", "voltage"] {
            out.push_str(&six(stem));
        }
        out.push_str(",status\n");
        for PoseSample { time, target, tick } in &self.samples {
            // Writing to a String cannot fail, here and below.
            let _ = write!(out, "{time:.6}");
            for value in [target, &tick.pose, &tick.measured].into_iter().flatten() {
                let _ = write!(out, ",{value:.4e}");
            }
            for value in tick.voltage {
                let _ = write!(out, ",{value:.4}");
            }
            let _ = writeln!(out, ",{}", tick.status);
        }
        out
    }
}

/// Places of the words that the bench connects.
struct Wiring {
    command: usize,
    selector: usize,
    sequence: usize,
    pose: [usize; 6],
    rate: [usize; 6],
    acceleration: [usize; 6],
    gauge: [usize; 6],
    wrench: [usize; 6],
    voltage: [usize; 6],
    target: [usize; 6],
    measured: [usize; 6],
    status: usize,
}

impl Wiring {
    fn of(controller: &dyn TickController) -> Result<Self, DescriptionError> {
        let description = controller.description();
        let six = |stem: &str, find: &dyn Fn(&str) -> Result<usize, DescriptionError>| {
            let mut places = [0; 6];
            for (k, place) in places.iter_mut().enumerate() {
                *place = find(&format!("{stem}[{k}]"))?;
            }
            Ok::<_, DescriptionError>(places)
        };
        let input = |name: &str| description.input(name);
        let output = |name: &str| description.output(name);
        Ok(Self {
            command: input("command")?,
            selector: input("selector")?,
            sequence: input("sequence")?,
            pose: six("setpoint", &input)?,
            rate: six("setpoint_rate", &input)?,
            acceleration: six("setpoint_acceleration", &input)?,
            gauge: six("gauge", &input)?,
            wrench: six("wrench", &input)?,
            voltage: six("voltage", &output)?,
            target: six("target", &output)?,
            measured: six("pose", &output)?,
            status: output("status")?,
        })
    }
}

#[cfg(test)]
mod tests;
