//! Sweeps of simulated machines that are not their spec; the modes they have by the eigenvalues of their own matrices.

use std::path::Path;

use host_sim::closed_loop::Preparation;
use host_sim::plant::LegParameters;
use host_sim::platform::rig::{Noise, PlatformRig};
use host_sim::platform::{Mains, ModePlace, Specimen, StructuralMode};
use nalgebra::{Matrix6, SMatrix, Vector6};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_compiler::compile::compile_source;
use specgen_compiler::lower::{leg_jacobian, poses_per_reading};
use specgen_language::spec::SpecSource;

use super::*;
use crate::machine;

fn reference() -> Compilation {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs/reference.toml");
    compile_source(SpecSource::read(&path).unwrap()).unwrap_or_else(|refusal| panic!("{:?}", refusal.findings))
}

/// Plays with creep, Bouc-Wen, and plays whose width grows with the rate; the last two with logarithmic creep.
fn class(number: u64) -> LegParameters {
    let [plays, bouc_wen] = [LegParameters::reference(), LegParameters::bouc_wen()];
    match number % 3 {
        0 => plays,
        1 => bouc_wen,
        _ => LegParameters {
            kappa: 0.02,
            creep_rates_per_s: bouc_wen.creep_rates_per_s,
            creep_weights: bouc_wen.creep_weights,
            creep_thresholds_v: bouc_wen.creep_thresholds_v,
            ..plays
        },
    }
}

/// A machine that is not its spec, and what is to be found.
struct Machine {
    rig: PlatformRig,
    rest: f64,
    period: f64,
    modes: [[f64; 2]; 6],
    lags: [f64; 6],
    other: StructuralMode,
    /// Readings over the true ones.
    gauges: [f64; 6],
    /// Legs per reading.
    per_reading: Matrix6<f64>,
    /// Ticks by which a wave is late.
    late: usize,
}

/// What has changed in a machine since it was commissioned.
#[derive(Default)]
struct Fault {
    /// Leg, and factor of its gain.
    gain: Option<(usize, f64)>,
    /// Leg, and time added to its lag, s.
    delay: Option<(usize, f64)>,
    /// Factor of the frequencies.
    modes: Option<f64>,
}

impl Machine {
    fn of(compiled: &Compilation, seed: u64) -> Self {
        Self::with(compiled, seed, &Fault::default(), seed)
    }

