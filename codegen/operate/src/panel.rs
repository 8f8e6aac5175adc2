//! Shows and operates a machine on a page in the browser.
//!
//! ```text
//! browsers ─ HTTP, WebSocket ─► a thread each ─ ClientEvent ─► this thread: Operator ─ link ─► machine
//!            page, samples ◄────────────────── Outbox ◄─┘ at every poll: samples, state, hold and ramp down
//! ```
//! One thread operates the machine. It polls the machine even while a command waits. At every poll it sends samples to the pages,
//! and executes *hold* and *ramp down*. A slow or failing browser delays nothing.

mod browser;
mod clients;
mod commissioning;
mod control;
mod http;
mod request;
mod rest;
mod samples;
pub(crate) mod status;
mod wiring;

use std::cell::RefCell;
use std::io;
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::rc::Rc;
use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

use serde::Serialize;
use serde_json::{Value, json};
use specgen_compiler::compile::Compilation;
use specgen_language::interrupt;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_link::Refusal;
use specgen_link::client::{ClientError, Port};
use specgen_runtime::setpoint::BUSY;
use specgen_runtime::supervisor::{Phase, Request};

use crate::commands::{MachineStatus, Operator, Pulse, Service, SessionError, is_gain, lost_link, recoverable};
use crate::samples::Block;
use crate::session::Session;
use clients::{Clients, now};
pub use commissioning::Commissioning;
use commissioning::Runner;
use control::{carry_out, queries};
use rest::RestError;
use status::StatusMessage;

/// Interval of messages with samples.
const FRAME: Duration = Duration::from_millis(25);
/// Interval of fetching samples.
const LOOK: Duration = Duration::from_millis(10);
/// Interval of messages with the state of the machine.
const STATE: Duration = Duration::from_millis(200);
/// Interval of longer queries: health, reach, recorder, gains.
const QUERY: Duration = Duration::from_secs(1);
/// Least interval of messages about late ticks.
const LATE: Duration = Duration::from_secs(60);
/// Largest number of rows per second.
const ROWS: f64 = 2000.0;
/// Upper bound of the duration of a ramp-down, s.
const RAMPED: f64 = 5.0;

/// State of the panel.
struct Panel {
    clients: Clients,
    compiled: Compilation,
    blocks: Vec<Block>,
    /// Expected number of the next block, and its first tick.
    next: Option<(u32, u64)>,
    /// Ticks whose samples were lost since the last message about them, and the time of that message.
    lost: (u64, Instant),
    framed: Instant,
    stated: Instant,
    /// Last published phase, cause and finding; late ticks.
    published: Option<((u8, u8, u16), u32)>,
    /// Late ticks since the last message about them, and the time of that message.
    late: (u32, Option<Instant>),
    /// A command is in progress; a stop ends it with an error.
    is_busy: bool,
    /// Results of the queries.
    known: Value,
    check: Value,
    wave: Value,
    commissioning: Option<Runner>,
    /// Error of a machine that runs at rest.
    rest: RestError,
}

/// State of machine and panel, for pages.
#[derive(Serialize)]
struct State<'a> {
    /// Kind of the message.
    k: &'static str,
    /// ms since 1970.
    t: f64,
    status: MachineStatus,
    phase: Option<&'static str>,
    said: StatusMessage,
    known: &'a Value,
    check: &'a Value,
    wave: &'a Value,
    /// None without a folder for it.
    commission: Value,
    busy: bool,
}

/// What the panel serves, and where.
pub struct Site {
    /// Address for browsers.
    pub listen: SocketAddr,
    /// The page.
    pub page: String,
    /// A commissioning that pages may begin.
    pub commissioning: Option<Commissioning>,
}

