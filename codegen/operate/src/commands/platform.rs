//! Commands for the pose of a platform, its limits, and the mode and gains of its control law.

use std::fmt::Write as _;

use crate::command::{Command, FrameRequest, ModeRequest};
use crate::frame::Frame;
use crate::motion::{self, Motion};
use crate::place::{self, AXES, AxisValues, Pace, amount, meant};
use crate::session::MeasuredPose;
use host_sim::word::status_words;
use serde::Serialize;
use specgen_compiler::compile;
use specgen_language::model::Gains;
use specgen_link::client::Port;
use specgen_runtime::setpoint::{BUSY, REFUSED, STALE};
use specgen_runtime::supervisor::{Cause, Phase};

use super::answer::{Acknowledgement, Destination};
use super::error::SessionError;
use super::location::Location;
use super::operator::Operator;
use super::pose::{ZERO, in_words, unit};
use specgen_language::outcome::Outcome;
use specgen_language::table::{left, right, row};
use specgen_language::ui::Ui;
use specgen_runtime::ControlMode;

/// Gains of each kind, in the order of the settings; those of P and of P/F with Invhys have the prefix `position_`.
const GAINS: [&str; 3] = ["kp", "ki", "kv"];
/// Why a frame has no such pose.
const BEYOND: &str = "rotation exceeds the 15 deg limit for frames";

/// The frame of poses in this session: µm and µrad.
#[derive(Serialize)]
struct FrameInForce {
    work: [f64; 6],
    tool: [f64; 3],
}

impl Outcome for FrameInForce {
    fn text(&self) -> String {
        let [x, y, z] = self.tool.map(|value| amount(0, value * 1e-6));
        format!(
            "work frame at {}; tool point at x {x}, y {y}, z {z}\n",
            place::in_words(&self.work.map(|value| value * 1e-6))
        )
    }
}

/// Range of each axis with the others unchanged: least and largest value, µm and µrad.
#[derive(Serialize)]
struct Limits {
    from: [f64; 6],
    limits: [[f64; 2]; 6],
}

impl Outcome for Limits {
    fn text(&self) -> String {
        let mut text = String::new();
        let columns = [left(6), right(12), right(12), right(12), left(0).behind("  ")];
        row(&mut text, &columns, &[&"", &"from", &"least", &"largest"]);
        for (axis, name) in AXES.iter().enumerate() {
            let cells =
                [self.from[axis], self.limits[axis][0], self.limits[axis][1]].map(|value| format!("{value:.3}"));
            row(&mut text, &columns, &[&format!("  {name}"), &cells[0], &cells[1], &cells[2], &unit(axis)]);
        }
        text
    }
}

/// Whether a pose can be reached.
#[derive(Serialize)]
struct Reachability {
    can: bool,
    /// The limit that is exceeded.
    binds: Option<String>,
}

impl Outcome for Reachability {
    fn text(&self) -> String {
        self.binds.as_ref().map_or_else(|| "yes\n".to_owned(), |binds| format!("no: {binds}\n"))
    }
}

/// Gains in force, SI: by axis, proportional, integral, derivative.
#[derive(Serialize)]
struct GainsInForce {
    mode: &'static str,
    gains: [[f64; 6]; 3],
    position_gains: [[f64; 6]; 3],
    /// After setting them: λ up to which every mode is stable with these gains, by the compiler's check.
    #[serde(skip_serializing_if = "Option::is_none")]
    gain_ratio_limit: Option<f64>,
}

impl Outcome for GainsInForce {
    fn text(&self) -> String {
        let mut text = format!("mode {}\n", self.mode);
        let columns = [left(24), right(12), right(12), right(12), right(12), right(12), right(12)];
        row(&mut text, &columns, &[&"", &"x", &"y", &"z", &"rx", &"ry", &"rz"]);
        for (prefix, set) in [("", &self.gains), ("position_", &self.position_gains)] {
            for (name, values) in GAINS.iter().zip(set) {
                let [x, y, z, rx, ry, rz] = values.map(|value| format!("{value:.4e}"));
                row(&mut text, &columns, &[&format!("  {prefix}{name}"), &x, &y, &z, &rx, &ry, &rz]);
            }
        }
        if let Some(limit) = self.gain_ratio_limit {
            let _ = writeln!(text, "  stable up to λ = {limit:.2} in every mode");
        }
        text
    }
}

