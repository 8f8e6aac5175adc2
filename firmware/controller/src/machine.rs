// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! A machine, the control law under its supervisor: what is remembered, read and given out, and inputs and outputs as 64-bit words:
//! those of the law, and what the supervisor adds.

use crate::hysteresis::TABLES;
use crate::limits::DAC;
use crate::supervision::SUPERVISION;
use crate::tick::{INPUT_NAMES, INPUT_WORDS, OUTPUT_NAMES, OUTPUT_WORDS, output_words};
use crate::{COMMAND_WORDS, Config, Real, State, TickInput, TickOutput};
use specgen_runtime::supervisor::{self, Cause, Phase, Request, toward};
use specgen_runtime::{Digest, Snapshot as _};

/// Words of a supervised tick's input.
pub const MACHINE_INPUT_WORDS: usize = INPUT_WORDS + 2;

/// Words of a supervised tick's output.
pub const MACHINE_OUTPUT_WORDS: usize = OUTPUT_WORDS + 2;

/// Names of the input words. `request` is 0 none, 1 arm, 2 run, 3 hold, 4 ramp down, 5 acknowledge; `events` holds bits.
pub const MACHINE_INPUT_NAMES: [&str; MACHINE_INPUT_WORDS] = followed(&INPUT_NAMES, ["request", "events"]);

/// Names of the output words. `supervisor` is phase | cause << 8 | amplifier on << 16 | finding of the wiring check, or what the law has fallen back to << 17;
/// `conditions` has bit 1 << cause for each cause that is present, whether it has lasted or not, from bit 16 on the gauges or legs concerned, from
/// bit 22 on the gauges whose words were replaced by predictions; bit 28 is cause 16, bits 29 and 30 say how far the law has fallen back, bit 31 is cause 17, see
/// [`Fallback`](supervisor::Fallback).
pub const MACHINE_OUTPUT_NAMES: [&str; MACHINE_OUTPUT_WORDS] = followed(&OUTPUT_NAMES, ["supervisor", "conditions"]);

/// State of the supervisor in this controller's arithmetic.
pub type Supervisor = supervisor::Supervisor<Real>;

specgen_runtime::state! { |words|
    /// Everything that is remembered from tick to tick. No NaN or infinity is ever stored here. Reset: disarmed, and [`State::new`].
    pub struct Machine {
        /// State of the control law.
        pub state: State = State::new(), part;
        /// Phase, cause and what the supervisor watches.
        pub supervisor: Supervisor = Supervisor::new(), part;
    }
}

impl Machine {
    /// Fingerprint of everything that later ticks depend on.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        digest.word(self.state.digest());
        self.supervisor.digest(&mut digest);
        digest.finish()
    }
}

/// What a tick reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MachineInput {
    /// Command and readings, as the control law takes them.
    pub tick: TickInput,
    /// What is wanted of the supervisor; it holds for as long as it is given.
    pub request: Request,
    /// What the target noticed since the last tick, as bits: [`MISSED_TICK`](supervisor::MISSED_TICK),
    /// [`LINK_LOST`](supervisor::LINK_LOST), [`INTEGRITY`](supervisor::INTEGRITY), [`CONVERTER`](supervisor::CONVERTER),
    /// [`STOP`](supervisor::STOP), [`AMPLIFIER`](supervisor::AMPLIFIER), [`STALLED`](supervisor::STALLED).
    pub events: u32,
}

/// What a tick yields. Every number is finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MachineOutput {
    /// Codes and voltages that go out, and the status of the control law where it ran.
    pub tick: TickOutput,
    /// What the machine does over the coming interval.
    pub phase: Phase,
    /// Why, if it was forced upon it.
    pub cause: Cause,
    /// Whether the amplifiers are to be on over the coming interval.
    pub amplifier_on: bool,
    /// Word of what the wiring check found, or of what the law has fallen back to, a [`Finding`](supervisor::Finding); 0 is nothing.
    pub finding: u32,
}

impl MachineOutput {
    /// phase | cause << 8 | amplifier on << 16 | finding << 17.
    #[inline]
    #[must_use]
    pub fn supervisor_word(&self) -> u32 {
        self.phase.word() as u32
            | (self.cause.word() as u32) << 8
            | (self.amplifier_on as u32) << 16
            | self.finding << 17
    }
}

impl MachineInput {
    /// From words in the order of [`MACHINE_INPUT_NAMES`].
    #[must_use]
    pub fn from_words(words: &[u64; MACHINE_INPUT_WORDS]) -> Self {
        // The law's words stand first, and are not copied: there always are so many.
        let tick = words.first_chunk().unwrap_or(&[0; INPUT_WORDS]);
        Self {
            tick: TickInput::from_words(tick),
            request: Request::from_word(words[INPUT_WORDS]),
            events: words[INPUT_WORDS + 1] as u32,
        }
    }

    /// Of what a target was asked for and what it measured, see [`TickInput::measured`].
    #[must_use]
    pub fn measured(
        command: &[u64; COMMAND_WORDS],
        gauge: &[Real; 6],
        wrench: &[Real; 6],
        request: Request,
        events: u32,
    ) -> Self {
        Self { tick: TickInput::measured(command, gauge, wrench), request, events }
    }
}

/// Words in the order of [`MACHINE_OUTPUT_NAMES`], of a tick and of the machine that it left.
#[must_use]
pub fn machine_output_words(output: &MachineOutput, machine: &Machine) -> [u64; MACHINE_OUTPUT_WORDS] {
    let mut words = [0; MACHINE_OUTPUT_WORDS];
    for (slot, word) in words.iter_mut().zip(output_words(&output.tick, &machine.state)) {
        *slot = word;
    }
    words[OUTPUT_WORDS] = output.supervisor_word() as u64;
    words[OUTPUT_WORDS + 1] = machine.supervisor.conditions as u64;
    words
}

/// The names of the law's words, and two more.
const fn followed<const N: usize, const ALL: usize>(
    law: &[&'static str; N],
    more: [&'static str; 2],
) -> [&'static str; ALL] {
    let mut all = [more[1]; ALL];
    let mut k = 0;
    while k < N {
        all[k] = law[k];
        k += 1;
    }
    all[N] = more[0];
    all
}

/// Codes held, on their way to rest, or in the pulse of the wiring check; the memories follow what is really sent.
pub(crate) fn move_codes(config: &Config, state: &mut State, supervisor: &mut Supervisor) {
    let step = supervisor.step_to_rest(&SUPERVISION, config.code_limits().max_step);
    for ((index, leg), table) in state.legs.iter_mut().enumerate().zip(&TABLES) {
        leg.code = toward(leg.code, supervisor.goal(&SUPERVISION, index), step);
        leg.memory.apply(table, DAC.drive(leg.code));
    }
}

/// Whether gauges are compared with the model although the law does not run: the codes must stand still.
#[inline]
pub(crate) fn compares(supervisor: &Supervisor) -> bool {
    matches!(supervisor.phase, Phase::Arming | Phase::Holding) && !supervisor.is_checking(&SUPERVISION)
}
