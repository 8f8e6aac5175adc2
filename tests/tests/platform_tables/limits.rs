//! Limits of stability: predicted from the linear platform, found on the nonlinear one with the emitted controller.

use host_sim::controller::{Controller, TickController};
use host_sim::platform::rig::{Noise, Record, RunOptions};
use host_sim::platform::{PlatformScenario, Specimen};
use host_sim::trajectory::{PoseTarget, PoseTrajectory};
use specgen::lower::platform;
use specgen::stability::platform::{ClosedLoop, Conditions, RestDynamics, Tuning};

use specgen_runtime::{ControlMode, Law};
use specgen_tests::{length, worse};

use super::bench::{BIAS, Bench, PERIOD, SEED, in_parallel, median, plants, random_machines, reference_machine};

/// A small step of the demand on every axis, then rest.
struct Nudge;

impl PoseTrajectory for Nudge {
    fn duration(&self) -> f64 {
        1.0
    }
    fn target(&self, time: f64) -> PoseTarget {
        let pose = if time > 0.01 { [2e-7, 2e-7, 2e-7, 2e-6, 2e-6, 2e-6] } else { [0.0; 6] };
        PoseTarget { pose, ..PoseTarget::default() }
    }
}

/// Where the words of a tuning stand.
struct Setting<'a> {
    mode: u32,
    tuning: &'a Tuning,
    position: &'a Tuning,
    latency: usize,
}

fn configure(controller: &mut Controller, setting: &Setting) {
    let description = controller.description().clone();
    let mut words = controller.default_config();
    let mut set = |name: &str, value: f64| description.set_config(&mut words, name, value).expect("a setting");
    set("mode", f64::from(setting.mode));
    set("level_weight", setting.tuning.level_bandwidth * PERIOD);
    set("drift_weight", setting.tuning.drift_bandwidth * PERIOD);
    for (prefix, tuning) in [("", setting.tuning), ("position_", setting.position)] {
        for axis in 0..6 {
            set(&format!("{prefix}kp[{axis}]"), tuning.proportional[axis]);
            set(&format!("{prefix}ki[{axis}]"), tuning.integral[axis]);
            set(&format!("{prefix}kv[{axis}]"), tuning.derivative[axis]);
        }
    }
    controller.configure(&words).expect("a permitted setting");
}

/// Whether the machine settles after a nudge.
fn settles(specimen: &Specimen, controller: &mut Controller, setting: &Setting) -> bool {
    configure(controller, setting);
    let mut options = RunOptions::new(PERIOD, BIAS);
    options.latency = setting.latency;
    options.record = Record::Samples;
    let scenario = PlatformScenario::new(specimen, &Noise::NONE, SEED, options);
    let run = scenario.run(controller, &Nudge).expect("a run");
    let geometry = specimen.nominal.geometry();
    // Deviation of the leg lengths from their mean, over tenths of the run.
    let rms = |tenth: usize| {
        let count = run.samples.len() / 10;
        let legs: Vec<[f64; 6]> =
            run.samples[tenth * count..][..count].iter().map(|sample| geometry.extensions(&sample.tick.pose)).collect();
        let mean: [f64; 6] = std::array::from_fn(|k| legs.iter().map(|l| l[k]).sum::<f64>() / count as f64);
        let square = |l: &[f64; 6]| (0..6).map(|k| (l[k] - mean[k]) * (l[k] - mean[k])).sum::<f64>();
        (legs.iter().map(square).sum::<f64>() / count as f64).sqrt()
    };
    // Converter steps keep a stable loop humming at some nanometres.
    rms(9) < 20e-9 || rms(9) < 0.5 * rms(2)
}

/// The largest factor at which `holds`, from 1 on, to 0.5 %; `holds` at 1.
fn largest(holds: impl Fn(f64) -> bool, highest: f64) -> f64 {
    let (mut low, mut high) = (1.0, 1.0);
    loop {
        high *= 1.1;
        if high > highest || !holds(high) {
            break;
        }
        low = high;
    }
    while high / low > 1.005 {
        let middle = (low * high).sqrt();
        if holds(middle) { low = middle } else { high = middle }
    }
    (low * high).sqrt()
}

pub fn closed_loop(bench: &Bench) -> ClosedLoop {
    let model = &bench.emitted.compiled.model;
    let rest = RestDynamics::of(&platform(model).expect("it compiled"));
    bench.design().closed_loop(model, model.task_space.as_ref().expect("[control]"), &rest).expect("it has modes")
}

/// Predicted and simulated factors on a tuning at which a law becomes unstable.
fn limit(bench: &Bench, (mode, law): (u32, ControlMode), tuning: &Tuning, latency: usize) -> [f64; 2] {
    let design = bench.design();
    let closed_loop = closed_loop(bench);
    let conditions = Conditions { delay: latency as f64, ..Conditions::NOMINAL };
    let stable = |factor: f64| closed_loop.spectral_radius(law, &tuning.scaled(factor, factor), &conditions) < 1.0;
    // A weight is at most 1.
    let highest = 0.99 / (tuning.level_bandwidth * PERIOD);
    let predicted = largest(stable, highest);
    let mut controller = bench.controller();
    let holds = |controller: &mut Controller, factor: f64| {
        let tuning = tuning.scaled(factor, factor);
        settles(&bench.specimen, controller, &Setting { mode, tuning: &tuning, position: &design.position, latency })
    };
    let (mut low, mut high) = (0.7 * predicted, (1.4 * predicted).min(highest));
    assert!(holds(&mut controller, low), "unstable at 0.7 of the predicted limit {predicted}");
    while high / low > 1.01 {
        let middle = (low * high).sqrt();
        if holds(&mut controller, middle) { low = middle } else { high = middle }
    }
    [predicted, (low * high).sqrt()]
}

