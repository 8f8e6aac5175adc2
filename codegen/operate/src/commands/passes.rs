//! Passes: the device plays a trajectory with a correction, and keeps its error.

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
use specgen_studies::learning::{Table, measured_translation_nm};

use super::answer::Acknowledgement;
use super::error::SessionError;
use super::operator::Operator;
use specgen_language::outcome::Outcome;
use specgen_language::ui::Ui;

/// Rest before a pass, s: ringing after the approach dies away.
const REST: f64 = 0.1;
/// Polling interval during a pass.
const LOOK: Duration = Duration::from_millis(5);
/// Extra time of a pass, and timeout of learning, s. It is counted in ticks of the device, because an emulated one is slower.
const LATER: f64 = 10.0;

/// Result of a pass.
pub struct PassResult {
    /// Mean error from knot to knot.
    pub errors: Vec<Knot>,
    /// Status bits seen.
    pub status: u32,
}

/// Answer to `play` with a correction.
#[derive(Serialize)]
pub struct PassReport {
    correction: String,
    /// Rms error of the translation by the gauges, over the motion and the rest after it, nm.
    error_nm: f64,
    #[serde(flatten)]
    coverage: Coverage,
    status: u32,
}

impl Outcome for PassReport {
    fn text(&self) -> String {
        let Self { correction, error_nm, coverage, .. } = self;
        let mut text = format!("played with {correction}: {error_nm:.1} nm rms by its gauges over {coverage}");
        let words = status_words(self.status & !BUSY);
        if !words.is_empty() {
            // Writing to a String cannot fail.
            let _ = write!(text, "; {}", words.replace('+', ", "));
        }
        text + "\n"
    }
}

impl<P: Port> Operator<P> {
    /// Number of a trajectory, and the table of its correction.
    ///
    /// # Errors
    /// There is no such trajectory, or the file is not a correction for it on this machine.
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

    /// Plays a trajectory. With a correction, the machine first moves to its start.
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
            return Err(SessionError::Fault(format!("the pass ended early, after {coverage}: its error is unknown")));
        }
        let error_nm = measured_translation_nm(motion);
        self.note(line, &PassReport { correction: shown(path), error_nm, coverage, status: passed.status }, ui);
        Ok(())
    }

    /// Words that play a trajectory.
    pub(super) fn words_of_trajectory(&self, number: usize) -> Result<Vec<u64>, SessionError> {
        let command = [("command", "trajectory".to_owned()), ("selector", number.to_string())];
        let command = command.map(|(name, value)| (name.to_owned(), value));
        self.session.assign(&command).map_err(SessionError::Refused)
    }

    /// Largest number of knots of a pass on the device.
    pub fn pass_capacity(&mut self) -> Result<u32, SessionError> {
        self.session.pass(PassAction::Look).map(|status| status.capacity).map_err(refused)
    }

    /// Sends the correction of a course, padded with zeros.
    pub fn correct(&mut self, knots: &[Knot], course: Course) -> Result<(), SessionError> {
        let mut whole = knots.to_vec();
        whole.resize(course.knots() as usize, [0; 6]);
        self.session.put_knots(0, &whole).map_err(refused)
    }

    /// Moves to `start` (the controller's coordinates, m and rad), rests there, and makes a pass with these knots as correction, or
    /// those already on the device.
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
                "a pass of {} knots exceeds the device's capacity of {capacity}; learn with a lower --bandwidth, which needs fewer, \
                 or a shorter trajectory",
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
            return Err(SessionError::Fault(format!("the pass was aborted; the machine is {}", self.state())));
        }
        let errors = self.session.errors().map_err(refused)?;
        Ok(PassResult { errors, status: status.status })
    }
}

/// Learning in the device.
impl<P: Port> Operator<P> {
    /// [`LATER`] in ticks of the device.
    fn later(&self) -> u64 {
        (LATER / self.session.period()) as u64
    }

    /// Sends the rows of a learning plan, which are stored after the knots of the passes.
    pub fn plan(&mut self, knots: usize, rows: &[Knot]) -> Result<(), SessionError> {
        self.session.put_knots(knots, rows).map_err(refused)
    }

    /// Lets the device compute the correction of the next pass, and returns its knots.
    pub fn learn(&mut self, Settings { reach, fade }: Settings, ui: &Ui) -> Result<Vec<Knot>, SessionError> {
        let mut status = self.session.pass(PassAction::Learn { reach, fade }).map_err(refused)?;
        let limit = self.session.status().tick + self.later();
        while Stage::from_word(status.stage) == Some(Stage::Learning) {
            if self.session.status().tick > limit {
                return Err(SessionError::Fault("the device does not finish learning".to_owned()));
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
            "the device takes no correction; write correction = \"<number> um\" in [control] of its spec, then rebuild and install it"
                .to_owned(),
        ),
        ClientError::Refused(Refusal::State) => SessionError::Refused(
            "not now: a pass needs a running machine at rest, with no wave or other pass in progress"
                .to_owned(),
        ),
        other => other.into(),
    }
}
