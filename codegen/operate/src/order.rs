//! What an operator types, as orders.

use std::path::PathBuf;
use std::time::Duration;

use specgen_link::RecorderAction;
use specgen_runtime::supervisor::{Phase, Request};

use crate::place::{Named, named};

/// How long something is waited for if nothing else is said.
const TIMEOUT: Duration = Duration::from_secs(60);
/// Longest time that can be asked for, s.
const LONGEST: f64 = 86_400.0;
/// Rows after a trigger, if nothing else is said.
const AFTER: u32 = 1000;
const COMMANDS: &str = "status, arm, run, hold, ramp-down, acknowledge, none, set NAME=VALUE…, \
                        move|jog AXIS=QUANTITY…, wait PHASE|arrived|SECONDS [TIMEOUT], config, \
                        config write SPEC, record arm [AFTER] | trigger | stop | look | download FILE, wave FILE | stop, stop";

/// One order.
#[derive(Debug, Clone, PartialEq)]
pub enum Order {
    /// Say how the machine stands and what it noticed of itself.
    Status,
    /// Ask the supervisor.
    Ask(Request),
    /// Set input words that are no measurements.
    Set(Vec<(String, String)>),
    /// Go to a pose, or by a step from the one commanded last.
    Move {
        /// By a step.
        relative: bool,
        /// What is said of each axis.
        axes: Named,
    },
    /// Go on when something is so.
    Wait {
        /// What.
        until: Until,
        /// At most so long.
        limit: Duration,
    },
    /// Show the settings in force.
    Config,
    /// Take the settings of a spec.
    WriteConfig(PathBuf),
    /// Something of the recorder.
    Record(RecorderAction),
    /// Fetch the record into a file.
    Download(PathBuf),
    /// Start the wave of a file.
    Wave(PathBuf),
    /// End the wave under way.
    StopWave,
    /// Ramp down and end the program that serves the link.
    Stop,
}

/// What is waited for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Until {
    /// The machine is in this phase.
    Phase(Phase),
    /// It runs, and no way to the bias, move, trajectory or stop is under way.
    Arrived,
    /// So long has passed.
    Passed(Duration),
}

impl Order {
    /// Of a line; none if there is nothing in it but blanks and a comment (`# …`).
    ///
    /// # Errors
    /// What is wrong with it, and what is expected.
    pub fn parse(line: &str) -> Result<Option<Self>, String> {
        let line = line.split('#').next().unwrap_or_default().trim();
        let words: Vec<&str> = line.split_whitespace().collect();
        let order = match words[..] {
            [] => return Ok(None),
            ["status"] => Self::Status,
            ["none"] => Self::Ask(Request::None),
            ["arm"] => Self::Ask(Request::Arm),
            ["run"] => Self::Ask(Request::Run),
            ["hold"] => Self::Ask(Request::Hold),
            ["ramp-down"] => Self::Ask(Request::RampDown),
            ["acknowledge"] => Self::Ask(Request::Acknowledge),
            ["set", ref rest @ ..] if !rest.is_empty() => {
                Self::Set(rest.iter().map(|text| assignment(text)).collect::<Result<_, _>>()?)
            }
            ["move", ref rest @ ..] if !rest.is_empty() => Self::Move { relative: false, axes: named(rest)? },
            ["jog", ref rest @ ..] if !rest.is_empty() => Self::Move { relative: true, axes: named(rest)? },
            ["wait", until] => Self::wait(until, None)?,
            ["wait", until, limit] => Self::wait(until, Some(limit))?,
            ["config"] => Self::Config,
            ["config", "write", spec] => Self::WriteConfig(spec.into()),
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
            ["stop"] => Self::Stop,
            _ => return Err(format!("`{line}` is none of: {COMMANDS}")),
        };
        Ok(Some(order))
    }

    fn wait(until: &str, limit: Option<&str>) -> Result<Self, String> {
        let limit = limit.map(seconds).transpose()?;
        let phase = (0..).map_while(Phase::from_word).find(|phase| phase.name().replace(' ', "-") == until);
        let until = match phase {
            Some(phase) => Until::Phase(phase),
            None if until == "arrived" => Until::Arrived,
            None => Until::Passed(seconds(until)?),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_orders() {
        let time = Duration::from_secs_f64;
        let cases = [
            ("", None),
            ("  # nothing", None),
            ("arm # now", Some(Order::Ask(Request::Arm))),
            ("wait running", Some(Order::Wait { until: Until::Phase(Phase::Running), limit: TIMEOUT })),
            ("wait ramping-down 3", Some(Order::Wait { until: Until::Phase(Phase::RampingDown), limit: time(3.0) })),
            ("wait 0.5", Some(Order::Wait { until: Until::Passed(time(0.5)), limit: TIMEOUT })),
            ("set a=1 b[2]=-2e-6", Some(Order::Set(vec![("a".into(), "1".into()), ("b[2]".into(), "-2e-6".into())]))),
            ("wait arrived 3", Some(Order::Wait { until: Until::Arrived, limit: time(3.0) })),
            ("jog z=1um", Some(Order::Move { relative: true, axes: [None, None, Some(1e-6), None, None, None] })),
            ("record arm 7", Some(Order::Record(RecorderAction::Arm { after: 7 }))),
            ("record download run.rec", Some(Order::Download("run.rec".into()))),
            ("wave stop", Some(Order::StopWave)),
            ("stop", Some(Order::Stop)),
            ("wave w.toml", Some(Order::Wave("w.toml".into()))),
            ("config write tuned.toml", Some(Order::WriteConfig("tuned.toml".into()))),
        ];
        for (line, order) in cases {
            assert_eq!(Order::parse(line), Ok(order), "{line}");
        }
    }

    #[test]
    fn what_is_none_is_refused_with_what_is_expected() {
        for (line, expected) in [
            ("go", "`go` is none of: status, arm"),
            ("set", "is none of"),
            ("set a", "expected NAME=VALUE"),
            ("wait", "is none of"),
            ("move", "is none of"),
            ("move z=1", "z wants a unit of"),
            ("wait nan", "expected a phase (disarmed, arming, running"),
            ("wait -1", "found `-1`"),
            ("wait running soon", "found `soon`"),
            ("record arm 0", "1 or more"),
            ("record arm -1", "1 or more"),
            ("config write", "is none of"),
            ("arm now", "is none of"),
        ] {
            let error = Order::parse(line).unwrap_err();
            assert!(error.contains(expected), "{line}: {error}");
        }
    }
}
