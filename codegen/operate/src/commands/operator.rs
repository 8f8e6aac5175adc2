//! The operator of a session: executes commands one after the other, detects faults, keeps the link alive.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::json;
use specgen_link::client::{ClientError, Port};
use specgen_link::{RecorderStatus, Refusal, Status};
use specgen_runtime::setpoint::{BUSY, REFUSED};
use specgen_runtime::supervisor::{Cause, Phase, Request};

use super::answer::{Acknowledgement, Answer, Destination, DownloadReport, MachineStatus, RecorderState};
use super::error::{SessionError, unsupported, waving};
use super::health::StatusReport;
use super::pose::{ZERO, in_words};
use crate::command::{Command, WaitCondition};
use crate::frame::Frame;
use crate::session::{POLL_INTERVAL, Session};
use specgen_language::files;
use specgen_language::model::Model;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::{check_input, check_place, check_table, write_file};
use specgen_language::ui::Ui;

/// Timeout of a ramp-down.
const DOWN: Duration = Duration::from_secs(60);
/// Ticks after which the status shows the effect of a command.
const SEEN: u64 = 10;
/// Time limit for these ticks.
const ANSWERED: Duration = Duration::from_secs(2);

/// Called at every poll of the machine. An error ends the current command.
pub type Pulse<P> = Box<dyn FnMut(&mut Operator<P>) -> Result<(), SessionError>>;

/// One host that operates a machine.
pub struct Operator<P> {
    pub(crate) session: Session<P>,
    /// The model that the device was built from, if known.
    pub model: Option<Model>,
    /// Sets of faults that its wiring check cannot distinguish.
    pub alike: Vec<Vec<u32>>,
    /// Saved poses by name.
    pub(super) marks: BTreeMap<String, [f64; 6]>,
    /// The frame of poses in this session.
    pub(super) frame: Frame,
    /// Whether this host is in control: the machine holds if it disconnects.
    pub in_control: bool,
    /// This host has requested a stop.
    is_stopping: bool,
    /// The machine was running, and another host, a fault or the emergency stop stopped it.
    pub(super) was_stopped: bool,
    interrupted: &'static AtomicBool,
    /// The last phase, cause and finding shown.
    shown: (u8, u8, u16),
    /// An interactive session: a fault is shown and does not end it.
    pub attended: bool,
    /// Called at every poll, even during a long command.
    pub(crate) pulse: Option<Pulse<P>>,
    /// Answers to the commands so far, for the JSON document.
    pub answers: Vec<Answer>,
}

impl<P: Port> Operator<P> {
    /// Operates the machine of this session until `interrupted` is set.
    pub fn new(session: Session<P>, interrupted: &'static AtomicBool) -> Self {
        let shown = (session.status().phase, session.status().cause, session.status().finding);
        Self {
            session,
            model: None,
            alike: Vec::new(),
            marks: BTreeMap::new(),
            frame: Frame::default(),
            in_control: false,
            is_stopping: false,
            was_stopped: false,
            interrupted,
            shown,
            attended: false,
            pulse: None,
            answers: Vec::new(),
        }
    }

    /// Phase and cause in words.
    pub fn state(&self) -> String {
        self.session.state(&self.alike)
    }

    /// Number of the phase.
    pub fn phase(&self) -> u8 {
        self.session.status().phase
    }

    /// Whether these settings are in force.
    pub fn is_set_to(&mut self, settings: &[u64]) -> Result<bool, ClientError> {
        Ok(self.session.config()? == settings)
    }

    /// Whether the amplifiers are on.
    pub fn is_powered(&self) -> bool {
        self.session.status().amplifier_on
    }

    /// State of the machine at the last poll.
    pub fn status(&self) -> MachineStatus {
        let status = *self.session.status();
        MachineStatus {
            tick: status.tick,
            phase: status.phase,
            cause: status.cause,
            state: self.state(),
            amplifiers_on: status.amplifier_on,
            status: status.status,
            status_in_words: host_sim::word::status_words(status.status).replace('+', ", "),
            events: status.events,
            late: status.late,
            age: status.age.map(|age| Duration::from_micros(age).as_secs_f64()),
            link_errors: status.link.errors(),
            damaged_frames: self.session.damaged(),
            period: self.session.period(),
        }
    }

