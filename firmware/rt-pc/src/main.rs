//! The emitted controller on a Linux PC, in real time.
//!
//! ```text
//! real-time thread   sleep to the tick → gauges → supervise → amplifiers → hand over     control.rs, control/
//!        │ rows, states, recorder              ▲ orders              rings, never wait    handover.rs
//!        ▼                                     │
//! main thread        record to a file, link, plan, signals                               service.rs, console.rs, operator.rs
//! ```
//! The machine outside is a data acquisition card or a simulated one (devices/). What is late is entered in a book and
//! has a cause; the summary shows it.

mod capture;
mod console;
mod control;
mod devices;
mod handover;
mod operator;
mod options;
mod outputs;
mod passes;
mod record;
mod samples;
mod service;
mod summary;
mod words;

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;

use controller::supervision::HOST_TICKS;
use controller::{CONFIG_NAMES, CONFIG_WORDS, Config};
use signal_hook::consts::{SIGINT, SIGTERM};
use specgen_rt::account::Account;
use specgen_rt::allocation::Watched;
use specgen_rt::scheduling::{self, AwakeProcessors, Refused};
use specgen_rt::{clock, exchange};

use capture::Capture;
use console::Console;
use control::{Loop, Timing};
use devices::Device;
use devices::simulated::Simulated;
use handover::Shared;
use operator::{Operator, Timeout};
use options::{Asked, Options};
use service::{Link, Service};
use summary::Summary;

/// Notices if the real-time thread allocates.
#[global_allocator]
static ALLOCATOR: Watched = Watched;

/// Bytes of the real-time thread's stack.
const STACK: usize = 2 * scheduling::STACK + (1 << 20);

/// Why it cannot run, by exit code.
enum Failure {
    Run(String),
    Usage(String),
    Environment(String),
}

fn main() -> ExitCode {
    // A record that outgrows the limit brings the machine down in order.
    specgen_rt::signals::ignore_file_size();
    let asked = options::parse(std::env::args_os()).map_err(Failure::Usage);
    let done = asked.and_then(|asked| match asked {
        Asked::Text(text) => outputs::print(&text).map_err(Failure::Environment),
        Asked::Run(options) => open(&options),
    });
    let (code, text) = match done {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Failure::Run(text)) => (1, text),
        Err(Failure::Usage(text)) => (2, text),
        Err(Failure::Environment(text)) => (3, text),
    };
    eprintln!("error: {text}");
    ExitCode::from(code)
}

/// Opens the machine outside and runs on it.
fn open(options: &Options) -> Result<(), Failure> {
    match &options.hardware {
        options::Hardware::Simulated(name) => {
            let path = exchange::path_of(name).map_err(|text| Failure::Usage(format!("--sim: {text}")))?;
            let edges = options.sim_edge_every.zip(words::period()).map(|(every, period)| every.div_ceil(period));
            let device = Simulated::open(&path, options.sim_timeout, edges);
            run(options, &mut device.map_err(Failure::Environment)?)
        }
        #[cfg(feature = "comedi")]
        options::Hardware::Comedi(input) => {
            accept_assumptions(controller::ASSUMED, options.assumed_ok).map_err(Failure::Run)?;
            let library = devices::comedi::library::Comedilib::open(options.comedi_library.as_deref());
            let library = library.map_err(Failure::Environment)?;
            let settings = devices::comedi::Settings {
                input: input.clone(),
                outputs: options.comedi_outputs.clone(),
                input_volts: options.comedi_ranges[0],
                output_volts: options.comedi_ranges[1],
            };
            let device = devices::comedi::Comedi::open(&library, &settings);
            run(options, &mut device.map_err(Failure::Environment)?)
        }
        #[cfg(not(feature = "comedi"))]
        options::Hardware::Comedi(_) => {
            Err(Failure::Usage("--comedi needs another build: cargo build --release --features comedi".to_owned()))
        }
    }
}

/// A card drives a real machine: what the controller rests on is measured, or accepted as it is.
#[cfg(feature = "comedi")]
fn accept_assumptions(assumed: &[&str], accepted: bool) -> Result<(), String> {
    if accepted || assumed.is_empty() {
        return Ok(());
    }
    Err(format!(
        "the controller of a real machine would rest on what nobody measured: {}; measure it, take its entries out of `assumed` in the \
         spec, name records of the machine's own legs and build again, or accept it with --assumed-ok",
        assumed.join(", ")
    ))
}