/// Facts about the device for the page: its name, the rate of a ramp-down (V/s), the trajectories.
///
/// # Errors
/// The device controls six legs.
pub fn device_facts(
    session: &Session<impl Port>,
    name: &str,
    compiled: &Compilation,
) -> Result<[(&'static str, Value); 3], Failure> {
    let Some(motion) = session.motion() else {
        return Err(Failure::Gate(format!("{name}: the device controls six legs; the panel needs a platform")));
    };
    let (rules, volts) = (&compiled.ir.supervision, compiled.ir.actuation.volts_per_code);
    let ramp = f64::from(rules.ramp_step) * volts / (f64::from(rules.ramp_every) * session.period());
    Ok([("device", json!(name)), ("ramp", json!(ramp)), ("trajectories", json!(motion.trajectories()))])
}

/// Serves a page at an address until Ctrl-C, and operates the machine as the pages request; then ramps down. If the link breaks, it
/// calls `reopen` until the machine answers again.
///
/// # Errors
/// The address is in use, the device sends no samples, or the link is broken at the end.
pub fn serve<P: Port + 'static>(
    session: Session<P>,
    reopen: impl Fn() -> Result<Session<P>, Failure>,
    name: &str,
    compiled: Compilation,
    Site { listen, page, commissioning }: Site,
    ui: &Ui,
) -> Result<Service, Failure> {
    let refused = |error: io::Error| Failure::Environment(format!("cannot listen at {listen}: {error}"));
    let listener = TcpListener::bind(listen).map_err(refused)?;
    let address = listener.local_addr().map_err(refused)?;
    let commissioning = commissioning.map(Runner::new);
    let mut guard = http::Guard::new(address.port()).map_err(refused)?;
    guard.result = commissioning.as_ref().map(Runner::page);
    announce(name, address, guard.token(), ui);
    let (sender, events) = sync_channel(256);
    browser::serve(listener, guard, page, sender);

    let mut operator = Operator::new(session, interrupt::heed());
    operator.model = Some(compiled.model.clone());
    operator.alike = compiled.ir.supervision.alike().to_vec();
    operator.attended = true;
    let panel = Rc::new(RefCell::new(Panel::new(Clients::new(events), compiled)));
    panel.borrow_mut().commissioning = commissioning;
    panel.borrow_mut().begin(&mut operator.session).map_err(|error| match error {
        ClientError::Refused(_) => {
            let what = "the device sends no samples; build and flash it with this specgen";
            Failure::Gate(format!("{name}: {what}: {error}"))
        }
        other => lost_link(name, &other),
    })?;
    operator.pulse = Some(pulse(panel.clone()));
    let ending = loop {
        match operate(&mut operator, &panel, ui) {
            SessionError::Link(error) => {
                let failure = lost_link(name, &error);
                ui.progress(&format!("{name}: {error}; reconnecting"));
                let Some(session) = panel.borrow_mut().reconnect(&operator, &reopen) else {
                    break SessionError::Failed(failure);
                };
                // `in_control` stays: without a page in control, this host must not keep a machine running that it controlled.
                operator.session = session;
                ui.progress(&format!("{name}: connected again"));
            }
            other => break other,
        }
    };
    operator.pulse = None;
    // A commissioning ends with its machine ramped down.
    drop(panel.borrow_mut().commissioning.take());
    let left = match ending {
        SessionError::Failed(failure) => Err(failure),
        _ if operator.is_powered() => operator.ramp_down(ui).map_err(|error| lost_link(name, &error)),
        _ => Ok(operator.state()),
    };
    let why = if left.is_ok() { "The panel was closed." } else { "The link to the machine broke." };
    panel.borrow_mut().clients.publish(&json!({ "k": "end", "why": why }));
    // Gives the threads of the pages time to send it.
    std::thread::sleep(FRAME);
    Ok(Service { device: name.to_owned(), listened: address.to_string(), state: left? })
}

/// Prints the address of the page.
fn announce(name: &str, address: SocketAddr, token: &str, ui: &Ui) {
    // A server at all addresses can be reached at the loopback address.
    let shown = match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => SocketAddr::from(([127, 0, 0, 1], address.port())),
        _ => address,
    };
    if !address.ip().is_loopback() {
        ui.progress(
            "warning: anyone who can reach this address and knows the token can move the machine; nothing is encrypted",
        );
    }
    ui.progress(&format!("{name}: panel at http://{shown}/?token={token}"));
    ui.progress("Ctrl-C ramps down and exits");
}

