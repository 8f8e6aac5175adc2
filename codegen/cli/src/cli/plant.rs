//! `specgen plant`: serves the simulated machine of a spec in shared memory to the real-time target on the same computer.

use clap::Args;
use host_sim::machine::Machine;
use specgen_compiler::{lower, spec_file};
use specgen_rt::exchange;

use super::number::number;
use super::path_roles::InputFile;
use super::sim::PlantArguments;
use specgen_compiler::compile::Compilation;
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_operate::plant_server::{Options, serve};
use specgen_runtime::supervisor::Finding;
use specgen_studies::machine;

/// Samples per period of the paper's trajectory; not used here.
const NO_TRAJECTORY: u32 = 1;

/// Arguments of `plant`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::PLANT)]
pub struct Arguments {
    /// The spec file.
    spec: InputFile,
    /// Name under which the controller finds the machine, with `rt-pc --sim NAME`.
    #[arg(long, default_value = "plant")]
    name: String,
    /// Stop after this time, s; run until Ctrl-C if not given.
    #[arg(long, value_name = "S", value_parser = number("", "a time from 0.01 to 10000000 s", 0.01..=1e7), allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Run on this processor; it must not be the controller's.
    #[arg(long, value_name = "N")]
    cpu: Option<usize>,
    /// SCHED_FIFO priority, below the controller's; normal scheduling if not given.
    #[arg(long, value_name = "P", allow_negative_numbers = true, value_parser = clap::value_parser!(u8).range(1..=98))]
    priority: Option<u8>,
    /// A wiring fault, such as "gauge 3 inverted", "leg 1 swapped with leg 4", "leg 2 dead", "gauge 0 gain x 0.50", or "all" for every
    /// single fault. Several faults are applied in turn, a new one each time the amplifiers are switched on.
    #[arg(long, value_name = "FAULT", value_parser = faults)]
    wrong: Vec<Faults>,
    #[command(flatten)]
    plant: PlantArguments,
}

/// Faults of one argument.
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

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let path = exchange::path_of(&arguments.name).map_err(|error| Failure::Usage(format!("--name: {error}")))?;
    let compiled = spec_file::looked_up(&arguments.spec, ui)?;
    let plant = prepared(arguments, &compiled, ui)?;
    let options = Options {
        name: &arguments.name,
        faults: arguments.wrong.iter().flat_map(|faults| faults.0.clone()).collect(),
        processor: arguments.cpu,
        priority: arguments.priority,
        seconds: arguments.seconds,
    };
    ui.result(&serve(plant, &compiled, &path, options, ui)?);
    Ok(())
}

/// The machine after its pre-cycle, with the gauges zeroed.
fn prepared(arguments: &Arguments, compiled: &Compilation, ui: &Ui) -> Result<Machine, Failure> {
    let plant = arguments.plant.options();
    ui.progress("preparing the machine: pre-cycle, settling, gauges zeroed");
    Ok(match &compiled.model.task_space {
        Some(task) => Machine::Platform(Box::new(plant.platform(&compiled.model, task)?.1.rig().clone())),
        None => {
            let (leg, noise) = plant.read()?;
            let legs = std::array::from_fn(|_| leg.clone());
            let scenario = machine::legs(&compiled.model, &legs, &noise, plant.seed, NO_TRAJECTORY);
            Machine::Legs(Box::new(scenario.rig().clone()))
        }
    })
}
