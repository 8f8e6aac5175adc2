//! Commands as the operator types them.

use std::path::{Path, PathBuf};
use std::time::Duration;

use specgen_link::RecorderAction;
use specgen_link::samples::MOST_EVERY;
use specgen_runtime::ControlMode;
use specgen_runtime::supervisor::{Phase, Request};
use specgen_runtime::trigger::MOST;

use crate::place::{AxisValues, Pace, named, pace};

/// Default timeout of `wait`.
const TIMEOUT: Duration = Duration::from_secs(60);
/// Longest time of a command, s.
const LONGEST: f64 = 86_400.0;
/// Default duration of `watch`, s.
const WATCHED: f64 = 10.0;
/// Default number of ticks that are recorded after the trigger.
const AFTER: u32 = 1000;
/// Commands that an edge of the input line can start.
const EDGE_STARTS: &str = "move, jog, goto, play without a correction, or wave FILE";
const COMMANDS: &str = "status, arm, run, hold, drive, ramp-down, acknowledge, none, set NAME=VALUE…, \
                        move|jog AXIS=QUANTITY…, where, limits, can-i-go AXIS=QUANTITY… [speed=QUANTITY], frame [none | work|tool AXIS=QUANTITY…], mark NAME, goto NAME, \
                        play TRAJECTORY [correction=FILE machine=NAME], mode p|f|pf, gains [NAME=VALUE…], trigger LINE NAME=VALUE…, \
                        wait PHASE|arrived|SECONDS [TIMEOUT], config [code_min=CODE] [code_max=CODE], config write SPEC, \
                        record arm [AFTER] | trigger | stop | look | download FILE, wave FILE | stop, on-edge [drop | move … | jog … | goto … | play … | wave FILE], watch [EVERY [SECONDS [FILE]]], shutdown";

/// One command.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    /// Show state and health of the machine.
    Status,
    /// Send a request to the supervisor.
    Ask(Request),
    /// Set input words other than measurements.
    Set(Vec<(String, String)>),
    /// Move to a pose, or by a step from the set-point.
    Move {
        /// Whether values are steps.
        relative: bool,
        /// Value of each named axis.
        axes: AxisValues,
    },
    /// Show the pose of the platform.
    Where,
    /// Show the range of each axis at the current set-point.
    Limits,
    /// Check whether a pose can be reached; otherwise show the limit that is exceeded.
    CanIGo {
        /// Value of each named axis.
        axes: AxisValues,
        /// Required speed, m/s and rad/s.
        speed: Pace,
    },
    /// Show or set the frame of poses: work frame, tool point. Axes that are not named are zero.
    Frame(Option<FrameRequest>),
    /// Save the current set-point under a name.
    Mark(String),
    /// Move to a saved pose.
    Goto(String),
    /// Play a trajectory of the spec, optionally with a correction that was learned on this machine.
    Play {
        /// Its name.
        name: String,
        /// File of the correction, and the machine's name.
        correction: Option<(PathBuf, String)>,
    },
    /// Set the control mode, the setting `mode`: 0 P, 1 to 3 F, 4 to 6 P/F.
    Mode(ModeRequest),
    /// Show or set gains.
    Gains(Vec<(String, f64)>),
    /// Change the settings of a trigger output.
    Trigger {
        /// Its number.
        line: usize,
        /// Settings without the prefix `trigger_`, in SI; choices by their index.
        settings: Vec<(String, f64)>,
    },
    /// Wait for a condition.
    Wait {
        /// The condition.
        until: WaitCondition,
        /// The timeout.
        limit: Duration,
    },
    /// Show the settings in force.
    Config,
    /// Set the lowest or highest code of all legs, `code_min` or `code_max`.
    CodeLimits(Vec<(String, u64)>),
    /// Write the settings of a spec to the device.
    WriteConfig(PathBuf),
    /// A recorder action.
    Record(RecorderAction),
    /// Download the record to a file.
    Download(PathBuf),
    /// Start the wave in a file.
    Wave(PathBuf),
    /// Stop the running wave.
    StopWave,
    /// Show the state of the input line and of the command that waits for its edge.
    Edge,
    /// Cancel the command that waits for the edge.
    DropEdge,
    /// Start a move, a trajectory or a wave at the next rising edge of the input line.
    OnEdge(Box<Command>),
    /// Show samples of the running machine, or write them to a file.
    Watch {
        /// Ticks per row; by default those of 0.1 s.
        every: Option<u32>,
        /// Duration, s.
        seconds: f64,
        /// CSV file, or JSON Lines if the name ends in `.jsonl`.
        file: Option<PathBuf>,
    },
    /// Ramp down and end the program that serves the link.
    Shutdown,
}