/// Operates the machine until an error or Ctrl-C.
fn operate<P: Port + 'static>(operator: &mut Operator<P>, panel: &Rc<RefCell<Panel>>, ui: &Ui) -> SessionError {
    // Answers go to pages; nothing is printed.
    let mut quiet = Ui::called(|_| (), None);
    let mut queried = Instant::now();
    loop {
        if let Err(error) = round(operator, panel, &mut quiet, &mut queried) {
            match recoverable(Err(error), &mut quiet) {
                // It only ended a command.
                Ok(_) => {}
                Err(error) => return error,
            }
        }
        operator.show(ui);
    }
}

/// One round: handles pages, polls the machine, executes one command or the queries that are due.
fn round<P: Port + 'static>(
    operator: &mut Operator<P>,
    panel: &Rc<RefCell<Panel>>,
    quiet: &mut Ui,
    queried: &mut Instant,
) -> Result<(), SessionError> {
    panel.borrow_mut().clients.listen(operator.session.due().min(LOOK));
    if operator.is_interrupted() {
        return Err(SessionError::Interrupted);
    }
    if panel.borrow_mut().leaves_alone(operator) {
        return Ok(());
    }
    operator.look()?;
    let next = panel.borrow_mut().clients.next();
    if let Some((page, command)) = next {
        panel.borrow_mut().is_busy = true;
        let done = carry_out(operator, panel, page, &command, quiet);
        panel.borrow_mut().is_busy = false;
        operator.answers.clear();
        let id = command.id();
        return match done {
            Ok(value) => {
                panel.borrow().clients.answer(page, id, Ok(value));
                Ok(())
            }
            Err(error) => {
                if let SessionError::Link(error) = &error {
                    let why = format!("the link broke, and the machine may have received it: {error}");
                    panel.borrow().clients.answer(page, id, Err(&why));
                }
                if let Some(why) = recoverable(Err(error), quiet)? {
                    panel.borrow().clients.answer(page, id, Err(&why));
                }
                Ok(())
            }
        };
    }
    if queried.elapsed() >= QUERY {
        *queried = Instant::now();
        // The pulse of a query borrows the panel.
        let settings = panel.borrow().compiled.ir.integrity.settings.clone();
        let known = queries(operator, &settings, quiet)?;
        panel.borrow_mut().known = known;
    }
    Ok(())
}

/// The work at every poll.
fn pulse<P: Port + 'static>(panel: Rc<RefCell<Panel>>) -> Pulse<P> {
    Box::new(move |operator| panel.borrow_mut().pulse(operator))
}

impl Panel {
    fn new(clients: Clients, compiled: Compilation) -> Self {
        let begun = Instant::now();
        Self {
            clients,
            compiled,
            blocks: Vec::new(),
            next: None,
            lost: (0, begun),
            framed: begun,
            stated: begun,
            published: None,
            late: (0, None),
            is_busy: false,
            known: json!({}),
            check: Value::Null,
            wave: Value::Null,
            commissioning: None,
            rest: RestError::default(),
        }
    }

    /// Whether another command has the machine.
    fn is_commissioning(&self) -> bool {
        self.commissioning.as_ref().is_some_and(Runner::runs)
    }

