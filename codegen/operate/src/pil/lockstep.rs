//! Two controllers as one: the host library and a device on the link, stepped with the same words and compared bit for bit.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use host_sim::closed_loop::LEGS;
use host_sim::controller::{ControllerError, MachineWord, Supervised, TickController};
use host_sim::description::Description;
use serde::Serialize;
use specgen_link::client::{Client, ClientError, Port, Timeout};
use specgen_link::{CostUnit, Identity, Reply, Request, WORDS, put_words};

use super::difference::Difference;
use super::session::{self, OpenError, OpenSession};

/// Largest number of ticks for arming.
const ARMING: u64 = 100_000;
/// Phases of the supervisor.
const DISARMED: u8 = 0;
const RUNNING: u8 = 2;
/// `setpoint_kind` in the settings of six legs: leg displacements.
const SETPOINT_LEG: u64 = 1;
/// Requests to the supervisor.
const ARM: u64 = 1;
const RUN: u64 = 2;

/// Why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum Stop {
    /// Host and device differ.
    #[error("{0}")]
    Difference(Difference),
    /// The link failed.
    #[error(transparent)]
    Link(ClientError),
    /// The supervisor does not reach the running phase, or leaves it.
    #[error("tick {tick}: the machine is {word} instead of running; host and device agree")]
    Supervisor {
        /// Tick since power-up.
        tick: u64,
        /// Its phase and cause.
        word: MachineWord,
    },
    /// The host's controller refuses the settings.
    #[error(transparent)]
    Settings(ControllerError),
    /// Interrupted by the user.
    #[error("interrupted")]
    Interrupted,
}

/// Cost of a stage of the tick on the device.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    /// `supervise` is the whole tick.
    pub name: String,
    /// Number of calls.
    pub calls: u64,
    /// Minimum.
    pub min: u64,
    /// Mean.
    pub mean: f64,
    /// Maximum.
    pub max: u64,
    /// For the whole tick: peak stack, bytes; none if the device does not measure it.
    pub stack: Option<u32>,
}

/// The host's controller and a device, as one [`TickController`] for any scenario. After a reset, it first arms the machine with
/// the readings of the first tick plus the displacements of the legs during arming.
///
/// If the two differ, the link fails or the supervisor leaves the running phase, it outputs NaN voltages, which end any scenario;
/// [`Lockstep::stop`] then has the reason.
pub struct Lockstep<P> {
    host: Supervised,
    client: Client<P>,
    identity: Identity,
    names: Vec<String>,
    config: Vec<u64>,
    input: Vec<u64>,
    ours: Vec<u64>,
    theirs: Vec<u64>,
    bytes: [u8; WORDS * size_of::<u64>()],
    /// The machine is at reset.
    fresh: bool,
    tick: u64,
    total: u64,
    stop: Option<Stop>,
    interrupted: &'static AtomicBool,
    waited: Duration,
}

impl<P: Port> Lockstep<P> {
    /// Opens the link and checks that the device runs the same controller. Setting `interrupted` ends the run.
    ///
    /// # Errors
    /// No answer, or another controller.
    pub fn open(
        host: Supervised,
        port: P,
        timeout: Timeout,
        interrupted: &'static AtomicBool,
    ) -> Result<Self, OpenError> {
        let OpenSession { client, identity, description: theirs, .. } = session::open(port, timeout)?;
        let ours = host.controller().description();
        if &theirs != ours {
            let (name, digest, version, bits) = (&theirs.name, &theirs.digest, &theirs.version, theirs.scalar.bits());
            let (own_name, own_digest, own_version) = (&ours.name, &ours.digest, &ours.version);
            let own_bits = ours.scalar.bits();
            return Err(OpenError::Other(format!(
                "the device runs the controller `{name}` of spec digest {digest}, specgen {version}, f{bits}; expected `{own_name}` of {own_digest}, specgen {own_version}, f{own_bits}: \
                 build and flash it from this spec"
            )));
        }
        let config = host.controller().default_config();
        let (inputs, names) = (host.input_names().len(), host.output_names());
        let found = [identity.config_words, identity.input_words, identity.output_words].map(usize::from);
        let expected = [config.len(), inputs, names.len()];
        if found != expected {
            return Err(OpenError::Other(format!(
                "the device has {found:?} words of settings, inputs and outputs; expected {expected:?}: build and flash it with this specgen"
            )));
        }
        Ok(Self {
            input: vec![0; inputs],
            ours: vec![0; names.len()],
            theirs: vec![0; names.len()],
            bytes: [0; WORDS * size_of::<u64>()],
            host,
            client,
            identity,
            names,
            config,
            fresh: false,
            tick: 0,
            total: 0,
            stop: None,
            interrupted,
            waited: Duration::ZERO,
        })
    }

    /// Why the run ended early, if it did; cleared by the next reset.
    #[must_use]
    pub fn stop(&self) -> Option<&Stop> {
        self.stop.as_ref()
    }

    /// Takes the reason.
    pub fn take_stop(&mut self) -> Option<Stop> {
        self.stop.take()
    }

