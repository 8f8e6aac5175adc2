//! The emitted controller on a Linux PC, in real time.
//!
//! ```text
//! real-time thread   sleep to the tick → gauges → supervise → amplifiers → hand over     control.rs, control/
//!        │ rows, states, recorder              ▲ commands            rings, never wait    handover.rs
//!        ▼                                     │
//! main thread        record to a file, link, plan, signals                               service.rs, console.rs, operator.rs
//! ```
//! The machine is a data acquisition card or a simulated one (devices/). Every late tick is entered in an account with
//! its cause; the summary shows it.

#[cfg(test)]
#[path = "bench/tests.rs"]
mod bench;
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
use specgen_rt::allocation::WatchedAllocator;
use specgen_rt::scheduling::{self, AwakeProcessors, MissingPrivilege};
use specgen_rt::{clock, exchange};

use capture::Capture;
use console::Console;
use control::{Loop, Timing};
use devices::Device;
use devices::simulated::SimulatedDevices;
use handover::Shared;
use operator::{Arbiter, Timeout};
use options::{Invocation, Options};
use service::{Link, Service};
use summary::Summary;

/// Detects allocations of the real-time thread.
#[global_allocator]
static ALLOCATOR: WatchedAllocator = WatchedAllocator;

/// Bytes of the real-time thread's stack.
const STACK: usize = 2 * scheduling::STACK + (1 << 20);

/// Reason why it cannot run, by exit code.
enum Failure {
    Run(String),
    Usage(String),
    Environment(String),
}

impl Failure {
    fn code_and_text(self) -> (u8, String) {
        match self {
            Self::Run(text) => (1, text),
            Self::Usage(text) => (2, text),
            Self::Environment(text) => (3, text),
        }
    }
}

fn main() -> ExitCode {
    // A record that exceeds the limit stops the machine normally.
    specgen_rt::signals::ignore_file_size();
    let asked = options::parse(std::env::args_os()).map_err(Failure::Usage);
    let done = asked.and_then(|asked| match asked {
        Invocation::Text(text) => outputs::print(&text).map_err(Failure::Environment),
        Invocation::Run(options) => open(&options),
    });
    let Err(failure) = done else { return ExitCode::SUCCESS };
    let (code, text) = failure.code_and_text();
    eprintln!("error: {text}");
    ExitCode::from(code)
}

/// Opens the machine outside and runs on it.
fn open(options: &Options) -> Result<(), Failure> {
    match &options.hardware {
        options::Hardware::Simulated(name) => {
            let path = exchange::path_of(name).map_err(|text| Failure::Usage(format!("--sim: {text}")))?;
            let edges = options.sim_edge_every.zip(words::period()).map(|(every, period)| every.div_ceil(period));
            let device = SimulatedDevices::open(&path, options.sim_timeout, edges);
            run(options, &mut device.map_err(Failure::Environment)?, signals()?)
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
            run(options, &mut device.map_err(Failure::Environment)?, signals()?)
        }
        #[cfg(not(feature = "comedi"))]
        options::Hardware::Comedi(_) => {
            Err(Failure::Usage("--comedi needs another build: cargo build --release --features comedi".to_owned()))
        }
    }
}

/// A card drives a real machine: assumed values must be measured, or accepted.
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

/// What a signal that asks for the end sets.
fn signals() -> Result<Arc<AtomicBool>, Failure> {
    let signal = Arc::new(AtomicBool::new(false));
    for number in [SIGINT, SIGTERM] {
        signal_hook::flag::register(number, Arc::clone(&signal))
            .map_err(|error| Failure::Environment(format!("signal {number}: {error}")))?;
    }
    Ok(signal)
}

/// Times of the loop and of the hosts, from a period in ns.
fn times(options: &Options, period: u64) -> (Timing, Timeout) {
    let silence = options.link_silence.map_or(u64::from(HOST_TICKS), |silence| silence.div_ceil(period));
    let limit = (period as f64 * options.late_after) as u64;
    (
        Timing { period, limit, silence, elastic: options.elastic },
        Timeout { silence: silence * period, idle: options.link_idle },
    )
}

