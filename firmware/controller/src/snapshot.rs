// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! The machine as 64-bit words and back, and the supervised tick with a recorder.
//!
//! A record of [`supervise_recorded`] replays bit for bit wherever it begins: `specgen replay`.

pub use specgen_runtime::recorder;
pub use specgen_runtime::snapshot::Invalid;

use crate::machine::{MACHINE_INPUT_WORDS, Machine, MachineInput, MachineOutput};
use crate::supervised::supervise;
use crate::{CONFIG_WORDS, Config, permitted};
use specgen_runtime::record::Layout;
use specgen_runtime::recorder::{Recorder, Row};
use specgen_runtime::snapshot::{Field, Piece, Reader, Snapshot, Writer};

/// Words of a [`Machine`].
pub const MACHINE_STATE_WORDS: usize = Machine::WORDS;
/// Words of this controller's records.
pub const RECORD_LAYOUT: Layout =
    Layout { config: CONFIG_WORDS, input: MACHINE_INPUT_WORDS, state: MACHINE_STATE_WORDS };

impl Machine {
    /// Everything that later ticks depend on, as words.
    pub fn save(&self, words: &mut [u64; MACHINE_STATE_WORDS]) {
        self.save_into(words);
    }

    /// The same into a slice of that length.
    pub fn save_into(&self, words: &mut [u64]) {
        Snapshot::save(self, &mut Writer::new(words));
    }

    /// Words of it from the `first`-th on, as many as have room.
    #[cold]
    pub fn save_piece(&self, first: usize, words: &mut [u64]) {
        let Ok(()) = self.show(&mut Piece::new(words, first));
    }

    /// The machine that [`Machine::save`] wrote.
    ///
    /// # Errors
    /// The first word that no machine holds: not finite, none of its kind, a code out of limits, no staircase of extrema.
    pub fn load(words: &[u64; MACHINE_STATE_WORDS]) -> Result<Self, Invalid> {
        let mut reader = Reader::new(words).within(permitted::STATE);
        let mut machine = Self::new();
        machine.restore(&mut reader)?;
        Ok(machine)
    }
}

impl MachineInput {
    /// As words in the order of `MACHINE_INPUT_NAMES`.
    #[must_use]
    pub fn to_words(&self) -> [u64; MACHINE_INPUT_WORDS] {
        let mut all = [0; MACHINE_INPUT_WORDS];
        let mut words = Writer::new(&mut all);
        self.tick.save(&mut words);
        words.word(self.request.word());
        words.word(self.events as u64);
        all
    }
}

/// [`supervise`], and what the recorder is to keep of it.
pub fn supervise_recorded(
    config: &Config,
    machine: &mut Machine,
    input: &MachineInput,
    recorder: &mut Recorder<'_>,
) -> MachineOutput {
    record_before(config, machine, recorder);
    let output = supervise(config, machine, input);
    record_after(machine, input, &output, recorder);
    output
}

/// What a recorder keeps before a tick under these settings.
#[inline]
pub fn record_before(config: &Config, machine: &Machine, recorder: &mut Recorder<'_>) {
    if recorder.opens() {
        recorder.open_with(&config.to_words(), || machine.digest(), |words| machine.save_into(words));
    }
}

/// What it keeps after the tick. Compiled here, for speed, and in a frame of its own, which is done with before the law needs the stack.
#[inline(never)]
pub fn record_after(machine: &Machine, input: &MachineInput, output: &MachineOutput, recorder: &mut Recorder<'_>) {
    let row = Row { codes: output.tick.dac_code, status: output.tick.status, supervisor: output.supervisor_word() };
    recorder.push(&input.to_words(), &row, || machine.digest());
}