    /// Waits for a new session while the link is broken, and tells the pages; none after Ctrl-C. Commands of pages are refused, but a
    /// requested stop is sent once there is a session.
    fn reconnect<P: Port>(
        &mut self,
        operator: &Operator<P>,
        reopen: impl Fn() -> Result<Session<P>, Failure>,
    ) -> Option<Session<P>> {
        self.clients.note("warning", "The link to the machine broke.", "", None);
        // What the machine did meanwhile is unknown.
        (self.next, self.published, self.wave, self.known) = (None, None, Value::Null, json!({}));
        self.blocks.clear();
        self.rest = RestError::default();
        let mut tried = Instant::now();
        let mut why = String::new();
        while !operator.is_interrupted() {
            self.clients.listen(LOOK);
            self.refuse();
            if self.stated.elapsed() >= STATE {
                self.stated = Instant::now();
                self.clients.publish(&json!({ "k": "lost", "t": now(), "why": why }));
            }
            if tried.elapsed() < STATE {
                continue;
            }
            let begun = Instant::now();
            let opened = reopen().map(|mut session| self.begin(&mut session).map(|()| session));
            // An attempt at a device that does not answer takes seconds, in which pages are not heard.
            if begun.elapsed() >= STATE {
                self.clients.excuse();
            }
            match opened {
                Ok(Ok(session)) => {
                    // What pages asked for during the attempt, they asked of a machine whose state nobody knew.
                    for _ in 0..2 {
                        self.clients.listen(Duration::ZERO);
                    }
                    self.refuse();
                    self.clients.note("note", "The machine answers again.", "", None);
                    return Some(session);
                }
                Ok(Err(error)) => why = error.to_string(),
                Err(Failure::Environment(text) | Failure::Gate(text)) => why = text,
                Err(_) => {}
            }
            tried = Instant::now();
        }
        None
    }

    /// Refuses the commands of pages.
    fn refuse(&mut self) {
        while let Some((page, command)) = self.clients.next() {
            self.clients.answer(page, command.id(), Err("no link to the machine"));
        }
    }

    /// Starts the stream of samples, at the highest useful rate that the line permits.
    fn begin(&mut self, session: &mut Session<impl Port>) -> Result<(), ClientError> {
        let mut every = (1.0 / (ROWS * session.period())).ceil() as u32;
        loop {
            match session.stream(every) {
                Err(ClientError::Refused(Refusal::Rate { least })) if least > every => every = least,
                other => return other,
            }
        }
    }

    fn pulse<P: Port>(&mut self, operator: &mut Operator<P>) -> Result<(), SessionError> {
        self.clients.listen(Duration::ZERO);
        if let Some((who, request)) = self.clients.urgent() {
            self.commissioning.iter().for_each(Runner::stop);
            operator.in_control = true;
            let sent = operator.session.supervise(request).map_err(SessionError::from);
            // One that a broken link kept back is sent after reconnecting.
            if !matches!(sent, Err(SessionError::Link(_))) {
                self.clients.sent();
            }
            sent?;
            let what = if request == Request::Hold { "hold" } else { "ramp down" };
            self.clients.note("note", &format!("{who} requested: {what}."), "", None);
            if self.is_busy {
                return Err(SessionError::Refused(format!("{who} requested: {what}")));
            }
        }
        if self.is_busy && !self.clients.has_holder() {
            return Err(SessionError::Refused("the page in control is gone".to_owned()));
        }
        self.samples(&mut operator.session)?;
        self.publish(operator);
        Ok(())
    }

    /// Whether to send the machine no heartbeat: the page in control is gone, so the machine must act as without a host.
    fn leaves_alone<P: Port>(&mut self, operator: &Operator<P>) -> bool {
        let rules = &self.compiled.ir.supervision;
        let gone = f64::from(*rules.timeout.last().unwrap_or(&0)) * operator.session.period();
        let silent = operator.session.silence().as_secs_f64();
        let is_at_rest = silent > gone + RAMPED || !operator.is_powered() || !operator.in_control;
        if self.clients.is_left && is_at_rest {
            self.clients.is_left = false;
        }
        if !self.clients.is_left || self.clients.is_pressed() {
            return false;
        }
        if self.stated.elapsed() >= STATE {
            self.stated = Instant::now();
            let left = if silent < gone { gone - silent } else { 0.0 };
            self.clients.publish(&json!({ "k": "left", "t": now(), "left": left }));
        }
        true
    }

