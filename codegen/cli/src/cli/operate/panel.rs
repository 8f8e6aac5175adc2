//! `specgen panel`: a machine on one page in the browser.
//!
//! ```text
//! browsers ─ HTTP, WebSocket ─► a thread each ─ Heard ─► this thread: Operator ─ link ─► machine
//!            page, samples ◄────────────────── Outbox ◄─┘ at every look: samples, state, hold and ramp down
//! ```
//! One thread has the machine. Whatever an order waits for, the machine is looked at meanwhile, and at every look the pages get their
//! samples and *hold* and *ramp down* are carried out. What a browser does, or fails to do, keeps nothing waiting.

mod ask;
mod browser;
mod check;
mod feed;
mod hall;
mod http;
mod orders;
mod said;

use std::cell::RefCell;
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::rc::Rc;
use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

use clap::{ArgGroup, Args};
use serde_json::{Value, json};
use specgen_compiler::compile::Compilation;
use specgen_compiler::spec_file;
use specgen_language::interrupt;
use specgen_link::Refusal;
use specgen_link::client::{ClientError, Port};
use specgen_operate::Session;
use specgen_operate::samples::Block;
use specgen_runtime::supervisor::{Phase, Request};

use super::operator::Pulse;
use super::{Ended, Operator, Served, mistake};
use crate::cli::line::Line;
use crate::cli::named::InputFile;
use hall::{Hall, now};
use orders::{carry_out, question};
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;

/// Between two messages with samples.
const FRAME: Duration = Duration::from_millis(25);
/// Between two looks at the samples that wait.
const LOOK: Duration = Duration::from_millis(10);
/// Between two words about how the machine stands.
const STATE: Duration = Duration::from_millis(200);
/// Between two questions that need more than a look: what it noticed, reach, recorder, gains.
const QUESTION: Duration = Duration::from_secs(1);
/// Between two words about late ticks.
const LATE: Duration = Duration::from_secs(60);
/// Rows a second that are asked for, at most.
const ROWS: f64 = 2000.0;
/// Longer than any ramp after a host was gone, s.
const RAMPED: f64 = 5.0;

/// Arguments of `panel`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("line").required(true).args(["port", "socket"])), after_help = crate::cli::examples::PANEL)]
pub struct Arguments {
    /// The spec that the device was built from: for the figure of the platform, and for the margins of gains.
    #[arg(value_name = "SPEC")]
    spec: InputFile,
    #[command(flatten)]
    line: Line,
    /// Where browsers connect. Any address but one of this computer itself lets others on the network who know the token move the
    /// machine.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8020")]
    listen: SocketAddr,
}

/// What the panel knows and tells.
struct Panel {
    hall: Hall,
    compiled: Compilation,
    blocks: Vec<Block>,
    /// Number of the next block, and its first tick.
    next: Option<(u32, u64)>,
    /// Ticks of which the machine's samples never came here, not told yet; when they were told last.
    lost: (u64, Instant),
    framed: Instant,
    stated: Instant,
    /// Phase, cause and finding that were told last; late ticks.
    told: Option<((u8, u8, u16), u32)>,
    /// Late ticks that were not told yet, and when some were told last.
    late: (u32, Option<Instant>),
    /// An order is under way: what ends it is told as an error.
    is_busy: bool,
    /// What the questions gave.
    known: Value,
    check: Value,
    wave: Value,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let compiled = spec_file::looked_up(&arguments.spec, ui)?;
    interrupt::heed();
    let (session, name) = arguments.line.open(Some(&compiled.ir.digest))?;
    let Some(motion) = session.motion() else {
        return Err(Failure::Gate(format!("{name}: the device controls six legs: the panel shows a platform")));
    };
    let listen = arguments.listen;
    let no = |error: std::io::Error| Failure::Environment(format!("cannot listen at {listen}: {error}"));
    let listener = TcpListener::bind(listen).map_err(no)?;
    let address = listener.local_addr().map_err(no)?;
    let guard = http::Guard::new(address.port()).map_err(no)?;
    // What is listened at everywhere is reached here.
    let shown = match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => SocketAddr::from(([127, 0, 0, 1], address.port())),
        _ => address,
    };
    if !address.ip().is_loopback() {
        ui.progress(
            "warning: whoever reaches this address and knows the token can move the machine; nothing is encrypted",
        );
    }
    ui.progress(&format!("{name}: panel at http://{shown}/?token={}", guard.token()));
    ui.progress("Ctrl-C ramps down and ends");

    let mut facts = specgen_report::panel::facts(&compiled.model, compiled.design.as_ref());
    facts["device"] = json!(name);
    // V/s.
    let (rules, volts) = (&compiled.ir.supervision, compiled.ir.actuation.volts_per_code);
    facts["ramp"] = json!(f64::from(rules.ramp_step) * volts / (f64::from(rules.ramp_every) * session.period()));
    facts["trajectories"] = json!(motion.trajectories());
    let page = specgen_report::panel::html(&format!("{}: panel", compiled.model.name), &facts);
    let (heard, hears) = sync_channel(256);
    browser::serve(listener, guard, page, heard);

    let stop = interrupt::heed();
    let mut operator = Operator::new(session, stop);
    operator.model = Some(compiled.model.clone());
    operator.alike = compiled.ir.supervision.alike().to_vec();
    operator.attended = true;
    let panel = Rc::new(RefCell::new(Panel::new(Hall::new(hears), compiled)));
    let lost = |error: ClientError| {
        Failure::Environment(format!(
            "{name}: {error}; a machine that lost its host holds, then ramps down (supervisor.host_lost)"
        ))
    };
    panel.borrow_mut().begin(&mut operator.session).map_err(|error| match error {
        ClientError::Refused(refusal) => {
            let what = "the device sends no samples; build and flash it with this specgen";
            Failure::Gate(format!("{name}: {what}: {}", ClientError::Refused(refusal)))
        }
        other => lost(other),
    })?;
    operator.pulse = Some(pulse(panel.clone()));
    let ended = serve(&mut operator, &panel, ui);
    operator.pulse = None;
    let left = match ended {
        Ended::Link(error) => Err(lost(error)),
        Ended::Failed(failure) => Err(failure),
        _ if operator.is_powered() => operator.ramp_down(ui).map_err(lost),
        _ => Ok(operator.stands()),
    };
    let why = left
        .as_ref()
        .map_or_else(|_| "The link to the machine broke.".to_owned(), |_| "The panel was ended.".to_owned());
    panel.borrow_mut().hall.publish(&json!({ "k": "end", "why": why }));
    // The threads of the pages send it.
    std::thread::sleep(FRAME);
    ui.result(&Served { device: name.clone(), listened: address.to_string(), stands: left? });
    Ok(())
}