/// The requested frame of a session.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrameRequest {
    /// The controller's coordinates.
    None,
    /// This work frame, m and rad.
    Work([f64; 6]),
    /// This tool point, m.
    Tool([f64; 3]),
}

/// A requested mode: a name of [`ControlMode::WORDS`], or its first part for the run-to-run law in force.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModeRequest(String);

impl ModeRequest {
    fn parse(text: &str) -> Result<Self, String> {
        if ControlMode::WORDS.iter().any(|(name, _)| *name == text || name.split('-').next() == Some(text)) {
            return Ok(Self(text.to_owned()));
        }
        Err(format!("expected p, f or pf, the last two optionally with a law, -invhys, -ewma or -pcc; found `{text}`"))
    }

    /// The word of the mode; `now` is the current one.
    ///
    /// # Errors
    /// No law is given, and none is active.
    pub fn word(&self, now: u64) -> Result<u64, String> {
        let law = ControlMode::WORDS
            .iter()
            .find(|(_, word)| u64::from(*word) == now)
            .and_then(|(name, _)| name.split_once('-'));
        let kept = law.map(|(_, law)| format!("{}-{law}", self.0));
        let found = ControlMode::WORDS.iter().find(|(name, _)| *name == self.0 || kept.as_deref() == Some(*name));
        found
            .map(|(_, word)| u64::from(*word))
            .ok_or_else(|| format!("mode P has no run-to-run law to keep: name one, such as {}-pcc", self.0))
    }
}

/// The condition of `wait`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WaitCondition {
    /// The machine is in this phase.
    Phase(Phase),
    /// It is running, and no motion is in progress: approach to the bias, move, trajectory or stop.
    Arrived,
    /// This time has passed.
    Passed(Duration),
}

impl Command {
    /// Whether it moves the machine or enables motion.
    #[must_use]
    pub fn moves(&self) -> bool {
        matches!(
            self,
            Self::Ask(Request::Arm | Request::Run | Request::Drive)
                | Self::Set(_)
                | Self::Move { .. }
                | Self::Goto(_)
                | Self::Play { .. }
                | Self::Wave(_)
                | Self::OnEdge(_)
        )
    }

    /// The file that it reads, if any.
    #[must_use]
    pub fn input(&self) -> Option<&Path> {
        match self {
            Self::WriteConfig(path) | Self::Wave(path) | Self::Play { correction: Some((path, _)), .. } => Some(path),
            Self::OnEdge(command) => command.input(),
            _ => None,
        }
    }

