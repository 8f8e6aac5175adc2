//! Learning on a machine over the link.

mod machine;

use std::path::Path;

use specgen_compiler::compile::Compilation;
use specgen_language::interrupt;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_studies::learning::{LearnError, RepeatableMachine};
use specgen_studies::lessons::{self, MachineSource, Options, SessionResult, failure};
use specgen_studies::trajectory::NamedTrajectory;

use crate::commands::{Operator, SessionError, lost_link, motion_name};
use crate::line::Line;
use machine::{LinkedMachine, OwnTrajectory};

/// Learns a trajectory of the spec on the machine at `line`. `spec` is the file of the spec, for messages.
///
/// # Errors
/// The machine has no such trajectory, or the session or learning fails.
pub fn run(line: Line<'_>, spec: &Path, options: &Options, compiled: Compilation, ui: &mut Ui) -> Result<(), Failure> {
    let own = OwnTrajectory::named(options.trajectory.as_deref(), &compiled)?;
    lessons::run(options, compiled, &mut OnLine { line, spec, own }, ui)
}

/// A machine at a line.
struct OnLine<'a> {
    line: Line<'a>,
    /// File of the spec, for a message.
    spec: &'a Path,
    own: OwnTrajectory,
}

impl MachineSource for OnLine<'_> {
    fn motion_name(&self, followed: &NamedTrajectory) -> String {
        motion_name(&followed.name)
    }

    fn start(&self) -> Option<[f64; 6]> {
        Some(self.own.start)
    }

    fn work<T, F>(
        &mut self,
        compiled: &Compilation,
        ui: &mut Ui,
        work: impl FnOnce(&mut dyn RepeatableMachine, &Ui) -> Result<T, LearnError>,
        keep: impl FnOnce(T, &Ui) -> Result<F, Failure>,
    ) -> Result<SessionResult<F>, Failure> {
        interrupt::heed();
        let ir = &compiled.ir;
        let (session, name) = self.line.open(Some(&ir.digest))?;
        let mut operator = Operator::new(session, interrupt::heed());
        if !operator.is_set_to(&ir.integrity.settings).map_err(|error| lost_link(&name, &error))? {
            return Err(Failure::Gate(format!(
                "{name}: its settings differ from those of the spec, for which learning is proven to converge; `config write {}` in \
                 specgen operate restores them",
                self.spec.display()
            )));
        }
        let mut machine = LinkedMachine { operator: &mut operator, ui, own: &self.own, has: None, error: None };
        let done = match machine.arm() {
            Ok(()) => work(&mut machine, ui),
            Err(error) => Err(machine.ended(error)),
        };
        let ending = machine.error;
        let down = match &ending {
            Some(SessionError::Link(error)) => Err(lost_link(&name, error)),
            _ if operator.is_powered() => operator.ramp_down(ui).map_err(|error| lost_link(&name, &error)),
            _ => Ok(format!("the machine is {}, amplifiers off", operator.state())),
        };
        // Keep the result, even if the machine faulted.
        let result = match done {
            Ok(done) => Some(keep(done, ui)?),
            Err(LearnError::PassEnded) => None,
            Err(error) => return Err(down.err().unwrap_or_else(|| failure(&error, format!("{name}: {error}")))),
        };
        let final_state = format!("; {}", down?);
        let reason = match ending {
            Some(SessionError::Refused(text) | SessionError::Fault(text)) => Some(format!("{name}: {text}")),
            Some(SessionError::Failed(failure)) => return Err(failure),
            Some(SessionError::Stopped) => Some(format!("{name}: the program that serves the link has ended")),
            Some(SessionError::Link(_) | SessionError::Interrupted) | None => None,
        };
        Ok(SessionResult { result, reason, final_state })
    }
}
