//! Drives that identify an assembled platform: limits, workspace, mains; the wave files against the runtime's generator.

mod machine;
mod table;

use crate::identify_support::{generator, uniform};
use nalgebra::{Matrix6, Vector3, Vector6};
use specgen::identify::assembled::{Bench, Drive, Kind, Plan, plan};
use specgen::operate::read_wave;
use specgen_runtime::wave::{Limits, Settings, Wave};
use specgen_tests::{compile_text, edited, length};
use std::sync::OnceLock;

/// The platform of the study, whose legs have a stroke of 63 µm at 100 V.
fn reference() -> Bench {
    static BENCH: OnceLock<Bench> = OnceLock::new();
    BENCH.get_or_init(of_spec).clone()
}

fn of_spec() -> Bench {
    let compiled = compile_text(&edited("reference.toml", &[])).unwrap();
    let model = &compiled.model;
    let poses = specgen::lower::poses_per_reading(model).unwrap().unwrap();
    let gauges = Matrix6::from_fn(|axis, gauge| poses[axis][gauge]).try_inverse().unwrap();
    let reading = |gauge: usize| (std::array::from_fn(|axis| gauges[(gauge, axis)]), model.sensor.range);
    Bench {
        tick_rate: 1.0 / model.timing.period,
        voltage: model.actuator.voltage,
        rest: model.rest_voltage(),
        slew_rate: model.actuator.slew_rate,
        stroke: [63e-6; 6],
        jacobian: specgen::lower::leg_jacobian(&model.geometry).unwrap(),
        workspace: model.workspace.bounds().map(|bound| [-bound, bound]),
        readings: (0..6).map(reading).collect(),
        mains: 50.0,
        slowest_mode: 361.0,
    }
}

/// A machine that may be: joints on circles with errors, drives of either sign, slow and fast amplifiers and ticks.
fn random(seed: u64) -> Bench {
    let mut random = generator(seed);
    let mut between = |low: f64, high: f64| low + (high - low) * uniform(&mut random);
    let (base, platform, height) = (between(0.12, 0.2), between(0.08, 0.12), between(0.15, 0.22));
    let jacobian = std::array::from_fn(|leg| {
        let side = if leg % 2 == 0 { 1.0 } else { -1.0 };
        let at = |radius: f64, angle: f64, z: f64| Vector3::new(radius * angle.cos(), radius * angle.sin(), z);
        let third = std::f64::consts::TAU / 3.0 * leg.div_ceil(2) as f64;
        let upper = at(platform, third + side * between(0.05, 0.1) - std::f64::consts::FRAC_PI_3, 0.0);
        let lower = at(base, std::f64::consts::TAU / 3.0 * (leg / 2) as f64 - side * between(0.05, 0.1), -height);
        let along = (upper - lower).normalize();
        let turn = upper.cross(&along);
        [along.x, along.y, along.z, turn.x, turn.y, turn.z]
    });
    let pick = |share: f64, count: usize| (share * count as f64) as usize;
    let voltage = [[0.0, 100.0], [0.0, 150.0], [-20.0, 120.0], [-100.0, 0.0], [5.0, 75.0]][pick(between(0.0, 1.0), 5)];
    let [low, high] = voltage;
    let rest = if low > 0.0 { low } else { 0.0 };
    let stroke = between(30e-6, 75e-6);
    let room = between(0.4, 1.0) * stroke;
    // Poses count from the lowest voltage: a machine that rests above it is given room for that.
    let raised = 1.0 + (rest - low) / (high - low);
    let tilt = between(4.0, 9.0) * room;
    let workspace = [room, room, room, tilt, tilt, 1.4 * tilt].map(|bound| [-raised * bound, raised * bound]);
    Bench {
        tick_rate: [1e3, 4e3, 1e4, 2e4][pick(between(0.0, 1.0), 4)],
        voltage,
        rest,
        slew_rate: (high - low) * 10.0_f64.powf(between(0.3, 3.0)),
        stroke: std::array::from_fn(|_| stroke * between(0.85, 1.15)),
        jacobian,
        workspace,
        readings: Vec::new(),
        mains: [50.0, 60.0][pick(between(0.0, 1.0), 2)],
        slowest_mode: between(80.0, 800.0),
    }
}