fn beyond_range(name: &str) -> String {
    format!("the device refused `{name}`: out of its range")
}

/// Whether a setting is a gain.
pub(crate) fn is_gain(name: &str) -> bool {
    let stem = name.split('[').next().unwrap_or(name);
    GAINS.contains(&stem.strip_prefix("position_").unwrap_or(stem))
}

impl<P: Port> Operator<P> {
    pub(super) fn motion(&self) -> Result<&Motion, String> {
        self.session.motion().ok_or_else(|| "the device controls six legs and has no pose".to_owned())
    }

    pub(crate) fn place(&mut self) -> Result<MeasuredPose, SessionError> {
        let place = self.session.place()?;
        place.ok_or_else(|| SessionError::Refused("the device controls six legs and has no pose".to_owned()))
    }

    /// The set-point, in the session's frame.
    pub(super) fn target(&mut self) -> Result<[f64; 6], SessionError> {
        let target = self.place()?.target;
        Ok(self.seen(&target))
    }

    /// A pose of the controller in the session's frame.
    pub(super) fn seen(&self, user: &[f64; 6]) -> [f64; 6] {
        self.frame.pose(user).unwrap_or(*user)
    }

    /// The controller's coordinates of a pose in the session's frame.
    pub(super) fn user(&self, pose: &[f64; 6]) -> Result<[f64; 6], SessionError> {
        self.frame.user(pose).ok_or_else(|| SessionError::Refused(format!("cannot move there: {BEYOND}")))
    }

    /// Destination of a `move`, `jog` or `goto`, in the controller's coordinates.
    pub(super) fn user_of(&mut self, command: &Command) -> Result<[f64; 6], SessionError> {
        match command {
            Command::Goto(name) if name == ZERO => Ok([0.0; 6]),
            Command::Goto(name) => {
                self.marks.get(name).copied().ok_or_else(|| SessionError::Refused(self.no_mark(name)))
            }
            Command::Move { relative, axes } => {
                let from = self.target()?;
                self.user(&meant(&from, *relative, axes))
            }
            _ => Err(SessionError::Refused("the command is not a move".to_owned())),
        }
    }

    /// Location in the session's frame.
    pub(super) fn located(&self, place: &MeasuredPose) -> Location {
        Location::of(place, self.session.status(), |user| self.seen(user))
    }

    pub(super) fn no_mark(&self, name: &str) -> String {
        let known: Vec<&str> = std::iter::once(ZERO).chain(self.marks.keys().map(String::as_str)).collect();
        format!("there is no pose `{name}`: `mark {name}` first; known poses: {}", known.join(", "))
    }

    pub(super) fn trajectory(&self, name: &str) -> Result<usize, String> {
        let known = self.motion()?.trajectories();
        known.iter().position(|known| known == name).ok_or_else(|| {
            format!(
                "the machine has no trajectory `{name}`; it has {}",
                if known.is_empty() { "none".to_owned() } else { known.join(", ") }
            )
        })
    }

    /// These gains by the names of their settings, as words.
    pub(super) fn gains_of(&self, gains: &[(String, f64)]) -> Result<Vec<(String, u64)>, String> {
        self.motion()?;
        if !gains.is_empty() && self.model.is_none() {
            return Err("gains are checked for stability with the spec before they are sent: name the spec".to_owned());
        }
        let description = self.session.description();
        let mut words = Vec::new();
        for (name, value) in gains {
            let found = description.config_names.iter().filter(|known| {
                let whole = known.split('[').next() == Some(name.as_str());
                is_gain(known) && (**known == *name || whole)
            });
            let before = words.len();
            words.extend(found.map(|name| (name.clone(), description.scalar.encode(*value))));
            if words.len() == before {
                return Err(format!(
                    "there is no gain `{name}`; expected kp, ki, kv or, for P and P/F with Invhys, position_kp, position_ki, position_kv, each for all axes or for one, as in ki[2]"
                ));
            }
        }
        Ok(words)
    }

