//! The state of a commissioning in its folder, `commission.json`: what was done, skipped and found. An interrupted commissioning
//! continues from it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use specgen_language::files;
use specgen_language::outcome::Failure;
use specgen_language::output::{edit_file, unread_file};
use specgen_studies::open_response::OpenResponse;

/// Name of the file.
pub(super) const FILE: &str = "commission.json";

/// A step, in the order in which they are done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Step {
    /// Noise of the gauges, amplifiers off; then the wiring check of the controller, and the noise with the amplifiers on.
    Wiring,
    /// Lag, modes and damping at rest.
    Response,
    /// E of the assembled legs.
    CrossTalk,
    /// Reversal curves of each leg, and an arbitrary record.
    Curves,
    /// The model of each leg, from its records.
    Identify,
    /// A spec with what was found.
    Spec,
    /// Figures of the machine with the new controller.
    Acceptance,
}

impl Step {
    /// All, in their order.
    pub const ALL: [Self; 7] =
        [Self::Wiring, Self::Response, Self::CrossTalk, Self::Curves, Self::Identify, Self::Spec, Self::Acceptance];
    /// Their names, in the same order.
    pub const NAMES: [&str; 7] = ["wiring", "response", "cross-talk", "curves", "identify", "spec", "acceptance"];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// Whether it moves the machine.
    #[must_use]
    pub fn moves(self) -> bool {
        !matches!(self, Self::Identify | Self::Spec)
    }

    /// The step of this name.
    ///
    /// # Errors
    /// There is none.
    pub fn parse(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|step| step.name() == text);
        found.ok_or_else(|| format!("expected {}, found `{text}`", Self::NAMES.join(", ")))
    }

    /// A step and the reason to skip it, `STEP=REASON`.
    ///
    /// # Errors
    /// There is no such step, or no reason.
    pub fn parse_skip(text: &str) -> Result<(Self, String), String> {
        let (step, reason) = text.split_once('=').unwrap_or((text, ""));
        match reason.trim() {
            "" => Err(format!("expected STEP=REASON, such as curves=\"identified before\", found `{text}`")),
            reason => Ok((Self::parse(step)?, reason.to_owned())),
        }
    }
}

/// A step that is over.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Passed {
    /// Day, UTC.
    pub date: String,
    /// Reason why it was skipped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skipped: Option<String>,
}

/// Noise of the pose at rest, by axis, m and rad.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Rest {
    /// Rms without its mean and drift.
    pub rms: [f64; 6],
    /// Amplitude at the frequency of the mains.
    pub mains: [f64; 6],
    /// Mean of each gauge, m.
    #[serde(default)]
    pub gauges: [f64; 6],
    /// The strongest lines of each axis.
    #[serde(default)]
    pub lines: Vec<Peak>,
}

/// A line of a spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Peak {
    pub axis: usize,
    /// Hz.
    pub frequency: f64,
    /// m or rad.
    pub amplitude: f64,
}

/// The response at rest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Response {
    /// Lag, modes and damping.
    #[serde(flatten)]
    pub found: OpenResponse,
    /// Displacement of each leg per volt in a stroke, m/V.
    pub strokes: [f64; 6],
    /// Day of the records, UTC.
    pub date: String,
    /// What disagrees with the spec.
    pub agreement: Vec<String>,
}

/// E of the legs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Coupling {
    /// By row and column; its diagonal is zero.
    pub matrix: [[f64; 6]; 6],
    /// Largest standard error of an entry.
    pub error: f64,
}

/// The model of a leg.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Leg {
    /// Family.
    pub model: String,
    /// Mean gain over the whole voltage, m/V.
    pub gain: f64,
    /// Root mean square error of the fit, or on curves that were held out, m.
    pub fit_rms: f64,
    /// The same on the arbitrary record, which no fit used.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arbitrary_rms: Option<f64>,
    /// File of its main reversal curves.
    pub record: String,
}