/// Voltages of all legs.
fn voltages(drive: &Drive, tick: f64) -> [f64; 6] {
    let moving = drive.voltage(tick);
    std::array::from_fn(|leg| if drive.legs.contains(&leg) { moving } else { drive.held[leg] })
}

/// The largest part of the workspace that the platform reaches, at its speed for another 2 ms.
fn reach(bench: &Bench, drive: &Drive, stride: usize) -> f64 {
    let inverse = Matrix6::from_fn(|leg, axis| bench.jacobian[leg][axis]).try_inverse().unwrap();
    let [low, high] = bench.voltage;
    let pose = |tick: f64| {
        let volts = voltages(drive, tick);
        inverse * Vector6::from_fn(|leg, _| bench.stroke[leg] * (volts[leg] - low) / (high - low))
    };
    let ticks = (drive.seconds() * bench.tick_rate) as usize;
    (1..ticks).step_by(stride).fold(0.0, |most: f64, tick| {
        let (before, now) = (pose(tick as f64 - 1.0), pose(tick as f64));
        let ahead = now + (now - before) * (2e-3 * bench.tick_rate);
        (0..6).fold(most, |most, axis| {
            let [low, high] = bench.workspace[axis];
            most.max(ahead[axis] / if ahead[axis] < 0.0 { low } else { high })
        })
    })
}

/// The runtime's limits of an open drive.
fn limits(bench: &Bench) -> Limits<f64> {
    let slew = bench.slew_rate;
    Limits {
        low: [bench.voltage[0]; 6],
        high: [bench.voltage[1]; 6],
        rate: [slew; 6],
        acceleration: [2.0 * slew * bench.tick_rate; 6],
        ticks_per_second: bench.tick_rate,
    }
}

fn accepted(bench: &Bench, drive: &Drive) -> Wave<f64> {
    let file = drive.wave_file();
    let read = read_wave(&file, 1.0 / bench.tick_rate, false).unwrap_or_else(|error| panic!("{error}\n{file}"));
    assert!(read.drives);
    let settings = Settings::from_words(read.words.as_slice().try_into().unwrap()).unwrap();
    let mut wave = Wave::new(limits(bench)).of_drive(true);
    wave.set(&settings).unwrap_or_else(|refusal| panic!("{}: {refusal:?}\n{file}", drive.name));
    wave
}

