//! Lock-step with a host: the device computes a tick whenever the host asks for one. The host's plant closes the loop, and
//! the device's converters stay where they are.

use crate::bytes::{Bytes, WORDS, put_words};
use crate::endpoint::Device;
use crate::message::{Counted, Identity, Refusal, Reply, Request, Stage};

/// A controller that can be stepped from outside.
pub trait Machine {
    /// The controller's own description, `key=value` lines.
    fn description(&self) -> &str;

    /// Words of its settings, inputs and outputs: at most [`WORDS`] each.
    fn words(&self) -> [usize; 3];

    /// Stages that are counted, the whole tick first.
    fn stages(&self) -> usize;

    /// In what they are counted.
    fn counted(&self) -> Counted;

    /// Takes settings; what it remembers stays.
    ///
    /// # Errors
    /// The place of the first word out of range; nothing has changed then.
    fn configure(&mut self, config: &[u64]) -> Result<(), usize>;

    /// As at power-up, with the settings in force.
    fn reset(&mut self);

    /// One tick; the digest after it, and what it cost.
    fn step(&mut self, input: &[u64], output: &mut [u64]) -> (u64, u32);

    /// What a stage has cost so far.
    fn stage(&self, index: usize) -> Option<Stage<'_>>;
}

/// Carries out the requests of a lock-step on a machine; refuses all others.
pub struct Lockstep<M> {
    machine: M,
    /// Words of a request, then those of the answer.
    words: [u64; WORDS],
    bytes: [u8; WORDS * size_of::<u64>()],
    /// Whether it was put at reset: before that there are no settings to step with.
    ready: bool,
}

impl<M: Machine> Lockstep<M> {
    /// Waits for the first reset.
    pub const fn new(machine: M) -> Self {
        Self { machine, words: [0; WORDS], bytes: [0; WORDS * size_of::<u64>()], ready: false }
    }

    /// The machine.
    pub fn machine(&self) -> &M {
        &self.machine
    }

    /// The machine, to change it behind the link's back.
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

    fn configure(&mut self, config: Bytes<'_>) -> Reply<'static> {
        let [count, ..] = self.machine.words();
        let Some(words) = self.words.get_mut(..count) else { return Reply::Refused(Refusal::TooLong) };
        if !config.read_words(words) {
            return Reply::Refused(Refusal::Length { expected: count as u16 });
        }
        match self.machine.configure(words) {
            Ok(()) => Reply::Done,
            Err(index) => Reply::Refused(Refusal::Word { index: index as u16 }),
        }
    }

    fn reset(&mut self, config: Bytes<'_>) -> Reply<'static> {
        let reply = self.configure(config);
        if reply == Reply::Done {
            self.machine.reset();
            self.ready = true;
        }
        reply
    }

    fn step(&mut self, input: Bytes<'_>) -> Reply<'_> {
        if !self.ready {
            return Reply::Refused(Refusal::State);
        }
        let [_, inputs, outputs] = self.machine.words();
        let mut row = [0; WORDS];
        let Some(row) = row.get_mut(..inputs) else { return Reply::Refused(Refusal::TooLong) };
        if !input.read_words(row) {
            return Reply::Refused(Refusal::Length { expected: inputs as u16 });
        }
        let Some(words) = self.words.get_mut(..outputs) else { return Reply::Refused(Refusal::TooLong) };
        let (digest, cost) = self.machine.step(row, words);
        match put_words(words, &mut self.bytes) {
            Some(output) => Reply::Stepped { cost, digest, output },
            None => Reply::Refused(Refusal::TooLong),
        }
    }
}

/// Bytes of a text that one answer carries.
const PIECE: usize = 512;

impl<M: Machine> Device for Lockstep<M> {
    fn execute(&mut self, request: &Request<'_>) -> Reply<'_> {
        match *request {
            Request::Hello => Reply::Identity(self.identity()),
            Request::Describe { offset } => piece(self.machine.description().as_bytes(), offset),
            Request::WriteConfig { words } => self.configure(words),
            Request::LockstepReset { config } => self.reset(config),
            Request::LockstepStep { input } => self.step(input),
            Request::LockstepStage { index } => {
                self.machine.stage(usize::from(index)).map_or(Reply::Refused(Refusal::Unsupported), Reply::Stage)
            }
            _ => Reply::Refused(Refusal::Unsupported),
        }
    }
}

/// The bytes of something longer from `offset` on, as many as an answer carries.
#[must_use]
pub fn piece(whole: &[u8], offset: u32) -> Reply<'_> {
    let rest = whole.get(offset as usize..).unwrap_or_default();
    let bytes = Bytes(rest.get(..PIECE).unwrap_or(rest));
    Reply::Chunk { offset, total: whole.len() as u32, bytes }
}
