//! A machine as words and back.

use super::Supervised;

/// Reason why words are not a valid machine.
#[derive(Debug, thiserror::Error)]
pub enum SnapshotError {
    /// Their number differs from that of this controller's machine.
    #[error("a state of {given} words; this controller's has {expected}")]
    Length {
        /// How many.
        given: usize,
        /// How many it has.
        expected: usize,
    },
    /// An invalid word.
    #[error("word {index} of the state is {word:016x}, which is invalid")]
    Word {
        /// Its index.
        index: usize,
        /// Its bits.
        word: u64,
    },
}

impl Supervised {
    /// Words of [`Supervised::save`].
    pub fn state_words(&self) -> usize {
        self.controller.engine.machine_words()
    }

    /// The machine as words.
    pub fn save(&self) -> Vec<u64> {
        let mut words = vec![0; self.state_words()];
        self.controller.engine.save_machine(&mut words);
        words
    }

    /// Takes the machine that [`Supervised::save`] wrote.
    ///
    /// # Errors
    /// If the words are not a machine of this controller; it is then unchanged.
    pub fn load(&mut self, words: &[u64]) -> Result<(), SnapshotError> {
        let expected = self.state_words();
        if words.len() != expected {
            return Err(SnapshotError::Length { given: words.len(), expected });
        }
        let loaded = self.controller.engine.load_machine(words);
        loaded.map_err(|index| SnapshotError::Word { index, word: words.get(index).copied().unwrap_or_default() })
    }
}