    /// Parses a line; none if it has only blanks or a comment (`# …`).
    ///
    /// # Errors
    /// The line is invalid; the text says what is expected.
    pub fn parse(line: &str) -> Result<Option<Self>, String> {
        let line = line.split('#').next().unwrap_or_default().trim();
        let words: Vec<&str> = line.split_whitespace().collect();
        let command = match words[..] {
            [] => return Ok(None),
            ["status"] => Self::Status,
            ["none"] => Self::Ask(Request::None),
            ["arm"] => Self::Ask(Request::Arm),
            ["run"] => Self::Ask(Request::Run),
            ["hold"] => Self::Ask(Request::Hold),
            ["drive"] => Self::Ask(Request::Drive),
            ["ramp-down"] => Self::Ask(Request::RampDown),
            ["acknowledge"] => Self::Ask(Request::Acknowledge),
            ["set", ref rest @ ..] if !rest.is_empty() => {
                Self::Set(rest.iter().map(|text| assignment(text)).collect::<Result<_, _>>()?)
            }
            ["move", ref rest @ ..] if !rest.is_empty() => Self::Move { relative: false, axes: named(rest)? },
            ["jog", ref rest @ ..] if !rest.is_empty() => Self::Move { relative: true, axes: named(rest)? },
            ["where"] => Self::Where,
            ["limits"] => Self::Limits,
            ["can-i-go", ref rest @ ..] if !rest.is_empty() => {
                let (speeds, axes): (Vec<&str>, Vec<&str>) = rest.iter().partition(|word| word.starts_with("speed="));
                Self::CanIGo { axes: named(&axes)?, speed: pace(&speeds)? }
            }
            ["frame"] => Self::Frame(None),
            ["frame", "none"] => Self::Frame(Some(FrameRequest::None)),
            ["frame", "work", ref rest @ ..] if !rest.is_empty() => {
                Self::Frame(Some(FrameRequest::Work(named(rest)?.map(Option::unwrap_or_default))))
            }
            ["frame", "tool", ref rest @ ..] if !rest.is_empty() => match named(rest)? {
                [x, y, z, None, None, None] => {
                    Self::Frame(Some(FrameRequest::Tool([x, y, z].map(Option::unwrap_or_default))))
                }
                _ => return Err(format!("`{line}`: a tool point has only x, y and z")),
            },
            ["mark", name] => Self::Mark(name.to_owned()),
            ["goto", name] => Self::Goto(name.to_owned()),
            ["play", name] => Self::Play { name: name.to_owned(), correction: None },
            ["play", name, correction, machine] => {
                let of = |word: &str, key: &str| word.strip_prefix(key).map(str::to_owned);
                let correction = of(correction, "correction=").zip(of(machine, "machine="));
                let (file, machine) = correction.ok_or_else(|| {
                    format!(
                        "`{line}`: expected play TRAJECTORY correction=FILE machine=NAME, with a file of `specgen learn`"
                    )
                })?;
                Self::Play { name: name.to_owned(), correction: Some((file.into(), machine)) }
            }
            ["mode", mode] => Self::Mode(ModeRequest::parse(mode)?),
            ["gains", ref rest @ ..] => Self::Gains(rest.iter().map(|text| gain(text)).collect::<Result<_, _>>()?),
            ["trigger", line, first, ref rest @ ..] => {
                let line = line.parse().ok().filter(|line| *line < MOST);
                let line = line.ok_or_else(|| format!("expected a trigger number, 0 to {}", MOST - 1))?;
                let settings = std::iter::once(&first).chain(rest).map(|text| of_trigger(text));
                Self::Trigger { line, settings: settings.collect::<Result<_, _>>()? }
            }
            ["wait", until, ref limit @ ..] if limit.len() < 2 => Self::wait(until, limit.first().copied())?,
            ["config"] => Self::Config,
            ["config", "write", spec] => Self::WriteConfig(spec.into()),
            ["config", ref rest @ ..] => {
                Self::CodeLimits(rest.iter().map(|text| code_limit(text)).collect::<Result<_, _>>()?)
            }
            ["record", "arm"] => Self::Record(RecorderAction::Arm { after: AFTER }),
            ["record", "arm", after] => {
                let after = after.parse().ok().filter(|after| *after > 0);
                let after = after.ok_or_else(|| format!("`{line}`: expected ticks after the trigger, 1 or more"))?;
                Self::Record(RecorderAction::Arm { after })
            }
            ["record", "trigger"] => Self::Record(RecorderAction::Trigger),
            ["record", "stop"] => Self::Record(RecorderAction::Stop),
            ["record", "look"] => Self::Record(RecorderAction::Look),
            ["record", "download", file] => Self::Download(file.into()),
            ["wave", "stop"] => Self::StopWave,
            ["wave", file] => Self::Wave(file.into()),
            ["on-edge"] => Self::Edge,
            ["on-edge", "drop"] => Self::DropEdge,
            ["on-edge", ref rest @ ..] => match Self::parse(&rest.join(" "))? {
                Some(
                    command @ (Self::Move { .. } | Self::Goto(_) | Self::Play { correction: None, .. } | Self::Wave(_)),
                ) => Self::OnEdge(Box::new(command)),
                _ => return Err(format!("`{line}`: an edge can start {EDGE_STARTS}")),
            },
            ["watch", ref rest @ ..] if rest.len() <= 3 => Self::watch(rest)?,
            ["shutdown"] => Self::Shutdown,
            ["stop"] => {
                return Err("`stop`: `hold` stops the motion, `ramp-down` switches the amplifiers off, `shutdown` also ends the program at a socket".to_owned());
            }
            _ => return Err(format!("invalid command `{line}`; expected one of: {COMMANDS}")),
        };
        Ok(Some(command))
    }

    fn watch(words: &[&str]) -> Result<Self, String> {
        let every = words.first().map(|text| {
            let every = text.parse().ok().filter(|every| (1..=MOST_EVERY).contains(every));
            every.ok_or_else(|| format!("`watch {text}`: expected ticks per row, 1 to {MOST_EVERY}"))
        });
        let time = words.get(1).map(|text| {
            let time = text.parse().ok().filter(|time| *time > 0.0 && *time <= LONGEST);
            time.ok_or_else(|| format!("`watch … {text}`: expected a time of more than 0 and up to {LONGEST} s"))
        });
        let file = words.get(2).map(PathBuf::from);
        Ok(Self::Watch { every: every.transpose()?, seconds: time.transpose()?.unwrap_or(WATCHED), file })
    }