    /// Executes a command that needs a platform.
    pub(super) fn of_platform(&mut self, command: &Command, line: &str, ui: &Ui) -> Result<(), SessionError> {
        match command {
            Command::Where => {
                let place = self.place()?;
                self.note(line, &self.located(&place), ui);
            }
            Command::Limits => {
                let target = self.target()?;
                let motion = self.motion().map_err(SessionError::Refused)?;
                let admits = |pose: &[f64; 6]| self.frame.user(pose).is_some_and(|user| motion.admits(&user));
                let limits =
                    core::array::from_fn(|axis| motion::limits(admits, &target, axis).map(|value| value * 1e6));
                self.note(line, &Limits { from: target.map(|value| value * 1e6), limits }, ui);
            }
            Command::CanIGo { axes, speed } => {
                let target = self.target()?;
                let binds = self.binds(&target, axes, speed).map_err(SessionError::Refused)?;
                self.note(line, &Reachability { can: binds.is_none(), binds }, ui);
            }
            Command::Frame(frame) => {
                self.frame = match frame {
                    None => self.frame,
                    Some(FrameRequest::None) => Frame::default(),
                    Some(FrameRequest::Work(work)) => Frame::new(*work, *self.frame.tool()),
                    Some(FrameRequest::Tool(tool)) => Frame::new(*self.frame.work(), *tool),
                };
                let (work, tool) =
                    (self.frame.work().map(|value| value * 1e6), self.frame.tool().map(|value| value * 1e6));
                self.note(line, &FrameInForce { work, tool }, ui);
            }
            Command::Mark(name) => {
                let target = self.place()?.target;
                self.marks.insert(name.clone(), target);
                self.note(line, &Acknowledgement("done".to_owned()), ui);
            }
            Command::Goto(_) => {
                let user = self.user_of(command)?;
                self.go(user)?;
                self.note(line, &Destination { pose: self.seen(&user) }, ui);
            }
            Command::Play { name, correction } => self.play(name, correction.as_ref(), line, ui)?,
            Command::Mode(wanted) => {
                self.set_mode(wanted)?;
                self.show_gains(None, line, ui)?;
            }
            Command::Gains(gains) => {
                let limit = if gains.is_empty() { None } else { self.set_gains(gains)? };
                self.show_gains(limit, line, ui)?;
            }
            // The other commands do not need a platform.
            _ => {}
        }
        Ok(())
    }

    /// The limit that prevents a move at this speed; none if it is possible.
    fn binds(&self, from: &[f64; 6], axes: &AxisValues, [along, about]: &Pace) -> Result<Option<String>, String> {
        let (motion, to) = (self.motion()?, meant(from, false, axes));
        let Some(user) = self.frame.user(&to) else { return Ok(Some(BEYOND.to_owned())) };
        if let Some(binding) = motion.binding(&user) {
            return Ok(Some(in_words(&binding)));
        }
        let start = self.frame.user(from);
        let slow = (0..6).find_map(|axis| {
            // Speed limits are along the controller's axes.
            let (asked, speed) = (if axis < 3 { along } else { about }, motion.speed()[axis]);
            let moves = start.is_none_or(|start| (user[axis] - start[axis]).abs() > 0.0);
            // Tolerates the rounding of the spec's decimals.
            asked.filter(|asked| moves && *asked > speed * (1.0 + 1e-9)).map(|_| (axis, speed))
        });
        Ok(slow.map(|(axis, speed)| {
            format!("{} moves at {}/s at most (control.setpoint.speed)", AXES[axis], amount(axis, speed))
        }))
    }

    fn word_of(&self, words: &[u64], name: &str) -> Option<u64> {
        words.get(self.setting(name)?).copied()
    }

    /// Six numbers of the settings.
    fn six(&self, words: &[u64], stem: &str) -> [f64; 6] {
        let scalar = self.session.description().scalar;
        let number = |axis: usize| self.word_of(words, &format!("{stem}[{axis}]")).map(|word| scalar.decode(word));
        core::array::from_fn(|axis| number(axis).unwrap_or_default())
    }

