//! Settings of a running controller: read, change, and write those of a spec.

use std::path::Path;

use host_sim::word::WordKind;
use serde_json::json;
use specgen_compiler::compile;
use specgen_link::Refusal;
use specgen_link::client::{ClientError, Port};

use super::answer::Settings;
use super::error::SessionError;
use super::operator::Operator;

impl<P: Port> Operator<P> {
    /// The settings in force, by name.
    pub(super) fn config(&mut self) -> Result<Settings, SessionError> {
        let words = self.session.config()?;
        let description = self.session.description();
        let value = |name: &str, word: u64| match WordKind::of(name) {
            WordKind::Integer => json!(word),
            WordKind::Real => json!(description.scalar.decode(word)),
        };
        let names = description.config_names.iter();
        Ok(Settings(names.zip(words).map(|(name, word)| (name.clone(), value(name, word))).collect()))
    }

    /// Writes the settings of a spec to the device, without its tables.
    pub(super) fn write_config(&mut self, path: &Path) -> Result<(), SessionError> {
        let compiled =
            self.meanwhile(|| compile::compile(path))?.map_err(|refused| SessionError::Failed(refused.into()))?;
        let (ours, theirs) = (&compiled.ir, self.session.description());
        let words = &compiled.ir.integrity.settings;
        if ours.scalar.bits() != theirs.scalar.bits() || words.len() != theirs.config_names.len() {
            let (path, own, own_bits) = (path.display(), words.len(), ours.scalar.bits());
            let (others, other_bits) = (theirs.config_names.len(), theirs.scalar.bits());
            return Err(SessionError::Refused(format!(
                "{path} has {own} settings in f{own_bits}, the device has {others} in f{other_bits}: the spec must have the same kind and scalar as the device's"
            )));
        }
        let of = path.display();
        self.configure(words, |name| format!("the device refused `{name}` of {of}: out of its range"))
    }

    /// Index of a setting.
    pub(super) fn setting(&self, name: &str) -> Option<usize> {
        self.session.description().config_names.iter().position(|known| known == name)
    }

    /// The settings in force, with these words changed.
    pub(super) fn changed(&mut self, words: &[(String, u64)]) -> Result<Vec<u64>, SessionError> {
        let mut settings = self.session.config()?;
        for (name, word) in words {
            if let Some(slot) = self.setting(name).and_then(|place| settings.get_mut(place)) {
                *slot = *word;
            }
        }
        Ok(settings)
    }

    /// Sends all settings. `refused` is the message about a setting of this name that the device refuses.
    pub(crate) fn configure(&mut self, words: &[u64], refused: impl Fn(&str) -> String) -> Result<(), SessionError> {
        self.in_control = true;
        self.session.write_config(words).map_err(|error| match error {
            ClientError::Refused(Refusal::Word { index }) => {
                let name = self.session.description().config_names.get(usize::from(index));
                SessionError::Refused(refused(name.map_or("?", String::as_str)))
            }
            other => other.into(),
        })
    }
}
