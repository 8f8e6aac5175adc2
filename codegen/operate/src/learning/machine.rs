//! Passes over a machine at the end of a link.

use std::time::{Duration, Instant};

use specgen_compiler::compile::Compilation;
use specgen_compiler::ir::Path as Poses;
use specgen_link::client::Port;
use specgen_runtime::playback::Knot;
use specgen_runtime::supervisor::{Phase, Request};
use specgen_studies::learning::{LearnError, Motion, PassObservation, Plan, RepeatableMachine, course, held};

use crate::command::{Command, WaitCondition};
use crate::commands::{Operator, SessionError};
use crate::session::ALIVE;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;

/// How long arming, and the way to the bias pose, may take.
const ARMING: Duration = Duration::from_secs(120);

/// A trajectory of the spec, as its machine plays it.
pub(super) struct OwnTrajectory {
    /// Its number.
    number: u32,
    /// Where it begins, as the controller has it, in the user's coordinates, m and rad.
    pub start: [f64; 6],
}

impl OwnTrajectory {
    /// Of a name.
    ///
    /// # Errors
    /// There is none, or not one with an end.
    pub fn named(name: Option<&str>, compiled: &Compilation) -> Result<Self, Failure> {
        let known = compiled.ir.task_space.iter().flat_map(|task| &task.setpoints.trajectories);
        let names: Vec<&str> = known.clone().map(|one| one.name.as_str()).collect();
        let found = known.enumerate().find(|(_, one)| Some(one.name.as_str()) == name);
        match found.map(|(number, one)| (number as u32, &one.path)) {
            Some((number, path @ Poses::Segments { .. })) => Ok(Self { number, start: path.start() }),
            Some(_) => Err(Failure::Usage("a machine learns trajectories of the paper's kinds, not waveforms".to_owned())),
            None if names.is_empty() => Err(Failure::Usage(
                "a machine learns the trajectories that it has, and this spec has none: add a [[trajectory]], and build anew"
                    .to_owned(),
            )),
            None => Err(Failure::Usage(format!(
                "a machine learns the trajectories that it has: name one of them by --trajectory: {}",
                names.join(", ")
            ))),
        }
    }
}

/// A machine, and its operator.
pub(super) struct LinkedMachine<'a, P> {
    pub operator: &'a mut Operator<P>,
    pub ui: &'a Ui,
    pub own: &'a OwnTrajectory,
    /// The correction that its device has in its memory, once that is known.
    pub has: Option<Vec<Knot>>,
    /// The error that ended a pass.
    pub error: Option<SessionError>,
}

impl<P: Port> LinkedMachine<'_, P> {
    /// Brings it to its bias pose. One that runs already is taken as it is.
    pub fn arm(&mut self) -> Result<(), SessionError> {
        let wait = |until| Command::Wait { until, limit: ARMING };
        let stands = u64::from(self.operator.phase());
        if stands == Phase::Disarmed.word() {
            self.operator.execute(&Command::Ask(Request::Arm), self.ui)?;
            let start = Instant::now();
            while u64::from(self.operator.phase()) == Phase::Disarmed.word() {
                if start.elapsed() > ARMING {
                    return Err(SessionError::Fault(
                        "the machine does not arm; `specgen operate` with `status` says why".to_owned(),
                    ));
                }
                self.operator.execute(&wait(WaitCondition::Passed(ALIVE)), self.ui)?;
            }
            self.operator.execute(&Command::Ask(Request::Run), self.ui)?;
            self.operator.execute(&wait(WaitCondition::Phase(Phase::Running)), self.ui)?;
        } else if stands != Phase::Running.word() {
            return Err(SessionError::Refused(format!(
                "the machine is {}; learning begins with one that is disarmed or runs",
                self.operator.state()
            )));
        }
        self.operator.execute(&wait(WaitCondition::Arrived), self.ui)
    }
}

impl<P: Port> RepeatableMachine for LinkedMachine<'_, P> {
    fn pass(&mut self, motion: &Motion, knots: &[Knot], spacing: u32) -> Result<PassObservation, LearnError> {
        let course = course(motion, spacing, self.own.number);
        // What the device has stays there.
        let sent = if self.has.as_deref() == Some(knots) { None } else { Some(knots) };
        match self.operator.pass(&self.own.start, course, sent, self.ui) {
            Ok(passed) => {
                self.has = Some(knots.to_vec());
                let measured = held(&passed.errors, spacing, motion.corrected);
                Ok(PassObservation { real: measured.clone(), measured, kept: passed.errors, status: passed.status })
            }
            Err(error) => {
                self.error = Some(error);
                Err(LearnError::Ended)
            }
        }
    }

    /// The device makes it, and the same kernel here finds whether it made it to the bit.
    fn next(&mut self, plan: &Plan, played: &[Knot], seen: &PassObservation) -> Result<Vec<Knot>, LearnError> {
        let expected = plan.next(played, &seen.kept).ok_or(LearnError::Refused)?;
        let made =
            self.operator.plan(seen.kept.len(), &plan.rows).and_then(|()| self.operator.learn(plan.settings, self.ui));
        match made {
            Ok(made) if made == expected => {
                self.has = Some(made.clone());
                Ok(made)
            }
            Ok(_) => Err(LearnError::Refused),
            Err(error) => {
                self.error = Some(error);
                Err(LearnError::Ended)
            }
        }
    }

    /// What is not kept does not stay in the device, either.
    fn keep(&mut self, motion: &Motion, knots: &[Knot], spacing: u32) -> Result<(), LearnError> {
        if self.has.as_deref() == Some(knots) {
            return Ok(());
        }
        self.operator.correct(knots, course(motion, spacing, self.own.number)).map_err(|error| {
            self.error = Some(error);
            LearnError::Ended
        })
    }
}