    fn wait(until: &str, limit: Option<&str>) -> Result<Self, String> {
        let limit = limit.map(seconds).transpose()?;
        let phase = (0..).map_while(Phase::from_word).find(|phase| phase.name().replace(' ', "-") == until);
        let until = match phase {
            Some(phase) => WaitCondition::Phase(phase),
            None if until == "arrived" => WaitCondition::Arrived,
            None => WaitCondition::Passed(seconds(until)?),
        };
        Ok(Self::Wait { until, limit: limit.unwrap_or(TIMEOUT) })
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let time = text.parse().ok().filter(|time| (0.0..=LONGEST).contains(time));
    time.map(Duration::from_secs_f64).ok_or_else(|| {
        let phases: Vec<String> =
            (0..).map_while(Phase::from_word).map(|phase| phase.name().replace(' ', "-")).collect();
        format!("expected a phase ({}), `arrived` or a time from 0 to {LONGEST} s, found `{text}`", phases.join(", "))
    })
}

fn assignment(text: &str) -> Result<(String, String), String> {
    let (name, value) =
        text.split_once('=').ok_or_else(|| format!("expected NAME=VALUE such as setpoint[2]=1e-6, found `{text}`"))?;
    Ok((name.to_owned(), value.to_owned()))
}

fn gain(text: &str) -> Result<(String, f64), String> {
    let expected = || format!("expected a gain such as ki[2]=1e9 in SI, found `{text}`");
    let (name, value) = assignment(text).map_err(|_| expected())?;
    let value = value.parse().ok().filter(|value: &f64| value.is_finite() && *value >= 0.0).ok_or_else(expected)?;
    Ok((name, value))
}

fn code_limit(text: &str) -> Result<(String, u64), String> {
    let limit = assignment(text).ok().filter(|(name, _)| ["code_min", "code_max"].contains(&name.as_str()));
    let limit = limit.and_then(|(name, code)| Some((name, code.parse::<u32>().ok()?.into())));
    limit.ok_or_else(|| format!("expected write SPEC, code_min=CODE or code_max=CODE, found `{text}`"))
}

/// Settings that are choices, with the words of their values.
const CHOICES: [(&str, &[&str]); 3] = [
    ("kind", &["off", "position", "level", "motion", "points", "ticks"]),
    ("axis", &["x", "y", "z", "theta_x", "theta_y", "theta_z"]),
    ("direction", &["both", "up", "down"]),
];

fn of_trigger(text: &str) -> Result<(String, f64), String> {
    let (name, value) = assignment(text)
        .map_err(|_| format!("expected a setting of a trigger such as step=1e-6 in SI, found `{text}`"))?;
    let words = CHOICES.iter().find(|(choice, _)| *choice == name).map(|(_, words)| *words);
    let found = match words {
        Some(words) => words.iter().position(|word| *word == value).map(|place| place as f64),
        None => value.parse().ok().filter(|value: &f64| value.is_finite()),
    };
    let expected = words.map_or("a number in SI".to_owned(), |words| words.join(", "));
    Ok((name.clone(), found.ok_or_else(|| format!("`{name}` of a trigger: expected {expected}, found `{value}`"))?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_parsed() {
        let time = Duration::from_secs_f64;
        let cases = [
            ("", None),
            ("  # nothing", None),
            ("arm # now", Some(Command::Ask(Request::Arm))),
            ("wait running", Some(Command::Wait { until: WaitCondition::Phase(Phase::Running), limit: TIMEOUT })),
            (
                "wait ramping-down 3",
                Some(Command::Wait { until: WaitCondition::Phase(Phase::RampingDown), limit: time(3.0) }),
            ),
            ("wait 0.5", Some(Command::Wait { until: WaitCondition::Passed(time(0.5)), limit: TIMEOUT })),
            ("set a=1 b[2]=-2e-6", Some(Command::Set(vec![("a".into(), "1".into()), ("b[2]".into(), "-2e-6".into())]))),
            ("wait arrived 3", Some(Command::Wait { until: WaitCondition::Arrived, limit: time(3.0) })),
            ("jog z=1um", Some(Command::Move { relative: true, axes: [None, None, Some(1e-6), None, None, None] })),
            ("where", Some(Command::Where)),
            ("gains", Some(Command::Gains(Vec::new()))),
            ("gains ki[2]=1e9", Some(Command::Gains(vec![("ki[2]".into(), 1e9)]))),
            (
                "trigger 1 kind=position axis=theta_z start=-1e-4",
                Some(Command::Trigger {
                    line: 1,
                    settings: vec![("kind".into(), 1.0), ("axis".into(), 5.0), ("start".into(), -1e-4)],
                }),
            ),
            ("frame tool z=40mm", Some(Command::Frame(Some(FrameRequest::Tool([0.0, 0.0, 0.04]))))),
            ("goto zero", Some(Command::Goto("zero".into()))),
            ("mode pf-ewma", Some(Command::Mode(ModeRequest("pf-ewma".to_owned())))),
            (
                "can-i-go x=1um speed=2um/s",
                Some(Command::CanIGo { axes: [Some(1e-6), None, None, None, None, None], speed: [Some(2e-6), None] }),
            ),
            ("record arm 7", Some(Command::Record(RecorderAction::Arm { after: 7 }))),
            ("record download run.rec", Some(Command::Download("run.rec".into()))),
            ("wave stop", Some(Command::StopWave)),
            ("shutdown", Some(Command::Shutdown)),
            ("on-edge", Some(Command::Edge)),
            ("on-edge drop", Some(Command::DropEdge)),
            ("on-edge goto zero", Some(Command::OnEdge(Box::new(Command::Goto("zero".into()))))),
            ("on-edge wave w.toml", Some(Command::OnEdge(Box::new(Command::Wave("w.toml".into()))))),
            ("watch", Some(Command::Watch { every: None, seconds: 10.0, file: None })),
            ("watch 20 0.5 w.csv", Some(Command::Watch { every: Some(20), seconds: 0.5, file: Some("w.csv".into()) })),
            ("wave w.toml", Some(Command::Wave("w.toml".into()))),
            ("config write tuned.toml", Some(Command::WriteConfig("tuned.toml".into()))),
            ("config code_max=4369", Some(Command::CodeLimits(vec![("code_max".into(), 4369)]))),
        ];
        for (line, command) in cases {
            assert_eq!(Command::parse(line), Ok(command), "{line}");
        }
    }

    #[test]
    fn invalid_lines_are_refused_with_the_expected_form() {
        for (line, expected) in [
            ("go", "invalid command `go`; expected one of: status, arm"),
            ("set", "invalid command"),
            ("set a", "expected NAME=VALUE"),
            ("wait", "invalid command"),
            ("move", "invalid command"),
            ("move z=1", "z needs a unit of"),
            ("wait nan", "expected a phase (disarmed, arming, running"),
            ("wait -1", "found `-1`"),
            ("wait running soon", "found `soon`"),
            ("frame tool rx=1urad", "a tool point has only x, y and z"),
            ("mode p-pcc", "expected p, f or pf"),
            ("mode fast", "expected p, f or pf"),
            ("gains ki=-1", "expected a gain such as"),
            ("gains ki", "expected a gain such as"),
            ("can-i-go x=1um speed=2um", "expected a speed such as"),
            ("can-i-go", "invalid command"),
            ("record arm 0", "1 or more"),
            ("record arm -1", "1 or more"),
            ("config write", "expected write SPEC, code_min=CODE"),
            ("config code_max=-1", "found `code_max=-1`"),
            ("config ki[2]=1e9", "expected write SPEC, code_min=CODE"),
            ("trigger 4 step=1e-6", "0 to 3"),
            ("trigger 0 kind=hold", "expected off, position"),
            ("trigger 0 step=1um", "expected a number in SI, found `1um`"),
            ("arm now", "invalid command"),
            ("on-edge arm", "`on-edge arm`: an edge can start move, jog"),
            ("on-edge wave stop", "an edge can start move, jog"),
            ("on-edge on-edge goto zero", "an edge can start move, jog"),
            ("on-edge move z=1", "z needs a unit of"),
            ("watch 0", "`watch 0`: expected ticks per row, 1 to 1000000"),
            ("watch 1 0", "expected a time of more than 0"),
            ("watch 1 1 a b", "invalid command"),
        ] {
            let error = Command::parse(line).unwrap_err();
            assert!(error.contains(expected), "{line}: {error}");
        }
    }

    #[test]
    fn a_mode_keeps_the_law_that_is_not_named() {
        let word = |text, now| ModeRequest::parse(text).unwrap().word(now);
        assert_eq!([word("p", 6), word("f", 6), word("pf", 2), word("pf-pcc", 0)], [Ok(0), Ok(3), Ok(5), Ok(6)]);
        assert!(word("f", 0).unwrap_err().contains("name one, such as f-pcc"));
    }
}
