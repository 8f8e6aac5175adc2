//! The open drive: voltages of the legs from the host, without feedback, within every limit.

use super::bench::*;
use super::oscillation::machine::Machine;
use specgen_runtime::setpoint::REFUSED;
use specgen_tests::{Emitted, leg_class};

/// Hz; the steepest has 20 V · 2π · 15 Hz = 1.9 kV/s of the slew limit of 40 kV/s.
const SPEEDS: [f64; 6] = [2.0, 3.0, 5.0, 7.0, 11.0, 15.0];

fn platform(name: &str) -> (Emitted, Bench) {
    let emitted = emitted(name, "reference.toml", &[]);
    let mut bench = Bench::new(Kind::Platform, &emitted, &[("mode", 6.0)]);
    drive(&mut bench);
    (emitted, bench)
}

/// From disarmed into an open drive, at rest.
fn drive(bench: &mut Bench) {
    bench.tick(NOTHING, 0);
    bench.until(ARMING, ARM);
    bench.until(HOLDING, ARM);
    bench.until(DRIVING, DRIVE);
}

/// One tick with these voltages.
fn tick(bench: &mut Bench, voltages: [f64; 6], request: u64) {
    bench.prepare(request, 0);
    bench.drive(voltages);
    bench.step();
}

/// Codes are those of the voltages, whatever the gauges read and whatever feedback the mode would give.
#[test]
fn an_open_drive_has_no_feedback() {
    let (emitted, mut bench) = platform("supervisor-drive");
    let step = emitted.compiled.ir.actuation.volts_per_code;
    for time in 0..3000_u32 {
        let along = f64::from(time) * 1e-4;
        let voltages = SPEEDS.map(|speed| 20.0 * (1.0 - (std::f64::consts::TAU * speed * along).cos()));
        let swing = |gauge: usize| (f64::from(time) * 0.01 + gauge as f64).sin() - (gauge as f64).sin();
        bench.offset = std::array::from_fn(|gauge| 2e-6 * swing(gauge));
        tick(&mut bench, voltages, DRIVE);
        assert_eq!(bench.word.phase, DRIVING, "tick {time}: {:?}", bench.word);
        for (leg, (sent, voltage)) in bench.six("voltage").iter().zip(voltages).enumerate() {
            assert!((sent - voltage).abs() <= 0.5001 * step, "tick {time}, leg {leg}: {sent} V of {voltage} V");
        }
    }
}

/// Voltages that are not finite, and commands without voltages, hold the codes; a hold command does so without a refusal.
#[test]
fn an_open_drive_holds_where_no_voltage_is_commanded() {
    let (_, mut bench) = platform("supervisor-drive");
    for _ in 0..500 {
        tick(&mut bench, [10.0; 6], DRIVE);
    }
    let held = bench.codes();
    let status = |bench: &Bench| bench.output[bench.at("status")] as u32;
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        tick(&mut bench, [10.0, 20.0, bad, 10.0, 10.0, 10.0], DRIVE);
        assert_eq!((bench.codes(), status(&bench) & REFUSED), (held, REFUSED));
    }
    let command = bench.input_at("command");
    for (word, refused) in [(0, 0), (1, REFUSED), (2, REFUSED), (3, REFUSED), (5, REFUSED), (u64::MAX, REFUSED)] {
        bench.prepare(DRIVE, 0);
        bench.input[command] = word;
        bench.step();
        assert_eq!((bench.codes(), status(&bench) & REFUSED, bench.word.phase), (held, refused, DRIVING), "{word}");
    }
    // The law, in its turn, knows no voltages.
    bench.until(RUNNING, RUN);
    for _ in 0..3000 {
        tick(&mut bench, [90.0; 6], RUN);
    }
    assert_eq!((status(&bench) & REFUSED, bench.word.phase), (REFUSED, RUNNING));
    assert!(bench.six("voltage").iter().all(|voltage| *voltage < 80.0), "no leg goes to 90 V");
}