/// WaitCondition it is to end.
fn serve<P: Port + 'static>(operator: &mut Operator<P>, panel: &Rc<RefCell<Panel>>, ui: &Ui) -> Ended {
    // Answers go to pages; nothing is printed.
    let mut quiet = Ui::called(|_| (), None);
    let mut asked = Instant::now();
    loop {
        if let Err(ended) = round(operator, panel, &mut quiet, &mut asked) {
            match mistake(Err(ended), &mut quiet) {
                // It ended an order at most.
                Ok(_) => {}
                Err(ended) => return ended,
            }
        }
        operator.show(ui);
    }
}

/// Listens, looks, carries out one order or asks what is asked now and then.
fn round<P: Port + 'static>(
    operator: &mut Operator<P>,
    panel: &Rc<RefCell<Panel>>,
    quiet: &mut Ui,
    asked: &mut Instant,
) -> Result<(), Ended> {
    panel.borrow_mut().hall.listen(operator.session.due().min(LOOK));
    if operator.is_interrupted() {
        return Err(Ended::Interrupted);
    }
    if panel.borrow_mut().leaves_alone(operator) {
        return Ok(());
    }
    operator.look()?;
    let next = panel.borrow_mut().hall.next();
    if let Some((page, order)) = next {
        panel.borrow_mut().is_busy = true;
        let done = carry_out(operator, panel, page, &order, quiet);
        panel.borrow_mut().is_busy = false;
        operator.answers.clear();
        let id = order.id();
        return match done {
            Ok(value) => {
                panel.borrow().hall.answer(page, id, Ok(value));
                Ok(())
            }
            Err(ended) => {
                if let Some(why) = mistake(Err(ended), quiet)? {
                    panel.borrow().hall.answer(page, id, Err(&why));
                }
                Ok(())
            }
        };
    }
    if asked.elapsed() >= QUESTION {
        *asked = Instant::now();
        let known = question(operator, quiet)?;
        panel.borrow_mut().known = known;
    }
    Ok(())
}

/// What is done at every look.
fn pulse<P: Port + 'static>(panel: Rc<RefCell<Panel>>) -> Pulse<P> {
    Box::new(move |operator| panel.borrow_mut().pulse(operator))
}

impl Panel {
    fn new(hall: Hall, compiled: Compilation) -> Self {
        let begun = Instant::now();
        Self {
            hall,
            compiled,
            blocks: Vec::new(),
            next: None,
            lost: (0, begun),
            framed: begun,
            stated: begun,
            told: None,
            late: (0, None),
            is_busy: false,
            known: json!({}),
            check: Value::Null,
            wave: Value::Null,
        }
    }

    /// Asks for samples, as many as are of use and there is room for.
    fn begin(&mut self, session: &mut Session<impl Port>) -> Result<(), ClientError> {
        let mut every = (1.0 / (ROWS * session.period())).ceil() as u32;
        loop {
            match session.stream(every) {
                Err(ClientError::Refused(Refusal::Rate { least })) if least > every => every = least,
                other => return other,
            }
        }
    }

