//! What is asked of the machine, and when: by the command line's plan, by lines on a socket, by signals.
//!
//! An operator only asks. Whether a request is granted is the supervisor's business, and each step here waits for what it says.

use controller::supervised::{Cause, MACHINE_INPUT_NAMES, MACHINE_INPUT_WORDS, Phase, Request};
use specgen_rt::clock::SECOND;

use crate::control::Wish;
use crate::words::{Places, Words, place, word_of};

/// How long a step of the plan may take before it is given up, ns.
const STEP_LIMIT: u64 = 120 * SECOND;
/// How long ramping down may take before the loop ends all the same, ns.
const DOWN_LIMIT: u64 = 30 * SECOND;

/// What the supervisor last said.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Said {
    /// Phase.
    pub phase: Phase,
    /// Cause.
    pub cause: Cause,
    /// Amplifiers on.
    pub on: bool,
    /// Status of the control law.
    pub status: u32,
    /// Tick of these.
    pub tick: u64,
}

/// Where the plan stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// No plan: lines alone.
    Free,
    /// Asked to arm, until it does.
    Arming,
    /// Asked to run, until it does.
    Starting,
    /// Running; what was to be played is asked for.
    Playing,
    /// Asked to ramp down, until it is off.
    GoingDown,
    /// Nothing left to ask.
    Over,
}

/// The operator.
#[derive(Debug)]
pub struct Operator {
    places: Places,
    words: Words,
    request: Request,
    step: Step,
    since: u64,
    /// Input words to set once it runs, by place.
    play: Vec<(usize, u64)>,
    /// Why the plan could not be carried out.
    pub complaint: Option<String>,
    changed: bool,
    /// After a fault the loop goes on, for somebody will look at it or end it.
    attended: bool,
}

impl Operator {
    /// An operator without a plan. If the plan fails the loop goes on where it is `attended`, else it ends.
    #[must_use]
    pub fn new(places: Places, attended: bool) -> Self {
        Self {
            places,
            words: [0; MACHINE_INPUT_WORDS],
            request: Request::None,
            step: Step::Free,
            since: 0,
            play: Vec::new(),
            complaint: None,
            changed: true,
            attended,
        }
    }

    /// Plans: arm, run, then set `play` (assignments such as `command=3`).
    ///
    /// # Errors
    /// An assignment that makes no sense.
    pub fn plan(&mut self, play: &[String], now: u64) -> Result<(), String> {
        for assignment in play {
            self.play.push(self.assignment(assignment)?);
        }
        self.go(Step::Arming, Request::Arm, now);
        Ok(())
    }

    /// Asks to ramp down; then the loop may end.
    pub fn go_down(&mut self, now: u64) {
        if !matches!(self.step, Step::GoingDown | Step::Over) {
            self.go(Step::GoingDown, Request::RampDown, now);
        }
    }

