//! Lock-step with a host: the device computes a tick for each request of the host. The host's plant closes the loop;
//! the device's converters do not change.

use crate::bytes::{Bytes, WORDS, put_words};
use crate::endpoint::Device;
use crate::message::{CostUnit, Identity, Refusal, Reply, Request, Stage};

/// A controller that can be stepped from outside.
pub trait Machine {
    /// The controller's own description, `key=value` lines.
    fn description(&self) -> &str;

    /// Words of its settings, inputs and outputs: at most [`WORDS`] each.
    fn words(&self) -> [usize; 3];

    /// Number of counted stages, the whole tick first.
    fn stages(&self) -> usize;

    /// Unit of the counts.
    fn counted(&self) -> CostUnit;

    /// Takes settings; the state is unchanged.
    ///
    /// # Errors
    /// The index of the first word out of range; nothing has changed then.
    fn configure(&mut self, config: &[u64]) -> Result<(), usize>;

    /// Resets to power-up, with the present settings.
    fn reset(&mut self);

    /// One tick; returns the digest after it, and its cost.
    fn step(&mut self, input: &[u64], output: &mut [u64]) -> (u64, u32);

    /// Total cost of a stage so far.
    fn stage(&self, index: usize) -> Option<Stage<'_>>;
}

/// State of a lock-step besides the machine, for one of up to N words of settings, inputs and outputs each.
#[derive(Debug)]
pub struct Session<const N: usize = WORDS> {
    /// Of the answer.
    bytes: [[u8; size_of::<u64>()]; N],
    /// Whether it was reset: before that there are no settings.
    ready: bool,
}

impl<const N: usize> Default for Session<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Session<N> {
    /// Waits for the first reset.
    #[must_use]
    pub const fn new() -> Self {
        Self { bytes: [[0; size_of::<u64>()]; N], ready: false }
    }

    /// Refuses steps until the next reset.
    pub const fn end(&mut self) {
        self.ready = false;
    }

    /// Room for the bytes of an answer.
    pub fn buffer(&mut self) -> &mut [u8] {
        self.bytes.as_flattened_mut()
    }

    /// [`Request::WriteConfig`].
    pub fn configure(&mut self, machine: &mut impl Machine, config: Bytes<'_>) -> Reply<'static> {
        let [count, ..] = machine.words();
        let mut row = [0; N];
        let Some(words) = row.get_mut(..count) else { return Reply::Refused(Refusal::TooLong) };
        if !config.read_words(words) {
            return Reply::Refused(Refusal::Length { expected: count as u16 });
        }
        match machine.configure(words) {
            Ok(()) => Reply::Done,
            Err(index) => Reply::Refused(Refusal::Word { index: index as u16 }),
        }
    }

    /// [`Request::LockstepReset`].
    pub fn reset(&mut self, machine: &mut impl Machine, config: Bytes<'_>) -> Reply<'static> {
        let reply = self.configure(machine, config);
        if reply == Reply::Done {
            machine.reset();
            self.ready = true;
        }
        reply
    }

    /// [`Request::LockstepStep`].
    pub fn step(&mut self, machine: &mut impl Machine, input: Bytes<'_>) -> Reply<'_> {
        if !self.ready {
            return Reply::Refused(Refusal::State);
        }
        let [_, inputs, outputs] = machine.words();
        let mut row = [0; N];
        let Some(row) = row.get_mut(..inputs) else { return Reply::Refused(Refusal::TooLong) };
        if !input.read_words(row) {
            return Reply::Refused(Refusal::Length { expected: inputs as u16 });
        }
        let mut out = [0; N];
        let Some(words) = out.get_mut(..outputs) else { return Reply::Refused(Refusal::TooLong) };
        let (digest, cost) = machine.step(row, words);
        match put_words(words, self.bytes.as_flattened_mut()) {
            Some(output) => Reply::Stepped { cost, digest, output },
            None => Reply::Refused(Refusal::TooLong),
        }
    }
}

/// Carries out the requests of a lock-step on a machine; refuses all others.
pub struct Lockstep<M> {
    machine: M,
    session: Session,
}

impl<M: Machine> Lockstep<M> {
    /// Waits for the first reset.
    pub const fn new(machine: M) -> Self {
        Self { machine, session: Session::new() }
    }

    /// The machine.
    pub fn machine(&self) -> &M {
        &self.machine
    }

    /// The machine, for changes outside the link.
    pub fn machine_mut(&mut self) -> &mut M {
        &mut self.machine
    }

    fn identity(&self) -> Identity {
        let [config_words, input_words, output_words] = self.machine.words().map(|count| count as u16);
        Identity {
            config_words,
            input_words,
            output_words,
            stages: self.machine.stages() as u8,
            counted: self.machine.counted(),
            description: self.machine.description().len() as u32,
        }
    }
}

/// Bytes of text in one answer.
pub const PIECE: usize = 512;

impl<M: Machine> Device for Lockstep<M> {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        match *request {
            Request::Hello => Reply::Identity(self.identity()),
            Request::Describe { offset } => piece(self.machine.description().as_bytes(), offset, PIECE),
            Request::WriteConfig { words } => self.session.configure(&mut self.machine, words),
            Request::LockstepReset { config } => self.session.reset(&mut self.machine, config),
            Request::LockstepStep { input } => self.session.step(&mut self.machine, input),
            Request::LockstepStage { index } => {
                self.machine.stage(usize::from(index)).map_or(Reply::Refused(Refusal::Unsupported), Reply::Stage)
            }
            _ => Reply::Refused(Refusal::Unsupported),
        }
    }
}

/// The bytes of something longer from `offset` on, at most `most`.
#[must_use]
pub fn piece(whole: &[u8], offset: u32, most: usize) -> Reply<'_> {
    let rest = whole.get(offset as usize..).unwrap_or_default();
    let bytes = Bytes(rest.get(..most).unwrap_or(rest));
    Reply::Chunk { offset, total: whole.len() as u32, bytes }
}
