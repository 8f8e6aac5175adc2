//! Output lines: other settings while the machine runs.

use host_sim::word::WordKind;
use specgen_link::Refusal;
use specgen_link::client::{ClientError, Port};

use super::operator::{Ended, Operator};

impl<P: Port> Operator<P> {
    /// Places and words of settings of a trigger.
    pub(super) fn places_of(&self, line: usize, settings: &[(String, f64)]) -> Result<Vec<(usize, u64)>, String> {
        let description = self.session.description();
        let place = |name: &str| {
            let wanted = format!("trigger_{name}[{line}]");
            let known = description.config_names.iter().position(|known| *known == wanted);
            let suffix = format!("[{line}]");
            known.map(|place| (place, WordKind::of(&wanted))).ok_or_else(|| {
                let names = description.config_names.iter();
                let names = names.filter_map(|name| name.strip_prefix("trigger_")?.strip_suffix(&suffix));
                match names.collect::<Vec<_>>().join(", ") {
                    none if none.is_empty() => {
                        format!("the controller has {} triggers, from 0 on", description.lines())
                    }
                    names => format!("a trigger has no `{name}`: {names}"),
                }
            })
        };
        let word = |(name, value): &(String, f64)| {
            let (place, kind) = place(name)?;
            match kind {
                WordKind::Real => Ok((place, description.scalar.encode(*value))),
                WordKind::Integer if value.fract() == 0.0 && *value >= 0.0 => Ok((place, *value as u64)),
                WordKind::Integer => Err(format!("`{name}`: expected a whole number, found {value}")),
            }
        };
        settings.iter().map(word).collect()
    }

    /// Other settings of a trigger. Each is in force with the next tick, where the line begins anew.
    pub(super) fn set_trigger(&mut self, line: usize, settings: &[(String, f64)]) -> Result<(), Ended> {
        let places = self.places_of(line, settings).map_err(Ended::Refused)?;
        let mut words = self.session.config()?;
        for (place, word) in places {
            if let Some(slot) = words.get_mut(place) {
                *slot = word;
            }
        }
        match self.session.write_config(&words) {
            Err(ClientError::Refused(Refusal::Word { index })) => {
                let names = &self.session.description().config_names;
                let name = names.get(usize::from(index)).map_or("?", String::as_str);
                Err(Ended::Refused(format!("`{name}` is out of its range (docs/triggers.md); the settings stay")))
            }
            other => Ok(other?),
        }
    }
}
