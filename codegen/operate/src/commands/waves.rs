//! Waves from files.

use std::path::Path;

use crate::wave::{read_wave, refused_wave};
use specgen_language::files;
use specgen_link::Refusal;
use specgen_link::client::{ClientError, Port};

use super::error::{SessionError, no_input};
use super::operator::Operator;

impl<P: Port> Operator<P> {
    pub(super) fn wave_of(&self, path: &Path) -> Result<(Vec<u64>, [u64; 6]), String> {
        let name = path.display();
        let text = files::text(path).map_err(|unread| format!("`{name}` cannot be read: {unread}"))?;
        self.wave_of_text(&text).map_err(|error| format!("{name}: {error}"))
    }

    /// Words and center of a wave from the text of its file.
    pub(crate) fn wave_of_text(&self, text: &str) -> Result<(Vec<u64>, [u64; 6]), String> {
        let single = self.session.description().scalar.bits() == 32;
        read_wave(text, self.session.period(), single).map_err(|error| error.trim_end().to_owned())
    }

    pub(super) fn wave(&mut self, path: &Path, on_edge: bool) -> Result<(), SessionError> {
        let (words, center) = self.wave_of(path).map_err(SessionError::Refused)?;
        self.start_wave(&path.display().to_string(), &words, &center, on_edge)
    }

    /// Starts a wave, at once or at the next edge of the input line. `name` is for messages.
    pub(crate) fn start_wave(
        &mut self,
        name: &str,
        words: &[u64],
        center: &[u64; 6],
        on_edge: bool,
    ) -> Result<(), SessionError> {
        self.in_control = true;
        self.session.start_wave(words, center, on_edge).map_err(|error| match error {
            ClientError::Refused(Refusal::Unsupported) => no_input(),
            ClientError::Refused(Refusal::Word { index }) => SessionError::Refused(format!("{name}: {}", refused_wave(index))),
            ClientError::Refused(Refusal::State) => SessionError::Refused(format!(
                "{name}: not now; the machine must be running, at the wave's center, with no wave or move in progress: {}",
                self.state()
            )),
            other => other.into(),
        })
    }
}
