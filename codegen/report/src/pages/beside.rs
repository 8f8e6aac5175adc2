//! Replays the commands of a record with a simulated machine instead of the recorded one.

use crate::record::Sample;
use host_sim::controller::Supervised;
use host_sim::machine::Machine;
use host_sim::plant::LegParameters;
use host_sim::platform::rig::Noise;
use host_sim::record::Block;
use specgen_compiler::compile::Compilation;
use specgen_language::model::Model;
use specgen_runtime::record::Reason;
use specgen_runtime::supervisor::MISSED_TICK;

use super::SEED;
use super::words::Words;
use specgen_studies::machine;

/// Time to bring a machine to the state where a record continues, and for the resulting oscillation to decay, s.
const SETTLE: f64 = 0.2;
/// Number of steps to that state.
const STEPS: u32 = 50;
/// Number of bisections for a peak: to 6 mV of 100 V.
const HALVINGS: u32 = 14;

/// The simulated machine of a spec, prepared.
fn prepared(model: &Model) -> Machine {
    let leg = LegParameters::reference();
    match &model.task_space {
        Some(task) => {
            let specimen = machine::specimen(model, task, &leg, Some(SEED));
            let scenario = machine::scenario(model, task, &specimen, &Noise::of(&specimen), SEED);
            Machine::Platform(Box::new(scenario.rig().clone()))
        }
        None => {
            let leg = machine::leg(model, &leg);
            let legs = std::array::from_fn(|_| leg.clone());
            Machine::Legs(Box::new(machine::legs(model, &legs, &leg.noise, SEED, 1).rig().clone()))
        }
    }
}

/// A machine at rest, led to the voltages of a tick, where the gauges read `reading`. A leg goes there through a peak that
/// makes its gauge read so; which one it was, nobody knows. Each gauge of a platform sees all legs, which go there straight.
fn moved_to(machine: &Machine, model: &Model, voltages: &[f64; 6], reading: &[f64; 6]) -> Machine {
    let rest = [model.rest_voltage(); 6];
    let through = |peaks: &[f64; 6]| {
        let mut machine = machine.clone();
        for (from, to) in [(&rest, peaks), (peaks, voltages), (voltages, voltages)] {
            for step in 1..=STEPS {
                let share = f64::from(step) / f64::from(STEPS);
                let between = std::array::from_fn(|leg| from[leg] + share * (to[leg] - from[leg]));
                machine.hold(&between, SETTLE / f64::from(STEPS));
            }
        }
        machine
    };
    let mut low = *voltages;
    if matches!(machine, Machine::Legs(_)) {
        let mut high = [model.actuator.voltage[1]; 6];
        for _ in 0..HALVINGS {
            let middle: [f64; 6] = std::array::from_fn(|leg| 0.5 * (low[leg] + high[leg]));
            let found = through(&middle).read_gauges();
            for leg in 0..6 {
                // The higher the peak, the longer the leg after it.
                if found[leg] < reading[leg] {
                    low[leg] = middle[leg];
                } else {
                    high[leg] = middle[leg];
                }
            }
        }
    }
    through(&low)
}

/// Runs the commands of `blocks` with a simulated machine. `recorded` are the same ticks as recorded; in both, only comparable ticks
/// remain scored: the law is active in both, and the simulated machine has settled.
///
/// At power-up both start in the same state. Where a record starts in the middle of a run, or continues after a gap, the controller starts from
/// the record's snapshot, and the simulated machine is brought to the voltages of the first tick, with its gauges set to the readings
/// of that tick. The history is not in the record, so the offset of the hysteresis, creep and speed are unknown.
///
/// # Errors
/// Why a comparison is impossible.
pub(super) fn simulate(
    controller: &mut Supervised,
    blocks: &[Block],
    words: &Words,
    compiled: &Compilation,
    recorded: &mut [Sample],
) -> Result<Vec<Sample>, String> {
    let period = compiled.model.timing.period;
    let settle = (SETTLE / period) as u64;
    controller.reset();
    let power_up = controller.save();
    let prepared = prepared(&compiled.model);
    let (mut machine, mut offset) = (prepared.clone(), [0.0; 6]);
    let mut output = vec![0; controller.output_names().len()];
    let mut samples: Vec<Sample> = Vec::with_capacity(recorded.len());
    // Expected next tick; first scored tick.
    let (mut next, mut settled) = (None, 0);
    for block in blocks {
        controller.configure(&block.config).map_err(|error| error.to_string())?;
        if next != Some(block.first) || block.reason == Reason::Started {
            controller.load(&block.state).map_err(|_| "a snapshot in the record does not match".to_owned())?;
            (machine, offset) = (prepared.clone(), [0.0; 6]);
            if let (true, Some(first), Some(row)) =
                (block.state != power_up, recorded.get(samples.len()), block.rows.first())
            {
                let reading = words.gauge.map(|place| words.scalar.decode(row.input[place]));
                machine = moved_to(&prepared, &compiled.model, &first.voltage, &reading);
                let found = machine.read_gauges();
                offset = std::array::from_fn(|k| reading[k] - found[k]);
                settled = block.first + settle;
            }
        }
        for row in &block.rows {
            let mut input = row.input.clone();
            for ((place, value), offset) in words.gauge.iter().zip(machine.read_gauges()).zip(offset) {
                input[*place] = words.scalar.encode(value + offset);
            }
            for (place, value) in words.wrench.iter().flatten().zip(machine.read_wrench()) {
                input[*place] = words.scalar.encode(value);
            }
            // A tick that was late on the machine is not late here.
            input[words.events] &= !u64::from(MISSED_TICK);
            let word = controller.step(&input, &mut output);
            let mut sample = words.sample(row.tick, word, &input, &output);
            machine.hold(&sample.voltage, period);
            if let Some(beside) = recorded.get_mut(samples.len()) {
                sample.scored = sample.running && beside.running && row.tick >= settled;
                beside.scored = sample.scored;
            }
            samples.push(sample);
        }
        next = Some(block.first + block.rows.len() as u64);
    }
    if samples.iter().any(|sample| sample.scored) {
        return Ok(samples);
    }
    recorded.iter_mut().for_each(|sample| sample.scored = sample.running);
    Err(if recorded.iter().any(|sample| sample.running) {
        format!(
            "the record does not start at power-up and has no continuous {SETTLE} s, which the simulated machine needs to settle"
        )
    } else {
        "the law was never active".to_owned()
    })
}