/// All legs at once leave the workspace: the drive ends before, and ramps down. One leg alone does not leave it.
#[test]
fn an_open_drive_ends_before_the_platform_leaves_its_workspace() {
    let (emitted, mut bench) = platform("supervisor-drive");
    let workspace = &emitted.compiled.model.workspace;
    let [x, y, z] = workspace.translation;
    let [a, b, c] = workspace.rotation;
    let bound = [x, y, z, a, b, c];
    let within = |bench: &Bench| bench.six("pose").iter().zip(bound).all(|(pose, bound)| pose.abs() <= bound);
    let mut rise = 0.0;
    while rise < 95.0 {
        rise += 0.05;
        tick(&mut bench, [rise, 0.0, 0.0, 0.0, 0.0, 0.0], DRIVE);
        assert_eq!(bench.word.phase, DRIVING, "{rise} V");
        assert!(within(&bench), "{rise} V");
    }
    while rise > 0.0 {
        rise -= 0.05;
        tick(&mut bench, [rise, 0.0, 0.0, 0.0, 0.0, 0.0], DRIVE);
    }
    let mut highest: f64 = 0.0;
    for time in 0..40_000 {
        tick(&mut bench, [f64::from(time) * 0.05; 6], DRIVE);
        assert!(within(&bench), "tick {time}: {:?}", bench.six("pose"));
        highest = highest.max(bench.six("pose")[2]);
        if bench.word.phase != DRIVING {
            break;
        }
    }
    println!("all legs: the drive ended at z = {:.2} µm of {:.2} µm", highest * 1e6, z * 1e6);
    assert_eq!((bench.word.phase, bench.word.cause), (RAMPING, WORKSPACE));
    assert!(highest > 0.95 * z);
    bench.until(FAULTED, NOTHING);
    assert_eq!(bench.codes(), [bench.rest; 6]);
}

/// At the slew limit, on a machine whose legs lag and whose modes ring; and a motion under way is finished before a drive.
#[test]
fn the_fastest_open_drive_keeps_the_platform_within_its_workspace() {
    let emitted = emitted("supervisor-drive", "reference.toml", &[]);
    let workspace = emitted.compiled.model.workspace.bounds();
    for legs in [0b111111, 0b000111, 0b010101, 0b000001] {
        let mut machine = Machine::new(&emitted, &leg_class(0), 3);
        for (phase, request) in [(ARMING, ARM), (HOLDING, ARM), (DRIVING, DRIVE)] {
            for _ in 0..4000 {
                if machine.tick(request).phase == phase {
                    break;
                }
            }
        }
        let volts: [f64; 6] = std::array::from_fn(|leg| if legs >> leg & 1 == 1 { 100.0 } else { 0.0 });
        let mut farthest: f64 = 0.0;
        for _ in 0..3000 {
            machine.command(4, 0, &volts);
            machine.tick(DRIVE);
            let pose = machine.rig.plant_mut().pose();
            farthest = pose.iter().zip(workspace).fold(farthest, |most, (pose, bound)| most.max(pose.abs() / bound));
        }
        println!("legs {legs:06b}: {:.2} of the workspace, then {}", farthest, machine.word);
        assert!(farthest <= 1.0, "{legs:b}");
    }
}

#[test]
fn a_drive_waits_for_the_end_of_a_motion() {
    let emitted = emitted("supervisor-drive", "reference.toml", &[]);
    let mut bench = Bench::new(Kind::Platform, &emitted, &[("mode", 6.0)]);
    bench.bring_to(RUNNING);
    bench.setpoint = [2e-6, -3e-6, 5e-6, 0.0, 0.0, 0.0];
    for _ in 0..20 {
        bench.tick(RUN, 0);
    }
    let at = bench.six("target");
    bench.tick(HOLD, 0);
    bench.tick(DRIVE, 0);
    assert_eq!(bench.word.phase, HOLDING, "it comes to rest first");
    assert_ne!(bench.six("target"), at);
    bench.until(DRIVING, DRIVE);
    let volts = bench.six("voltage");
    for tick in 0..3000 {
        self::tick(&mut bench, volts.map(|volts| volts + f64::from(tick) * 1e-3), DRIVE);
    }
    let held = bench.codes();
    bench.tick(HOLD, 0);
    for tick in 0..500 {
        bench.tick(HOLD, 0);
        assert_eq!(bench.codes(), held, "{tick}: the law has no part in a hold after a drive");
    }
}

