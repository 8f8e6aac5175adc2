//! Figures of the platform plant with the reference controller, beside those of the feasibility study and the paper.
//!
//! `cargo run --release -p oracle --example platform_figures [free] [machining] [limits] [windup] [random]`
#![allow(clippy::expect_used)]

use std::time::Instant;

use host_sim::plant::LegParameters;
use host_sim::platform::rig::{Noise, PoseSample, Record, RunOptions};
use host_sim::platform::scenario::{FREE_MODES, MACHINING_MODES, NamedTrajectory, PLATFORM_MODES, select};
use host_sim::platform::{PlatformRig, PlatformScenario, Specimen, WorkPart};
use host_sim::trajectory::{PaperPath, PaperPose, PoseTarget, PoseTrajectory};
use oracle::design::{Deviation, Gains, Rule};
use oracle::{PlatformOracle, Settings};

const PERIOD: f64 = 1e-4;
const PARTS: [(&str, WorkPart); 2] = [("glass", WorkPart::glass()), ("aluminium", WorkPart::aluminium())];

fn scenario(specimen: &Specimen, settings: &Settings) -> PlatformScenario {
    PlatformScenario::new(specimen, &Noise::of(specimen), 1, RunOptions::new(settings.plant.period, settings.bias))
}

fn oracle(settings: &Settings) -> PlatformOracle {
    PlatformOracle::new(settings).expect("the reference geometry is regular")
}

/// Tables 5 to 8.
fn free(specimen: &Specimen) {
    let settings = Settings::base_n(specimen);
    let scenario = scenario(specimen, &settings);
    let mut controller = oracle(&settings);
    let runs: Vec<(&str, f64, PaperPose)> = [("case-1", PaperPath::Case1), ("case-2", PaperPath::Case2)]
        .into_iter()
        .flat_map(|(name, path)| [0.1, 1.0, 10.0].map(|f| (name, f, PaperPose::corrected(path, f))))
        .collect();
    let named: Vec<NamedTrajectory> = runs
        .iter()
        .map(|(name, frequency, trajectory)| NamedTrajectory { name, frequency: *frequency, trajectory })
        .collect();
    let table = scenario.free_motion(&mut controller, &FREE_MODES, &named).expect("a run");
    println!("{}", table.to_text());
    println!("study, case 1, base N, x/y/z nm, θx nrad at 0.1 | 1 | 10 Hz:");
    println!("  pf-invhys 1.4/1.4/.5, 11 | 4.2/4.7/1.4, 26 | 67/71/21, 169");
    println!("  pf-ewma   1.6/1.5/.5, 12 | 1.9/1.9/.7, 15 | 14.2/22.0/4.7, 130");
    println!("  pf-pcc    1.6/1.5/.5, 12 | 2.0/1.9/.7, 15 | 14.0/22.0/4.7, 132");
    for mode in [PLATFORM_MODES[0], PLATFORM_MODES[2], PLATFORM_MODES[3]] {
        let one = scenario.free_motion(&mut controller, &[mode], &named[1..3]).expect("a run");
        print!("{}", one.to_text());
    }
}

/// Table 9.
fn machining(specimen: &Specimen) {
    let settings = Settings::base_n(specimen);
    let scenario = scenario(specimen, &settings);
    let mut controller = oracle(&settings);
    let modes = [MACHINING_MODES[0], PLATFORM_MODES[3], MACHINING_MODES[1]];
    let table = scenario
        .machining(&mut controller, &modes, &PARTS, &PaperPose::corrected(PaperPath::Machining, 1.0))
        .expect("a run");
    println!("{}", table.to_text());
    println!("study, base N, no K_e: P 15.0 nm 74 nrad, F 4.9/26, P/F 2.3/21; aluminium 11.9/73, 3.1/22, 2.3/21\n");
}

/// A small step of the demand, then rest.
struct Nudge;