fn run<D: Device + Send>(options: &Options, device: &mut D) -> Result<(), Failure> {
    let usage = Failure::Usage;
    let environment = |error: String| Failure::Environment(error);
    let config = configure(&options.config).map_err(usage)?;
    let period = words::period().ok_or_else(|| environment("the controller does not state its period".to_owned()))?;
    let timing = Timing {
        period,
        limit: (period as f64 * options.late_after) as u64,
        silence: options.link_silence.map_or(u64::from(HOST_TICKS), |silence| silence.div_ceil(period)),
        elastic: options.elastic,
    };
    // A host or a time ends it, not a fault.
    let attended = options.link.is_some() || options.duration.is_some();
    let timeout = Timeout { silence: timing.silence * period, idle: options.link_idle };
    let mut operator = Operator::new(attended, timeout);
    if options.arm {
        operator.plan(&options.set, clock::now()).map_err(|error| usage(format!("--set: {error}")))?;
    }

    let signal = Arc::new(AtomicBool::new(false));
    for number in [SIGINT, SIGTERM] {
        signal_hook::flag::register(number, Arc::clone(&signal))
            .map_err(|error| environment(format!("signal {number}: {error}")))?;
    }
    let named = |path: &std::path::Path, error: std::io::Error| environment(format!("{}: {error}", path.display()));
    let link = options.link.as_deref().map(|path| Link::listen(path).map_err(|error| named(path, error)));
    let link = link.transpose()?;
    outputs::check(options.record.as_deref(), options.capture.as_deref())?;
    let record = options.record.as_deref().map(|path| {
        let writer = record::Writer::create(path, &config).map_err(environment)?;
        Ok::<_, Failure>((path.to_owned(), writer))
    });
    let record = record.transpose()?;
    let (capture, tape) = Capture::new(options.capture.as_deref()).map_err(environment)?;
    let console = Console::new(operator, capture, config);

    let (inner, outer) = handover::rings(record.is_some());
    let shared = Shared::default();
    shared.service_alive.store(clock::now(), Ordering::Relaxed);
    let description = device.describe();
    let mut account = Box::new(Account::new(timing.period, timing.limit));
    let (mut missing, _awake) = prepare_process();

    let control = Loop {
        device,
        config,
        standing_events: control::integrity_event(controller::integrity::intact()),
        rings: inner,
        tape: Some(tape),
        shared: &shared,
        timing,
    };
    let (ready, readiness) = mpsc::channel();
    let (go, wait) = mpsc::channel();
    let (cpu, priority) = (options.cpu, options.priority);
    let book = &mut *account;
    let outcome = std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().name("real-time".to_owned()).stack_size(STACK);
        let spawned = thread.spawn_scoped(scope, move || {
            let _ = ready.send(prepare_thread(cpu, priority));
            // Without the word to go there is nothing to run.
            if wait.recv().is_ok() {
                control.run(book);
            }
        });
        spawned.map_err(|error| environment(format!("no thread for the loop: {error}")))?;
        missing.extend(readiness.recv().unwrap_or_default());
        for refused in &missing {
            eprintln!("{}: {refused}", if options.allow_no_rt { "warning" } else { "error" });
        }
        if !missing.is_empty() && !options.allow_no_rt {
            drop(go);
            return Err(environment(
                "this user may not run in real time; see the lines above and `specgen doctor`, or try with --allow-no-rt"
                    .to_owned(),
            ));
        }
        let until = options.duration.map(|duration| clock::now() + duration);
        let _ = go.send(());
        let service = Service { rings: outer, shared: &shared, console, record, link, signal, signals: 0, until };
        Ok(service.run())
    })?;

    let summary = Summary {
        account: &account,
        outcome: &outcome,
        lost_rows: shared.lost_rows.load(Ordering::Relaxed),
        device_faults: shared.device_faults.load(Ordering::Relaxed),
        device: description,
        period,
        missing_rights: missing.iter().map(ToString::to_string).collect(),
    };
    let printed = outputs::print(&if options.json { summary.to_json() } else { summary.to_text() });
    // What became of the machine counts more than who reads it.
    summary.failure().map_or(Ok(()), |failure| Err(Failure::Run(failure)))?;
    printed.map_err(environment)
}

/// Rights of the whole process: what is missing, and what keeps processors awake. That one is a courtesy, not a need.
fn prepare_process() -> (Vec<Refused>, Option<AwakeProcessors>) {
    let awake = match AwakeProcessors::request() {
        Ok(awake) => Some(awake),
        Err(refused) => {
            eprintln!("warning: {refused}");
            None
        }
    };
    (scheduling::lock_memory().err().into_iter().collect(), awake)
}

/// Rights of the calling thread: what is missing.
fn prepare_thread(cpu: Option<usize>, priority: u8) -> Vec<Refused> {
    let pinned = cpu.map_or(Ok(()), scheduling::pin);
    pinned.err().into_iter().chain(scheduling::set_fifo(priority).err()).collect()
}

/// The spec's settings with assignments such as `mode=6`.
fn configure(assignments: &[String]) -> Result<Config, String> {
    let mut words: [u64; CONFIG_WORDS] = controller::integrity::config().to_words();
    for text in assignments {
        let (name, value) =
            text.split_once('=').ok_or_else(|| format!("--config: expected NAME=VALUE, found `{text}`"))?;
        let place = CONFIG_NAMES.iter().position(|known| *known == name);
        let place =
            place.ok_or_else(|| format!("--config: no setting `{name}`; there are {}", CONFIG_NAMES.join(", ")))?;
        let number: f64 =
            value.parse().map_err(|_| format!("--config: `{name}`: expected a number, found `{value}`"))?;
        words[place] = words::setting(place, number).ok_or_else(|| {
            format!("--config: `{name}`: expected a finite number, or a whole one from 0 where it is a choice or a code; found `{value}`")
        })?;
    }
    Config::from_words(&words).map_err(|error| {
        let name = CONFIG_NAMES.get(error.word).copied().unwrap_or("?");
        format!("--config: `{name}` is out of its range: expected {}", words::range(error.word))
    })
}