    fn show_gains(&mut self, gain_ratio_limit: Option<f64>, line: &str, ui: &Ui) -> Result<(), SessionError> {
        let words = self.session.config()?;
        let mode = self.word_of(&words, "mode").and_then(|mode| ControlMode::WORDS.get(usize::try_from(mode).ok()?));
        let set = |prefix: &str| GAINS.map(|name| self.six(&words, &format!("{prefix}{name}")));
        let (gains, position_gains) = (set(""), set("position_"));
        self.note(
            line,
            &GainsInForce { mode: mode.map_or("?", |(name, _)| *name), gains, position_gains, gain_ratio_limit },
            ui,
        );
        Ok(())
    }

    /// Sets the mode. It needs no stability check: the compiler accepts a spec only if all modes are stable.
    fn set_mode(&mut self, wanted: &ModeRequest) -> Result<(), SessionError> {
        let words = self.session.config()?;
        let now = self.word_of(&words, "mode").unwrap_or_default();
        let mode = wanted.word(now).map_err(SessionError::Refused)?;
        let words = self.changed(&[("mode".to_owned(), mode)])?;
        self.configure(&words, beyond_range)
    }

    /// Checks the stability margins of the gains, then sends them. Returns λ up to which every mode is stable.
    fn set_gains(&mut self, gains: &[(String, f64)]) -> Result<Option<f64>, SessionError> {
        let words = self.gains_of(gains).map_err(SessionError::Refused)?;
        let words = self.changed(&words)?;
        let of = |prefix: &str| {
            let [proportional, integral, derivative] = GAINS.map(|name| self.six(&words, &format!("{prefix}{name}")));
            Gains { proportional, integral, derivative }
        };
        let Some(mut model) = self.model.clone() else { return Ok(None) };
        if let Some(task) = &mut model.task_space {
            (task.gains, task.position_gains) = (Some(of("")), Some(of("position_")));
        }
        let design = self.meanwhile(|| compile::check_stability(&model))?.map_err(|findings| {
            let texts: Vec<String> = findings.iter().map(|one| format!("{}: {}", one.code, one.message)).collect();
            SessionError::Refused(format!("not sent: {}", texts.join("; ")))
        })?;
        self.configure(&words, beyond_range)?;
        let limits = design.1.iter().flat_map(|design| &design.margins).filter_map(|mode| mode.gain_ratio_limit);
        Ok(limits.reduce(|least, limit| if limit < least { limit } else { least }))
    }

    /// Suggested next step, by phase, cause and status.
    pub(super) fn advice(&self) -> Option<String> {
        let status = self.session.status();
        let phase = Phase::from_word(u64::from(status.phase))?;
        let cause = Cause::from_word(u64::from(status.cause)).unwrap_or(Cause::None);
        let text = match (phase, cause) {
            (Phase::Disarmed, _) => "`arm`, then `run`".to_owned(),
            (Phase::Arming, _) => "`run` can be requested now".to_owned(),
            (Phase::Holding, Cause::None) => "`run` to continue, `ramp-down` to switch off".to_owned(),
            (Phase::Holding, Cause::NotIdentified) => {
                "`drive`: this machine has the open drive only, until `specgen commission` has identified its legs"
                    .to_owned()
            }
            (Phase::Holding, cause) => {
                format!("holding because of {}: when that is fixed, `none`, then `run`", cause.name())
            }
            (Phase::Driving, _) => {
                "`set command=drive setpoint[0]=VOLTS …` or `wave FILE` of voltages; `hold` ends it".to_owned()
            }
            (Phase::RampingDown, _) => "`wait disarmed`, or faulted".to_owned(),
            (Phase::Faulted, cause) => format!("fix the cause ({}), then `none`, `acknowledge`, `arm`", cause.name()),
            (Phase::Running, Cause::Oscillation) => {
                "it oscillated, and the law has fallen back: when that is fixed, `none`, then `acknowledge`".to_owned()
            }
            (Phase::Running, _) if status.status & STALE != 0 => {
                "the stream has stopped: send set-points, or move".to_owned()
            }
            (Phase::Running, _) if status.status & REFUSED != 0 => {
                "the command was refused: `limits` shows the range; `set command=hold` cancels the command".to_owned()
            }
            (Phase::Running, _) => {
                let limited = status.status & !(REFUSED | STALE | BUSY);
                return (limited != 0).then(|| format!("check: {}", status_words(limited).replace('+', ", ")));
            }
        };
        Some(text)
    }
}
