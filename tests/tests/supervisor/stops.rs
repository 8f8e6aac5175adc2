//! A platform in motion that the supervisor holds, ramps down or switches off: how the set-point comes to rest, and the codes.

use super::bench::*;
use specgen_runtime::setpoint::StopLimits;

const PERIOD: f64 = 1e-4;
/// Along x, m/s.
const SPEED: f64 = 1e-3;
const LINK_LOST: u64 = 2;
const EMERGENCY_STOP: u64 = 16;

/// One tick of a stream along x at [`SPEED`], `count` ticks from where it began.
fn stream(bench: &mut Bench, count: u32, request: u64, events: u64) {
    bench.prepare(request, events);
    let [command, sequence, place, rate] =
        ["command", "sequence", "setpoint[0]", "setpoint_rate[0]"].map(|name| bench.input_at(name));
    bench.input[command] = 1;
    bench.input[sequence] = u64::from(count);
    bench.input[place] = bench.scalar.encode(SPEED * PERIOD * f64::from(count));
    bench.input[rate] = bench.scalar.encode(SPEED);
    bench.step();
}

/// In the middle of such a stream.
fn streaming(emitted: &specgen_tests::Emitted) -> (Bench, u32) {
    let mut bench = Bench::new(Kind::Platform, emitted, &[]);
    bench.bring_to(RUNNING);
    let count = 40;
    for tick in 1..=count {
        stream(&mut bench, tick, RUN, 0);
    }
    assert!((bench.six("target")[0] - SPEED * PERIOD * f64::from(count)).abs() < 1e-12, "the stream is followed");
    (bench, count)
}

#[test]
fn a_platform_in_motion_is_brought_to_rest_before_its_codes_are_held_or_ramped_down() {
    let tolerant = [("voltage_time      = \"2 ms\"", "voltage_time      = \"500 ms\"")];
    let emitted = emitted("supervisor-stops", "reference.toml", &tolerant);
    let setpoints = &emitted.compiled.ir.task_space.as_ref().expect("in task space").setpoints;
    let limits = StopLimits {
        acceleration: setpoints.stop_acceleration_limit,
        jerk: setpoints.stop_jerk_limit,
        shortest: setpoints.shortest_stop,
    };
    let mut per_tick = [0.0; 6];
    per_tick[0] = SPEED * PERIOD;
    let ticks = limits.ticks(&per_tick) as u32;
    assert!(ticks > 2, "{ticks}");
    for (request, events, phase) in [(HOLD, 0, HOLDING), (RUN, LINK_LOST, HOLDING), (RAMP_DOWN, 0, RAMPING)] {
        let (mut bench, count) = streaming(&emitted);
        let from = bench.six("target")[0];
        let mut last = from;
        for tick in 1..=ticks {
            let before = bench.codes();
            stream(&mut bench, count + tick, request, if tick == 1 { events } else { 0 });
            let target = bench.six("target")[0];
            assert_eq!(bench.word.phase, phase, "tick {tick}");
            assert!(target > last && target - last < SPEED * PERIOD, "tick {tick}: by {:e}", target - last);
            assert!(tick == ticks || bench.codes() != before, "tick {tick}: the law brings it to rest");
            last = target;
        }
        let way = SPEED * PERIOD * f64::from(ticks) * 0.5;
        println!("request {request}, events {events}: stands after {ticks} ticks, {:.3} um on", (last - from) * 1e6);
        assert!((last - from - way).abs() < 1e-12, "{:e} {way:e}", last - from);
        let held = bench.codes();
        for tick in 1..200 {
            stream(&mut bench, count + ticks + tick, request, 0);
            assert_eq!(bench.six("target")[0], last);
        }
        assert_eq!(bench.codes() == held, phase == HOLDING, "held, or on their way to rest");
    }
}

#[test]
fn a_platform_on_its_way_to_the_bias_is_held_at_once_and_one_that_is_switched_off_waits_for_nothing() {
    let emitted = emitted("supervisor-stops-at-once", "reference.toml", &[]);
    let mut bench = Bench::new(Kind::Platform, &emitted, &[]);
    bench.tick(NOTHING, 0);
    bench.until(ARMING, ARM);
    bench.until(HOLDING, ARM);
    bench.until(RUNNING, RUN);
    for _ in 0..300 {
        bench.tick(RUN, 0);
    }
    let (codes, target) = (bench.codes(), bench.six("target"));
    bench.tick(RUN, 0);
    assert_ne!(bench.six("target"), target, "on its way");
    let target = bench.six("target");
    bench.tick(HOLD, 0);
    assert_eq!((bench.word.phase, bench.six("target")), (HOLDING, target));
    assert_ne!(bench.codes(), [0; 6], "{codes:?}");

    let (mut bench, count) = streaming(&emitted);
    let target = bench.six("target");
    stream(&mut bench, count + 1, RUN, EMERGENCY_STOP);
    assert_eq!((bench.word.phase, bench.word.amplifier_on, bench.six("target")), (FAULTED, false, target));
}