    fn samples(&mut self, session: &mut Session<impl Port>) -> Result<(), ClientError> {
        for block in session.take_blocks()? {
            if let Some((number, tick)) = self.next
                && block.number != number
            {
                self.lost.0 += block.tick.saturating_sub(tick);
            }
            self.next = Some((block.number.wrapping_add(1), block.end()));
            self.rest.add(&block, session.period());
            self.blocks.push(block);
        }
        if self.lost.0 > 0 && self.lost.1.elapsed() >= QUERY {
            let seconds = self.lost.0 as f64 * session.period();
            self.lost = (0, Instant::now());
            self.clients.note("warning", &format!("{seconds:.3} s of samples from the machine were lost."), "", None);
        }
        if self.framed.elapsed() >= FRAME && !self.blocks.is_empty() {
            self.framed = Instant::now();
            let number = self.clients.number();
            let bytes = samples::message(number, &self.blocks, session.motion(), now());
            self.clients.show(number, bytes);
            self.blocks.clear();
        }
        Ok(())
    }

    /// Publishes the state of the machine and its changes.
    fn publish<P: Port>(&mut self, operator: &Operator<P>) {
        let status = operator.session.status();
        let current = ((status.phase, status.cause, status.finding), status.late);
        let (rules, model) = (&self.compiled.ir.supervision, &self.compiled.model);
        let mut message = status::message(status, rules, model);
        if message.kind == "ok" && status.status & BUSY == 0 {
            message = self.rest.message(rules, model);
        }
        if message.kind == "ok" && self.known["differ"].as_array().is_some_and(|names| !names.is_empty()) {
            message.kind = "warning";
            message.what = "Running. Settings differ from the spec.".to_owned();
            message.advice = "Restore those of the spec, or write these into it.";
        }
        if let Some(before) = self.published.replace(current) {
            if before.0 != current.0 {
                self.clients.note(
                    if message.kind == "ok" { "note" } else { message.kind },
                    &message.what,
                    message.advice,
                    message.code.as_deref(),
                );
                if !Phase::from_word(u64::from(status.phase)).is_some_and(Phase::is_commanded) {
                    self.wave = Value::Null;
                }
            }
            self.late.0 += current.1.saturating_sub(before.1);
            if self.late.0 > 0 && self.late.1.is_none_or(|last| last.elapsed() >= LATE) {
                let late = std::mem::take(&mut self.late.0);
                let again = self.late.1.replace(Instant::now()).is_some();
                let s = if late == 1 { "" } else { "s" };
                let advice = if again {
                    "Check the load of the controller's computer."
                } else {
                    "No action needed, unless it happens again."
                };
                self.clients.note("warning", &format!("{late} late tick{s}."), advice, None);
            }
        }
        if self.stated.elapsed() < STATE {
            return;
        }
        self.stated = Instant::now();
        let commission = self.commissioning.as_mut().map_or(Value::Null, |runner| {
            let (state, event) = runner.look();
            if let Some(event) = event {
                self.clients.note("note", &event, "", None);
            }
            state
        });
        self.clients.publish(&json!(State {
            k: "state",
            t: now(),
            status: operator.status(),
            phase: Phase::from_word(u64::from(status.phase)).map(Phase::name),
            said: message,
            known: &self.known,
            check: &self.check,
            wave: &self.wave,
            commission,
            busy: self.is_busy,
        }));
    }

    /// All gains of the spec, multiplied by a factor.
    fn gains<P: Port>(&self, operator: &Operator<P>, factor: f64) -> Result<Vec<(String, f64)>, String> {
        if !(factor.is_finite() && factor > 0.0) {
            return Err(format!("expected a gain factor above 0, found {factor}"));
        }
        let description = operator.session.description();
        let words = description.config_names.iter().zip(&self.compiled.ir.integrity.settings);
        let gains = words.filter(|(name, _)| is_gain(name));
        Ok(gains.map(|(name, word)| (name.clone(), description.scalar.decode(*word) * factor)).collect())
    }
}
