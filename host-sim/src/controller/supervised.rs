//! The supervised tick of a controller, which the other targets run.

mod snapshot;
mod standing;

use std::fmt;

use specgen_runtime::supervisor::{Cause, Finding, FindingText, Phase};

use super::{Controller, ControllerError, TickController};

pub use snapshot::SnapshotError;
pub use standing::RestingReadings;

/// Additional input words of the supervised tick: request, events.
const MORE_INPUTS: usize = 2;
/// Additional output words: the supervisor's, conditions.
const MORE_OUTPUTS: usize = 2;

/// The supervisor's word of an output row, decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MachineWord {
    /// Number of a [`Phase`].
    pub phase: u8,
    /// Number of a [`Cause`].
    pub cause: u8,
    /// Whether the amplifiers are on.
    pub amplifier_on: bool,
    /// Word of a [`Finding`]: of the wiring check, or the fallback stage; 0 is nothing.
    pub finding: u32,
}

impl MachineWord {
    /// phase | cause << 8 | amplifier on << 16 | finding << 17.
    pub fn of(word: u64) -> Self {
        let [phase, cause, on, ..] = word.to_le_bytes();
        Self { phase, cause, amplifier_on: on & 1 == 1, finding: (word as u32) >> 17 }
    }

    /// Whether the machine refuses to run: it has the open drive only.
    #[must_use]
    pub fn cannot_run(&self) -> bool {
        u64::from(self.cause) == Cause::NotIdentified.word()
    }
}

/// Phase and, if there is one, cause as text; unknown values as numbers.
impl fmt::Display for MachineWord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.among::<[u32; 0]>(&[]))
    }
}

impl MachineWord {
    /// The same with the finding of the wiring check or the fallback stage, and its alternatives: `alike` are sets of
    /// equivalent faults, as words of [`Finding`].
    pub fn among<S: AsRef<[u32]>>(&self, alike: &[S]) -> String {
        let Self { phase, cause, finding, .. } = *self;
        let of =
            Phase::from_word(u64::from(phase)).map_or_else(|| format!("phase {phase}"), |phase| phase.name().into());
        match Cause::from_word(u64::from(cause)) {
            Some(cause) => {
                let finding = Finding::of_word(finding);
                let parts = [cause.name().to_owned(), FindingText(finding, alike).to_string()];
                let parts: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
                if parts.is_empty() { of } else { format!("{of}: {}", parts.join(", ")) }
            }
            None => format!("{of}: cause {cause}"),
        }
    }
}

/// A controller with its supervisor: configuration and constants of a [`Controller`], and a machine of its own.
pub struct Supervised {
    controller: Controller,
}

impl Supervised {
    /// A controller under its supervisor, disarmed.
    pub fn new(mut controller: Controller) -> Self {
        controller.engine.reset_machine();
        Self { controller }
    }

    /// The inner controller: its description and configuration. Its own state is not that of the machine.
    pub fn controller(&self) -> &Controller {
        &self.controller
    }

    /// Takes a configuration; the machine is kept.
    ///
    /// # Errors
    /// If the number of words is wrong or a word is refused; the present configuration is then kept.
    pub fn configure(&mut self, words: &[u64]) -> Result<(), ControllerError> {
        self.controller.configure(words)
    }

    /// Names of the input words of [`Supervised::step`].
    pub fn input_names(&self) -> Vec<String> {
        let mut names = self.controller.description.input_names.clone();
        names.extend(["request", "events"].map(str::to_owned));
        names
    }

    /// Names of the output words of [`Supervised::step`].
    pub fn output_names(&self) -> Vec<String> {
        let mut names = self.controller.description.output_names.clone();
        names.extend(["supervisor", "conditions"].map(str::to_owned));
        names
    }

    /// As at power-up: disarmed.
    pub fn reset(&mut self) {
        self.controller.engine.reset_machine();
    }

    /// One supervised tick; returns the supervisor's word of the output.
    ///
    /// # Panics
    /// If `input` or `output` does not have two words more than the description.
    pub fn step(&mut self, input: &[u64], output: &mut [u64]) -> MachineWord {
        let description = &self.controller.description;
        assert_eq!(input.len(), description.input_names.len() + MORE_INPUTS, "input words");
        assert_eq!(output.len(), description.output_names.len() + MORE_OUTPUTS, "output words");
        self.controller.engine.step_machine(input, output);
        MachineWord::of(output[description.output_names.len()])
    }

    /// Digest of the machine.
    pub fn digest(&self) -> u64 {
        self.controller.engine.machine_digest()
    }

    /// Another machine in the same state, for several continuations from here.
    pub fn fork(&self) -> Self {
        Self { controller: self.controller.fork() }
    }
}