#[test]
fn every_drive_of_a_random_machine_stays_within_its_limits() {
    let machines = length(40_u64, 200);
    let (mut planned, mut reduced, mut offset, mut paired) = (0, 0, 0, 0);
    for seed in 0..machines {
        let bench = random(seed);
        let grid = [4, 8, 16, 32][seed as usize % 4];
        let Ok(found) = plan(&bench, grid, seed % 3 > 0) else { continue };
        planned += 1;
        reduced += u64::from(!found.notes.is_empty());
        offset += u64::from(found.drives.iter().any(|drive| drive.held != [bench.rest; 6]));
        paired += u64::from(found.drives.iter().any(|drive| drive.legs.len() > 1));
        for drive in &found.drives {
            assert!(accepted(&bench, drive).stage() == specgen_runtime::wave::Stage::Idle);
            let at = format!("machine {seed}, {}", drive.name);
            let ticks = (drive.seconds() * bench.tick_rate).round();
            for end in [0.0, ticks] {
                assert_eq!(drive.voltage(end), bench.rest, "{at}");
            }
            // A prime, so that no phase is left out.
            for tick in (0..ticks as u32).step_by(397) {
                let volts = drive.voltage(f64::from(tick));
                let [low, high] = bench.voltage;
                assert!((low - 1e-9..=high + 1e-9).contains(&volts), "{at}: {volts} V at {tick}");
            }
            let most = reach(&bench, drive, 397);
            assert!(most < 31.0 / 32.0, "{at}: {most} of the workspace");
            let row = f64::from(drive.average) / bench.tick_rate;
            assert!(row >= 4.5e-3, "{at}: rows of {row} s");
            if let Kind::Curves { grid, rate } = drive.kind {
                let step = (drive.range[1] - drive.range[0]) / grid as f64 / rate;
                let angle = std::f64::consts::PI * bench.mains * step;
                // Only the fast set has steps shorter than a period.
                if bench.mains * step > 0.9 {
                    assert!((angle.sin() / angle).abs() <= 0.0101, "{at}: {step} s");
                }
                assert!((step / row).fract().min(1.0 - (step / row).fract()) < 1e-6, "{at}: {step} s, {row} s");
            }
        }
    }
    println!(
        "{planned} of {machines} machines, {reduced} with less than the range, {offset} with offsets, {paired} with pairs"
    );
    assert!(10 * planned >= 7 * machines && reduced > 0 && 10 * offset > machines && 10 * paired > machines);
}

#[test]
fn the_wave_file_gives_the_planned_voltages_in_the_runtime() {
    let bipolar = Bench { voltage: [-20.0, 120.0], rest: 0.0, stroke: [80e-6; 6], ..reference() };
    for bench in [reference(), bipolar] {
        let found = plan(&bench, 6, true).unwrap();
        for drive in found.drives.iter().filter(|drive| drive.legs.contains(&0)) {
            let mut wave = accepted(&bench, drive);
            wave.start();
            let mut ticks = 0;
            while let Some(motion) = wave.advance() {
                ticks += 1;
                let expected = drive.voltage(f64::from(ticks));
                for leg in 0..6 {
                    let volts = motion.pose[leg];
                    if drive.legs.contains(&leg) {
                        assert!((volts - expected).abs() < 1e-7, "{}, tick {ticks}: {volts} {expected}", drive.name);
                    } else {
                        let [from, to] = [bench.rest, drive.held[leg]];
                        assert!((from.min(to)..=from.max(to)).contains(&volts), "{}: {volts}", drive.name);
                    }
                }
            }
            assert_eq!(f64::from(ticks) / bench.tick_rate, drive.seconds(), "{}", drive.name);
        }
    }
}

fn seconds(found: &Plan) -> f64 {
    found.drives.iter().map(Drive::duration).sum()
}

fn shown(name: &str, bench: &Bench, found: &Plan) {
    let mut groups: Vec<&[usize]> = found.drives.iter().skip(6).map(|drive| drive.legs.as_slice()).collect();
    groups.dedup();
    let most = found.drives.iter().fold(0.0, |most: f64, drive| most.max(reach(bench, drive, 7)));
    println!(
        "{name}: {:.0} s, {} drives, groups {groups:?}, {most:.3} of the workspace",
        seconds(found),
        found.drives.len()
    );
    found.notes.iter().for_each(|note| println!("  {note}"));
}

/// The reference platform with a workspace in which pairs fit.
fn roomy() -> Bench {
    let bench = reference();
    let larger = |[low, high]: [f64; 2]| [1.4 * low, 1.4 * high];
    let readings = bench.readings.iter().map(|(reading, range)| (*reading, larger(*range))).collect();
    Bench { workspace: bench.workspace.map(larger), readings, ..bench }
}