fn run<D: Device + Send>(options: &Options, device: &mut D, signal: Arc<AtomicBool>) -> Result<(), Failure> {
    let usage = Failure::Usage;
    let environment = |error: String| Failure::Environment(error);
    let config = configure(&options.config).map_err(usage)?;
    let period = words::period().ok_or_else(|| environment("the controller does not state its period".to_owned()))?;
    let (timing, timeout) = times(options, period);
    // A host or a time limit ends it, not a fault.
    let attended = options.link.is_some() || options.duration.is_some();
    let mut operator = Arbiter::new(attended, timeout);
    if options.arm {
        operator.plan(&options.set, clock::now()).map_err(|error| usage(format!("--set: {error}")))?;
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
    // The state of the machine counts more than the reader of the output.
    summary.failure().map_or(Ok(()), |failure| Err(Failure::Run(failure)))?;
    printed.map_err(environment)
}

/// Privileges of the whole process: missing ones, and the one that keeps processors awake, which is optional.
fn prepare_process() -> (Vec<MissingPrivilege>, Option<AwakeProcessors>) {
    let awake = match AwakeProcessors::request() {
        Ok(awake) => Some(awake),
        Err(refused) => {
            eprintln!("warning: {refused}");
            None
        }
    };
    (scheduling::lock_memory().err().into_iter().collect(), awake)
}

/// Missing privileges of the calling thread.
fn prepare_thread(cpu: Option<usize>, priority: u8) -> Vec<MissingPrivilege> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use bench::{Bench, Call, options};
    use std::path::Path;
    use std::time::{Duration, Instant};

    /// A run on a made-up machine, to which something happens at the beginning of every tick: why it failed, and how long it took.
    fn run_on(line: &str, act: impl FnMut(&mut Bench) + Send + 'static) -> (Result<(), (u8, String)>, Duration, Bench) {
        run_with(line, Arc::default(), act)
    }

    fn run_with(
        line: &str,
        signal: Arc<AtomicBool>,
        act: impl FnMut(&mut Bench) + Send + 'static,
    ) -> (Result<(), (u8, String)>, Duration, Bench) {
        let mut bench = Bench::new(handover::rings(false).1, act);
        let start = Instant::now();
        let done = run(&options(line), &mut bench, signal).map_err(Failure::code_and_text);
        (done, start.elapsed(), bench)
    }

    /// One after the other: each locks the memory of the process.
    #[test]
    fn a_run_goes_from_its_options_to_its_end() {
        let folder = std::env::temp_dir().join(format!("rt-pc-run-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = |name: &str| folder.join(name).to_str().unwrap().to_owned();
        let base = "--elastic --allow-no-rt --json --priority 1";

        // A plan that arms and runs, with a record; a time ends it.
        let line = format!("{base} --arm --seconds 1.5 --record {} --capture {}", file("run.rec"), file("run.cap"));
        let (done, took, bench) = run_on(&line, |_| {});
        assert_eq!(done, Ok(()));
        assert!(took >= Duration::from_millis(1500) && took < Duration::from_secs(20), "{took:?}");
        let on = bench.calls.iter().filter(|(_, call)| *call == Call::Enable(true)).count();
        assert_eq!((on, bench.calls.last().unwrap().1), (1, Call::Enable(false)));
        assert!(
            bench
                .calls
                .iter()
                .any(|(_, call)| matches!(call, Call::Write(codes) if codes.iter().any(|code| *code > 0)))
        );
        assert!(std::fs::metadata(file("run.rec")).unwrap().len() > 10 * bench.tick);
        assert!(!Path::new(&file("run.cap")).exists(), "nothing happened that the recorder keeps");

        // A fault is the end of a run that nobody attends, and what it failed of.
        let stops = |bench: &mut Bench| bench.contacts.stop = bench.tick >= 50;
        let line = format!("{base} --arm --capture {}", file("run.cap"));
        let (done, took, _) = run_on(&line, stops);
        assert!(matches!(&done, Err((1, text)) if text.contains("emergency stop")), "{done:?}");
        assert!(took < Duration::from_secs(20));
        assert!(std::fs::metadata(file("run.cap")).unwrap().len() > 0);
        // Where a time is given the run goes on until then.
        let (done, took, _) = run_on(&format!("{base} --arm --seconds 0.4"), stops);
        assert!(matches!(done, Err((1, _))) && took >= Duration::from_millis(400));

        // A signal.
        let signal = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&signal);
        let (done, _, bench) = run_with(base, signal, move |bench| {
            flag.fetch_or(bench.tick == 40, Ordering::Relaxed);
        });
        assert_eq!(done, Ok(()));
        assert!(bench.tick >= 40 && bench.calls.iter().all(|(_, call)| *call != Call::Enable(true)));

        // A missing privilege, such as a processor that does not exist, is an error unless the option permits it.
        let cpu = "--elastic --json --priority 1 --cpu 4000 --seconds 0.05";
        let (done, _, bench) = run_on(cpu, |_| {});
        assert!(matches!(&done, Err((3, text)) if text.contains("may not run in real time")), "{done:?}");
        assert!(bench.beats.is_empty());
        let (done, _, bench) = run_on(&format!("{cpu} --allow-no-rt"), |_| {});
        assert!(done.is_ok() && !bench.beats.is_empty());
        let rights =
            prepare_process().0.is_empty() && std::thread::spawn(|| prepare_thread(None, 1)).join().unwrap().is_empty();
        let (done, _, _) = run_on("--elastic --json --priority 1 --seconds 0.05", |_| {});
        assert_eq!(done.is_ok(), rights, "{done:?}");

        // What cannot be is refused before anything runs.
        for (line, code, words) in [
            ("--config mode", 2, "expected NAME=VALUE"),
            ("--set setpoint[0]=x", 2, "--set: "),
            ("--record /nowhere/a", 3, "/nowhere/a"),
            ("--link /nowhere/a", 3, "/nowhere/a"),
            ("--record /dev/shm/rt-pc-same --capture /dev/shm/rt-pc-same", 2, "two"),
        ] {
            let (done, _, bench) = run_on(&format!("{base} {line}"), |_| {});
            assert!(matches!(&done, Err((found, text)) if *found == code && text.contains(words)), "{line}: {done:?}");
            assert!(bench.calls.is_empty());
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn times_are_whole_ticks_of_the_period() {
        let (timing, timeout) = times(&options("--late-after 0.25 --link-silence 1.01 --link-idle 2"), 50_000);
        assert_eq!((timing.period, timing.limit, timing.silence, timing.elastic), (50_000, 12_500, 21, false));
        assert_eq!((timeout.silence, timeout.idle), (21 * 50_000, 2_000_000_000));
        let (timing, timeout) = times(&options("--elastic"), 100_000);
        assert_eq!((timing.silence, timing.elastic), (u64::from(HOST_TICKS), true));
        assert_eq!(timeout.silence, u64::from(HOST_TICKS) * 100_000);
    }

    #[test]
    fn settings_of_a_run_are_named_and_in_their_range() {
        let configured = |text: &str| configure(&[text.to_owned()]);
        let mode = |config: Config| config.to_words()[CONFIG_NAMES.iter().position(|name| *name == "mode").unwrap()];
        assert_eq!(mode(configured("mode=6").unwrap()), 6);
        let words = controller::integrity::config().to_words();
        assert_eq!(configure(&[]).unwrap().to_words(), words);
        let changed = configured("kp[0]=0").unwrap().to_words();
        let gain = CONFIG_NAMES.iter().position(|name| *name == "kp[0]").unwrap();
        for (place, (new, old)) in changed.iter().zip(words).enumerate() {
            assert_eq!(*new, if place == gain { words::word(0.0) } else { old }, "{place}");
        }
        for (text, expected) in [
            ("mode", "expected NAME=VALUE, found `mode`"),
            ("speed=1", "no setting `speed`; there are mode, "),
            ("mode=x", "expected a number, found `x`"),
            ("mode=0.5", "a whole one from 0"),
            ("kp[0]=inf", "expected a finite number"),
            ("mode=99", "`mode` is out of its range: expected a whole number from 0 to"),
        ] {
            let error = configured(text).unwrap_err();
            assert!(error.starts_with("--config: ") && error.contains(expected), "{error}");
        }
    }

    #[test]
    fn a_machine_that_is_not_there_is_said_to_be_missing() {
        for (line, code, words) in [
            ("--sim ../a", 2, "--sim: expected a name"),
            ("--sim rt-pc-nobody-serves-this", 3, "no simulated machine there"),
            #[cfg(not(feature = "comedi"))]
            ("--comedi /dev/comedi0", 2, "--features comedi"),
        ] {
            let done = open(&options(line)).map_err(Failure::code_and_text);
            assert!(matches!(&done, Err((found, text)) if *found == code && text.contains(words)), "{line}: {done:?}");
        }
    }
}