impl PoseTrajectory for Nudge {
    fn duration(&self) -> f64 {
        1.0
    }
    fn target(&self, time: f64) -> PoseTarget {
        let x = if time > 0.01 { 0.2e-6 } else { 0.0 };
        PoseTarget { pose: [x, x, x, 2e-6, 2e-6, 2e-6].map(|v| if x > 0.0 { v } else { 0.0 }), ..PoseTarget::default() }
    }
}

/// z rises steadily: every leg's plays move one way, so that small motion on top sees one constant gain.
struct Climb;

impl PoseTrajectory for Climb {
    fn duration(&self) -> f64 {
        0.6
    }
    fn target(&self, time: f64) -> PoseTarget {
        PoseTarget {
            pose: [0.0, 0.0, 60e-6 * time, 0.0, 0.0, 0.0],
            rate: [0.0, 0.0, 60e-6, 0.0, 0.0, 0.0],
            ..PoseTarget::default()
        }
    }
}

/// A run without noise, `delay` ticks late, with every sample.
fn samples(
    specimen: &Specimen,
    settings: &Settings,
    mode: u32,
    delay: usize,
    trajectory: &dyn PoseTrajectory,
) -> Vec<PoseSample> {
    let mut options = RunOptions::new(settings.plant.period, settings.bias);
    options.latency = delay;
    options.record = Record::Samples;
    let mut controller = oracle(settings);
    select(&mut controller, mode).expect("a mode");
    let scenario = PlatformScenario::new(specimen, &Noise::NONE, 1, options);
    scenario.run(&mut controller, trajectory).expect("a run").samples
}

/// The largest number between two, to 1 %, that is `good`.
fn largest(mut low: f64, mut high: f64, good: impl Fn(f64) -> bool) -> f64 {
    while high / low > 1.01 {
        let middle = (low * high).sqrt();
        if good(middle) { low = middle } else { high = middle }
    }
    (low * high).sqrt()
}

/// P alone while climbing: largest factor on its gains without ringing, and λ, the legs' slope over ρ̂, seen there.
fn simulated_position_limit(specimen: &Specimen, settings: &Settings, delay: usize, linear: f64) -> (f64, f64) {
    let run = |factor: f64| {
        let scaled = Settings { position: settings.position.scaled(factor), ..settings.clone() };
        samples(specimen, &scaled, PLATFORM_MODES[0].1, delay, &Climb)
    };
    let legs = |pose: &[f64; 6]| specimen.nominal.geometry().extensions(pose);
    // Second differences over ten ticks see ringing and not the climb.
    let ringing = |samples: &[PoseSample]| {
        let late = &samples[samples.len() * 8 / 10..];
        let mut sum = 0.0;
        for window in late.windows(21) {
            let [a, b, c] = [0, 10, 20].map(|n| legs(&window[n].tick.pose));
            for leg in 0..6 {
                let bend = a[leg] - 2.0 * b[leg] + c[leg];
                sum += bend * bend;
            }
        }
        (sum / (6 * late.len()) as f64).sqrt()
    };
    let calm = run(0.4 * linear);
    let quiet = ringing(&calm);
    let limit = largest(0.4 * linear, 2.5 * linear, |factor| ringing(&run(factor)) < 3.0 * quiet + 2e-9);
    let (from, to) = (&calm[calm.len() / 2], &calm[calm.len() - 1]);
    let (a, b) = (legs(&from.tick.pose), legs(&to.tick.pose));
    let slopes = (0..6).map(|leg| (b[leg] - a[leg]) / (to.tick.voltage[leg] - from.tick.voltage[leg]));
    (limit, slopes.sum::<f64>() / 6.0 / settings.drive.gain)
}

