//! The machine as 64-bit words and back, and the supervised tick with a recorder.

use specgen_runtime::recorder::{Recorder, Row};
use specgen_runtime::snapshot::{InvalidState, Reader, Snapshot, StatePart, Writer};

use crate::machine::{MachineInput, MachineOutput};
use crate::spec::{ConstSpec, ControlLaw as _, Input as _, Machine, Spec, TickOutput};
use crate::words::WordArray as _;

impl<P: Spec> Machine<P> {
    /// The whole state as words; the slice must have the state's length.
    pub fn save_into(&self, words: &mut [u64]) {
        Snapshot::save(self, &mut Writer::new(words));
    }

    /// Its words from the `first`-th on, as many as fit.
    #[cold]
    pub fn save_piece(&self, first: usize, words: &mut [u64]) {
        let Ok(()) = self.show(&mut StatePart::new(words, first));
    }
}

impl<P: ConstSpec> Machine<P> {
    /// The whole state as words.
    pub fn save(&self, words: &mut P::MachineWords) {
        self.save_into(words.as_mut());
    }

    /// The machine that [`Machine::save`] wrote.
    ///
    /// # Errors
    /// The first invalid word: not finite, of the wrong kind, a code out of limits, or not a staircase of extrema.
    pub fn load(words: &P::MachineWords) -> Result<Self, InvalidState> {
        let mut reader = Reader::new(words.as_ref()).within(P::CONSTANTS.sizes());
        let mut machine = Self::new(P::Law::at_reset(&P::CONSTANTS.reset()));
        machine.restore(&mut reader)?;
        Ok(machine)
    }
}

impl<P: ConstSpec> MachineInput<P> {
    /// As words in the order of the controller's `MACHINE_INPUT_NAMES`.
    #[must_use]
    pub fn to_words(&self) -> P::MachineInputWords {
        let mut all = P::MachineInputWords::ZERO;
        let mut words = Writer::new(all.as_mut());
        self.tick.save(&mut words);
        words.word(self.request.word());
        words.word(self.events as u64);
        all
    }
}

/// The recorder's part after a tick.
#[inline]
pub fn record_after<P: ConstSpec>(
    machine: &Machine<P>,
    input: &MachineInput<P>,
    output: &MachineOutput<P>,
    recorder: &mut Recorder<'_>,
) {
    let TickOutput { dac_code: codes, status, .. } = output.tick;
    let row = Row { codes, status, supervisor: output.supervisor_word() };
    recorder.push(input.to_words().as_ref(), &row, || machine.digest());
}