/// Creep goes on while no voltage is commanded.
#[test]
fn the_models_of_the_legs_follow_an_open_drive() {
    let edits = [(
        "memory  = 64",
        "memory  = 64\nrate = \"creep\"\ncreep_times = [\"2 s\", \"50 ms\"]\ncreep_weights = [0.03, 0.05]",
    )];
    let emitted = emitted("supervisor-drive-creep", "reference.toml", &edits);
    let mut benches: [Bench; 2] = std::array::from_fn(|_| Bench::new(Kind::Platform, &emitted, &[("mode", 6.0)]));
    for (bench, phase) in benches.iter_mut().zip([HOLDING, DRIVING]) {
        drive(bench);
        for time in 0..2000 {
            tick(bench, [f64::from(time) * 0.01; 6], DRIVE);
        }
        bench.until(HOLDING, HOLD);
        bench.until(phase, if phase == DRIVING { DRIVE } else { HOLD });
        for _ in 0..3000 {
            bench.prepare(NOTHING, 0);
            let command = bench.input_at("command");
            bench.input[command] = 0;
            bench.step();
        }
    }
    let [holding, driving] = benches.each_ref().map(|bench| bench.six("requested"));
    assert_eq!(holding, driving);
}

/// Beyond the voltage limits the codes stop at the limit, and that holds like a saturation of the law.
#[test]
fn an_open_drive_stays_within_the_limits_of_voltage_and_slew_rate() {
    let (_, mut bench) = platform("supervisor-drive");
    // `Bench::step` checks both limits in every tick.
    let mut to_and_fro = 0;
    while bench.word.phase == DRIVING && to_and_fro < 100 {
        let voltage = if to_and_fro / 5 % 2 == 0 { 90.0 } else { 0.0 };
        tick(&mut bench, [voltage, 0.0, 0.0, 0.0, 0.0, 0.0], DRIVE);
        to_and_fro += 1;
    }
    assert_eq!((bench.word.phase, bench.word.cause), (HOLDING, 7), "slew rate");
    bench.tick(NOTHING, 0);
    bench.until(DRIVING, DRIVE);
    for _ in 0..200 {
        tick(&mut bench, [-500.0, 0.0, 0.0, 0.0, 0.0, 0.0], DRIVE);
    }
    assert_eq!((bench.word.phase, bench.word.cause), (HOLDING, 6), "voltage");
}

/// After an open drive the law begins where the legs then are.
#[test]
fn the_law_begins_after_an_open_drive_without_a_jump() {
    let (_, mut bench) = platform("supervisor-drive");
    for round in 0..6_usize {
        let mut voltages = [15.0; 6];
        voltages[round] = 60.0;
        for time in 0..1000 {
            tick(&mut bench, voltages.map(|voltage| voltage * f64::from(time) / 999.0), DRIVE);
        }
        let held = bench.codes();
        bench.until(RUNNING, RUN);
        for (code, held) in bench.codes().iter().zip(held) {
            assert!((code - held).abs() <= 1, "round {round}: {code} after {held}");
        }
        for _ in 0..3000 {
            assert_eq!(bench.tick(RUN, 0).phase, RUNNING, "round {round}: {:?}", bench.word);
        }
        bench.until(DISARMED, RAMP_DOWN);
        drive(&mut bench);
    }
}

/// Six legs have no open drive: the request holds them.
#[test]
fn six_legs_are_held_in_an_open_drive() {
    let emitted = emitted("supervisor-drive-legs", "legs.toml", &[]);
    let mut bench = Bench::new(Kind::Legs, &emitted, &[("setpoint_kind", 1.0), ("mode", 2.0)]);
    bench.bring_to(HOLDING);
    let held = bench.codes();
    bench.setpoint = [30e-6; 6];
    for _ in 0..500 {
        bench.tick(DRIVE, 0);
        assert_eq!((bench.word.phase, bench.codes()), (DRIVING, held));
    }
}
