//! `specgen operate`: one session with a machine over the link, from the command line, a script, or line by line.

mod answer;
mod ended;
mod health;
mod located;
mod operator;
pub mod panel;
mod passes;
mod platform;
mod pose;
mod triggers;
mod watch;
mod waves;

use std::io::{BufRead, IsTerminal};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};

use clap::{ArgGroup, Args};
use serde::Serialize;
use specgen_compiler::{compile, spec_file};
use specgen_link::client::Port;

use super::line::Line;
use super::named::InputFile;
use answer::{Mistake, Report};
pub use ended::Ended;
pub use operator::Operator;
pub use passes::motion_name;
use specgen_language::interrupt;
use specgen_language::model::Model;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::read_text;
use specgen_language::ui::Ui;
use specgen_operate::{ALIVE, Order, Session};
use specgen_runtime::supervisor::Request;

/// Arguments of `operate`.
#[derive(Args, Debug)]
#[command(
    group(ArgGroup::new("line").required(true).args(["port", "socket"])),
    override_usage = "specgen operate [OPTIONS] --port <DEVICE> [SPEC] [COMMAND]...\n       specgen operate [OPTIONS] --socket <PATH> [SPEC] [COMMAND]...",
    after_help = super::examples::OPERATE
)]
pub struct Arguments {
    #[command(flatten)]
    line: Line,
    /// Commands from this file, one a line; `#` begins a comment.
    #[arg(long, value_name = "FILE")]
    script: Option<InputFile>,
    /// The spec that the device was built from (a name that ends in .toml), then commands, each one argument. Without any,
    /// commands come from standard input.
    #[arg(value_name = "SPEC] [COMMAND")]
    words: Vec<String>,
}

/// What is known beforehand of the device.
struct Device {
    digest: Option<String>,
    model: Option<Model>,
    alike: Vec<Vec<u32>>,
    has_one_host: bool,
}

/// Where commands come from.
enum Source {
    List(Vec<Order>),
    /// Lines as they come, from a person or program that sees what happens.
    Lines,
}

/// What was served to clients that connect, and how the machine stands then.
#[derive(Serialize)]
pub(super) struct Served {
    pub device: String,
    pub listened: String,
    pub stands: String,
}

impl Outcome for Served {
    fn text(&self) -> String {
        String::new()
    }
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    // `wave x.toml` is a command.
    let is_spec = |word: &&String| word.ends_with(".toml") && Order::parse(word).is_err();
    let spec = arguments.words.first().filter(is_spec);
    let commands = arguments.words.get(usize::from(spec.is_some())..).unwrap_or_default();
    let source = source(arguments, commands)?;
    let compiled = match spec {
        Some(spec) => Some(spec_file::looked_up(spec.as_ref(), ui)?),
        None => None,
    };
    if let Source::List(orders) = &source {
        for order in orders {
            if let Order::WriteConfig(spec) = order {
                compile::compile(spec)?;
            }
        }
    }
    let digest = compiled.as_ref().map(|compiled| compiled.ir.digest.clone());
    let alike = compiled.as_ref().map(|compiled| compiled.ir.supervision.alike().to_vec()).unwrap_or_default();
    let model = compiled.map(|compiled| compiled.model);
    let device = Device { digest, model, alike, has_one_host: arguments.line.port.is_some() };
    // The machine is not to be left alone.
    interrupt::heed();
    let (session, name) = arguments.line.open(device.digest.as_deref())?;
    operate(session, &name, device, source, ui)
}

/// Every command is read before anything is asked of the machine: a mistake in the last line stops the first.
fn source(arguments: &Arguments, commands: &[String]) -> Result<Source, Failure> {
    let source = read(arguments, commands)?;
    match &source {
        Source::List(orders) if orders.iter().rev().skip(1).any(|order| *order == Order::Stop) => {
            Err(Failure::Usage("`stop` ends the session: nothing comes after it".to_owned()))
        }
        _ => Ok(source),
    }
}

fn read(arguments: &Arguments, commands: &[String]) -> Result<Source, Failure> {
    let mut orders = Vec::new();
    for command in commands {
        orders.extend(Order::parse(command).map_err(Failure::Usage)?);
    }
    match &arguments.script {
        Some(_) if !commands.is_empty() => Err(Failure::Usage(
            "commands as arguments and --script exclude each other: put all of them into the script".to_owned(),
        )),
        Some(path) => {
            let text = read_text(path)?;
            for (index, line) in text.lines().enumerate() {
                let place = |error| Failure::Usage(format!("{}:{}: {error}", path.display(), index + 1));
                orders.extend(Order::parse(line).map_err(place)?);
            }
            Ok(Source::List(orders))
        }
        None if commands.is_empty() => Ok(Source::Lines),
        None => Ok(Source::List(orders)),
    }
}

fn operate(
    session: Session<Box<dyn Port>>,
    name: &str,
    device: Device,
    source: Source,
    ui: &mut Ui,
) -> Result<(), Failure> {
    if device.digest.is_none() {
        let text = format!("{name}: not compared with a spec; name it to be sure that the device runs its controller");
        ui.progress(&text);
    }
    let mut operator = Operator::new(session, interrupt::heed());
    operator.model = device.model;
    operator.alike = device.alike;
    // A serial line has one end here: whoever asks over it is the host.
    operator.ordered = device.has_one_host;
    if let Source::List(orders) = &source {
        // A mistake in the last of them would leave the machine alone in the middle.
        operator.check(orders)?;
    }
    let ended = match source {
        Source::List(orders) => list(&orders, &mut operator, ui),
        Source::Lines => lines(&mut operator, ui),
    };
    finish(ended, &mut operator, name, ui)
}