    /// Ticks in which host and device were equal, in all runs.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.total
    }

    /// Time spent waiting for the device.
    #[must_use]
    pub fn waited(&self) -> Duration {
        self.waited
    }

    /// Unit of the device's costs.
    #[must_use]
    pub fn counted(&self) -> CostUnit {
        self.identity.counted
    }

    /// The line, and the number of damaged frames.
    pub fn line(&mut self) -> (&mut P, u32) {
        let damaged = self.client.damaged();
        (self.client.port(), damaged)
    }

    /// Costs of the stages of a tick on the device since it started, the whole tick first.
    ///
    /// # Errors
    /// As [`Client::ask`].
    pub fn costs(&mut self) -> Result<Vec<Cost>, ClientError> {
        let mut costs = Vec::new();
        for index in 0..self.identity.stages {
            let Reply::Stage(stage) = self.client.ask(&Request::LockstepStage { index })? else {
                return Err(ClientError::Unexpected);
            };
            if stage.calls > 0 {
                costs.push(Cost {
                    name: stage.name.to_owned(),
                    calls: stage.calls,
                    min: stage.smallest,
                    mean: stage.sum as f64 / stage.calls as f64,
                    max: stage.largest,
                    stack: stage.stack,
                });
            }
        }
        Ok(costs)
    }

    /// Sends the current settings, with or without a reset.
    fn settle(&mut self, reset: bool) -> Result<(), Stop> {
        let words = put_words(&self.config, &mut self.bytes).ok_or(Stop::Link(ClientError::TooLong))?;
        let request = if reset { Request::LockstepReset { config: words } } else { Request::WriteConfig { words } };
        match self.client.ask(&request).map_err(Stop::Link)? {
            Reply::Done => Ok(()),
            _ => Err(Stop::Link(ClientError::Unexpected)),
        }
    }

    /// Runs one tick on both, with this request to the supervisor. Returns the supervisor's word.
    fn tick(&mut self, input: &[u64], request: u64) -> Result<MachineWord, Stop> {
        if self.interrupted.load(Ordering::Relaxed) {
            return Err(Stop::Interrupted);
        }
        for (slot, word) in self.input.iter_mut().zip(input.iter().chain(&[request, 0])) {
            *slot = *word;
        }
        let word = self.host.step(&self.input, &mut self.ours);
        let digest = self.host.digest();

        let start = Instant::now();
        let input = put_words(&self.input, &mut self.bytes).ok_or(Stop::Link(ClientError::TooLong))?;
        let reply = self.client.ask(&Request::LockstepStep { input }).map_err(Stop::Link)?;
        let Reply::Stepped { digest: theirs, output, .. } = reply else {
            return Err(Stop::Link(ClientError::Unexpected));
        };
        if !output.read_words(&mut self.theirs) {
            return Err(Stop::Link(ClientError::Unexpected));
        }
        self.waited += start.elapsed();
        let scalar = self.host.controller().description().scalar;
        let (host, device) = ((&self.ours[..], digest), (&self.theirs[..], theirs));
        if let Some(difference) = Difference::first(self.tick, &self.names, scalar, host, device) {
            return Err(Stop::Difference(difference));
        }
        self.tick += 1;
        self.total += 1;
        Ok(word)
    }

    /// Arms the machine at rest. The readings include the displacements of the legs in the wiring check, by the controller's model.
    ///
    /// For six legs, the set-point stays at the measured displacements until the machine is running, so that the run starts with
    /// the first tick of the trajectory. Otherwise the supervisor would move the legs to its first point for up to a period.
    fn arm(&mut self, input: &[u64]) -> Result<(), Stop> {
        let mut input = self.stays(input);
        let mut standing = self.host.standing(&input).map_err(Stop::Settings)?;
        let mut word = self.tick(&input, ARM)?;
        while word.phase != RUNNING {
            if self.tick >= ARMING || word.cannot_run() {
                return Err(Stop::Supervisor { tick: self.tick, word });
            }
            // The supervisor accepts `run` once it is armed.
            standing.show(&self.host, &self.ours, &mut input);
            word = self.tick(&input, if word.phase == DISARMED { ARM } else { RUN })?;
        }
        Ok(())
    }

    /// The input row with the gauges' words as set-point, if the set-point is of leg displacements.
    fn stays(&self, input: &[u64]) -> Vec<u64> {
        let description = self.host.controller().description();
        let mut row = input.to_vec();
        let of_legs = description.config_names.iter().position(|name| name == "setpoint_kind");
        if of_legs.and_then(|place| self.config.get(place)) != Some(&SETPOINT_LEG) {
            return row;
        }
        for leg in 0..LEGS {
            let places = ["setpoint", "displacement"].map(|stem| description.input(&format!("{stem}[{leg}]")));
            if let [Ok(setpoint), Ok(gauge)] = places
                && let Some(reading) = input.get(gauge)
                && let Some(slot) = row.get_mut(setpoint)
            {
                *slot = *reading;
            }
        }
        row
    }

    fn advance(&mut self, input: &[u64]) -> Result<(), Stop> {
        if self.fresh {
            self.arm(input)?;
            self.fresh = false;
        }
        let word = self.tick(input, RUN)?;
        if word.phase == RUNNING { Ok(()) } else { Err(Stop::Supervisor { tick: self.tick - 1, word }) }
    }
}

impl<P: Port> TickController for Lockstep<P> {
    fn description(&self) -> &Description {
        self.host.controller().description()
    }

    fn default_config(&self) -> Vec<u64> {
        self.host.controller().default_config()
    }

    fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        self.host.configure(words)?;
        self.config = words.to_vec();
        // At reset they are sent with the next one.
        if !self.fresh
            && let Err(stop) = self.settle(false)
        {
            self.stop = Some(stop);
        }
        Ok(())
    }

    fn reset(&mut self) {
        self.host.reset();
        self.tick = 0;
        self.stop = self.settle(true).err();
        self.fresh = true;
    }

    fn step(&mut self, input: &[u64], output: &mut [u64]) {
        if self.stop.is_none() {
            self.stop = self.advance(input).err();
        }
        if self.stop.is_some() {
            output.fill(u64::MAX);
            return;
        }
        for (slot, word) in output.iter_mut().zip(&self.ours) {
            *slot = *word;
        }
    }

    fn state_digest(&self) -> u64 {
        self.host.digest()
    }
}