    fn pulse<P: Port>(&mut self, operator: &mut Operator<P>) -> Result<(), Ended> {
        self.hall.listen(Duration::ZERO);
        if let Some((who, request)) = self.hall.urgent() {
            operator.ordered = true;
            operator.session.supervise(request)?;
            let what = if request == Request::Hold { "hold" } else { "ramp down" };
            self.hall.note("note", &format!("{who} asked to {what}."), "", None);
            if self.is_busy {
                return Err(Ended::Refused(format!("{who} asked to {what}")));
            }
        }
        if self.is_busy && !self.hall.has_holder() {
            return Err(Ended::Refused("the page that had the orders is gone".to_owned()));
        }
        self.samples(&mut operator.session)?;
        self.say(operator);
        Ok(())
    }

    /// Whether the machine gets no sign of us: the page that had the orders is gone, and it is to do what it does without a host.
    fn leaves_alone<P: Port>(&mut self, operator: &Operator<P>) -> bool {
        let rules = &self.compiled.ir.supervision;
        let gone = f64::from(*rules.timeout.last().unwrap_or(&0)) * operator.session.period();
        let silent = operator.session.silence().as_secs_f64();
        let is_at_rest = silent > gone + RAMPED || !operator.is_powered() || !operator.ordered;
        if self.hall.is_left && is_at_rest {
            self.hall.is_left = false;
        }
        if !self.hall.is_left || self.hall.is_pressed() {
            return false;
        }
        if self.stated.elapsed() >= STATE {
            self.stated = Instant::now();
            let left = if silent < gone { gone - silent } else { 0.0 };
            self.hall.publish(&json!({ "k": "left", "t": now(), "left": left }));
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
            self.blocks.push(block);
        }
        if self.lost.0 > 0 && self.lost.1.elapsed() >= QUESTION {
            let seconds = self.lost.0 as f64 * session.period();
            self.lost = (0, Instant::now());
            self.hall.note(
                "warning",
                &format!("{seconds:.3} s of samples were lost on the way from the machine."),
                "",
                None,
            );
        }
        if self.framed.elapsed() >= FRAME && !self.blocks.is_empty() {
            self.framed = Instant::now();
            let number = self.hall.number();
            let bytes = feed::message(number, &self.blocks, session.motion(), now());
            self.hall.show(number, bytes);
            self.blocks.clear();
        }
        Ok(())
    }

    /// Tells how the machine stands, and what is new.
    fn say<P: Port>(&mut self, operator: &Operator<P>) {
        let status = operator.session.status();
        let told = ((status.phase, status.cause, status.finding), status.late);
        let said = said::stands(status, &self.compiled.ir.supervision, &self.compiled.model);
        if let Some(before) = self.told.replace(told) {
            if before.0 != told.0 {
                self.hall.note(
                    if said.kind == "ok" { "note" } else { said.kind },
                    &said.what,
                    said.advice,
                    said.code.as_deref(),
                );
                if u64::from(status.phase) != Phase::Running.word() {
                    self.wave = Value::Null;
                }
            }
            self.late.0 += told.1.saturating_sub(before.1);
            if self.late.0 > 0 && self.late.1.is_none_or(|last| last.elapsed() >= LATE) {
                let late = std::mem::take(&mut self.late.0);
                let again = self.late.1.replace(Instant::now()).is_some();
                let s = if late == 1 { "" } else { "s" };
                let advice = if again {
                    "Look at the load of the controller's computer."
                } else {
                    "Nothing, unless it comes back."
                };
                self.hall.note("warning", &format!("{late} late tick{s}."), advice, None);
            }
        }
        if self.stated.elapsed() < STATE {
            return;
        }
        self.stated = Instant::now();
        let state = json!({
            "k": "state",
            "t": now(),
            "status": operator.status(),
            "phase": Phase::from_word(u64::from(status.phase)).map(Phase::name),
            "said": { "kind": said.kind, "what": said.what, "do": said.advice, "code": said.code },
            "known": self.known,
            "check": self.check,
            "wave": self.wave,
            "busy": self.is_busy,
        });
        self.hall.publish(&state);
    }

    /// All gains as the spec has them, by this factor.
    fn gains<P: Port>(&self, operator: &Operator<P>, factor: f64) -> Result<Vec<(String, f64)>, String> {
        if !(factor.is_finite() && factor > 0.0) {
            return Err(format!("expected a factor on the gains above 0, found {factor}"));
        }
        let description = operator.session.description();
        let words = description.config_names.iter().zip(&self.compiled.ir.integrity.settings);
        let gains = words.filter(|(name, _)| super::platform::is_gain(name));
        Ok(gains.map(|(name, word)| (name.clone(), description.scalar.decode(*word) * factor)).collect())
    }
}