/// A figure of the acceptance, m or rad.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Figure {
    pub name: String,
    /// 0 to 5 for an axis; 0 also for the translation as a whole.
    pub axis: usize,
    pub value: f64,
    /// By the simulation of the identified machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub computed: Option<f64>,
    /// Limit, and its key.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<(f64, String)>,
}

/// |S| at a frequency: by the axis along which the set-point moved. None where the error was too small to tell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Sensitivity {
    pub hertz: f64,
    /// Number of the mode at this frequency.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mode: Option<usize>,
    pub measured: [Option<f64>; 6],
    /// Standard error of the measured value.
    pub error: [f64; 6],
    /// Of the spec, for the same direction.
    pub computed: [f64; 6],
}

/// A trajectory that was learned: error by the gauges in its first pass and in that of the correction that is kept, m rms.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct LearnedFigure {
    pub trajectory: String,
    pub before: f64,
    pub after: f64,
    /// Passes until then.
    pub passes: u64,
    /// File of the correction.
    pub correction: String,
}

/// Everything that is known.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct State {
    /// Digest of the spec that the measurements began with.
    pub spec: String,
    /// Its name.
    pub name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub machine: Option<String>,
    /// Digest of the spec that was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub written: Option<String>,
    /// What the written spec has of the workspace, and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub narrowed: Vec<String>,
    /// Tables that the written spec names are replaced, or were and the spec was not: it has another digest than the one above.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub replacing: bool,
    /// Cells of the reversal curves, and Hz of the mains.
    pub grid: usize,
    pub mains: f64,
    /// Gain of a leg in the first spec, m/V.
    pub spec_gain: f64,
    pub steps: BTreeMap<Step, Passed>,
    /// What the wiring check compares and cannot see on this geometry, gauges, and noise.
    #[serde(default)]
    pub wiring: String,
    /// With the amplifiers off, and on.
    #[serde(default)]
    pub rest: Vec<Rest>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cross_talk: Option<Coupling>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub response: Option<Response>,
    #[serde(default)]
    pub legs: Vec<Leg>,
    #[serde(default)]
    pub acceptance: Vec<Figure>,
    /// Error of a straight line of the first spec on the arbitrary record of each leg, m rms.
    #[serde(default)]
    pub straight: Vec<Option<f64>>,
    #[serde(default)]
    pub sensitivity: Vec<Sensitivity>,
    #[serde(default)]
    pub learned: Vec<LearnedFigure>,
}

impl State {
    /// That of a folder, if it has one.
    ///
    /// # Errors
    /// The file cannot be read, or is not of this command.
    pub fn read(folder: &Path) -> Result<Option<Self>, Failure> {
        let path = folder.join(FILE);
        if !path.exists() {
            return Ok(None);
        }
        let text = files::text(&path).map_err(|unread| unread_file(&path, &unread))?;
        serde_json::from_str(&text).map(Some).map_err(|error| {
            let shown = path.display();
            Failure::Gate(format!("{shown} is not of `specgen commission`: {error}; name another folder with -o"))
        })
    }

