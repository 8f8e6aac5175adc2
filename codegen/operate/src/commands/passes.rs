//! Passes: a trajectory of the device played under a correction, and what it keeps of the error.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::command::WaitCondition;
use host_sim::coverage::Coverage;
use host_sim::word::status_words;
use serde::Serialize;
use specgen_link::client::{ClientError, Port};
use specgen_link::{PassAction, Refusal};
use specgen_runtime::learning::Settings;
use specgen_runtime::pass::{Course, Stage};
use specgen_runtime::playback::Knot;
use specgen_runtime::setpoint::BUSY;
use specgen_studies::learning::{Table, translation_nm};

use super::answer::Acknowledgement;
use super::error::SessionError;
use super::operator::Operator;
use specgen_language::outcome::Outcome;
use specgen_language::ui::Ui;

/// Rest before a pass, s: what rings after the way to its start has died away.
const REST: f64 = 0.1;
/// How often a pass is looked at.
const LOOK: Duration = Duration::from_millis(5);
/// How much longer than its ticks a pass may take, and how long learning, s: by the ticks of the device, which on an emulated one take longer.
const LATER: f64 = 10.0;

/// Result of a pass.
pub struct PassResult {
    /// Means of the error from knot to knot.
    pub errors: Vec<Knot>,
    /// Status bits seen.
    pub status: u32,
}

/// Answer to `play` under a correction.
#[derive(Serialize)]
pub struct PassReport {
    correction: String,
    /// Root mean square of the translation's error as the gauges show it, over the motion and the rest after it, nm.
    error_nm: f64,
    /// Over both.
    #[serde(flatten)]
    coverage: Coverage,
    status: u32,
}

impl Outcome for PassReport {
    fn text(&self) -> String {
        let Self { correction, error_nm, coverage, .. } = self;
        let mut text = format!("played under {correction}: {error_nm:.1} nm rms by its gauges over {coverage}");
        let words = status_words(self.status & !BUSY);
        if !words.is_empty() {
            // Writing to a String cannot fail.
            let _ = write!(text, "; {}", words.replace('+', ", "));
        }
        text + "\n"
    }
}

impl<P: Port> Operator<P> {
    /// A trajectory by its name: its number, and the table of its correction.
    ///
    /// # Errors
    /// There is no such trajectory; the file is no correction for it on this machine.
    pub(super) fn playable(
        &self,
        name: &str,
        correction: Option<&(PathBuf, String)>,
    ) -> Result<(usize, Option<Table>), String> {
        let number = self.trajectory(name)?;
        let Some((path, machine)) = correction else { return Ok((number, None)) };
        let digest = &self.session.description().digest;
        let table = Table::of_file(path).map_err(|error| format!("{}: {error}", path.display()))?;
        table.is_for(digest, machine, &motion_name(name)).map_err(|error| format!("{}: {error}", path.display()))?;
        Ok((number, Some(table)))
    }

    /// Plays a trajectory; under a correction from its start, which it is brought to first.
    pub(super) fn play(
        &mut self,
        name: &str,
        correction: Option<&(PathBuf, String)>,
        line: &str,
        ui: &Ui,
    ) -> Result<(), SessionError> {
        let (number, table) = self.playable(name, correction).map_err(SessionError::Refused)?;
        let Some((table, (path, _))) = table.zip(correction) else {
            let words = self.words_of_trajectory(number)?;
            self.send_and_see(words)?;
            self.note(line, &Acknowledgement("done".to_owned()), ui);
            return Ok(());
        };
        let (spacing, before) = (table.spacing, table.before);
        let ticks = u32::try_from(table.knots.len()).unwrap_or(u32::MAX).saturating_mul(spacing);
        let course = Course { spacing, before, ticks, trajectory: number as u32 };
        let passed = self.pass(&table.start, course, Some(&table.knots), ui)?;
        let rest = (before / spacing) as usize;
        let motion = passed.errors.get(rest..).unwrap_or_default();
        let [seen, whole] = [motion.len(), (course.knots() as usize).saturating_sub(rest)];
        let ticks = spacing as usize;
        let coverage = Coverage::new(seen * ticks, whole * ticks, self.session.period());
        if !coverage.is_whole() {
            return Err(SessionError::Fault(format!("the pass ended early, after {coverage}: there is no figure")));
        }
        let error_nm = translation_nm(motion);
        self.note(line, &PassReport { correction: shown(path), error_nm, coverage, status: passed.status }, ui);
        Ok(())
    }

    /// Words that play a trajectory.
    pub(super) fn words_of_trajectory(&self, number: usize) -> Result<Vec<u64>, SessionError> {
        let command = [("command", "trajectory".to_owned()), ("selector", number.to_string())];
        let command = command.map(|(name, value)| (name.to_owned(), value));
        self.session.assign(&command).map_err(SessionError::Refused)
    }

