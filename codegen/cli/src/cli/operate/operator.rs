//! The operator of a session: carries orders out one after the other, notices faults, keeps the link alive.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::json;
use specgen_link::client::{ClientError, Port};
use specgen_link::{RecorderStatus, Refusal, Status};
use specgen_runtime::setpoint::{BUSY, REFUSED};
use specgen_runtime::supervisor::{Phase, Request};

use super::answer::{Answer, Downloaded, MachineStatus, Moves, Plain, RecorderState, Settings};
use super::ended::{Ended, unsupported, waving};
use super::health::Standing;
use super::pose::{ZERO, in_words};
use specgen_compiler::compile;
use specgen_language::files;
use specgen_language::model::Model;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::{check_input, check_place, write_file};
use specgen_language::ui::Ui;
use specgen_operate::frame::Frame;
use specgen_operate::{Order, Session, WaitCondition};

/// How long ramping down may take.
const DOWN: Duration = Duration::from_secs(60);
/// After so many ticks the status says what became of a command.
const SEEN: u64 = 10;
/// How long these may take.
const ANSWERED: Duration = Duration::from_secs(2);

/// What is done whenever a machine is looked at. An error ends what is under way.
pub type Pulse<P> = Box<dyn FnMut(&mut Operator<P>) -> Result<(), Ended>>;

/// One host's hands on a machine.
pub struct Operator<P> {
    pub(super) session: Session<P>,
    /// What the device was built from, where that is known.
    pub model: Option<Model>,
    /// Sets of faults that look alike to its wiring check.
    pub alike: Vec<Vec<u32>>,
    /// Poses by the names that this session gave them.
    pub(super) marks: BTreeMap<String, [f64; 6]>,
    /// What poses are said in.
    pub(super) frame: Frame,
    /// Whether anything was ordered, so that this host is missed when it leaves.
    pub ordered: bool,
    /// This host asked it to run no more.
    goes_down: bool,
    /// It ran, and another host, a fault or the emergency contact ended that.
    pub(super) was_stopped: bool,
    interrupted: &'static AtomicBool,
    /// Phase, cause and finding that were shown last.
    shown: (u8, u8, u16),
    /// A person looks at it: a fault is shown, and ends nothing.
    pub attended: bool,
    /// Done at every look, however long an order takes.
    pub(super) pulse: Option<Pulse<P>>,
    /// Answers to the orders so far, for the JSON document.
    pub answers: Vec<Answer>,
}

impl<P: Port> Operator<P> {
    pub fn new(session: Session<P>, interrupted: &'static AtomicBool) -> Self {
        let shown = (session.status().phase, session.status().cause, session.status().finding);
        Self {
            session,
            model: None,
            alike: Vec::new(),
            marks: BTreeMap::new(),
            frame: Frame::default(),
            ordered: false,
            goes_down: false,
            was_stopped: false,
            interrupted,
            shown,
            attended: false,
            pulse: None,
            answers: Vec::new(),
        }
    }

    /// Phase and cause in words.
    pub fn stands(&self) -> String {
        self.session.stands(&self.alike)
    }

    /// Number of the phase.
    pub fn phase(&self) -> u8 {
        self.session.status().phase
    }

    /// Whether the settings in force are these.
    pub fn is_set_to(&mut self, settings: &[u64]) -> Result<bool, ClientError> {
        Ok(self.session.config()? == settings)
    }

    pub fn is_powered(&self) -> bool {
        self.session.status().amplifier_on
    }