    /// Whether the user has interrupted the session.
    pub(crate) fn is_interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    /// Polls the machine. A new fault ends a session that is not attended.
    pub fn look(&mut self) -> Result<(), SessionError> {
        if self.is_interrupted() {
            return Err(SessionError::Interrupted);
        }
        let before = self.session.status().phase;
        self.session.poll()?;
        let faulted = Phase::Faulted.word() as u8;
        let is_commanded = |phase: u8| Phase::from_word(u64::from(phase)).is_some_and(Phase::is_commanded);
        let status = self.session.status();
        if !self.attended && status.phase == faulted && before != faulted {
            return Err(SessionError::Fault(format!("the machine is {}, at tick {}", self.state(), status.tick)));
        }
        if is_commanded(before) && status.phase != before && !std::mem::take(&mut self.is_stopping) {
            // The commands that follow assume a machine that runs, or drives.
            self.was_stopped = true;
            // If it ramps down for a cause, it soon faults, which gives the better message.
            let faults = u64::from(status.phase) == Phase::RampingDown.word() && status.cause != 0;
            if !self.attended && !faults {
                return Err(self.stopped_by_others());
            }
        }
        // The pulse itself may poll.
        let Some(mut pulse) = self.pulse.take() else { return Ok(()) };
        let done = pulse(self);
        self.pulse = Some(pulse);
        done
    }

    /// Polls the machine during work that waits for a disk: that may take longer than the machine waits for its host.
    pub(crate) fn beside<R: Send>(&mut self, work: impl FnOnce() -> R + Send) -> Result<R, SessionError> {
        std::thread::scope(|scope| {
            let worker = scope.spawn(work);
            while !worker.is_finished() {
                std::thread::sleep(Duration::from_millis(1));
                if self.session.due().is_zero() {
                    self.look()?;
                }
            }
            worker.join().map_err(|_| SessionError::Fault("writing a file crashed".to_owned()))
        })
    }

    fn stopped_by_others(&self) -> SessionError {
        SessionError::Fault(format!("the machine was stopped, and is {}, at tick {}", self.state(), self.status().tick))
    }

    /// Requests a stop during a command. It also ends the command and cancels those that wait.
    pub(super) fn stop_by_hand(&mut self, request: Request) -> Result<(), ClientError> {
        (self.in_control, self.is_stopping, self.was_stopped) = (true, true, true);
        self.session.supervise(request)
    }

    /// Shows a change of phase.
    pub fn show(&mut self, ui: &Ui) {
        let status = self.session.status();
        let now = (status.phase, status.cause, status.finding);
        if now != self.shown {
            self.shown = now;
            ui.progress(&format!("tick {}: {}", status.tick, self.state()));
        }
    }

    /// Records the answer to a command for the JSON document, or shows it.
    pub fn note(&mut self, command: &str, answer: &impl Outcome, ui: &Ui) {
        self.answers.push(Answer { command: command.to_owned(), answer: json!(answer) });
        if !ui.is_json() {
            ui.out(&answer.text());
        }
    }

    /// Refuses `commands` if one of them cannot be valid: unknown names, bad numbers, waves or files.
    pub fn check(&self, commands: &[Command]) -> Result<(), Failure> {
        let nonsense = |text: String| Failure::Usage(format!("{text}; nothing was sent to the machine"));
        let mut marks: Vec<&str> = self.marks.keys().map(String::as_str).collect();
        // A download may precede the command that reads its file.
        commands.iter().filter_map(Command::input).for_each(files::note_input);
        commands.iter().try_for_each(|command| match command {
            Command::Set(assignments) => self.session.assign(assignments).map(|_| ()).map_err(nonsense),
            Command::Mark(name) => {
                marks.push(name);
                self.motion().map(|_| ()).map_err(nonsense)
            }
            Command::OnEdge(command) => self.check(std::slice::from_ref(command)),
            Command::Goto(name) if name != ZERO && !marks.contains(&name.as_str()) => Err(nonsense(self.no_mark(name))),
            Command::Play { name, correction } => {
                correction.as_ref().map_or(Ok(()), |(path, _)| check_input(path))?;
                self.playable(name, correction.as_ref()).map(|_| ()).map_err(nonsense)
            }
            Command::Gains(gains) => self.gains_of(gains).map(|_| ()).map_err(nonsense),
            Command::Trigger { line, settings } => self.trigger_words(*line, settings).map(|_| ()).map_err(nonsense),
            Command::Move { .. }
            | Command::Frame(_)
            | Command::Where
            | Command::Limits
            | Command::CanIGo { .. }
            | Command::Goto(_)
            | Command::Watch { file: None, .. }
            | Command::Mode(_) => self.motion().map(|_| ()).map_err(nonsense),
            Command::Ask(Request::Drive) => self.motion().map(|_| ()).map_err(nonsense),
            Command::Wave(path) => {
                check_input(path)?;
                self.wave_of(path).map(|_| ()).map_err(nonsense)
            }
            Command::Watch { file: Some(path), .. } => {
                self.motion().map_err(nonsense)?;
                check_table(path)
            }
            Command::Download(path) => check_place(path),
            _ => Ok(()),
        })
    }