/// Largest factor on the gains at which the simulated platform settles.
fn simulated_limit(specimen: &Specimen, settings: &Settings, mode: u32, delay: usize, linear: f64) -> f64 {
    let settles = |factor: f64| {
        let scaled = Settings {
            combined: settings.combined.scaled(factor),
            position: settings.position.scaled(factor),
            ..settings.clone()
        };
        let samples = samples(specimen, &scaled, mode, delay, &Nudge);
        // Growth of the error's rms from the third to the last tenth of the run.
        let rms = |from: usize, to: usize| {
            let part = &samples[from * samples.len() / 10..to * samples.len() / 10];
            let legs = |pose: &[f64; 6]| specimen.nominal.geometry().extensions(pose);
            let mean: Vec<f64> =
                (0..6).map(|k| part.iter().map(|s| legs(&s.tick.pose)[k]).sum::<f64>() / part.len() as f64).collect();
            let sum: f64 = part
                .iter()
                .map(|s| legs(&s.tick.pose).iter().zip(&mean).map(|(a, b)| (a - b) * (a - b)).sum::<f64>())
                .sum();
            (sum / part.len() as f64).sqrt()
        };
        // Converter steps keep a stable loop humming at some nanometres.
        rms(9, 10) < 20e-9 || rms(9, 10) < 0.5 * rms(2, 3)
    };
    largest(0.7 * linear, 1.4 * linear, settles)
}

/// Predicted against simulated limits of P alone. Its gain is that of the legs themselves: while plays stand it is half of
/// what it is while they move, so its limit depends on the motion.
fn positions(specimen: &Specimen) {
    let settings = Settings::base_n(specimen);
    let rule = Rule::of(&specimen.nominal, LegParameters::reference().tau_amp_s, PERIOD, Some(1.0));
    for delay in [0, 1] {
        let nominal = rule.margin(settings.position, Deviation { delay, ..Deviation::NONE });
        let (simulated, gain) = simulated_position_limit(specimen, &settings, delay, nominal);
        let linear = rule.margin(settings.position, Deviation { delay, gain, ..Deviation::NONE });
        println!(
            "  P base N climbing, {delay} extra ticks: {nominal:.2} at λ 1, {linear:.2} at its λ {gain:.2}, {simulated:.2} ({:+.1} %)",
            100.0 * (simulated / linear - 1.0)
        );
    }
}

/// Predicted against simulated limits.
fn limits(specimen: &Specimen) {
    positions(specimen);
    println!("largest factor on all gains: linear, simulated");
    for (rate, notch) in
        [(1e3, None), (2e3, None), (10e3, None), (10e3, Some(1.0)), (5e3, Some(1.0)), (20e3, Some(1.0))]
    {
        let period = 1.0 / rate;
        let rule = Rule::of(&specimen.nominal, LegParameters::reference().tau_amp_s, period, notch);
        let alone = Gains { proportional: 0.0, integral: 0.0, level: 100.0, drift: 0.0 };
        let settings = Settings { combined: alone, ..Settings::of(specimen, period, notch) };
        let linear = rule.margin(alone, Deviation::NONE);
        let simulated = simulated_limit(specimen, &settings, 2, 0, linear);
        let weights = [linear, simulated].map(|factor| factor * 100.0 * period);
        println!(
            "  F+EWMA {rate} Hz, notch {notch:?}: ω1 {:.4}, {:.4} ({:+.1} %)",
            weights[0],
            weights[1],
            100.0 * (simulated / linear - 1.0)
        );
    }
    for delay in [0, 1] {
        let rule = Rule::of(&specimen.nominal, LegParameters::reference().tau_amp_s, PERIOD, Some(1.0));
        let settings = Settings::base_n(specimen);
        let linear = rule.margin(settings.combined, Deviation { delay, ..Deviation::NONE });
        let simulated = simulated_limit(specimen, &settings, 6, delay, linear);
        println!(
            "  P/F+PCC base N, {delay} extra ticks: {linear:.2}, {simulated:.2} ({:+.1} %)",
            100.0 * (simulated / linear - 1.0)
        );
    }
    println!();
}

/// z out of reach for 0.3 s.
struct OverRange;

impl OverRange {
    const BACK: f64 = 0.5;
}

impl PoseTrajectory for OverRange {
    fn duration(&self) -> f64 {
        1.5
    }
    fn target(&self, time: f64) -> PoseTarget {
        let z = if time > 0.2 && time <= Self::BACK { 80e-6 } else { 0.0 };
        PoseTarget { pose: [0.0, 0.0, z, 0.0, 0.0, 0.0], ..PoseTarget::default() }
    }
}

