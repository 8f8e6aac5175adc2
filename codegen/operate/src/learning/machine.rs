//! Passes on a machine over the link.

use std::time::{Duration, Instant};

use specgen_compiler::compile::Compilation;
use specgen_compiler::ir::Path as Poses;
use specgen_link::client::Port;
use specgen_runtime::playback::Knot;
use specgen_runtime::supervisor::{Phase, Request};
use specgen_studies::learning::{
    LearnError, Motion, PassObservation, Plan, RepeatableMachine, error_by_tick, pass_timing,
};

use crate::command::{Command, WaitCondition};
use crate::commands::{Operator, SessionError};
use crate::session::POLL_INTERVAL;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;

/// Timeout of arming, and of the move to the bias pose.
const ARMING: Duration = Duration::from_secs(120);

/// A trajectory of the spec that the machine plays.
pub(super) struct OwnTrajectory {
    /// Its number.
    number: u32,
    /// Its start, in the user's coordinates, m and rad.
    pub start: [f64; 6],
}

impl OwnTrajectory {
    /// The trajectory of this name.
    ///
    /// # Errors
    /// There is none, or it is a waveform.
    pub fn named(name: Option<&str>, compiled: &Compilation) -> Result<Self, Failure> {
        let known = compiled.ir.task_space.iter().flat_map(|task| &task.setpoints.trajectories);
        let names: Vec<&str> = known.clone().map(|one| one.name.as_str()).collect();
        let found = known.enumerate().find(|(_, one)| Some(one.name.as_str()) == name);
        match found.map(|(number, one)| (number as u32, &one.path)) {
            Some((number, path @ Poses::Segments { .. })) => Ok(Self { number, start: path.start() }),
            Some(_) => Err(Failure::Usage("a machine can learn trajectories of the paper's kinds, not waveforms".to_owned())),
            None if names.is_empty() => Err(Failure::Usage(
                "a machine can learn only trajectories of its spec, and this spec has none: add a [[trajectory]] and rebuild"
                    .to_owned(),
            )),
            None => Err(Failure::Usage(format!(
                "a machine can learn only trajectories of its spec: name one with --trajectory: {}",
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
    /// The correction in the memory of the device, if known.
    pub has: Option<Vec<Knot>>,
    /// The error that ended a pass.
    pub error: Option<SessionError>,
}

impl<P: Port> LinkedMachine<'_, P> {
    /// Arms and runs a disarmed machine, and waits until it is at rest.
    pub fn arm(&mut self) -> Result<(), SessionError> {
        let wait = |until| Command::Wait { until, limit: ARMING };
        let phase = u64::from(self.operator.phase());
        if phase == Phase::Disarmed.word() {
            self.operator.execute(&Command::Ask(Request::Arm), self.ui)?;
            let start = Instant::now();
            while u64::from(self.operator.phase()) == Phase::Disarmed.word() {
                if start.elapsed() > ARMING {
                    return Err(SessionError::Fault(
                        "the machine does not arm; `status` in `specgen operate` shows why".to_owned(),
                    ));
                }
                self.operator.execute(&wait(WaitCondition::Passed(POLL_INTERVAL)), self.ui)?;
            }
            self.operator.execute(&Command::Ask(Request::Run), self.ui)?;
            self.operator.execute(&wait(WaitCondition::Phase(Phase::Running)), self.ui)?;
        } else if phase != Phase::Running.word() {
            return Err(SessionError::Refused(format!(
                "the machine is {}; learning needs a disarmed or running machine",
                self.operator.state()
            )));
        }
        self.operator.execute(&wait(WaitCondition::Arrived), self.ui)
    }

    /// Keeps the error that ended a pass.
    pub fn ended(&mut self, error: SessionError) -> LearnError {
        self.error = Some(error);
        LearnError::PassEnded
    }
}

impl<P: Port> RepeatableMachine for LinkedMachine<'_, P> {
    fn pass(&mut self, motion: &Motion, knots: &[Knot], spacing: u32) -> Result<PassObservation, LearnError> {
        let timing = pass_timing(motion, spacing, self.own.number);
        // Do not resend a correction that the device has.
        let sent = if self.has.as_deref() == Some(knots) { None } else { Some(knots) };
        match self.operator.pass(&self.own.start, timing, sent, self.ui) {
            Ok(passed) => {
                self.has = Some(knots.to_vec());
                let measured = error_by_tick(&passed.errors, spacing, motion.corrected);
                Ok(PassObservation { real: measured.clone(), measured, kept: passed.errors, status: passed.status })
            }
            Err(error) => Err(self.ended(error)),
        }
    }

    /// Lets the device compute the correction, and checks it bit for bit with the same kernel.
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
            Err(error) => Err(self.ended(error)),
        }
    }

    /// Restores the correction that was kept on the device.
    fn keep(&mut self, motion: &Motion, knots: &[Knot], spacing: u32) -> Result<(), LearnError> {
        if self.has.as_deref() == Some(knots) {
            return Ok(());
        }
        let timing = pass_timing(motion, spacing, self.own.number);
        self.operator.correct(knots, timing).map_err(|error| self.ended(error))
    }
}