    /// Executes a command and records its answer.
    ///
    /// # Errors
    /// The command failed, or the session ends.
    pub fn execute(&mut self, command: &Command, ui: &Ui) -> Result<(), SessionError> {
        self.look()?;
        let line = format!("{command:?}");
        match command {
            Command::Status => {
                let health = self.session.health()?.into();
                let place = self.session.place()?.map(|place| self.located(&place));
                let advice = self.advice();
                self.note(&line, &StatusReport { status: self.status(), place, advice, health }, ui);
            }
            Command::Wait { until, limit } => {
                self.wait(*until, *limit, ui)?;
                self.note(&line, &Acknowledgement(self.state()), ui);
            }
            Command::Move { .. } => {
                let user = self.user_of(command)?;
                self.go(user)?;
                self.note(&line, &Destination { pose: self.seen(&user) }, ui);
            }
            Command::OnEdge(command) => {
                self.on_edge(command)?;
                self.note(&line, &Acknowledgement("done".to_owned()), ui);
            }
            Command::Edge | Command::DropEdge => {
                let edge = self.edge(*command == Command::DropEdge)?;
                self.note(&line, &edge, ui);
            }
            Command::Where
            | Command::Limits
            | Command::CanIGo { .. }
            | Command::Frame(_)
            | Command::Mark(_)
            | Command::Goto(_)
            | Command::Play { .. }
            | Command::Mode(_)
            | Command::Gains(_) => self.of_platform(command, &line, ui)?,
            Command::Watch { every, seconds, file } => self.watch(*every, *seconds, file.as_deref(), &line, ui)?,
            Command::Config => {
                let settings = self.config()?;
                self.note(&line, &settings, ui);
            }
            Command::Record(action) => {
                let RecorderStatus { running, triggered, ticks, capacity } = self.session.recorder(*action)?;
                let period = self.session.period();
                self.note(&line, &RecorderState { running, triggered, ticks, capacity, period }, ui);
            }
            Command::Download(path) => {
                let downloaded = self.download(path)?;
                self.note(&line, &downloaded, ui);
            }
            _ => {
                self.ask(command)?;
                self.note(&line, &Acknowledgement("done".to_owned()), ui);
                if *command == Command::Shutdown {
                    return self.stopped(ui);
                }
            }
        }
        self.look()?;
        self.show(ui);
        Ok(())
    }

    /// Executes a command that has no answer of its own.
    fn ask(&mut self, command: &Command) -> Result<(), SessionError> {
        self.in_control = true;
        match command {
            Command::Ask(request) => {
                let drives = u64::from(self.session.status().phase) == Phase::Driving.word();
                self.is_stopping = match request {
                    Request::Hold | Request::RampDown => true,
                    // Through a hold.
                    Request::Run => drives,
                    _ => false,
                };
                self.session.supervise(*request)?;
            }
            Command::Set(assignments) => {
                let assignments = &self.whole_drive(assignments)?;
                let words = self.session.assign(assignments).map_err(SessionError::Refused)?;
                self.session.command(words).map_err(waving)?;
            }
            Command::WriteConfig(spec) => self.write_config(spec)?,
            Command::CodeLimits(limits) => {
                let words = self.changed(limits)?;
                self.configure(&words, |name| format!("`{name}`: expected code_min ≤ code_max, within the spec's"))?;
            }
            Command::Trigger { line, settings } => self.set_trigger(*line, settings)?,
            Command::Wave(path) => self.wave(path, false)?,
            Command::StopWave => self.session.stop_wave()?,
            Command::Shutdown => {
                self.is_stopping = true;
                self.session.stop().map_err(unsupported)?;
            }
            // The other commands have their own answers.
            _ => {}
        }
        Ok(())
    }

