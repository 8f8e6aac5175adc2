//! The dynamic error budget: what each source adds to the error while the machine moves.
//!
//! Every run follows the same path from the same state. The run without noise and with a drive converter as fine as there
//! is leaves the hysteresis that model and adaptation do not take up, with creep and the corners of the path; a run with
//! one source less that run is what the source adds. The converter is inside the controller, so the fine one is another
//! controller, emitted from the spec with `dac.bits = 24`: with the coarse one in every run, noise would move the codes
//! and every source would bring the converter's steps with it.

use host_sim::closed_loop::RunError;
use host_sim::controller::TickController;
use host_sim::plant::{LegParameters, NoiseParameters};
use host_sim::platform::Specimen;
use host_sim::platform::rig::{Noise, Record, RunOptions};
use host_sim::platform::scenario::{PLATFORM_MODES, select as select_platform};
use host_sim::scenario::{LegScenario, MODES, select};
use host_sim::trajectory::{PaperPath, PaperPose, Reading};

use specgen_runtime::setpoint::{REFUSED, STALE};

use super::chart::{Axis, Chart, DASHED, LINE, pairs};
use super::section::{Grid, Section};
use super::spectrum::cumulative;
use specgen_language::model::{Model, TaskSpace};
use specgen_studies::machine;
use specgen_studies::reproduce;
use specgen_studies::reproduce::write::digits;

/// Operating frequency of the path, Hz.
const FREQUENCY: f64 = 1.0;

/// Name of a source, and the noise that is left when it is alone.
fn sources(all: &NoiseParameters) -> [(&'static str, NoiseParameters); 3] {
    let none = NoiseParameters::NONE;
    [
        ("gauge noise", NoiseParameters { sensor_nm_rms: all.sensor_nm_rms, ..none }),
        ("ADC steps", NoiseParameters { adc_lsb_nm: all.adc_lsb_nm, ..none }),
        ("amplifier noise", NoiseParameters { amplifier_mv_rms: all.amplifier_mv_rms, ..none }),
    ]
}

/// The emitted controller, and one whose drive converter has the steps of [`FINE_BITS`].
pub struct Pair<'a> {
    /// The controller of the spec.
    pub own: &'a mut dyn TickController,
    /// The controller of the spec with a fine converter.
    pub fine: &'a mut dyn TickController,
}

/// Bits of the fine converter, the most that a spec may have.
pub const FINE_BITS: i64 = 24;

/// Errors by coordinate, then by tick, m and rad.
type Errors = Vec<Vec<f64>>;

/// A source with what it adds.
struct Added {
    name: &'static str,
    errors: Errors,
}

/// A platform on case 1 at 1 Hz, P/F with PCC.
///
/// # Errors
/// As [`host_sim::platform::PlatformScenario::run`].
pub fn of_platform(
    model: &Model,
    task: &TaskSpace,
    specimen: &Specimen,
    controllers: Pair,
    seed: u64,
) -> Result<Section, RunError> {
    let Pair { own, fine } = controllers;
    select_platform(own, PLATFORM_MODES[6].1)?;
    select_platform(fine, PLATFORM_MODES[6].1)?;
    let trajectory = PaperPose { path: PaperPath::Case1, reading: Reading::Corrected, frequency: FREQUENCY };
    let run = |controller: &mut dyn TickController, noise: &Noise| -> Result<Errors, RunError> {
        let mut scenario = machine::scenario(model, task, specimen, noise, seed);
        scenario.options = RunOptions { record: Record::Samples, ..scenario.options };
        let run = scenario.run(controller, &trajectory)?;
        if run.status & (REFUSED | STALE) != 0 {
            return Ok(Errors::new());
        }
        let samples = run.samples;
        let of = |axis: usize| samples.iter().map(|s| s.target[axis] - s.tick.pose[axis]).collect();
        Ok((0..6).map(of).collect())
    };
    let all = Noise::of(specimen);
    let alone = |channels| Noise { channels, ..Noise::NONE };
    let silent = run(own, &Noise::NONE)?;
    if silent.is_empty() {
        return Ok(empty().text("Not made: the controller refuses case 1 at 1 Hz; the path leaves the workspace of the spec, or moves faster than its control.setpoint.stream_speed."));
    }
    let added = each(&sources(&all.channels), silent, |channels| run(fine, &alone(channels)))?;
    let together = run(own, &Noise { force: [0.0; 6], ..all })?;
    let what = "case 1 at 1 Hz, P/F with PCC; the true pose of one machine within tolerances";
    let names = ["x, nm", "y, nm", "z, nm", "θx, nrad", "θy, nrad", "θz, nrad"];
    Ok(section(what, &names, 3, &added, &together, model.timing.period))
}

