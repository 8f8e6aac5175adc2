//! The machine of a commissioning: armed before a step and ramped down after it, however the step ends.

use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::Value;
use specgen_compiler::compile::Compilation;
use specgen_identify::assembled::{Drive, Kind};
use specgen_language::interrupt;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_link::client::Port;
use specgen_runtime::supervisor::{Finding, Phase, Request};

use super::plan;
use crate::command::{Command, WaitCondition};
use crate::commands::{Operator, SessionError, lost_link};
use crate::line::Line;
use crate::panel::status::advice;

/// Timeout of arming with the wiring check.
const ARMING: Duration = Duration::from_secs(120);
/// After this time without a tick the machine is not ticking.
const SILENT: Duration = Duration::from_secs(2);
/// When a wave is over for certain, s.
const ENDED: f64 = 0.1;

/// An operator of any device.
pub(super) type Machine = Operator<Box<dyn Port>>;

/// Opens the line and does `work` on the machine, which is disarmed; then ramps it down.
///
/// # Errors
/// Another controller answers, the work fails, or Ctrl-C; the message ends with the state of the machine.
pub(super) fn with<T>(
    line: Line<'_>,
    compiled: &Compilation,
    ui: &Ui,
    work: impl FnOnce(&mut Machine) -> Result<T, SessionError>,
) -> Result<T, Failure> {
    let stop = interrupt::heed();
    let (session, name) = line.open(Some(&compiled.ir.digest))?;
    let mut machine = Operator::new(session, stop);
    machine.alike = compiled.ir.supervision.alike().to_vec();
    machine.model = Some(compiled.model.clone());
    if !is_disarmed(&machine) {
        // Another host may operate it.
        return Err(Failure::Gate(format!(
            "{name}: the machine is {}; a step begins with a disarmed machine: `ramp-down`, or `acknowledge`, in `specgen operate`",
            machine.state()
        )));
    }
    let done = work(&mut machine);
    // The last status may be older than the last request.
    let down = match machine.in_control || machine.is_powered() {
        true => machine.ramp_down(ui),
        false => Ok(format!("the machine is {}, amplifiers off", machine.state())),
    };
    if let Err(SessionError::Link(error)) = &done {
        return Err(lost_link(&name, error));
    }
    let down = down.map_err(|error| lost_link(&name, &error))?;
    if done.is_ok() && !is_disarmed(&machine) {
        return Err(Failure::Gate(format!("{name}: {down}")));
    }
    done.map_err(|error| match error {
        SessionError::Interrupted => Failure::Interrupted {
            message: format!("interrupted; {down}; the same command continues"),
            result: Value::Null,
        },
        SessionError::Refused(text) | SessionError::Fault(text) => Failure::Gate(format!("{name}: {text}; {down}")),
        SessionError::Failed(failure) => failure,
        SessionError::Link(error) => lost_link(&name, &error),
        SessionError::Stopped => Failure::Gate(format!("{name}: the program that serves the link has ended")),
    })
}

fn is_disarmed(machine: &Machine) -> bool {
    u64::from(machine.phase()) == Phase::Disarmed.word()
}

/// Arms, with the wiring check; the machine then holds.
pub(super) fn arm(machine: &mut Machine, ui: &Ui) -> Result<(), SessionError> {
    request(machine, Request::Arm, Phase::Holding, ui).map_err(|error| {
        let advice = advice(Finding::of_word(u32::from(machine.session.status().finding)));
        match error {
            SessionError::Fault(text) if !advice.is_empty() => {
                SessionError::Fault(format!("{text}. {advice} Then `acknowledge`"))
            }
            other => other,
        }
    })
}

/// Arms, and begins an open drive.
pub(super) fn drive(machine: &mut Machine, ui: &Ui) -> Result<(), SessionError> {
    arm(machine, ui)?;
    request(machine, Request::Drive, Phase::Driving, ui)
}

/// Sends a request, and waits for its phase.
pub(super) fn request(machine: &mut Machine, request: Request, phase: Phase, ui: &Ui) -> Result<(), SessionError> {
    machine.execute(&Command::Ask(request), ui)?;
    machine.execute(&Command::Wait { until: WaitCondition::Phase(phase), limit: ARMING }, ui)
}

/// Waits, s of the machine's time: that of an emulated one is slower.
pub(super) fn rest(machine: &mut Machine, seconds: f64, ui: &Ui) -> Result<(), SessionError> {
    let mut last = machine.session.status().tick;
    let end = last + libm::ceil(seconds / machine.session.period()) as u64;
    let mut ticked = Instant::now();
    while last < end {
        std::thread::sleep(machine.session.due());
        machine.look()?;
        machine.show(ui);
        let tick = machine.session.status().tick;
        if tick != last {
            (last, ticked) = (tick, Instant::now());
        } else if ticked.elapsed() > SILENT {
            return Err(SessionError::Fault(format!("the machine is {}, but not ticking", machine.state())));
        }
    }
    Ok(())
}

/// Makes a drive of an open drive. Its record goes to `path`, with a rest before and after it; none of preconditioning.
pub(super) fn play(machine: &mut Machine, drive: &Drive, path: &Path, ui: &Ui) -> Result<(), SessionError> {
    let words = machine.wave_of_text(&drive.wave_file()).map_err(SessionError::Refused)?;
    let mut start = |machine: &mut Machine| machine.start_wave(&drive.name, &words, false);
    rest(machine, drive.rest_before, ui)?;
    if drive.kind == Kind::Preconditioning {
        start(machine)?;
        return rest(machine, drive.seconds() + ENDED, ui);
    }
    let spans = [plan::REST, drive.seconds() + plan::REST];
    machine.record_rows((drive.average, drive.average), spans, path, &mut start, ui)
}
