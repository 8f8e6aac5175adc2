//! Answers of a machine, as text and as JSON.

use std::fmt::Write as _;
use std::time::Duration;

use crate::session::MAX_AGE;
use serde::{Serialize, Serializer};
use serde_json::Value;

use super::location::ago;
use specgen_language::outcome::Outcome;

/// Result of a session: all commands with their answers, and the final state of the machine. The text was printed earlier.
#[derive(Serialize)]
pub struct Report<'a> {
    pub device: &'a str,
    pub answers: Vec<Answer>,
    pub status: MachineStatus,
}

impl Outcome for Report<'_> {}

#[derive(Serialize)]
pub struct Answer {
    pub command: String,
    pub answer: Value,
}

/// An answer without text: done, or the state of the machine.
#[derive(Serialize)]
pub struct Acknowledgement(pub String);

impl Outcome for Acknowledgement {}

/// The error of a line.
#[derive(Serialize)]
pub struct CommandError {
    pub error: String,
}

impl Outcome for CommandError {
    fn text(&self) -> String {
        format!("error: {}\n", self.error.trim_end())
    }
}

#[derive(Serialize)]
pub struct MachineStatus {
    pub tick: u64,
    pub phase: u8,
    pub cause: u8,
    pub state: String,
    pub amplifiers_on: bool,
    pub status: u32,
    pub status_in_words: String,
    pub events: u32,
    pub late: u32,
    /// Age of this state, s; none before the first tick.
    pub age: Option<f64>,
    pub link_errors: u32,
    pub damaged_frames: u32,
    /// s.
    #[serde(skip)]
    pub period: f64,
}

impl Outcome for MachineStatus {
    fn text(&self) -> String {
        let on = if self.amplifiers_on { "on" } else { "off" };
        let age = match self.age.map(Duration::from_secs_f64) {
            None => "  no tick yet: these are initial values\n".to_owned(),
            Some(age) if age >= MAX_AGE => {
                format!("  the machine is not ticking: this is its state {} ago\n", ago(age))
            }
            Some(_) => String::new(),
        };
        let (tick, time, state, status) = (self.tick, self.tick as f64 * self.period, &self.state, self.status);
        let (words, late) = (if self.status_in_words.is_empty() { "-" } else { &self.status_in_words }, self.late);
        let damaged = self.link_errors + self.damaged_frames;
        format!(
            "tick {tick}, {time:.4} s: {state}, amplifiers {on}; status {status:#x}: {words}\n{age}  {late} late ticks, {damaged} damaged frames\n"
        )
    }
}

/// Destination of a move or a step, m and rad.
#[derive(Serialize)]
pub struct Destination {
    pub pose: [f64; 6],
}

impl Outcome for Destination {
    fn text(&self) -> String {
        format!("moves to {}\n", crate::place::in_words(&self.pose))
    }
}

/// Settings by name, in the order of the controller.
pub struct Settings(pub Vec<(String, Value)>);

impl Serialize for Settings {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl Outcome for Settings {
    fn text(&self) -> String {
        self.0.iter().fold(String::new(), |mut text, (name, value)| {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{name} = {value}");
            text
        })
    }
}

#[derive(Serialize)]
pub struct DownloadReport {
    pub file: String,
    pub bytes: usize,
}

impl Outcome for DownloadReport {
    fn text(&self) -> String {
        format!("wrote {} bytes to {}\n", self.bytes, self.file)
    }
}

#[derive(Serialize)]
pub struct RecorderState {
    pub running: bool,
    pub triggered: bool,
    pub ticks: u32,
    pub capacity: u32,
    /// s.
    #[serde(skip)]
    pub period: f64,
}

impl Outcome for RecorderState {
    fn text(&self) -> String {
        let does = match (self.running, self.triggered) {
            (true, false) => "is running and waits for its trigger",
            (true, true) => "is running after its trigger",
            (false, true) => "is complete",
            (false, false) => "is stopped",
        };
        let (ticks, seconds, capacity) = (self.ticks, f64::from(self.ticks) * self.period, self.capacity);
        format!(
            "the recorder {does}; it holds {ticks} ticks, {seconds:.4} s; its capacity is at least {capacity} ticks\n"
        )
    }
}