    /// In an open drive, assignments of every leg: those that are not given keep their voltages.
    fn whole_drive(&mut self, assignments: &[(String, String)]) -> Result<Vec<(String, String)>, SessionError> {
        let mut all = assignments.to_vec();
        if u64::from(self.session.status().phase) == Phase::Driving.word()
            && let Some(place) = self.session.place()?
        {
            for (leg, voltage) in place.voltage.iter().enumerate() {
                let name = format!("setpoint[{leg}]");
                if !all.iter().any(|(given, _)| *given == name) {
                    all.push((name, format!("{voltage:?}")));
                }
            }
        }
        Ok(all)
    }

    /// Words of a move from rest to `pose`, in the controller's coordinates; an error if the machine cannot make it.
    pub(super) fn words_of_move(&self, pose: &[f64; 6]) -> Result<Vec<u64>, SessionError> {
        let status = self.session.status();
        if u64::from(status.phase) != Phase::Running.word() {
            return Err(SessionError::Refused(format!("the machine is {}: it moves only while running", self.state())));
        }
        if status.status & BUSY != 0 {
            return Err(SessionError::Refused("a motion is in progress; `wait arrived` first".to_owned()));
        }
        if let Some(binding) = self.motion().map_err(SessionError::Refused)?.binding(pose) {
            let to = self.seen(pose);
            let (to, binds) = (crate::place::in_words(&to), in_words(&binding));
            return Err(SessionError::Refused(format!("cannot move to {to}: {binds}; no motion was started")));
        }
        self.session.move_words(pose).map_err(SessionError::Refused)
    }

    /// Sends a move, and waits until the machine has accepted or refused it. It must be at rest: during a motion a machine does
    /// not look at the next command.
    pub(crate) fn go(&mut self, pose: [f64; 6]) -> Result<(), SessionError> {
        let words = self.words_of_move(&pose)?;
        self.send_and_see(words)?;
        let status = self.session.status();
        if u64::from(status.phase) != Phase::Running.word() {
            return Err(SessionError::Fault(format!("the machine is {} and does not move", self.state())));
        }
        if status.status & REFUSED != 0 {
            return Err(SessionError::Refused(format!(
                "the machine refused to move to {}: outside the workspace; it did not move",
                crate::place::in_words(&pose)
            )));
        }
        Ok(())
    }

    /// Sends a command, and waits until the status shows its effect.
    pub(super) fn send_and_see(&mut self, words: Vec<u64>) -> Result<(), SessionError> {
        self.send(words)?;
        let (sent, start) = (self.session.status().tick, Instant::now());
        while self.session.status().tick < sent + SEEN {
            if start.elapsed() >= ANSWERED {
                return Err(SessionError::Fault(format!("the machine is {}, but not ticking", self.state())));
            }
            std::thread::sleep(Duration::from_millis(1));
            self.look()?;
        }
        Ok(())
    }

    /// Sends a command, and polls the machine.
    pub(super) fn send(&mut self, words: Vec<u64>) -> Result<(), SessionError> {
        self.in_control = true;
        self.session.command(words).map_err(waving)?;
        self.look()
    }