const EWMA: (u32, ControlMode) = (2, ControlMode::F(Law::Ewma));
const PCC: (u32, ControlMode) = (3, ControlMode::F(Law::Pcc));
const COMBINED: (u32, ControlMode) = (6, ControlMode::PF(Law::Pcc));

#[test]
fn predicted_limits_are_those_of_the_machine() {
    let cases = [
        ("weights, F ewma", EWMA, 0),
        ("one more tick, P/F pcc", COMBINED, 1),
        ("weights, F pcc", PCC, 0),
        ("weights and gains, P/F pcc", COMBINED, 0),
        ("one more tick, F ewma", EWMA, 1),
    ];
    let cases = &cases[..length(1, cases.len())];
    let found = in_parallel(length(1, 4), |number| {
        let mut rows = Vec::new();
        // In the short run the reference machine, whose records other tests need, too.
        let random = |number: u32| &random_machines()[number as usize];
        let benches = match length(true, false) {
            true => vec![("notch", reference_machine())],
            false => vec![("notch", &random(number).notched), ("no notch", random(number).plain())],
        };
        for (base, bench) in benches {
            for &(what, law, latency) in cases {
                rows.push((what, base, limit(bench, law, &bench.design().combined, latency)));
            }
        }
        rows
    });
    let mut deviations = Vec::new();
    for (number, rows) in found.iter().enumerate() {
        for (what, base, [predicted, simulated]) in rows {
            let deviation = simulated / predicted - 1.0;
            println!(
                "machine {number}, {what}, {base}: {predicted:.3}, simulated {simulated:.3} ({:+.1} %)",
                deviation * 100.0
            );
            deviations.push(deviation.abs());
        }
    }
    let worst = deviations.iter().copied().fold(0.0, worse);
    let typical = median(deviations);
    println!("predicted limits are off by {:.1} % typically, {:.1} % at worst", typical * 100.0, worst * 100.0);
    // One limit alone is not typical.
    assert!(worst <= 0.10 && typical <= length(0.10, 0.05), "{worst} {typical}");
}

/// k_v that damps every mode by 10 %: the diagonal of M V diag(2 ζ_a ω) Vᵀ M.
fn damping(closed_loop: &ClosedLoop) -> [f64; 6] {
    let basis = &closed_loop.basis;
    // Vᵀ M V = I, so that M V = V⁻ᵀ.
    std::array::from_fn(|axis| {
        (0..6).map(|i| basis.to_modal[i][axis] * basis.to_modal[i][axis] * 0.2 * basis.frequencies[i]).sum()
    })
}

#[test]
#[ignore = "long: start rules on random machines"]
fn no_start_rule_is_unstable_on_any_machine() {
    let machines = random_machines();
    let count = length(1, plants());
    let unstable: Vec<String> = in_parallel(count, |number| {
        let pair = &machines[number as usize];
        let (notched, plain) = (&pair.notched, pair.plain());
        let mut damped = notched.design().combined;
        damped.derivative = damping(&closed_loop(notched));
        let bases = [
            ("no notch", plain, plain.design().combined),
            ("notch", notched, notched.design().combined),
            ("notch and k_v", notched, damped),
        ];
        let mut bad = Vec::new();
        for (base, bench, tuning) in bases {
            let mut controller = bench.controller();
            for (mode, law) in [(0, ControlMode::P), PCC, (5, ControlMode::PF(Law::Ewma)), COMBINED] {
                let position = &bench.design().position;
                let setting = Setting { mode, tuning: &tuning, position, latency: 0 };
                if !settles(&bench.specimen, &mut controller, &setting) {
                    bad.push(format!("machine {number}, {base}, {law}"));
                }
            }
        }
        bad
    })
    .concat();
    println!("unstable of {} machines and bases: {unstable:?}", 3 * count);
    assert!(unstable.is_empty());
}

/// The criterion can fail: well above the predicted limit a loop does not settle.
#[test]
#[ignore = "long: a loop above its limit, simulated"]
fn a_loop_beyond_its_limit_does_not_settle() {
    let bench = &random_machines()[0].notched;
    let design = bench.design();
    let limit = design.bandwidth_limit / design.combined.level_bandwidth;
    let mut controller = bench.controller();
    for (factor, expected) in [(0.8, true), (1.2, false)] {
        let tuning = design.combined.scaled(1.0, factor * limit);
        let setting = Setting { mode: 2, tuning: &tuning, position: &design.position, latency: 0 };
        assert_eq!(settles(&bench.specimen, &mut controller, &setting), expected, "at {factor} of the limit");
    }
}
