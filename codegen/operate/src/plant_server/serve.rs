//! Serves a simulated machine to a controller on this computer.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use host_sim::machine::Machine;
use serde::Serialize;
use specgen_compiler::compile::Compilation;
use specgen_language::interrupt;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::ui::Ui;
use specgen_rt::clock::{self, SECOND};
use specgen_rt::exchange::{OpenError, Server};
use specgen_rt::histogram::{Histogram, known_text, time_text};
use specgen_rt::scheduling;
use specgen_runtime::supervisor::Finding;

use super::PlantServer;

/// Timeout of a wait for a controller, after which it checks whether to end, ns.
const TIMEOUT: u64 = SECOND / 10;

/// Options of a server.
#[derive(Debug)]
pub struct Options<'a> {
    /// Name of the machine for controllers.
    pub name: &'a str,
    /// Wiring faults, one for each time that the amplifiers are switched on.
    pub faults: Vec<Finding>,
    /// Processor to run on.
    pub processor: Option<usize>,
    /// SCHED_FIFO priority.
    pub priority: Option<u8>,
    /// Time after which it ends, s.
    pub seconds: Option<f64>,
}

/// Counts of a server, and the times of a tick.
#[derive(Serialize)]
pub struct Summary {
    #[serde(skip)]
    name: String,
    #[serde(skip)]
    period_ns: u64,
    digest: String,
    ticks: u64,
    controllers: u64,
    /// None without ticks, as below.
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

/// Serves the machine of a spec at `path` in shared memory until Ctrl-C or the end of its time.
///
/// # Errors
/// The file is already in use, the system refuses the processor or the priority, or the shared memory is damaged.
pub fn serve(
    plant: Machine,
    compiled: &Compilation,
    path: &Path,
    options: Options<'_>,
    ui: &Ui,
) -> Result<Summary, Failure> {
    let Options { name, faults, processor, priority, seconds } = options;
    let mut served = PlantServer::new(plant, &compiled.model, &compiled.ir).with_faults(faults);
    let environment = |error: &dyn std::fmt::Display| Failure::Environment(error.to_string());
    processor.map_or(Ok(()), scheduling::pin).map_err(|error| environment(&error))?;
    priority.map_or(Ok(()), scheduling::set_fifo).map_err(|error| environment(&error))?;
    // An interrupt must still remove the file and show the summary.
    let stop = interrupt::heed();
    let server = Server::create(path, &compiled.ir.digest).map_err(|error| match error {
        OpenError::Served { .. } => Failure::Usage(error.to_string()),
        error => environment(&error),
    })?;
    let machine = &compiled.ir.name;
    ui.progress(&format!("machine of {machine} at {}: start rt-pc --sim {name}; Ctrl-C ends it", path.display()));

    // With a spare processor it does not sleep between ticks, because waking it delays the controller. Under SCHED_FIFO it must
    // sleep, or the kernel stops it for 50 ms in every second.
    let period = (compiled.model.timing.period * 1e9) as u64;
    let spare = std::thread::available_parallelism().map_or(1, usize::from) > 1;
    let look = if spare && priority.is_none() { 2 * period } else { 0 };
    let end = seconds.map(|seconds| clock::now() + (seconds * SECOND as f64) as u64);
    let times = answer(&mut served, &server, look, || is_over(stop, end)).ok_or_else(|| {
        Failure::Environment(format!(
            "{}: the memory shared by machine and controller is damaged: its file was truncated or overwritten; restart both",
            path.display()
        ))
    })?;
    Ok(Summary {
        name: machine.clone(),
        period_ns: period,
        digest: compiled.ir.digest.clone(),
        ticks: served.ticks,
        controllers: served.sessions,
        p50_ns: times.quantile(0.5),
        p99_ns: times.quantile(0.99),
        max_ns: times.largest(),
    })
}

fn is_over(stop: &AtomicBool, end: Option<u64>) -> bool {
    stop.load(Ordering::Relaxed) || end.is_some_and(|end| clock::now() >= end)
}

/// Answers controllers until `is_over`, and returns the times of the ticks; none if the shared memory is damaged.
fn answer(served: &mut PlantServer, server: &Server, look: u64, is_over: impl Fn() -> bool) -> Option<Histogram> {
    let (mut times, mut seen) = (Histogram::new(), 0);
    while !is_over() {
        let request = server.wait(&mut seen, look, TIMEOUT);
        if server.is_lost() {
            return None;
        }
        if let Some((actuation, wanted)) = request {
            let start = clock::now();
            let sensing = served.answer(&actuation, wanted);
            server.publish(&sensing);
            times.add(clock::now() - start);
        }
    }
    Some(times)
}
