//! Streams that run dry, on simulated machines of several kinds of hysteresis: how far and how long the platform goes on,
//! against what the compiler states. `cargo test --release -p specgen-tests platform_stops -- --nocapture` prints every figure.

mod bench;

use bench::{Machine, StopRun, machines};
use specgen_tests::{length, worse};

use crate::platform_tables::bench::in_parallel;

/// Share of the largest speed of a stream: 0.2, 0.5, 1, 2 and 5 mm/s, or ten times as many µrad/s.
const SPEEDS: [f64; 5] = [0.04, 0.1, 0.2, 0.4, 1.0];

/// From 2 mm/s on in the short run.
fn speeds() -> &'static [f64] {
    &SPEEDS[length(3, 0)..]
}

/// What hysteresis that depends on the rate, which the controllers' tables do not hold, leaves of an error at any speed, m.
const UNMODELLED: f64 = 0.15e-6;

/// Every axis, both ways, at every speed.
fn stops(machine: &Machine) -> Vec<StopRun> {
    let mut ran = Vec::new();
    machine.run(|bench| {
        for share in speeds() {
            for axis in 0..6 {
                for sign in [1.0, -1.0] {
                    ran.push(bench.run_dry(axis, sign * share));
                }
            }
        }
    });
    ran
}

#[test]
fn a_dry_stream_stands_soon_near_and_with_no_leg_limited() {
    let machines = machines(length(1, usize::MAX));
    let all = in_parallel(machines.len() as u32, |index| stops(&machines[index as usize]));
    for (machine, ran) in machines.iter().zip(&all) {
        let stated = machine.stated();
        for share in speeds() {
            let of: Vec<&StopRun> = ran.iter().filter(|one| one.share.abs() == *share).collect();
            let most = |figure: &dyn Fn(&StopRun) -> f64| of.iter().map(|one| figure(one)).fold(0.0, worse);
            let (name, speed, time) = (&machine.name, 5.0 * share, most(&|one| one.time) * 1e3);
            let (target, pose) = (most(&|one| one.target) * 1e6, most(&|one| one.pose) * 1e6);
            let (worst, at_15) = (most(&|one| one.worst) * 1e6, most(&|one| one.at_15ms) * 1e6);
            let (at_50, status) = (most(&|one| one.at_50ms) * 1e6, of.iter().fold(0, |bits, one| bits | one.status));
            println!(
                "{name:<14} {speed:>4.1} mm/s: stands after {time:>4.1} ms; from where it counts as stale target {target:.3} um, platform {pose:.3} um; off by {worst:.3} um at most, {at_15:.3} um 15 ms, {at_50:.3} um 50 ms after the last set-point; limited {status:x}"
            );
        }
        for one in ran {
            let what = format!("{}, axis {}, {} of the largest speed: {one:?}", machine.name, one.axis, one.share);
            assert_eq!(one.status, 0, "{what}");
            assert!(one.time <= 15e-3, "{what}");
            let [way, overshoot] = [stated.way, stated.overshoot].map(|most| most * one.share.abs());
            assert!(one.target <= way * 1.000_001 && one.pose <= way + overshoot + UNMODELLED, "{what}");
            // 1 µm at 1 mm/s and below, 5 µm at 5 mm/s.
            let most = if one.share.abs() <= 0.2 { 1e-6 } else { 5e-6 * one.share.abs() };
            assert!(one.target <= most && one.pose <= most, "{what}");
        }
    }
}
