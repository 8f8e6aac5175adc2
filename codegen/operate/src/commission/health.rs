//! `--check`: what has changed since the commissioning. The response at rest is recorded again, with the same excitation, so that the
//! bias of hysteresis is the same in both, and compared leg by leg.

use std::fmt::Write as _;

use serde::Serialize;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::write_file;
use specgen_runtime::supervisor::{Phase, Request};
use specgen_studies::open_response::{Change, Health};

use super::rows::Rows;
use super::state::{self, State, record};
use super::{PlanReport, REST, RESTS, Work, machine, no_line, response};
use crate::commands::SessionError;
use crate::place::AXES;

/// Names of the records of a check begin so; that of the noise.
const CHECK: &str = "check";
const NOISE_RECORD: &str = "check-rest-on";
/// File of the result.
const FILE: &str = "check.json";

/// Noise over that at the commissioning above which it is reported.
const NOISE: f64 = 1.5;

impl Work<'_> {
    /// Measures again what was kept at the commissioning, and shows what has changed.
    pub(super) fn check(&self, state: &State) -> Result<(), Failure> {
        let folder = &self.options.output;
        let kept = state.response.as_ref().ok_or_else(|| {
            Failure::Gate(format!(
                "`{}` has no response at rest to compare with: measure it with --step response, and check the machine later",
                folder.display()
            ))
        })?;
        if self.line.is_none() {
            return Err(no_line());
        }
        let plan = self.plan(state)?;
        if !self.agreed(&PlanReport::check(state))? {
            return Err(Failure::Usage("nothing was sent and nothing compared: give --yes".to_owned()));
        }
        let path = record(folder, NOISE_RECORD);
        let every = libm::ceil(REST[1] / self.compiled.model.timing.period) as u32;
        self.powered(|machine, ui| {
            response::clear(folder, CHECK).map_err(SessionError::Failed)?;
            machine::arm(machine, ui)?;
            machine.record_rows((every, u32::MAX), [0.0, REST[0]], &path, &mut |_| Ok(()), ui)?;
            machine::request(machine, Request::Drive, Phase::Driving, ui)?;
            response::measure(machine, (self.compiled, state.spec_gain, &plan), folder, CHECK, ui)
        })?;
        let now = response::found(folder, CHECK, self.compiled, &state::today())?;
        let mut health = Health::of((&kept.found, &kept.strokes), (&now.found, &now.strokes));
        let quiet = record(folder, RESTS[1]);
        if quiet.exists() {
            louder(Rows::read(&quiet)?.jitter()?, Rows::read(&path)?.jitter()?, &mut health);
        }
        let health = Report { dates: [&kept.date, &now.date], health };
        let mut text = serde_json::to_string_pretty(&health).unwrap_or_default();
        text.push('\n');
        write_file(&folder.join(FILE), text.as_bytes())?;
        self.ui.judged(&health, health.failed())
    }
}

/// The result of a check.
#[derive(Serialize)]
struct Report<'a> {
    /// Day of the commissioning, and of the check.
    dates: [&'a str; 2],
    #[serde(flatten)]
    health: Health,
}

/// Adds the axes whose noise has grown.
fn louder(quiet: [f64; 6], noisy: [f64; 6], health: &mut Health) {
    for (axis, name) in AXES.iter().enumerate() {
        let ratio = noisy[axis] / quiet[axis];
        if ratio > NOISE {
            health.add(
                format!("noise of {name} at rest is {ratio:.1} times what it was"),
                "check grounds and shields of gauges and amplifiers, and what is new beside the machine",
            );
        }
    }
}

impl Report<'_> {
    /// What has changed, in one line; none if nothing has.
    fn failed(&self) -> Option<String> {
        let all: Vec<&str> = self.health.changes.iter().map(|change| change.what.as_str()).collect();
        (!all.is_empty()).then(|| format!("changed since {}: {}", self.dates[0], all.join("; ")))
    }
}

impl Outcome for Report<'_> {
    fn text(&self) -> String {
        let list = |values: &mut dyn Iterator<Item = f64>, digits: usize| {
            values.map(|value| format!("{value:+.digits$}")).collect::<Vec<_>>().join(" ")
        };
        let mut text = format!(
            "{} against {}\ngain of legs 0 to 5, %: {}\ndelay, us: {}\nmodes, %: {}\n",
            self.dates[1],
            self.dates[0],
            list(&mut self.health.gains.iter().map(|gain| 100.0 * (gain - 1.0)), 2),
            list(&mut self.health.delays.iter().map(|delay| delay * 1e6), 1),
            list(&mut self.health.modes.iter().map(|ratio| 100.0 * (ratio - 1.0)), 2)
        );
        for Change { what, advice } in &self.health.changes {
            // Writing to a String cannot fail.
            let _ = writeln!(text, "{what}: {advice}");
        }
        if self.health.changes.is_empty() {
            text += "nothing has changed\n";
        }
        text
    }
}