/// Six legs on the paper's trajectory at 1 Hz with PCC, or what the spec has weights for.
///
/// # Errors
/// As [`LegScenario::run`].
pub fn of_legs(leg: &LegParameters, mode: usize, controllers: Pair, seed: u64) -> Result<Section, RunError> {
    let Pair { own, fine } = controllers;
    let (name, word) = MODES[mode];
    select(own, word)?;
    select(fine, word)?;
    let legs = std::array::from_fn(|_| leg.clone());
    let mut interval = 0.0;
    let mut run = |controller: &mut dyn TickController, noise: &NoiseParameters| -> Result<Errors, RunError> {
        let scenario = LegScenario::new(&legs, noise, seed, reproduce::legs::SAMPLES);
        let tracking = scenario.run(controller, FREQUENCY)?.tracking;
        interval = tracking.interval;
        let of = |leg: usize| tracking.samples.iter().map(|s| s.target[leg] - s.measured[leg]).collect();
        Ok((0..6).map(of).collect())
    };
    let silent = run(own, &NoiseParameters::NONE)?;
    let added = each(&sources(&leg.noise), silent, |noise| run(fine, &noise))?;
    let together = run(own, &leg.noise)?;
    let what = format!("the leg trajectory at 1 Hz, {name}; errors as the gauges read them, their own noise included");
    let names = ["leg 1, nm", "leg 2, nm", "leg 3, nm", "leg 4, nm", "leg 5, nm", "leg 6, nm"];
    Ok(section(&what, &names, 6, &added, &together, interval))
}

/// What is left without noise, first, and what each source adds to it; last what the drive converter adds, from the run
/// `silent` without noise with the converter of the spec.
fn each(
    sources: &[(&'static str, NoiseParameters)],
    silent: Errors,
    mut run: impl FnMut(NoiseParameters) -> Result<Errors, RunError>,
) -> Result<Vec<Added>, RunError> {
    let quiet = run(NoiseParameters::NONE)?;
    let mut added = Vec::new();
    let mut add = |name, mut errors: Errors| {
        for (one, quiet) in errors.iter_mut().flatten().zip(quiet.iter().flatten()) {
            *one -= quiet;
        }
        added.push(Added { name, errors });
    };
    for (name, noise) in sources {
        add(*name, run(*noise)?);
    }
    add("DAC steps", silent);
    added.insert(0, Added { name: "hysteresis residual", errors: quiet });
    Ok(added)
}

fn rms(values: &[f64]) -> f64 {
    libm::sqrt(values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64) * 1e9
}

fn empty() -> Section {
    Section::new("error-budget", "Dynamic error budget", "")
}

/// Table by coordinate, and the cumulative spectrum of the first `translations` coordinates together.
fn section(
    what: &str,
    names: &[&str; 6],
    translations: usize,
    added: &[Added],
    together: &Errors,
    interval: f64,
) -> Section {
    let mut head = vec!["source, rms"];
    head.extend(names);
    let mut table = Grid::new(&format!("Error budget: {what}"), &head);
    let row = |name: &str, values: Vec<f64>| {
        let mut row = vec![name.to_owned()];
        row.extend(values.into_iter().map(digits));
        row
    };
    let mut squares = [0.0; 6];
    for one in added {
        let values: Vec<f64> = one.errors.iter().map(|errors| rms(errors)).collect();
        for (sum, value) in squares.iter_mut().zip(&values) {
            *sum += value * value;
        }
        table.push(row(one.name, values));
    }
    table.push(row("root of the sum of squares", squares.map(libm::sqrt).to_vec()));
    table.push(row("simulated, all together", together.iter().map(|errors| rms(errors)).collect()));
    let mut chart = Chart::new(
        "budget",
        &format!("Cumulative spectrum of {} together", if translations == 3 { "x, y and z" } else { "six legs" }),
        Axis::log("up to frequency", "Hz"),
        Axis::linear("error", "nm rms"),
    );
    let all = Added { name: "all together", errors: together.clone() };
    for one in added.iter().chain([&all]) {
        let signals: Vec<&[f64]> = one.errors[..translations].iter().map(Vec::as_slice).collect();
        let (frequencies, roots) = cumulative(&signals, interval);
        let roots: Vec<f64> = roots.iter().map(|root| root * 1e9).collect();
        let style = if one.name == all.name { DASHED } else { LINE };
        chart = chart.with(one.name, style, pairs(&frequencies, &roots));
    }
    empty()
        .text("Runs with one source each, less the run without any, on the same path and from the same state. The hysteresis residual is what is left without noise and with a drive converter of 24 bits: hysteresis and creep that model and adaptation do not take up, and the corners of the path. Linear and independent sources would make the last two rows equal.")
        .table(table)
        .charts(vec![chart])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_is_what_it_adds_to_the_run_without_noise() {
        let quiet = 3.0;
        let sources = [("gauge noise", NoiseParameters { sensor_nm_rms: 2.0, ..NoiseParameters::NONE })];
        let found = each(&sources, vec![vec![3.5; 4]; 6], |noise: NoiseParameters| {
            Ok(vec![vec![quiet + noise.sensor_nm_rms; 4]; 6])
        });
        let found = found.unwrap();
        assert_eq!((found[0].name, found[0].errors[0][0]), ("hysteresis residual", 3.0));
        assert_eq!((found[1].name, found[1].errors[5][3]), ("gauge noise", 2.0));
        assert_eq!((found[2].name, found[2].errors[0][1]), ("DAC steps", 0.5));
    }

    #[test]
    fn every_source_is_alone() {
        let all = NoiseParameters { sensor_nm_rms: 1.0, adc_lsb_nm: 2.0, dac_lsb_mv: 0.0, amplifier_mv_rms: 3.0 };
        for (name, noise) in sources(&all) {
            let on =
                [noise.sensor_nm_rms, noise.adc_lsb_nm, noise.amplifier_mv_rms].iter().filter(|v| **v > 0.0).count();
            assert_eq!(on, 1, "{name}");
        }
    }
}