    /// Writes it, whole or not at all.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), Failure> {
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        // An earlier one was read.
        edit_file(&folder.join(FILE), text.as_bytes())
    }

    /// This one with what the records of a folder show that lost its file: a step was done on the day of its last record.
    pub fn of_records(mut self, folder: &Path) -> Self {
        let last = |step| match step {
            Step::Wiring => "rest-on.csv",
            Step::Response => "response-leg5.rec",
            Step::CrossTalk => "leg5-cross-talk.csv",
            Step::Curves => "leg5-arbitrary.csv",
            Step::Identify => "leg5.csv",
            Step::Spec => "platform.toml",
            Step::Acceptance => "accept-hold.csv",
        };
        for step in Step::ALL {
            let written = std::fs::metadata(folder.join(last(step))).and_then(|found| found.modified());
            if let Ok(time) = written {
                self.steps.insert(step, Passed { date: day_of(time), skipped: None });
            }
        }
        if self.is_over(Step::Acceptance) {
            self.written = Some(self.spec.clone());
        }
        self
    }

    /// Whether a step is over.
    pub fn is_over(&self, step: Step) -> bool {
        self.steps.contains_key(&step)
    }

    /// Whether a step was skipped.
    pub fn is_skipped(&self, step: Step) -> bool {
        self.steps.get(&step).is_some_and(|passed| passed.skipped.is_some())
    }

    /// Notes that a step is over, or why it was skipped.
    pub fn pass(&mut self, step: Step, skipped: Option<String>) {
        self.steps.insert(step, Passed { date: today(), skipped });
    }

    /// Forgets a step, and the later ones that need it.
    pub fn forget(&mut self, step: Step) {
        self.steps.remove(&step);
        // The response is needed where the curves are evaluated.
        let first = if step == Step::Response { Step::Identify } else { step };
        if step != Step::Wiring && step != Step::Acceptance {
            self.steps.retain(|later, passed| *later < first || passed.skipped.is_some());
        }
        // Figures of another controller.
        if !self.is_over(Step::Acceptance) {
            self.acceptance.clear();
            self.sensitivity.clear();
            self.learned.clear();
        }
    }
}

/// A record of a wave.
pub(super) fn record(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.csv"))
}

/// The day of now, UTC.
pub(super) fn today() -> String {
    day_of(SystemTime::now())
}

/// The day of a time, UTC.
fn day_of(time: SystemTime) -> String {
    date(time.duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs()) / 86_400)
}

/// The day so many days after 1 January 1970, in the form 2026-11-29. Years count from 1 March, so that a leap day is the last of
/// its year.
fn date(days: u64) -> String {
    let days = days + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let from_march = (5 * of_year + 2) / 153;
    let day = of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 { from_march + 3 } else { from_march - 9 };
    let year = 400 * era + year + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_have_their_dates() {
        for (days, expected) in [
            (0, "1970-01-01"),
            (59, "1970-03-01"),
            (11_016, "2000-02-29"),
            (20_786, "2026-11-29"),
            (47_540, "2100-02-28"),
        ] {
            assert_eq!(date(days), expected);
        }
    }

    #[test]
    fn an_interrupted_commissioning_continues_where_it_stopped() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(State::read(folder.path()).unwrap(), None);
        let mut state = State { spec: "d".to_owned(), grid: 32, mains: 50.0, ..State::default() };
        for step in [Step::Wiring, Step::CrossTalk, Step::Curves, Step::Identify] {
            state.pass(step, None);
        }
        state.pass(Step::Spec, Some("by hand".to_owned()));
        state.write(folder.path()).unwrap();
        let mut again = State::read(folder.path()).unwrap().unwrap();
        assert_eq!(again, state);
        again.write(folder.path()).unwrap();
        // What was identified with other cross-talk is void; what was skipped stays so.
        again.forget(Step::CrossTalk);
        assert_eq!(again.steps.keys().copied().collect::<Vec<_>>(), [Step::Wiring, Step::Spec]);
        state.forget(Step::Wiring);
        assert!(state.is_over(Step::Identify) && !state.is_over(Step::Wiring));
        std::fs::write(folder.path().join(FILE), "{}").unwrap();
        let error = State::read(folder.path()).unwrap_err().message();
        assert!(error.contains("is not of `specgen commission`"), "{error}");
    }

    #[test]
    fn steps_are_named_and_skipped_with_a_reason() {
        assert_eq!(Step::ALL.map(Step::name), Step::NAMES);
        assert_eq!(Step::parse("cross-talk"), Ok(Step::CrossTalk));
        assert!(Step::parse("rest").unwrap_err().contains("expected wiring, response, cross-talk"));
        assert_eq!(Step::parse_skip("curves=done before"), Ok((Step::Curves, "done before".to_owned())));
        assert!(Step::parse_skip("curves").unwrap_err().contains("expected STEP=REASON"));
        assert!(Step::parse_skip("curves= ").unwrap_err().contains("expected STEP=REASON"));
    }
}