/// One leg fits, in a larger workspace pairs do, and so does a stroke of 75 µm; one of 120 µm is reduced.
#[test]
fn the_reference_platform_is_planned_as_the_study_says() {
    let bench = reference();
    let single = plan(&bench, 32, false).unwrap();
    shown("one leg at a time", &bench, &single);
    // Pairs need held legs that make room, which fails if these have the smaller strokes: only a larger workspace has any.
    assert_eq!(plan(&bench, 32, true).unwrap(), single);
    let bench = roomy();
    let pairs = plan(&bench, 32, true).unwrap();
    shown("pairs, workspace 1.4 times as large", &bench, &pairs);
    assert!(single.notes.is_empty() && pairs.notes.is_empty());
    let of = |found: &Plan, legs: &[usize]| found.drives.iter().filter(|drive| drive.legs == legs).count();
    assert!(pairs.drives.len() < single.drives.len() && of(&single, &[3]) == 8);
    // 230 s are for the rest of a commissioning: wiring 20, response 90, arming 20, acceptance 100.
    assert!(seconds(&single) < 900.0 - 230.0 && seconds(&pairs) < seconds(&single) - 100.0);
    let first = |found: &Plan| found.drives.iter().find(|drive| drive.name == "leg0-curves-156").unwrap().seconds();
    assert!((21.0..25.0).contains(&first(&single)), "{}", first(&single));
    let larger = Bench { stroke: [75e-6; 6], ..reference() };
    let found = plan(&larger, 32, false).unwrap();
    shown("75 µm", &larger, &found);
    assert!(found.notes.is_empty());
    let huge = Bench { stroke: [120e-6; 6], ..reference() };
    let found = plan(&huge, 32, false).unwrap();
    shown("120 µm", &huge, &found);
    assert!(found.notes.iter().any(|note| note.starts_with("leg ") && note.contains("of the range")));
    // Another seed is another record, the same bench the same bytes.
    assert_eq!(format!("{:?}", plan(&bench, 32, true).unwrap()), format!("{pairs:?}"));
    let files = |found: &Plan| found.drives.iter().map(Drive::wave_file).collect::<Vec<_>>();
    assert_eq!(files(&plan(&bench, 32, true).unwrap()), files(&pairs));
    // Gauges of ±30 µm are at their ends before the platform is at those of its workspace.
    let readings = bench.readings.iter().map(|(reading, _)| (*reading, [-30e-6, 30e-6])).collect();
    let small = plan(&Bench { readings, ..reference() }, 32, false).unwrap();
    shown("gauges of ±30 µm", &bench, &small);
    assert!(!small.notes.is_empty());
}

/// A record is found by its name.
#[test]
fn no_two_records_have_one_name() {
    for grid in 4..=64 {
        let found = plan(&reference(), grid, false).unwrap();
        let recorded = found.drives.iter().filter(|drive| drive.kind != Kind::Preconditioning);
        let mut names: Vec<&str> = recorded.map(|drive| drive.name.as_str()).collect();
        let all = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), all, "{grid}");
    }
}

#[test]
fn what_cannot_be_planned_is_said() {
    let refused = |bench: Bench, grid: usize| plan(&bench, grid, true).unwrap_err();
    assert!(refused(reference(), 3).contains("expected 4 to 128 curves, found 3"));
    assert!(refused(Bench { slew_rate: 0.0, ..reference() }, 32).contains("slew rate: expected more than 0"));
    assert!(refused(Bench { rest: -3.0, ..reference() }, 32).contains("rest: expected a voltage from 0 V to 100 V"));
    assert!(refused(Bench { jacobian: [[1.0; 6]; 6], ..reference() }, 32).contains("do not determine the pose"));
    let tiny = refused(Bench { workspace: [[-3e-6, 3e-6]; 6], ..reference() }, 32);
    assert!(tiny.starts_with("leg 0: ") && tiny.contains("widen `workspace`"), "{tiny}");
    let raised = refused(Bench { voltage: [-100.0, 100.0], stroke: [126e-6; 6], ..reference() }, 32);
    assert!(raised.starts_with("at rest, 0 V, the platform is beyond"), "{raised}");
}