/// Recovery from an over-range demand.
fn windup(specimen: &Specimen) {
    for (name, mode) in [PLATFORM_MODES[0], PLATFORM_MODES[6]] {
        let settings = Settings::base_n(specimen);
        let mut scenario = scenario(specimen, &settings);
        scenario.options.record = Record::Samples;
        let mut controller = oracle(&settings);
        select(&mut controller, mode).expect("a mode");
        let run = scenario.run(&mut controller, &OverRange).expect("a run");
        let late = run
            .samples
            .iter()
            .filter(|s| s.time > OverRange::BACK && (0..3).any(|k| (s.tick.pose[k] - s.target[k]).abs() > 0.1e-6))
            .map(|s| s.time - OverRange::BACK)
            .fold(0.0, f64::max);
        let limited = run.status & 0x3f;
        println!("over-range z, {name}: below 0.1 µm after {:.1} ms; legs limited {limited:#x}", late * 1e3);
    }
    println!();
}

/// Table 9 and case 1 over random machines, gains by the rule.
fn random(count: u32) {
    println!("random machines: P nm nrad, P/F nm nrad, ratios; case 1 at 10 Hz: Invhys, EWMA, PCC nm");
    for number in 0..count {
        let specimen = Specimen::random(1, number);
        let settings = Settings::of(&specimen, PERIOD, Some(1.0));
        let scenario = scenario(&specimen, &settings);
        let mut controller = oracle(&settings);
        print!("  k {:.2e} ζ {:.3}", specimen.nominal.axial_stiffness_n_per_m, specimen.nominal.modal_damping);
        let table = scenario
            .machining(&mut controller, &MACHINING_MODES, &PARTS, &PaperPose::corrected(PaperPath::Machining, 1.0))
            .expect("a run");
        for (part, _) in PARTS {
            let (p, pf) = (table.row(part, "p").expect("made"), table.row(part, "pf-pcc").expect("made"));
            let ratio = table.ratio(part, "p", "pf-pcc").expect("made");
            print!(
                " | {:.1} {:.0}, {:.2} {:.0}: {:.1} {:.1}",
                p.translation_nm, p.orientation_nrad, pf.translation_nm, pf.orientation_nrad, ratio[0], ratio[1]
            );
        }
        let case = PaperPose::corrected(PaperPath::Case1, 10.0);
        let named = [NamedTrajectory { name: "case-1", frequency: 10.0, trajectory: &case }];
        let free = scenario.free_motion(&mut controller, &FREE_MODES, &named).expect("a run");
        let nm: Vec<String> = free.rows.iter().map(|row| format!("{:.1}", row.translation_nm())).collect();
        println!(" | {}", nm.join(" "));
    }
    println!();
}

/// How fast the plant runs.
fn speed(specimen: &Specimen) {
    let mut rig = PlatformRig::new(specimen, &Noise::of(specimen), 1);
    let start = Instant::now();
    let ticks = 200_000;
    for n in 0..ticks {
        let volts = 30.0 + 0.4 * f64::from(n % 100);
        rig.read_gauges();
        rig.read_wrench();
        rig.hold(&[volts; 6], PERIOD);
    }
    let simulated = f64::from(ticks) * PERIOD;
    println!("plant alone: {:.0} × real time at 10 kHz\n", simulated / start.elapsed().as_secs_f64());
}

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let asked = |name: &str| wanted.is_empty() || wanted.iter().any(|w| w == name);
    let specimen = Specimen::reference();
    if asked("speed") {
        speed(&specimen);
    }
    if asked("free") {
        free(&specimen);
    }
    if asked("machining") {
        machining(&specimen);
    }
    if asked("windup") {
        windup(&specimen);
    }
    if wanted.iter().any(|w| w == "positions") {
        positions(&specimen);
    }
    if asked("limits") {
        limits(&specimen);
    }
    if asked("random") {
        random(12);
    }
}