    /// The machine of a seed after a fault; `noise`: seed of the noise.
    fn with(compiled: &Compilation, seed: u64, fault: &Fault, noise: u64) -> Self {
        let model = &compiled.model;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut within =
            |low: f64, high: f64| low + (high - low) * (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        let leg = machine::leg(model, &class(seed));
        let mut gauges = [1.0; 6];
        let mut specimen = machine::specimen(model, model.task_space.as_ref().unwrap(), &class(seed), None);
        let [stiffness, lag, heavier] = [within(0.85, 1.15), within(0.7, 1.3), within(0.9, 1.1)];
        for k in 0..6 {
            specimen.legs[k].gain_um_per_v *= within(0.85, 1.15);
            specimen.legs[k].tau_amp_s *= lag * within(0.95, 1.05);
            specimen.stiffness[k] *= stiffness * within(0.97, 1.03);
        }
        specimen.nominal.platform_mass_kg *= heavier;
        specimen.nominal.platform_inertia_kg_m2.iter_mut().flatten().for_each(|entry| *entry *= heavier);
        specimen.nominal.modal_damping *= within(0.7, 1.5);
        let other = StructuralMode {
            place: if seed.is_multiple_of(2) { ModePlace::Gauge(Some(3)) } else { ModePlace::Frame },
            frequency_hz: within(900.0, 1_300.0),
            damping_ratio: within(0.01, 0.03),
            participation: Some(if seed.is_multiple_of(2) { 0.2 } else { -0.1 }),
        };
        let imperfections = &mut specimen.nominal.imperfections;
        imperfections.modes = vec![other];
        imperfections.joint_stiffness_share = within(0.0, 0.03);
        imperfections.mains =
            vec![Mains { amplitude_m: 5e-9, frequency_hz: 50.0, gauge: None, phase_rad: within(0.0, 6.0) }];
        imperfections.gauge_drift_m_per_s = [1e-9; 6];
        for gain in &mut gauges {
            *gain = within(0.995, 1.005);
        }
        for probe in &mut specimen.nominal.probes {
            let tilted: [f64; 3] = std::array::from_fn(|k| probe.direction[k] + within(-1e-3, 1e-3));
            let size = tilted.iter().map(|x| x * x).sum::<f64>().sqrt();
            probe.direction = tilted.map(|x| x / size);
        }
        if let Some((leg, factor)) = fault.gain {
            specimen.legs[leg].gain_um_per_v *= factor;
        }
        if let Some((leg, time)) = fault.delay {
            specimen.legs[leg].tau_amp_s += time;
        }
        if let Some(factor) = fault.modes {
            specimen.stiffness.iter_mut().for_each(|stiffness| *stiffness *= factor * factor);
        }
        let of = |rows: [[f64; 6]; 6]| Matrix6::from_fn(|i, j| rows[i][j]);
        let rest = model.rest_voltage() - model.actuator.voltage[0];
        let mut rig = PlatformRig::new(&specimen, &Noise::of(&specimen), noise);
        rig.prepare(&Preparation::of(&leg, rest));
        rig.plant_mut().step_whole_ticks(model.timing.period);
        Self {
            rig,
            rest: model.rest_voltage(),
            period: model.timing.period,
            modes: own_modes(&specimen),
            lags: specimen.legs.each_ref().map(|leg| leg.tau_amp_s),
            other,
            gauges,
            per_reading: of(leg_jacobian(&model.geometry).unwrap()) * of(poses_per_reading(model).unwrap().unwrap()),
            late: noise as usize * 67 % 400,
        }
    }

    /// A tick in which one leg is not at rest, by `volts`: the readings at its start.
    fn tick(&mut self, leg: usize, volts: f64) -> [f64; 6] {
        let mut readings = self.rig.read_gauges();
        readings.iter_mut().zip(self.gauges).for_each(|(reading, gain)| *reading *= gain);
        self.rig.hold(&std::array::from_fn(|k| self.rest + if k == leg { volts } else { 0.0 }), self.period);
        readings
    }

    /// Displacement per volt in two strokes of a leg by 20 V, which begin so many ticks after the first of the rows, of 5 ms.
    fn strokes(&mut self, leg: usize, late: usize) -> f64 {
        let (mut volts, mut moved) = (Vec::new(), Vec::new());
        for row in 0..320 {
            let mut sums = [0.0; 2];
            for k in 0..50 {
                let time = (row * 50 + k) as f64 * self.period - (0.3 + late as f64 * self.period);
                let height = if (0.0..1.0).contains(&time) { 10.0 * (1.0 - libm::cos(TAU * 2.0 * time)) } else { 0.0 };
                let readings = Vector6::from(self.tick(leg, height));
                sums = [sums[0] + height / 50.0, sums[1] + (self.per_reading.row(leg) * readings)[0] / 50.0];
            }
            volts.push(sums[0]);
            moved.push(sums[1]);
        }
        gain_of_strokes(&volts, &moved).unwrap()
    }

    /// Strokes and sweeps of all legs.
    fn measured(&mut self, compiled: &Compilation) -> (OpenResponse, [f64; 6]) {
        let sweep = Sweep::of(compiled, compiled.model.actuator.leg_gain(), 16_400);
        let mut strokes = [0.0; 6];
        let records = std::array::from_fn(|leg| {
            strokes[leg] = self.strokes(leg, self.late + 31 * leg);
            self.rig.hold(&[self.rest; 6], 1.0);
            self.record(&sweep, leg)
        });
        (OpenResponse::of(compiled, &records).unwrap(), strokes)
    }

    /// Use between two checks: moves of all legs, and rests.
    fn used(&mut self, seed: u64) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..20 {
            let to: [f64; 6] = std::array::from_fn(|_| 60.0 * (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64);
            for step in (1..=50).chain((0..50).rev()) {
                self.rig.hold(&to.map(|to| self.rest + to * f64::from(step) / 50.0), 4e-3);
            }
        }
        self.rig.hold(&[self.rest; 6], 2.0);
    }

    fn record(&mut self, sweep: &Sweep, leg: usize) -> SweepRecord {
        let [before, after] = sweep.rest.map(|time| (time / self.period) as usize);
        let ticks = (sweep.seconds / self.period) as usize;
        let mut record = SweepRecord { volts: Vec::new(), readings: Default::default() };
        for tick in 0..before + ticks + after {
            // Codes of 16 bits for 150 V.
            let step = 150.0 / 65_535.0;
            let volts = step * (sweep.volts(tick as f64 - before as f64, self.period) / step).round();
            record.volts.push(self.rest + volts);
            let readings = self.tick(leg, volts);
            record.readings.iter_mut().zip(readings).for_each(|(all, reading)| all.push(reading));
        }
        record.about().unwrap()
    }
}

impl Sweep {
    /// V above the rest, so many ticks after the start; as the generator of waves computes it.
    fn volts(&self, tick: f64, period: f64) -> f64 {
        let (time, end) = (tick * period, self.seconds);
        let x = if end - time < time { end - time } else { time } / self.ramp;
        let envelope = match x {
            x if x <= 0.0 => 0.0,
            x if x < 1.0 => x * x * x * (10.0 - x * (15.0 - 6.0 * x)),
            _ => 1.0,
        };
        let [from, to] = self.band;
        let turns = time * (from + 0.5 * (to - from) * time / end);
        envelope * (self.offset + self.amplitude * libm::sin(TAU * turns))
    }
}

/// Frequencies and ζ of M x″ + C x′ + K x = 0.
fn own_modes(specimen: &Specimen) -> [[f64; 2]; 6] {
    let structure = specimen.structure();
    let matrix = |of: [[f64; 6]; 6]| Matrix6::from_fn(|i, j| of[i][j]);
    let jacobian = matrix(structure.geometry.jacobian(&[0.0; 6]));
    let damping = jacobian.transpose() * Matrix6::from_diagonal(&structure.damping.into()) * jacobian;
    let mass = matrix(structure.mass_matrix()).try_inverse().unwrap();
    let mut states = SMatrix::<f64, 12, 12>::zeros();
    states.fixed_view_mut::<6, 6>(0, 6).copy_from(&Matrix6::identity());
    states.fixed_view_mut::<6, 6>(6, 0).copy_from(&(-mass * matrix(structure.stiffness_matrix())));
    states.fixed_view_mut::<6, 6>(6, 6).copy_from(&(-mass * damping));
    let all = states.complex_eigenvalues();
    let mut found: Vec<[f64; 2]> =
        all.iter().filter(|x| x.im > 0.0).map(|x| [x.norm() / TAU, -x.re / x.norm()]).collect();
    found.sort_by(|a, b| a[0].total_cmp(&b[0]));
    found.try_into().unwrap()
}

/// Checks a machine against the bars of a commissioning, and prints what is off.
fn check(compiled: &Compilation, seed: u64) {
    let mut machine = Machine::of(compiled, seed);
    let (found, _) = machine.measured(compiled);
    let worst = |of: &dyn Fn(usize) -> f64| (0..6).map(|k| of(k).abs()).fold(0.0, f64::max);
    let delay = worst(&|leg| found.delay_of(leg) - machine.lags[leg]);
    let frequency = worst(&|k| found.modes[k].frequency.value / machine.modes[k][0] - 1.0);
    let zeta = worst(&|k| found.modes[k].zeta.value / machine.modes[k][1] - 1.0);
    let ratio = (0..6).map(|k| 2.0 * libm::log(machine.modes[k][0] / found.modes[k].spec[0])).sum::<f64>() / 6.0;
    println!(
        "machine {seed}: delay {:.1} us, modes {:.3} %, damping {:.2} %, k/m {:.3} %, fit {:.2} %",
        1e6 * delay,
        100.0 * frequency,
        100.0 * zeta,
        100.0 * (found.stiffness_to_mass.value / libm::exp(ratio) - 1.0),
        100.0 * found.misfit
    );
    let lag = machine.lags.iter().sum::<f64>() / 6.0;
    let off = (found.delay.value - lag) / found.delay.error;
    let modes = worst(&|k| (found.modes[k].frequency.value - machine.modes[k][0]) / found.modes[k].frequency.error);
    let ratios = worst(&|k| (found.modes[k].zeta.value - machine.modes[k][1]) / found.modes[k].zeta.error);
    println!("  in standard errors: delay {off:.1}, modes {modes:.1}, damping {ratios:.1}");
    assert!(off.abs() < 4.0 && modes < 5.0 && ratios < 5.0, "machine {seed}: {found:?}");
    assert!(delay <= 20e-6 && frequency <= 2e-3 && zeta <= 0.02, "machine {seed}: {found:?}");
    assert!((found.stiffness_to_mass.value / libm::exp(ratio) - 1.0).abs() < 2e-3, "machine {seed}");
    let StructuralMode { place, frequency_hz, damping_ratio, participation } = machine.other;
    let [other] = &found.others[..] else { panic!("machine {seed}: {:?}, there is {:?}", found.others, machine.other) };
    assert!(!other.known && other.place == place.to_string(), "machine {seed}: {other:?}");
    assert!((other.frequency.value / frequency_hz - 1.0).abs() < 5e-3, "machine {seed}: {other:?}");
    assert!((other.zeta.value / damping_ratio - 1.0).abs() < 0.1, "machine {seed}: {other:?}");
    assert!((other.participation.value / participation.unwrap() - 1.0).abs() < 0.1, "machine {seed}: {other:?}");
}

#[test]
fn lag_modes_and_damping_of_machines_that_are_not_their_spec_are_found() {
    let compiled = reference();
    (0..3).for_each(|seed| check(&compiled, seed));
}

#[test]
#[ignore = "long: 30 machines, two minutes"]
fn the_same_of_thirty_machines() {
    let compiled = reference();
    (0..30).for_each(|seed| check(&compiled, seed));
}

/// Checks machines that have changed, and ones that have not, after some use: the number of changes of gain, delay and modes that are
/// found, and of false alarms.
fn health(compiled: &Compilation, changed: std::ops::Range<u64>, same: std::ops::Range<u64>) -> ([u32; 3], u32) {
    let (mut found, mut alarms) = ([0; 3], 0);
    for seed in changed.start.min(same.start)..changed.end.max(same.end) {
        let (before, small) = Machine::of(compiled, seed).measured(compiled);
        let compare = |fault: &Fault| {
            let mut machine = Machine::with(compiled, seed, fault, 1000 + seed);
            machine.used(seed);
            let (after, large) = machine.measured(compiled);
            Health::of((&before, &small), (&after, &large))
        };
        if same.contains(&seed) {
            let health = compare(&Fault::default());
            alarms += u32::from(!health.changes.is_empty());
            println!("machine {seed}, not changed: {health:.4?}");
        }
        if changed.contains(&seed) {
            let [first, second] = [seed as usize % 6, (seed as usize / 2 + 3) % 6];
            let sign = if seed.is_multiple_of(2) { 1.0 } else { -1.0 };
            let health = compare(&Fault {
                gain: Some((first, 1.0 + 0.02 * sign)),
                delay: Some((second, 20e-6 * sign)),
                modes: Some(1.0 + 0.01 * sign),
            });
            println!("machine {seed}, changed: {health:.4?}");
            let named = |start: &str| health.changes.iter().filter(|change| change.what.starts_with(start)).count();
            let (gain, delay) = (format!("gain of leg {first}"), format!("delay of leg {second}"));
            assert!(health.changes.len() <= 3, "machine {seed}: {health:?}");
            found[0] += u32::from(named("gain") == 1 && named(&gain) == 1);
            found[1] += u32::from(named("delay") == 1 && named(&delay) == 1);
            found[2] += u32::from(named("all modes") == 1);
        }
    }
    println!("found of gain, delay, modes {found:?}, false alarms {alarms}");
    (found, alarms)
}

#[test]
fn a_check_finds_what_has_changed_and_nothing_else() {
    assert_eq!(health(&reference(), 0..2, 1..3), ([2; 3], 0));
}

/// Wherever the strokes begin in a row, and whatever the legs did before.
#[test]
fn gains_of_strokes_repeat() {
    let compiled = reference();
    for seed in 0..6 {
        let gains = [1, 6].map(|noise| {
            let mut machine = Machine::with(&compiled, seed, &Fault::default(), 100 * noise + seed);
            if noise > 1 {
                machine.used(seed);
            }
            std::array::from_fn::<f64, 6, _>(|leg| machine.strokes(leg, machine.late + 31 * leg))
        });
        let off = (0..6).map(|leg| (gains[1][leg] / gains[0][leg] - 1.0).abs()).fold(0.0, f64::max);
        println!("machine {seed}: gains repeat within {:.2} %", 100.0 * off);
        assert!(off < 6e-3, "machine {seed}: {gains:?}");
    }
}

#[test]
#[ignore = "long: 20 machines that have changed, and 50 that have not; ten minutes"]
fn checks_of_many_machines_find_what_has_changed_and_nothing_else() {
    let (found, alarms) = health(&reference(), 0..20, 0..50);
    assert!(found.iter().all(|found| *found >= 19) && alarms == 0, "{found:?}, {alarms}");
}

#[test]
fn records_without_a_sweep_are_refused() {
    let still = || SweepRecord { volts: vec![1.0; 4_000], readings: std::array::from_fn(|_| vec![0.0; 4_000]) };
    assert!(still().about().is_none());
    let error = OpenResponse::of(&reference(), &std::array::from_fn(|_| still())).unwrap_err();
    assert!(error.contains("record of leg 0 shows no sweep"), "{error}");
}
