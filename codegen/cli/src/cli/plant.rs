//! `specgen plant`: the simulated machine of a spec in shared memory, for the real-time target on the same computer.

use std::sync::atomic::Ordering;

use clap::Args;
use serde::Serialize;
use specgen_compiler::{lower, spec_file};
use specgen_rt::clock::{self, SECOND};
use specgen_rt::exchange::{self, OpenError, Server};
use specgen_rt::histogram::{Histogram, known_text, time_text};
use specgen_rt::scheduling;

use super::named::InputFile;
use super::sim::PlantArguments;
use specgen_compiler::compile::Compilation;
use specgen_language::interrupt;
use specgen_language::outcome::{Failure, Outcome, environment};
use specgen_language::ui::Ui;
use specgen_operate::served::{Plant, PlantServer};
use specgen_runtime::supervisor::Finding;
use specgen_studies::machine;

/// How long it waits for a controller before it looks whether it is to end, ns.
const TIMEOUT: u64 = SECOND / 10;
/// Samples per period of the paper's trajectory, which is not run here.
const NO_TRAJECTORY: u32 = 1;

/// Arguments of `plant`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::PLANT)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// Name under which a controller finds the machine.
    #[arg(long, default_value = "plant")]
    name: String,
    /// End after this time, s; at Ctrl-C if not given.
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Keep it on this processor: another one than the controller's.
    #[arg(long, value_name = "N")]
    cpu: Option<usize>,
    /// SCHED_FIFO priority, below the controller's; an ordinary process if not given.
    #[arg(long, value_name = "P", allow_negative_numbers = true, value_parser = clap::value_parser!(u8).range(1..=98))]
    priority: Option<u8>,
    /// A fault of its wiring, such as "gauge 3 inverted", "leg 1 swapped with leg 4", "leg 2 dead", "gauge 0 gain x 0.50". Each is
    /// there for one time that the amplifiers are on, one after the other; "all" are all single faults.
    #[arg(long, value_name = "FAULT", value_parser = faults)]
    wrong: Vec<Faults>,
    #[command(flatten)]
    plant: PlantArguments,
}

/// Faults that one argument names.
#[derive(Debug, Clone)]
struct Faults(Vec<Finding>);

fn faults(text: &str) -> Result<Faults, String> {
    let named = |fault: &Finding| text == "all" || fault.to_string().replace('×', "x") == text;
    let found: Vec<Finding> = lower::single_faults().into_iter().filter(named).collect();
    if found.is_empty() {
        return Err(format!(
            "expected \"all\" or a fault such as \"gauge 3 inverted\", \"leg 2 dead\", \"leg 1 swapped with leg 4\", \"gauge 0 gain x 0.50\", \
             \"leg 5 gain x 2.00\", found `{text}`"
        ));
    }
    Ok(Faults(found))
}

fn seconds(text: &str) -> Result<f64, String> {
    let expected = || format!("expected a time from 0.01 to 10000000 s, found `{text}`");
    text.parse().ok().filter(|time| (0.01..=1e7).contains(time)).ok_or_else(expected)
}

/// What was served, and the times of a tick.
#[derive(Serialize)]
struct Summary {
    #[serde(skip)]
    name: String,
    #[serde(skip)]
    period_ns: u64,
    digest: String,
    ticks: u64,
    controllers: u64,
    /// None of these where no tick was asked for.
    p50_ns: Option<u64>,
    p99_ns: Option<u64>,
    max_ns: Option<u64>,
}

impl Outcome for Summary {
    fn text(&self) -> String {
        let Self { name, ticks, controllers, .. } = self;
        let [median, most, longest] = [self.p50_ns, self.p99_ns, self.max_ns].map(known_text);
        let period = time_text(self.period_ns);
        format!(
            "{name}: {ticks} ticks for {controllers} controllers; a tick took {median} (median), {most} (99 %), {longest} (longest) of {period}\n"
        )
    }
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let path = exchange::path_of(&arguments.name).map_err(|error| Failure::Usage(format!("--name: {error}")))?;
    let compiled = spec_file::looked_up(&arguments.spec, ui)?;
    let plant = prepared(arguments, &compiled, ui)?;
    let faults = arguments.wrong.iter().flat_map(|faults| faults.0.clone()).collect();
    let mut served = PlantServer::new(plant, &compiled.model, &compiled.ir).with_faults(faults);
    for refused in
        [arguments.cpu.map_or(Ok(()), scheduling::pin), arguments.priority.map_or(Ok(()), scheduling::set_fifo)]
    {
        refused.map_err(environment)?;
    }
    // Whatever ends it, the file is to go, and what was served is shown.
    let stop = interrupt::heed();
    let server = Server::create(&path, &compiled.ir.digest).map_err(|error| match error {
        OpenError::Served { .. } => Failure::Usage(error.to_string()),
        error => environment(error),
    })?;
    let [name, own] = [&compiled.ir.name, &arguments.name];
    ui.progress(&format!("machine of {name} at {}: start rt-pc --sim {own}; Ctrl-C ends it", path.display()));

    // Where there is a processor to spare it does not sleep between two ticks: waking it costs the controller time. Under
    // SCHED_FIFO it has to, or the kernel stops it for 50 ms in every second.
    let period = (compiled.model.timing.period * 1e9) as u64;
    let spare = std::thread::available_parallelism().map_or(1, usize::from) > 1;
    let look = if spare && arguments.priority.is_none() { 2 * period } else { 0 };
    let mut times = Histogram::new();
    let end = arguments.seconds.map(|seconds| clock::now() + (seconds * SECOND as f64) as u64);
    let mut seen = 0;
    while !stop.load(Ordering::Relaxed) && end.is_none_or(|end| clock::now() < end) {
        let heard = server.wait(&mut seen, look, TIMEOUT);
        if server.is_lost() {
            return Err(Failure::Environment(format!(
                "{}: the memory that machine and controller share has lost its mark: the file was made shorter, or overwritten; start both again",
                path.display()
            )));
        }
        if let Some((actuation, wanted)) = heard {
            let start = clock::now();
            let sensing = served.answer(&actuation, wanted);
            server.publish(&sensing);
            times.add(clock::now() - start);
        }
    }
    ui.result(&Summary {
        name: compiled.ir.name.clone(),
        period_ns: period,
        digest: compiled.ir.digest.clone(),
        ticks: served.ticks,
        controllers: served.sessions,
        p50_ns: times.quantile(0.5),
        p99_ns: times.quantile(0.99),
        max_ns: times.largest(),
    });
    Ok(())
}

/// The machine after its pre-cycle, with the gauges zeroed.
fn prepared(arguments: &Arguments, compiled: &Compilation, ui: &Ui) -> Result<Plant, Failure> {
    let plant = arguments.plant.options();
    ui.progress("preparing the machine: pre-cycle, settling, gauges zeroed");
    Ok(match &compiled.model.task_space {
        Some(task) => Plant::Platform(Box::new(plant.platform(&compiled.model, task)?.1.rig().clone())),
        None => {
            let (leg, noise) = plant.read()?;
            let legs = std::array::from_fn(|_| leg.clone());
            let scenario = machine::legs(&compiled.model, &legs, &noise, plant.seed, NO_TRAJECTORY);
            Plant::Legs(Box::new(scenario.rig().clone()))
        }
    })
}
