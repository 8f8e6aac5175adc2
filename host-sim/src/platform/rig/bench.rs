//! A rig and a controller that run together, tick by tick.
//!
//! At tick n (time t_n) the controller gets the set-point for the end of the next interval, the gauge readings and the
//! wrench of t_n. Its voltages are held until t_{n+1}, where the pose is scored. With latency they are delayed by one
//! or more intervals.

use std::collections::VecDeque;

use super::PlatformRig;
use crate::closed_loop::{RunError, ticks_within};
use crate::controller::TickController;
use crate::description::DescriptionError;
use crate::platform::contact::Wrench;
use crate::platform::linear::Six;
use crate::trace::Trace;
use crate::trajectory::PoseTarget;
use crate::word::Scalar;

/// Status bit of a generator that is busy with bias, move or trajectory.
pub const BUSY: u32 = 1 << 18;
/// Status bits of refused or stale set-points: the controller held instead of following.
pub const NOT_FOLLOWED: u32 = 3 << 16;

/// Command to the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Command {
    /// Stay.
    #[default]
    Hold = 0,
    /// Follow the set-points of the words.
    Stream = 1,
    /// Go to the set-point.
    Move = 2,
    /// Run the trajectory of the selector.
    Trajectory = 3,
}

impl Command {
    /// Its word.
    pub fn word(self) -> u64 {
        self as u64
    }
}

/// The command words of one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Request {
    /// What is asked for.
    pub command: Command,
    /// Number of the trajectory.
    pub selector: u32,
    /// Whether the set-point is a new one: the stream counter is then incremented.
    pub fresh: bool,
    /// The set-point.
    pub target: PoseTarget,
    /// Correction of the request, m and rad; for controllers with corrections.
    pub correction: Six,
}

impl Request {
    /// The next set-point of a stream.
    pub fn stream(target: PoseTarget) -> Self {
        Self { command: Command::Stream, selector: 0, fresh: true, target, ..Self::default() }
    }
}

/// One tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tick {
    /// Status word.
    pub status: u32,
    /// The controller's target at the end of the tick, with the bias.
    pub target: Six,
    /// The pose that the controller computed at the beginning of the tick.
    pub measured: Six,
    /// Its voltages, V.
    pub voltage: Six,
    /// True pose at the end of the tick, from rest.
    pub pose: Six,
    /// True wrench on the platform at the end of the tick.
    pub wrench: Wrench,
}

/// State of a stopped bench, which [`Bench::resume`] needs besides rig and controller.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchState {
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
        Self::resume(rig, controller, interval, &BenchState { sequence: 0, ticks: 0, underway })
    }

    /// Continues a stopped bench, with clones of its rig and controller.
    ///
    /// # Errors
    /// As [`Bench::new`].
    pub fn resume(
        rig: &'a mut PlatformRig,
        controller: &'a mut dyn TickController,
        interval: f64,
        paused: &BenchState,
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

    /// Ends it, with the state for [`Bench::resume`].
    #[must_use]
    pub fn pause(self) -> BenchState {
        BenchState { sequence: self.sequence, ticks: self.ticks, underway: self.underway }
    }

    /// Stores every word from here on.
    pub fn record(&mut self) {
        self.trace = Some(Trace::new(self.controller.description().clone()));
    }

    /// The words kept.
    pub fn into_trace(self) -> Option<Trace> {
        self.trace
    }

    /// The rig.
    pub fn rig(&mut self) -> &mut PlatformRig {
        self.rig
    }

    /// The output words of the last tick.
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
        for (place, value) in self.wiring.correction.iter().flatten().zip(request.correction) {
            self.input[*place] = scalar.encode(value);
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
            pose: self.rig.plant.pose(),
            wrench: self.rig.plant.wrench(),
        })
    }

    /// Stays at a set-point for another part of a mains period each time, if the gauges have mains: no machine begins its motions in
    /// step with them.
    ///
    /// # Errors
    /// As [`Bench::tick`].
    pub fn shift_mains_phase(&mut self, at: PoseTarget) -> Result<(), RunError> {
        /// Inverse of the golden ratio: its multiples are spread evenly.
        const SPREAD: f64 = 0.618_033_988_749_894_9;
        let Some(period) = self.rig.mains_period() else { return Ok(()) };
        let (whole, ticks) = (period / self.interval, self.ticks as f64);
        let part = SPREAD * ticks - libm::floor(SPREAD * ticks);
        for _ in 0..(part * whole) as usize {
            self.tick(&Request::stream(at))?;
        }
        Ok(())
    }

    /// Holds until the controller is at its bias pose, at most `limit` (s); returns the time, s.
    ///
    /// # Errors
    /// If it takes longer, or as [`Bench::tick`].
    pub fn arm(&mut self, limit: f64) -> Result<f64, RunError> {
        self.until_arrived(&Request::default(), limit).map(|(ticks, _)| ticks as f64 * self.interval)
    }

    /// Moves to a pose of the user's frames (m and rad), at most for `limit` (s); returns the union of the status bits.
    ///
    /// # Errors
    /// As [`Bench::arm`].
    pub fn move_to(&mut self, pose: &Six, limit: f64) -> Result<u32, RunError> {
        let target = PoseTarget { pose: *pose, ..PoseTarget::default() };
        let request = Request { command: Command::Move, target, ..Request::default() };
        self.until_arrived(&request, limit).map(|(_, seen)| seen)
    }

    /// Repeats the request until nothing moves; returns the number of ticks, and the union of the status bits.
    fn until_arrived(&mut self, request: &Request, limit: f64) -> Result<(usize, u32), RunError> {
        let (mut status, mut seen) = (0, 0);
        for tick in 1..=ticks_within(limit, self.interval)? {
            status = self.tick(request)?.status;
            seen |= status & !BUSY;
            if status & BUSY == 0 {
                return Ok((tick, seen));
            }
        }
        Err(RunError::NotReady { limit, status })
    }
}

/// Indices of the words that the bench connects.
struct Wiring {
    command: usize,
    selector: usize,
    sequence: usize,
    pose: [usize; 6],
    rate: [usize; 6],
    acceleration: [usize; 6],
    /// None if the controller takes no correction.
    correction: Option<[usize; 6]>,
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
        Ok(Self {
            command: description.input("command")?,
            selector: description.input("selector")?,
            sequence: description.input("sequence")?,
            pose: description.inputs("setpoint")?,
            rate: description.inputs("setpoint_rate")?,
            acceleration: description.inputs("setpoint_acceleration")?,
            correction: description.inputs("correction").ok(),
            gauge: description.inputs("gauge")?,
            wrench: description.inputs("wrench")?,
            voltage: description.outputs("voltage")?,
            target: description.outputs("target")?,
            measured: description.outputs("pose")?,
            status: description.output("status")?,
        })
    }
}
