//! The dynamic error budget: what each source adds to the error while the machine moves.
//!
//! Every run follows the same path from the same state. The run without noise leaves the hysteresis that model and
//! adaptation do not take up, with creep, the corners of the path and the steps of the drive converter; a run with one
//! source less that run is what the source adds. The drive converter is inside the controller and cannot be left out: its
//! part is shown as that of white noise of LSB/√12 at the amplifiers, which is what a converter that crosses many codes
//! gives.

use host_sim::closed_loop::RunError;
use host_sim::controller::TickController;
use host_sim::plant::{LegParameters, NoiseParameters};
use host_sim::platform::Specimen;
use host_sim::platform::rig::{Noise, Record, RunOptions};
use host_sim::platform::scenario::{PLATFORM_MODES, select as select_platform};
use host_sim::scenario::{LegScenario, MODES, select};
use host_sim::trajectory::{PaperPath, PaperPose, Reading};

use super::chart::{Axis, Chart, Style, Values};
use super::section::{Grid, Section};
use super::spectrum::cumulative;
use crate::machine;
use crate::model::{Model, TaskSpace};
use crate::reproduce;
use crate::reproduce::write::digits;

/// Operating frequency of the path, Hz.
const FREQUENCY: f64 = 1.0;

/// Name of a source, and the noise that is left when it is alone.
fn sources(all: &NoiseParameters, dac_step_v: f64) -> [(&'static str, NoiseParameters); 4] {
    let none = NoiseParameters::NONE;
    [
        ("gauge noise", NoiseParameters { sensor_nm_rms: all.sensor_nm_rms, ..none }),
        ("ADC steps", NoiseParameters { adc_lsb_nm: all.adc_lsb_nm, ..none }),
        ("DAC steps", NoiseParameters { amplifier_mv_rms: dac_step_v * 1e3 / libm::sqrt(12.0), ..none }),
        ("amplifier noise", NoiseParameters { amplifier_mv_rms: all.amplifier_mv_rms, ..none }),
    ]
}

/// One step of the drive converter, V.
fn dac_step(model: &Model) -> f64 {
    let [low, high] = model.dac.range;
    (high - low) / (libm::exp2(f64::from(model.dac.bits)) - 1.0)
}

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
    controller: &mut dyn TickController,
    seed: u64,
) -> Result<Section, RunError> {
    select_platform(controller, PLATFORM_MODES[6].1)?;
    let trajectory = PaperPose { path: PaperPath::Case1, reading: Reading::Corrected, frequency: FREQUENCY };
    let mut run = |noise: &Noise| -> Result<Errors, RunError> {
        let mut scenario = machine::scenario(model, task, specimen, noise, seed);
        scenario.options = RunOptions { record: Record::Samples, ..scenario.options };
        let samples = scenario.run(controller, &trajectory)?.samples;
        let of = |axis: usize| samples.iter().map(|s| s.target[axis] - s.tick.pose[axis]).collect();
        Ok((0..6).map(of).collect())
    };
    let all = Noise::of(specimen);
    let alone = |channels| Noise { channels, ..Noise::NONE };
    let added = each(&sources(&all.channels, dac_step(model)), |channels| run(&alone(channels)))?;
    let together = run(&Noise { force: [0.0; 6], ..all })?;
    let what = "case 1 at 1 Hz, P/F with PCC; the true pose of one machine within tolerances";
    let names = ["x, nm", "y, nm", "z, nm", "θx, nrad", "θy, nrad", "θz, nrad"];
    Ok(section(what, &names, 3, &added, &together, model.timing.period))
}

/// Six legs on the paper's trajectory at 1 Hz with PCC, or what the spec has weights for.
///
/// # Errors
/// As [`LegScenario::run`].
pub fn of_legs(
    model: &Model,
    leg: &LegParameters,
    mode: usize,
    controller: &mut dyn TickController,
    seed: u64,
) -> Result<Section, RunError> {
    let (name, word) = MODES[mode];
    select(controller, word)?;
    let legs = std::array::from_fn(|_| leg.clone());
    let mut interval = 0.0;
    let mut run = |noise: &NoiseParameters| -> Result<Errors, RunError> {
        let scenario = LegScenario::new(&legs, noise, seed, reproduce::legs::SAMPLES);
        let tracking = scenario.run(controller, FREQUENCY)?.tracking;
        interval = tracking.interval;
        let of = |leg: usize| tracking.samples.iter().map(|s| s.target[leg] - s.measured[leg]).collect();
        Ok((0..6).map(of).collect())
    };
    let added = each(&sources(&leg.noise, dac_step(model)), |noise| run(&noise))?;
    let together = run(&leg.noise)?;
    let what = format!("the leg trajectory at 1 Hz, {name}; errors as the gauges read them, their own noise included");
    let names = ["leg 1, nm", "leg 2, nm", "leg 3, nm", "leg 4, nm", "leg 5, nm", "leg 6, nm"];
    Ok(section(&what, &names, 6, &added, &together, interval))
}

/// What is left without noise, first, and what each source adds to it.
fn each(
    sources: &[(&'static str, NoiseParameters)],
    mut run: impl FnMut(NoiseParameters) -> Result<Errors, RunError>,
) -> Result<Vec<Added>, RunError> {
    let quiet = run(NoiseParameters::NONE)?;
    let mut added = Vec::new();
    for (name, noise) in sources {
        let mut errors = run(*noise)?;
        for (one, quiet) in errors.iter_mut().flatten().zip(quiet.iter().flatten()) {
            *one -= quiet;
        }
        added.push(Added { name, errors });
    }
    added.insert(0, Added { name: "hysteresis residual", errors: quiet });
    Ok(added)
}

fn rms(values: &[f64]) -> f64 {
    libm::sqrt(values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64) * 1e9
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
        let style = if one.name == all.name { Style::Dash } else { Style::Line };
        chart = chart.with(one.name, style, Values::plain(&frequencies), Values::scaled(&roots));
    }
    Section::new("error-budget", "Dynamic error budget", "")
        .text("Runs with one source of noise each, less the run without any, on the same path and from the same state. The steps of the drive converter are in the run without noise as well, so the sum counts them twice; their row is white noise of LSB/√12 at the amplifiers. A linear, independent budget would make the last two rows equal.")
        .table(table)
        .charts(vec![chart])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_is_what_it_adds_to_the_run_without_noise() {
        let quiet = 3.0;
        let found =
            each(&[("gauge noise", NoiseParameters { sensor_nm_rms: 2.0, ..NoiseParameters::NONE })], |noise| {
                Ok(vec![vec![quiet + noise.sensor_nm_rms; 4]; 6])
            });
        let found = found.unwrap();
        assert_eq!((found[0].name, found[0].errors[0][0]), ("hysteresis residual", 3.0));
        assert_eq!((found[1].name, found[1].errors[5][3]), ("gauge noise", 2.0));
    }

    #[test]
    fn every_source_is_alone() {
        let all = NoiseParameters { sensor_nm_rms: 1.0, adc_lsb_nm: 2.0, dac_lsb_mv: 0.0, amplifier_mv_rms: 3.0 };
        for (name, noise) in sources(&all, 1e-3) {
            let on =
                [noise.sensor_nm_rms, noise.adc_lsb_nm, noise.amplifier_mv_rms].iter().filter(|v| **v > 0.0).count();
            assert_eq!(on, 1, "{name}");
        }
        let dac = sources(&all, 1e-3)[2].1.amplifier_mv_rms;
        assert!((dac - 1.0 / 12f64.sqrt()).abs() < 1e-12);
    }
}