fn list(orders: &[Order], operator: &mut Operator<impl Port>, ui: &mut Ui) -> Result<(), Ended> {
    for order in orders {
        operator.obey(order, ui)?;
    }
    // A request that was the last one is to be seen by a tick before the link goes silent, and what it does to be shown.
    operator.look()
}

/// Lines from standard input or the program that called, the machine looked at meanwhile. What is wrong with a line ends nothing.
fn lines(operator: &mut Operator<impl Port + 'static>, ui: &mut Ui) -> Result<(), Ended> {
    operator.attended = true;
    let (urgent, stops) = channel();
    operator.pulse = Some(Box::new(move |operator| match stops.try_recv() {
        Ok(request) => {
            operator.stop_by_hand(request)?;
            Err(Ended::Refused("stopped from the terminal".to_owned()))
        }
        Err(_) => Ok(()),
    }));
    let lines = match ui.take_lines() {
        Some(lines) => {
            line("status", operator, ui)?;
            lines
        }
        None => reader(urgent),
    };
    if std::io::stdin().is_terminal() {
        ui.progress(&format!("{}; commands, one a line; end with Ctrl-D", operator.stands()));
    }
    loop {
        match lines.recv_timeout(ALIVE) {
            Ok(text) => {
                line(&text, operator, ui)?;
                if std::mem::take(&mut operator.was_stopped) {
                    // What was sent before is not to move it.
                    for text in lines.try_iter() {
                        late(&text, operator, ui)?;
                    }
                }
            }
            Err(RecvTimeoutError::Timeout) => {
                mistake(operator.look(), ui)?;
                operator.was_stopped = false;
                operator.show(ui);
            }
            Err(RecvTimeoutError::Disconnected) => return operator.look(),
        }
    }
}

/// Carries a line out that was sent before the machine was stopped, unless it would move.
fn late(text: &str, operator: &mut Operator<impl Port>, ui: &mut Ui) -> Result<(), Ended> {
    if !matches!(Order::parse(text), Ok(Some(order)) if order.moves()) {
        return line(text, operator, ui);
    }
    operator.note(text, &Mistake { error: "the machine was stopped: not done".to_owned() }, ui);
    ui.answered(&mut operator.answers);
    Ok(())
}

/// Carries one line out, and answers it.
fn line(line: &str, operator: &mut Operator<impl Port>, ui: &mut Ui) -> Result<(), Ended> {
    let done = match Order::parse(line) {
        Ok(None) => Ok(()),
        Ok(Some(order)) => operator.obey(&order, ui),
        Err(text) => Err(Ended::Refused(text)),
    };
    if let Some(error) = mistake(done, ui)? {
        operator.note(line, &Mistake { error }, ui);
    }
    ui.answered(&mut operator.answers);
    Ok(())
}

/// Why an order was not carried out, where that ends nothing.
fn mistake(done: Result<(), Ended>, ui: &mut Ui) -> Result<Option<String>, Ended> {
    match done {
        Ok(()) => Ok(None),
        Err(Ended::Refused(text) | Ended::Fault(text)) => Ok(Some(text)),
        Err(Ended::Failed(Failure::Environment(text) | Failure::Gate(text) | Failure::Usage(text))) => Ok(Some(text)),
        Err(Ended::Failed(Failure::Refused(refused))) => {
            ui.findings(refused.source.as_ref(), &refused.findings);
            Ok(Some("the spec is refused".to_owned()))
        }
        Err(other) => Err(other),
    }
}

/// A thread that waits for lines, so that the link does not. A stop from a terminal does not wait for what was typed before.
fn reader(urgent: Sender<Request>) -> Receiver<String> {
    let (sender, receiver) = channel();
    let is_typed = std::io::stdin().is_terminal();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines() {
            let Ok(line) = line else { return };
            if is_typed && let Ok(Some(Order::Ask(request @ (Request::Hold | Request::RampDown)))) = Order::parse(&line)
            {
                let _ = urgent.send(request);
                continue;
            }
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}

/// Says how it ended. Ctrl-C brings the machine down first.
fn finish(
    ended: Result<(), Ended>,
    operator: &mut Operator<impl Port>,
    name: &str,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let open = ended.is_ok();
    let report = Report { device: name, answers: std::mem::take(&mut operator.answers), status: operator.status() };
    match ended {
        Ok(()) | Err(Ended::Stopped) => {
            // A machine that another host commands does not miss one that only looked.
            if open && operator.ordered && operator.is_powered() {
                let text =
                    "the amplifiers are on; without its host the machine holds, then ramps down (supervisor.host_lost)";
                ui.progress(&format!("{name}: {}: {text}", operator.stands()));
            }
            ui.result(&report);
            Ok(())
        }
        Err(Ended::Refused(text) | Ended::Fault(text)) => ui.judged(&report, Some(format!("{name}: {text}"))),
        Err(Ended::Failed(failure)) => Err(failure),
        Err(Ended::Link(error)) => Err(Failure::Environment(format!(
            "{name}: {error}; a machine that lost its host holds, then ramps down (supervisor.host_lost)"
        ))),
        Err(Ended::Interrupted) => match operator.ramp_down(ui) {
            Ok(text) => {
                let result = ui.shown(&Report { status: operator.status(), ..report });
                Err(Failure::Interrupted { message: format!("interrupted; {text}"), result })
            }
            Err(error) => Err(Failure::Environment(format!("{name}: interrupted, and then: {error}"))),
        },
    }
}