    /// Knots that the device has room for in a pass.
    pub fn pass_capacity(&mut self) -> Result<u32, SessionError> {
        self.session.pass(PassAction::Look).map(|status| status.capacity).map_err(refused)
    }

    /// Sends the correction of passes of a course, zeros behind its knots.
    pub fn correct(&mut self, knots: &[Knot], course: Course) -> Result<(), SessionError> {
        let mut whole = knots.to_vec();
        whole.resize(course.knots() as usize, [0; 6]);
        self.session.put_knots(0, &whole).map_err(refused)
    }

    /// Goes to `start` (the controller's coordinates, m and rad), rests there, and makes a pass under the correction of these knots, or of those that
    /// the device has.
    pub fn pass(
        &mut self,
        start: &[f64; 6],
        course: Course,
        knots: Option<&[Knot]>,
        ui: &Ui,
    ) -> Result<PassResult, SessionError> {
        let capacity = self.pass_capacity()?;
        if course.knots() > capacity {
            return Err(SessionError::Refused(format!(
                "a pass of {} knots is more than the {capacity} that the device has room for; learn with a lower --bandwidth, which \
                 needs fewer, or a shorter trajectory",
                course.knots()
            )));
        }
        self.go(*start)?;
        self.wait(WaitCondition::Arrived, Duration::from_secs(60), ui)?;
        let rested = self.session.status().tick + (REST / self.session.period()) as u64;
        while self.session.status().tick < rested {
            std::thread::sleep(LOOK);
            self.look()?;
        }
        if let Some(knots) = knots {
            self.correct(knots, course)?;
        }
        let Course { spacing, before, ticks, trajectory } = course;
        self.in_control = true;
        self.session.pass(PassAction::Begin { spacing, before, ticks, trajectory }).map_err(refused)?;
        let limit = self.session.status().tick + u64::from(ticks) + self.later();
        let status = loop {
            std::thread::sleep(LOOK);
            self.look()?;
            self.show(ui);
            let status = self.session.pass(PassAction::Look).map_err(refused)?;
            if Stage::from_word(status.stage) != Some(Stage::Running) {
                break status;
            }
            if self.session.status().tick > limit {
                self.session.pass(PassAction::Abort).map_err(refused)?;
                return Err(SessionError::Fault(format!("the pass does not end; the machine is {}", self.state())));
            }
        };
        if Stage::from_word(status.stage) != Some(Stage::Complete) {
            return Err(SessionError::Fault(format!("the pass was ended; the machine is {}", self.state())));
        }
        // What it began is what is commanded.
        let errors = self.session.errors().map_err(refused)?;
        Ok(PassResult { errors, status: status.status })
    }
}

/// Learning in the device.
impl<P: Port> Operator<P> {
    /// Ticks of the device after which something takes too long.
    fn later(&self) -> u64 {
        (LATER / self.session.period()) as u64
    }

    /// Sends what the device learns with, behind the knots of its passes.
    pub fn plan(&mut self, knots: usize, rows: &[Knot]) -> Result<(), SessionError> {
        self.session.put_knots(knots, rows).map_err(refused)
    }

    /// Lets the device make the correction of the next pass; it then has the knots that this gives.
    pub fn learn(&mut self, Settings { reach, fade }: Settings, ui: &Ui) -> Result<Vec<Knot>, SessionError> {
        let mut status = self.session.pass(PassAction::Learn { reach, fade }).map_err(refused)?;
        let limit = self.session.status().tick + self.later();
        while Stage::from_word(status.stage) == Some(Stage::Learning) {
            if self.session.status().tick > limit {
                return Err(SessionError::Fault("the device does not come to an end of learning".to_owned()));
            }
            std::thread::sleep(LOOK);
            self.look()?;
            self.show(ui);
            status = self.session.pass(PassAction::Look).map_err(refused)?;
        }
        self.session.correction().map_err(refused)
    }
}

/// The name in a correction file of a trajectory of the spec.
pub fn motion_name(trajectory: &str) -> String {
    format!("trajectory {trajectory}")
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

fn refused(error: ClientError) -> SessionError {
    match error {
        ClientError::Refused(Refusal::Unsupported) => SessionError::Refused(
            "the device takes no correction; write correction = \"<number> um\" in [control] of its spec, then build it anew"
                .to_owned(),
        ),
        ClientError::Refused(Refusal::State) => SessionError::Refused(
            "not now: a pass begins with a machine that runs and rests, with no wave or other pass under way"
                .to_owned(),
        ),
        other => other.into(),
    }
}