    /// Whether nothing is left to wait for before the loop ends.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.step == Step::Over
    }

    /// Hears what the supervisor said and goes on with the plan.
    pub fn hear(&mut self, said: &Said, now: u64) {
        let waited = now.saturating_sub(self.since);
        match (self.step, said.phase) {
            (Step::Arming | Step::Starting | Step::Playing, Phase::Faulted) => {
                self.complain(format!("the machine faulted at tick {}: {:?}", said.tick, said.cause), now);
            }
            (Step::Arming, Phase::Running) | (Step::Starting, Phase::Running) => {
                for (place, word) in std::mem::take(&mut self.play) {
                    self.words[place] = word;
                }
                self.go(Step::Playing, Request::None, now);
            }
            (Step::Arming, Phase::Arming | Phase::Holding) => self.go(Step::Starting, Request::Run, now),
            (Step::Arming | Step::Starting, _) if waited > STEP_LIMIT => {
                self.complain(format!("the machine is still {:?} after {} s", said.phase, STEP_LIMIT / SECOND), now);
            }
            (Step::GoingDown, Phase::Disarmed | Phase::Faulted) if !said.on => self.go(Step::Over, Request::None, now),
            (Step::GoingDown, _) if waited > DOWN_LIMIT => {
                let text =
                    format!("not down after {} s ({:?}): amplifiers switched off", DOWN_LIMIT / SECOND, said.phase);
                self.complaint.get_or_insert(text);
                self.go(Step::Over, Request::None, now);
            }
            _ => {}
        }
    }

    /// A line from the socket: its answer.
    pub fn obey(&mut self, line: &str, now: u64) -> Result<String, String> {
        let mut parts = line.split_whitespace();
        let verb = parts.next().unwrap_or_default();
        let rest: Vec<String> = parts.map(str::to_owned).collect();
        let request = match verb {
            "none" => Request::None,
            "arm" => Request::Arm,
            "run" => Request::Run,
            "hold" => Request::Hold,
            "ramp-down" => Request::RampDown,
            "acknowledge" => Request::Acknowledge,
            "set" if !rest.is_empty() => {
                let words = rest.iter().map(|text| self.assignment(text)).collect::<Result<Vec<_>, _>>()?;
                for (place, word) in words {
                    self.words[place] = word;
                }
                self.changed = true;
                return Ok("ok".to_owned());
            }
            "stop" => {
                self.go_down(now);
                return Ok("ok".to_owned());
            }
            _ => {
                return Err(format!(
                    "`{line}` is none of: status, set NAME=VALUE…, none, arm, run, hold, ramp-down, acknowledge, stop"
                ));
            }
        };
        if !rest.is_empty() {
            return Err(format!("`{verb}` takes nothing more, found `{}`", rest.join(" ")));
        }
        // By hand from here on, but for the way down.
        if self.step != Step::GoingDown && self.step != Step::Over {
            self.step = Step::Free;
        }
        self.request = request;
        self.changed = true;
        Ok("ok".to_owned())
    }

    /// What is to be sent to the loop, if it changed since the last call.
    pub fn wish(&mut self) -> Option<Wish> {
        std::mem::take(&mut self.changed).then(|| Wish { words: self.words, request: self.request.word() })
    }

    /// The last wish found no room: it is to be sent again.
    pub fn repeat(&mut self) {
        self.changed = true;
    }

    fn go(&mut self, step: Step, request: Request, now: u64) {
        (self.step, self.request, self.since, self.changed) = (step, request, now, true);
    }

    fn complain(&mut self, text: String, now: u64) {
        self.complaint.get_or_insert(text);
        if self.attended {
            self.go(Step::Free, Request::RampDown, now);
        } else {
            self.go(Step::GoingDown, Request::RampDown, now);
        }
    }

    /// Place and word of `name=value`.
    fn assignment(&self, text: &str) -> Result<(usize, u64), String> {
        let (name, value) =
            text.split_once('=').ok_or_else(|| format!("expected NAME=VALUE such as `command=3`, found `{text}`"))?;
        let place = place(name).map_err(|error| error.to_string())?;
        if !self.places.is_free(place) {
            let free = (0..MACHINE_INPUT_WORDS).filter(|k| self.places.is_free(*k));
            let free: Vec<&str> = free.map(|k| MACHINE_INPUT_NAMES[k]).collect();
            return Err(format!("`{name}` is measured or has a request of its own; free are {}", free.join(", ")));
        }
        let number: f64 = value.parse().map_err(|_| format!("`{name}`: expected a number, found `{value}`"))?;
        let word = number.is_finite().then(|| word_of(place, number)).flatten();
        word.map(|word| (place, word))
            .ok_or_else(|| format!("`{name}`: expected a finite number, or a whole one of 0 to 4294967295 where the word is a count; found `{value}`"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(phase: Phase, on: bool) -> Said {
        Said { phase, cause: Cause::None, on, status: 0, tick: 7 }
    }

    fn operator() -> Operator {
        Operator::new(Places::find().unwrap(), false)
    }

    #[test]
    fn the_plan_arms_runs_plays_and_goes_down() {
        let mut operator = operator();
        operator.plan(&["setpoint[0]=1e-6".to_owned()], 0).unwrap();
        assert_eq!(operator.wish().unwrap().request, Request::Arm.word());
        operator.hear(&said(Phase::Disarmed, false), 1);
        assert!(operator.wish().is_none());
        operator.hear(&said(Phase::Arming, true), 1);
        assert_eq!(operator.wish().unwrap().request, Request::Run.word());
        operator.hear(&said(Phase::Arming, true), 1);
        assert!(operator.wish().is_none());
        operator.hear(&said(Phase::Running, true), 2);
        let wish = operator.wish().unwrap();
        let index = place("setpoint[0]").unwrap();
        assert_eq!((wish.request, wish.words[index]), (Request::None.word(), word_of(index, 1e-6).unwrap()));
        operator.go_down(3);
        assert_eq!(operator.wish().unwrap().request, Request::RampDown.word());
        operator.hear(&said(Phase::RampingDown, true), 4);
        assert!(!operator.is_over());
        operator.hear(&said(Phase::Disarmed, false), 5);
        assert!(operator.is_over() && operator.complaint.is_none());
    }

    #[test]
    fn a_fault_ends_the_plan_and_a_machine_that_does_not_come_down_is_not_waited_for_for_ever() {
        let mut operator = operator();
        operator.plan(&[], 0).unwrap();
        operator.hear(&said(Phase::Faulted, true), 1);
        assert!(operator.complaint.as_ref().unwrap().contains("faulted at tick 7"));
        operator.hear(&said(Phase::Holding, true), 2);
        assert!(!operator.is_over());
        operator.hear(&said(Phase::Holding, true), 2 + DOWN_LIMIT);
        assert!(operator.is_over());
    }

    #[test]
    fn where_somebody_looks_a_fault_does_not_end_the_loop() {
        let mut operator = Operator::new(Places::find().unwrap(), true);
        operator.plan(&[], 0).unwrap();
        operator.hear(&said(Phase::Faulted, false), 1);
        operator.hear(&said(Phase::Faulted, false), 2);
        assert!(operator.complaint.is_some() && !operator.is_over());
        operator.go_down(3);
        operator.hear(&said(Phase::Faulted, false), 4);
        assert!(operator.is_over());
    }

    #[test]
    fn lines_are_obeyed_or_refused_with_what_is_expected() {
        let mut operator = operator();
        assert_eq!(operator.obey("arm", 0), Ok("ok".to_owned()));
        assert_eq!(operator.wish().unwrap().request, Request::Arm.word());
        for (line, expected) in [
            ("go", "is none of: status, set"),
            ("arm now", "takes nothing more, found `now`"),
            ("set", "is none of"),
            ("set request=1", "has a request of its own"),
            ("set setpoint[9]=1", "no input word `setpoint[9]`"),
            ("set setpoint[0]=x", "expected a number, found `x`"),
            ("set setpoint[0]=inf", "expected a finite number"),
            ("set setpoint[0]", "NAME=VALUE"),
        ] {
            let error = operator.obey(line, 0).unwrap_err();
            assert!(error.contains(expected), "{line}: {error}");
            assert!(operator.wish().is_none(), "{line}");
        }
        assert!(operator.obey("set setpoint[0]=1e-6 setpoint[1]=2e-6", 0).is_ok());
        assert!(operator.wish().is_some());
        // Half of a line is not obeyed.
        assert!(operator.obey("set setpoint[0]=5e-6 setpoint[1]=x", 0).is_err());
        assert!(operator.wish().is_none());
    }
}
