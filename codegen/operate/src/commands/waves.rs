//! Waves from files.

use std::path::Path;

use crate::wave::{WaveWords, read_wave, refused_wave};
use specgen_language::files;
use specgen_link::Refusal;
use specgen_link::client::{ClientError, Port};
use specgen_runtime::supervisor::Phase;

use super::error::{SessionError, no_input};
use super::operator::Operator;

impl<P: Port> Operator<P> {
    pub(super) fn wave_of(&self, path: &Path) -> Result<WaveWords, String> {
        let name = path.display();
        let text = files::text(path).map_err(|unread| format!("`{name}` cannot be read: {unread}"))?;
        self.wave_of_text(&text).map_err(|error| format!("{name}: {error}"))
    }

    /// A wave from the text of its file.
    pub(crate) fn wave_of_text(&self, text: &str) -> Result<WaveWords, String> {
        let single = self.session.description().scalar.bits() == 32;
        read_wave(text, self.session.period(), single).map_err(|error| error.trim_end().to_owned())
    }

    pub(super) fn wave(&mut self, path: &Path, on_edge: bool) -> Result<(), SessionError> {
        let wave = self.wave_of(path).map_err(SessionError::Refused)?;
        self.start_wave(&path.display().to_string(), &wave, on_edge)
    }

    /// Starts a wave, at once or at the next edge of the input line. `name` is for messages.
    pub(crate) fn start_wave(&mut self, name: &str, wave: &WaveWords, on_edge: bool) -> Result<(), SessionError> {
        // The unit depends on it.
        if wave.drives != (u64::from(self.session.status().phase) == Phase::Driving.word()) {
            let expected = if wave.drives {
                "a wave of voltages needs an open drive"
            } else {
                "an open drive needs `drive = true`"
            };
            return Err(SessionError::Refused(format!("{name}: {expected}; the machine is {}", self.state())));
        }
        self.in_control = true;
        self.session.start_wave(wave, on_edge).map_err(|error| match error {
            ClientError::Refused(Refusal::Unsupported) => no_input(),
            ClientError::Refused(Refusal::Word { index }) => {
                SessionError::Refused(format!("{name}: {}", refused_wave(index, wave.drives)))
            }
            ClientError::Refused(Refusal::State) if wave.drives => SessionError::Refused(format!(
                "{name}: not now; each leg must be at its `center`, with no wave in progress: {}",
                self.state()
            )),
            ClientError::Refused(Refusal::State) => SessionError::Refused(format!(
                "{name}: not now; the machine must be running, at the wave's center, with no wave or move in progress: {}",
                self.state()
            )),
            other => other.into(),
        })
    }
}