    pub(super) fn wait(&mut self, until: WaitCondition, limit: Duration, ui: &Ui) -> Result<(), SessionError> {
        let start = Instant::now();
        // Waiting for another phase means that a stop is expected.
        self.is_stopping |= matches!(until, WaitCondition::Phase(phase) if !phase.is_commanded());
        self.was_stopped = false;
        loop {
            if until == WaitCondition::Arrived && self.was_stopped {
                return Err(self.stopped_by_others());
            }
            let is_refused = u64::from(self.session.status().cause) == Cause::NotIdentified.word();
            if until == WaitCondition::Phase(Phase::Running) && is_refused {
                return Err(SessionError::Refused(format!("the machine is {} and cannot run", self.state())));
            }
            let there = match until {
                WaitCondition::Phase(phase) => u64::from(self.session.status().phase) == phase.word(),
                WaitCondition::Arrived => {
                    let Status { phase, status, .. } = *self.session.status();
                    let runs = u64::from(phase) == Phase::Running.word();
                    if runs && status & REFUSED != 0 {
                        return Err(SessionError::Refused(
                            "the machine refused the command and did not move".to_owned(),
                        ));
                    }
                    runs && status & BUSY == 0
                }
                WaitCondition::Passed(time) => start.elapsed() >= time,
            };
            if there {
                // The next stop is another one.
                self.is_stopping &= !matches!(until, WaitCondition::Phase(_));
                return Ok(());
            }
            let expected = match until {
                WaitCondition::Phase(phase) => phase.name(),
                WaitCondition::Arrived => "arrived",
                WaitCondition::Passed(_) => "",
            };
            if !expected.is_empty() && start.elapsed() >= limit {
                let (state, seconds) = (self.state(), limit.as_secs_f64());
                return Err(SessionError::Fault(format!(
                    "the machine is still {state} after {seconds} s, expected {expected}"
                )));
            }
            std::thread::sleep(self.session.due());
            self.look()?;
            self.show(ui);
        }
    }

    /// Waits until the program that serves the link has closed it.
    fn stopped(&mut self, ui: &Ui) -> Result<(), SessionError> {
        let start = Instant::now();
        while start.elapsed() < DOWN {
            match self.look() {
                Err(SessionError::Link(ClientError::Port(_))) => return Err(SessionError::Stopped),
                other => other?,
            }
            self.show(ui);
            std::thread::sleep(self.session.due());
        }
        Err(SessionError::Fault(format!(
            "the program has not ended after {} s; the machine is {}",
            DOWN.as_secs(),
            self.state()
        )))
    }

    /// Runs `work` in a thread, and keeps the link alive meanwhile.
    pub(super) fn meanwhile<T: Send>(&mut self, work: impl FnOnce() -> T + Send) -> Result<T, SessionError> {
        std::thread::scope(|scope| {
            let work = scope.spawn(work);
            while !work.is_finished() {
                self.look()?;
                std::thread::sleep(self.session.due());
            }
            // The panic hook has reported where.
            work.join().map_err(|_| SessionError::Failed(Failure::Environment("the spec compiler crashed".to_owned())))
        })
    }

    /// Downloads the record, as the bytes of its file.
    pub(crate) fn record(&mut self) -> Result<Vec<u8>, SessionError> {
        let (mut whole, mut looked) = (Vec::new(), Instant::now());
        loop {
            let complete = self.session.download_part(&mut whole).map_err(|error| match error {
                ClientError::Refused(Refusal::State) => {
                    SessionError::Refused("the recorder is running; `record stop`, or wait for its trigger".to_owned())
                }
                other => other.into(),
            })?;
            if complete {
                return Ok(whole);
            }
            if looked.elapsed() >= POLL_INTERVAL {
                self.look()?;
                looked = Instant::now();
            }
        }
    }

    fn download(&mut self, path: &Path) -> Result<DownloadReport, SessionError> {
        let bytes = self.record()?;
        self.beside(|| write_file(path, &bytes))?.map_err(SessionError::Failed)?;
        Ok(DownloadReport { file: path.display().to_string(), bytes: bytes.len() })
    }

    /// Ramps down and waits until the amplifiers are off; returns the resulting state as text.
    pub fn ramp_down(&mut self, ui: &Ui) -> Result<String, ClientError> {
        ui.progress("ramping down");
        self.session.supervise(Request::RampDown)?;
        let start = Instant::now();
        while start.elapsed() < DOWN {
            self.session.poll()?;
            self.show(ui);
            let status = self.session.status();
            let off = [Phase::Disarmed, Phase::Faulted].map(|phase| phase.word() as u8).contains(&status.phase);
            if off && !status.amplifier_on {
                return Ok(format!("the machine is {}, amplifiers off", self.state()));
            }
            std::thread::sleep(self.session.due());
        }
        Ok(format!("the machine is still {} after {} s", self.state(), DOWN.as_secs()))
    }
}