    pub fn status(&self) -> MachineStatus {
        let status = *self.session.status();
        MachineStatus {
            tick: status.tick,
            phase: status.phase,
            cause: status.cause,
            stands: self.stands(),
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

    /// Whether the user wants it to end.
    pub(super) fn is_interrupted(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    /// Asks how it stands. A fault that is new ends what is not attended.
    pub fn look(&mut self) -> Result<(), Ended> {
        if self.is_interrupted() {
            return Err(Ended::Interrupted);
        }
        let before = self.session.status().phase;
        self.session.poll()?;
        let [faulted, running] = [Phase::Faulted, Phase::Running].map(|phase| phase.word() as u8);
        let status = self.session.status();
        if !self.attended && status.phase == faulted && before != faulted {
            return Err(Ended::Fault(format!("the machine is {}, at tick {}", self.stands(), status.tick)));
        }
        if before == running && status.phase != running && !std::mem::take(&mut self.goes_down) {
            // What was to come was meant for a machine that runs.
            self.was_stopped = true;
            // One that ramps down for a cause is faulted soon, and that is the better message.
            let faults = u64::from(status.phase) == Phase::RampingDown.word() && status.cause != 0;
            if !self.attended && !faults {
                return Err(self.stopped_by_others());
            }
        }
        // It may look itself.
        let Some(mut pulse) = self.pulse.take() else { return Ok(()) };
        let done = pulse(self);
        self.pulse = Some(pulse);
        done
    }

    fn stopped_by_others(&self) -> Ended {
        Ended::Fault(format!("the machine was stopped, and is {}, at tick {}", self.stands(), self.status().tick))
    }

    /// Asks for a stop in the midst of an order, which ends with that, and all that waits.
    pub(super) fn stop_by_hand(&mut self, request: Request) -> Result<(), ClientError> {
        (self.ordered, self.goes_down, self.was_stopped) = (true, true, true);
        self.session.supervise(request)
    }

    /// Shows a phase that is new.
    pub fn show(&mut self, ui: &Ui) {
        let status = self.session.status();
        let now = (status.phase, status.cause, status.finding);
        if now != self.shown {
            self.shown = now;
            ui.progress(&format!("tick {}: {}", status.tick, self.stands()));
        }
    }

    /// Shows the answer to a line, or keeps it for the document.
    pub fn note(&mut self, command: &str, answer: &impl Outcome, ui: &Ui) {
        self.answers.push(Answer { command: command.to_owned(), answer: json!(answer) });
        if !ui.is_json() {
            ui.out(&answer.text());
        }
    }

    /// Refuses `orders` if one of them makes no sense whatever the device does: names, numbers, waves, files that cannot be.
    pub fn check(&self, orders: &[Order]) -> Result<(), Failure> {
        let nonsense = |text: String| Failure::Usage(format!("{text}; nothing was asked of the machine"));
        let mut marks: Vec<&str> = self.marks.keys().map(String::as_str).collect();
        // A download may stand above the order that reads its file.
        orders.iter().filter_map(Order::input).for_each(files::note_input);
        orders.iter().try_for_each(|order| match order {
            Order::Set(assignments) => self.session.assign(assignments).map(|_| ()).map_err(nonsense),
            Order::Mark(name) => {
                marks.push(name);
                self.motion().map(|_| ()).map_err(nonsense)
            }
            Order::OnEdge(order) => self.check(std::slice::from_ref(order)),
            Order::Goto(name) if name != ZERO && !marks.contains(&name.as_str()) => Err(nonsense(self.no_mark(name))),
            Order::Play { name, correction } => {
                correction.as_ref().map_or(Ok(()), |(path, _)| check_input(path))?;
                self.playable(name, correction.as_ref()).map(|_| ()).map_err(nonsense)
            }
            Order::Gains(gains) => self.gains_of(gains).map(|_| ()).map_err(nonsense),
            Order::Trigger { line, settings } => self.places_of(*line, settings).map(|_| ()).map_err(nonsense),
            Order::Move { .. }
            | Order::Frame(_)
            | Order::Where
            | Order::Limits
            | Order::CanIGo { .. }
            | Order::Goto(_)
            | Order::Watch { file: None, .. }
            | Order::Mode(_) => self.motion().map(|_| ()).map_err(nonsense),
            Order::Wave(path) => {
                check_input(path)?;
                self.wave_of(path).map(|_| ()).map_err(nonsense)
            }
            Order::Watch { file: Some(path), .. } => {
                self.motion().map_err(nonsense)?;
                check_place(path)
            }
            Order::Download(path) => check_place(path),
            _ => Ok(()),
        })
    }

    pub fn obey(&mut self, order: &Order, ui: &Ui) -> Result<(), Ended> {
        self.look()?;
        let line = format!("{order:?}");
        match order {
            Order::Status => {
                let health = self.session.health()?.into();
                let place = self.session.place()?.map(|place| self.located(&place));
                let advice = self.advice();
                self.note(&line, &Standing { status: self.status(), place, advice, health }, ui);
            }
            Order::Wait { until, limit } => {
                self.wait(*until, *limit, ui)?;
                self.note(&line, &Plain(self.stands()), ui);
            }
            Order::Move { .. } => {
                let user = self.user_of(order)?;
                self.go(user)?;
                self.note(&line, &Moves { pose: self.seen(&user) }, ui);
            }
            Order::OnEdge(order) => {
                self.on_edge(order)?;
                self.note(&line, &Plain("done".to_owned()), ui);
            }
            Order::Edge | Order::DropEdge => {
                let edge = self.edge(*order == Order::DropEdge)?;
                self.note(&line, &edge, ui);
            }
            Order::Where
            | Order::Limits
            | Order::CanIGo { .. }
            | Order::Frame(_)
            | Order::Mark(_)
            | Order::Goto(_)
            | Order::Play { .. }
            | Order::Mode(_)
            | Order::Gains(_) => self.of_platform(order, &line, ui)?,
            Order::Watch { every, seconds, file } => self.watch(*every, *seconds, file.as_deref(), &line, ui)?,
            Order::Config => {
                let settings = self.config()?;
                self.note(&line, &settings, ui);
            }
            Order::Record(action) => {
                let RecorderStatus { running, triggered, ticks, capacity } = self.session.recorder(*action)?;
                let period = self.session.period();
                self.note(&line, &RecorderState { running, triggered, ticks, capacity, period }, ui);
            }
            Order::Download(path) => {
                let downloaded = self.download(path)?;
                self.note(&line, &downloaded, ui);
            }
            _ => {
                self.ask(order)?;
                self.note(&line, &Plain("done".to_owned()), ui);
                if *order == Order::Stop {
                    return self.stopped(ui);
                }
            }
        }
        self.look()?;
        self.show(ui);
        Ok(())
    }

    /// Orders that are answered by being done.
    fn ask(&mut self, order: &Order) -> Result<(), Ended> {
        self.ordered = true;
        match order {
            Order::Ask(request) => {
                self.goes_down = matches!(request, Request::Hold | Request::RampDown);
                self.session.supervise(*request)?;
            }
            Order::Set(assignments) => {
                let words = self.session.assign(assignments).map_err(Ended::Refused)?;
                self.session.command(words).map_err(waving)?;
            }
            Order::WriteConfig(spec) => self.write_config(spec)?,
            Order::Trigger { line, settings } => self.set_trigger(*line, settings)?,
            Order::Wave(path) => self.wave(path, false)?,
            Order::StopWave => self.session.stop_wave()?,
            Order::Stop => {
                self.goes_down = true;
                self.session.stop().map_err(unsupported)?;
            }
            // The others have an answer of their own.
            _ => {}
        }
        Ok(())
    }

    /// Words of a move to `pose`, in the controller's coordinates, that the machine can make from rest.
    pub(super) fn words_of_move(&self, pose: &[f64; 6]) -> Result<Vec<u64>, Ended> {
        let status = self.session.status();
        if u64::from(status.phase) != Phase::Running.word() {
            return Err(Ended::Refused(format!("the machine is {}: it moves when it runs", self.stands())));
        }
        if status.status & BUSY != 0 {
            return Err(Ended::Refused("a motion is under way; `wait arrived` first".to_owned()));
        }
        if let Some(binding) = self.motion().map_err(Ended::Refused)?.binding(pose) {
            let to = self.seen(pose);
            let (to, binds) = (specgen_operate::place::in_words(&to), in_words(&binding));
            return Err(Ended::Refused(format!("it cannot go to {to}: {binds}; nothing moves")));
        }
        self.session.move_words(pose).map_err(Ended::Refused)
    }

    /// Sends a move, and waits until the machine has taken or refused it. Where a motion is under way a machine looks at a
    /// command only after it, so that nothing could be said of this one.
    pub(super) fn go(&mut self, pose: [f64; 6]) -> Result<(), Ended> {
        let words = self.words_of_move(&pose)?;
        self.send_and_see(words)?;
        let status = self.session.status();
        if u64::from(status.phase) != Phase::Running.word() {
            return Err(Ended::Fault(format!("the machine is {} and does not move", self.stands())));
        }
        if status.status & REFUSED != 0 {
            return Err(Ended::Refused(format!(
                "the machine refuses to move to {}: outside the workspace; it stands where it stood",
                specgen_operate::place::in_words(&pose)
            )));
        }
        Ok(())
    }

    /// Sends a command, and waits until the status says what became of it.
    pub(super) fn send_and_see(&mut self, words: Vec<u64>) -> Result<(), Ended> {
        self.send(words)?;
        let (sent, start) = (self.session.status().tick, Instant::now());
        while self.session.status().tick < sent + SEEN {
            if start.elapsed() >= ANSWERED {
                return Err(Ended::Fault(format!("the machine makes no ticks, and is {}", self.stands())));
            }
            std::thread::sleep(Duration::from_millis(1));
            self.look()?;
        }
        Ok(())
    }

    /// Sends a command, and looks at the machine.
    pub(super) fn send(&mut self, words: Vec<u64>) -> Result<(), Ended> {
        self.ordered = true;
        self.session.command(words).map_err(waving)?;
        self.look()
    }

    pub(super) fn wait(&mut self, until: WaitCondition, limit: Duration, ui: &Ui) -> Result<(), Ended> {
        let start = Instant::now();
        // Whoever waits for another phase expects it.
        self.goes_down |= matches!(until, WaitCondition::Phase(phase) if phase != Phase::Running);
        self.was_stopped = false;
        loop {
            if until == WaitCondition::Arrived && self.was_stopped {
                return Err(self.stopped_by_others());
            }
            let there = match until {
                WaitCondition::Phase(phase) => u64::from(self.session.status().phase) == phase.word(),
                WaitCondition::Arrived => {
                    let Status { phase, status, .. } = *self.session.status();
                    let runs = u64::from(phase) == Phase::Running.word();
                    if runs && status & REFUSED != 0 {
                        return Err(Ended::Refused("the machine refuses its command, and stands".to_owned()));
                    }
                    runs && status & BUSY == 0
                }
                WaitCondition::Passed(time) => start.elapsed() >= time,
            };
            if there {
                return Ok(());
            }
            let expected = match until {
                WaitCondition::Phase(phase) => phase.name(),
                WaitCondition::Arrived => "arrived",
                WaitCondition::Passed(_) => "",
            };
            if !expected.is_empty() && start.elapsed() >= limit {
                return Err(Ended::Fault(format!(
                    "the machine is still {} after {} s, expected {}",
                    self.stands(),
                    limit.as_secs_f64(),
                    expected
                )));
            }
            std::thread::sleep(self.session.due());
            self.look()?;
            self.show(ui);
        }
    }

    /// Waits until the program that serves the link has closed it.
    fn stopped(&mut self, ui: &Ui) -> Result<(), Ended> {
        let start = Instant::now();
        while start.elapsed() < DOWN {
            match self.look() {
                Err(Ended::Link(ClientError::Port(_))) => return Err(Ended::Stopped),
                other => other?,
            }
            self.show(ui);
            std::thread::sleep(self.session.due());
        }
        Err(Ended::Fault(format!("it has not ended after {} s, the machine is {}", DOWN.as_secs(), self.stands())))
    }

    fn config(&mut self) -> Result<Settings, Ended> {
        let words = self.session.config()?;
        let description = self.session.description();
        let value = |name: &str, word: u64| match host_sim::word::WordKind::of(name) {
            host_sim::word::WordKind::Integer => json!(word),
            host_sim::word::WordKind::Real => json!(description.scalar.decode(word)),
        };
        let names = description.config_names.iter();
        Ok(Settings(names.zip(words).map(|(name, word)| (name.clone(), value(name, word))).collect()))
    }

    /// Does what takes its time, in which the link is not to be lost.
    pub(super) fn meanwhile<T: Send>(&mut self, work: impl FnOnce() -> T + Send) -> Result<T, Ended> {
        std::thread::scope(|scope| {
            let work = scope.spawn(work);
            while !work.is_finished() {
                self.look()?;
                std::thread::sleep(self.session.due());
            }
            // The hook has said where.
            work.join().map_err(|_| Ended::Failed(Failure::Environment("the compiler of specs failed".to_owned())))
        })
    }

    /// The settings of a spec; its tables stay in the spec.
    fn write_config(&mut self, path: &Path) -> Result<(), Ended> {
        let compiled = self.meanwhile(|| compile::compile(path))?.map_err(|refused| Ended::Failed(refused.into()))?;
        let (ours, theirs) = (&compiled.ir, self.session.description());
        let words = &compiled.ir.integrity.settings;
        if ours.scalar.bits() != theirs.scalar.bits() || words.len() != theirs.config_names.len() {
            return Err(Ended::Refused(format!(
                "{} has {} settings in f{}, the device {} in f{}: write the settings of a spec of the same kind and scalar",
                path.display(),
                words.len(),
                ours.scalar.bits(),
                theirs.config_names.len(),
                theirs.scalar.bits()
            )));
        }
        let words = words.clone();
        self.session.write_config(&words).map_err(|error| match error {
            ClientError::Refused(Refusal::Word { index }) => {
                let names = &self.session.description().config_names;
                let name = names.get(usize::from(index)).map_or("?", String::as_str);
                Ended::Refused(format!("the device refuses `{name}` of {}: out of its range there", path.display()))
            }
            other => other.into(),
        })
    }

    /// The whole record, as the bytes of its file.
    pub(super) fn record(&mut self) -> Result<Vec<u8>, Ended> {
        let (mut whole, mut looked) = (Vec::new(), Instant::now());
        loop {
            let complete = self.session.download_on(&mut whole).map_err(|error| match error {
                ClientError::Refused(Refusal::State) => {
                    Ended::Refused("it still records; `record stop` first, or wait for the trigger".to_owned())
                }
                other => other.into(),
            })?;
            if complete {
                return Ok(whole);
            }
            if looked.elapsed() >= super::ALIVE {
                self.look()?;
                looked = Instant::now();
            }
        }
    }

    fn download(&mut self, path: &Path) -> Result<Downloaded, Ended> {
        let bytes = self.record()?;
        write_file(path, &bytes).map_err(Ended::Failed)?;
        Ok(Downloaded { file: path.display().to_string(), bytes: bytes.len() })
    }

    /// Ramps down and waits until the amplifiers are off; what came of it.
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
                return Ok(format!("the machine is {}, amplifiers off", self.stands()));
            }
            std::thread::sleep(self.session.due());
        }
        Ok(format!("the machine is still {} after {} s", self.stands(), DOWN.as_secs()))
    }
}
