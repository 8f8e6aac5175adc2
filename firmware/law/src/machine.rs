//! A machine: the control law under its supervisor. Its input and output, also as 64-bit words: those of the law, and
//! those of the supervisor.

use specgen_runtime::supervisor::{Cause, Phase, Request};

use crate::spec::{ConstSpec, ControlLaw as _, Input as _, InputOf, Machine, Spec, TickOutput};

/// Input of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MachineInput<P: Spec> {
    /// Command and readings, as the control law takes them.
    pub tick: InputOf<P>,
    /// Request to the supervisor. It applies to every tick in which it is given.
    pub request: Request,
    /// The target's events since the last tick, as bits: [`MISSED_TICK`](specgen_runtime::supervisor::MISSED_TICK),
    /// [`LINK_LOST`](specgen_runtime::supervisor::LINK_LOST), [`INTEGRITY`](specgen_runtime::supervisor::INTEGRITY),
    /// [`CONVERTER`](specgen_runtime::supervisor::CONVERTER), [`STOP`](specgen_runtime::supervisor::STOP),
    /// [`AMPLIFIER`](specgen_runtime::supervisor::AMPLIFIER), [`STALLED`](specgen_runtime::supervisor::STALLED).
    pub events: u32,
}

/// Output of a tick. Every number is finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MachineOutput<P: Spec> {
    /// Codes and voltages, and the status of the control law if it ran.
    pub tick: TickOutput<P>,
    /// Phase of the next interval.
    pub phase: Phase,
    /// Cause of the phase, if it was forced.
    pub cause: Cause,
    /// Whether the amplifiers are on over the next interval.
    pub amplifier_on: bool,
    /// Word of a [`Finding`](specgen_runtime::supervisor::Finding): of the wiring check, or the fallback stage of the
    /// law; 0 is none.
    pub finding: u32,
}

impl<P: Spec> MachineOutput<P> {
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

impl<P: Spec> MachineInput<P> {
    /// From words in the order of the controller's `MACHINE_INPUT_NAMES`.
    #[must_use]
    pub fn read(p: P, words: &[u64]) -> Self {
        let (law, [request, events]) = words.split_last_chunk().unwrap_or((words, &[0; 2]));
        Self { tick: InputOf::<P>::read(p, law), request: Request::from_word(*request), events: *events as u32 }
    }
}

impl<P: ConstSpec> MachineInput<P> {
    /// From words in the order of the controller's `MACHINE_INPUT_NAMES`.
    #[must_use]
    pub fn from_words(words: &P::MachineInputWords) -> Self {
        Self::read(P::CONSTANTS, words.as_ref())
    }

    /// From the command and the measured values of a target. A target without a wrench sensor gives NaN for the wrench.
    #[must_use]
    pub fn measured(
        command: &P::CommandWords,
        gauge: &[P::Real; 6],
        wrench: &[P::Real; 6],
        request: Request,
        events: u32,
    ) -> Self {
        Self { tick: InputOf::<P>::measured(P::CONSTANTS, command.as_ref(), gauge, wrench), request, events }
    }
}

/// Writes words in the order of the controller's `MACHINE_OUTPUT_NAMES`, from a tick's output and the machine after it.
pub fn write_machine_output<P: Spec>(p: P, output: &MachineOutput<P>, machine: &Machine<P>, words: &mut [u64]) {
    if let Some((law, last)) = words.split_last_chunk_mut() {
        P::Law::write_output(p, &output.tick, &machine.state, law);
        *last = [output.supervisor_word() as u64, machine.supervisor.conditions as u64];
    }
}

/// The names of the law's words, and two more.
#[must_use]
pub const fn followed_by<const N: usize, const ALL: usize>(
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
