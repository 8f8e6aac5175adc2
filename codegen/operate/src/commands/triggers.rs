//! Digital lines: trigger settings of outputs, and commands that wait for an edge of the input.

use crate::command::Command;
use serde::Serialize;
use specgen_link::client::{ClientError, Port};
use specgen_link::{EdgeStatus, Refusal};
use specgen_runtime::pending::Stage;

use super::error::{SessionError, no_input};
use super::operator::Operator;
use specgen_language::outcome::Outcome;

/// State of the input line.
#[derive(Serialize)]
pub struct EdgeState {
    /// Number of the stage of the last command.
    stage: u8,
    state: &'static str,
    /// Rising edges since power-up.
    edges: u32,
    /// Tick of the edge at which that command started or was refused.
    tick: Option<u64>,
}

impl Outcome for EdgeState {
    fn text(&self) -> String {
        let edges = match self.edges {
            1 => "1 edge".to_owned(),
            count => format!("{count} edges"),
        };
        let of_tick = self.tick.map(|tick| format!(" of tick {tick}")).unwrap_or_default();
        format!("{}{of_tick}; {edges} of the input line so far\n", self.state)
    }
}

impl<P: Port> Operator<P> {
    /// Names and words of a trigger's settings.
    pub(super) fn trigger_words(&self, line: usize, settings: &[(String, f64)]) -> Result<Vec<(String, u64)>, String> {
        let description = self.session.description();
        let full = |name: &str| {
            let suffix = format!("[{line}]");
            let full = format!("trigger_{name}{suffix}");
            self.setting(&full).map(|_| full).ok_or_else(|| {
                let names = description.config_names.iter();
                let names = names.filter_map(|name| name.strip_prefix("trigger_")?.strip_suffix(&suffix));
                match names.collect::<Vec<_>>().join(", ") {
                    none if none.is_empty() => {
                        format!("the controller has {} triggers, numbered from 0", description.lines())
                    }
                    names => format!("a trigger has no `{name}`; it has {names}"),
                }
            })
        };
        let word = |(name, value): &(String, f64)| {
            let name = full(name)?;
            let word = description.encode(&name, *value).map_err(|error| error.to_string())?;
            Ok((name, word))
        };
        settings.iter().map(word).collect()
    }

    /// Changes settings of a trigger. They take effect at the next tick, which restarts the line.
    pub(super) fn set_trigger(&mut self, line: usize, settings: &[(String, f64)]) -> Result<(), SessionError> {
        let words = self.trigger_words(line, settings).map_err(SessionError::Refused)?;
        let words = self.changed(&words)?;
        let refused =
            |name: &str| format!("`{name}` is out of its range (docs/triggers.md); the settings are unchanged");
        self.configure(&words, refused)
    }

    /// Queues a move, a trajectory or a wave for the next edge of the input line.
    pub(super) fn on_edge(&mut self, command: &Command) -> Result<(), SessionError> {
        let words = match command {
            Command::Wave(path) => return self.wave(path, true),
            Command::Play { name, .. } => {
                let number = self.trajectory(name).map_err(SessionError::Refused)?;
                self.words_of_trajectory(number)?
            }
            command => {
                let user = self.user_of(command)?;
                self.words_of_move(&user)?
            }
        };
        self.in_control = true;
        self.session.command_on_edge(&words).map_err(|error| match error {
            ClientError::Refused(Refusal::Unsupported) => no_input(),
            ClientError::Refused(Refusal::State) => {
                SessionError::Refused(format!("not now; the machine must be running and at rest: {}", self.state()))
            }
            other => other.into(),
        })
    }

    /// State of the input line. With `drop`, the waiting command is cancelled first.
    pub(super) fn edge(&mut self, drop: bool) -> Result<EdgeState, SessionError> {
        self.in_control |= drop;
        let EdgeStatus { stage, edges, tick } = self.session.edge(drop).map_err(|error| match error {
            ClientError::Refused(Refusal::Unsupported) => no_input(),
            other => other.into(),
        })?;
        let known = Stage::from_word(u64::from(stage));
        let settled = matches!(known, Some(Stage::Begun | Stage::Refused));
        Ok(EdgeState { stage, state: known.map_or("?", Stage::name), edges, tick: settled.then_some(tick) })
    }
}
