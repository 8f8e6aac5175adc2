//! The set-point generator: what it does on command and what it refuses; in [`promises`] what it promises whatever the
//! command, in [`busy`] when it says that it has arrived, in [`frames`] the user's frames, in [`stops`] how it comes to rest, in [`standing`] where it begins and stands.

mod busy;
mod frames;
mod promises;
mod standing;
mod stops;
mod support;

use crate::common::{Random, worse};
use specgen_runtime::Snapshot;
use specgen_runtime::setpoint::{
    BUSY, Command, CommandKind, Generator, MoveLimits, Parallel, Profile, REFUSED, STALE, Setpoints, StopLimits, Target,
};
use support::*;

type Setpoints64 = Setpoints<f64, Parallel>;

fn plan64() -> Setpoints64 {
    plan(Parallel, vec![spiral(), ring(false), ring(true)])
}

fn biased(pose: [f64; 6]) -> [f64; 6] {
    std::array::from_fn(|axis| pose[axis] + BIAS[axis])
}

/// Steps with one command until it is no longer busy; every set-point on the way.
fn run(generator: &mut Generator<f64>, plan: &Setpoints64, command: &Command<f64>) -> Vec<Target<f64>> {
    let mut targets = Vec::new();
    for _ in 0..200_000 {
        let (target, status) = generator.next(plan, command);
        targets.push(target);
        if status & BUSY == 0 {
            assert_eq!(status, 0);
            return targets;
        }
        assert_eq!(status, BUSY);
    }
    panic!("busy for ever");
}

/// Rates and accelerations that do not belong to the poses: largest deviation from central differences, in units of what
/// third derivatives up to `third` explain. Rounding of the poses is left out.
fn inconsistency(targets: &[Target<f64>], third: [f64; 6]) -> f64 {
    let mut worst = 0.0_f64;
    for w in targets.windows(3) {
        for (axis, third) in third.into_iter().enumerate() {
            let by_pose = (w[2].pose[axis] - w[0].pose[axis]) / (2.0 * PERIOD) - w[1].rate[axis];
            let by_rate = (w[2].rate[axis] - w[0].rate[axis]) / (2.0 * PERIOD) - w[1].acceleration[axis];
            let rounding = f64::EPSILON * BOUND[axis] / PERIOD;
            worst = worse(worst, (by_pose.abs() - rounding) / (third * PERIOD * PERIOD / 2.0));
            worst = worse(worst, (by_rate.abs() - rounding) / (third * PERIOD / 2.0));
        }
    }
    worst
}

#[test]
fn after_reset_the_bias_is_approached_slowly_whatever_the_command() {
    let plan = plan64();
    for kind in [CommandKind::Hold, CommandKind::Stream, CommandKind::Move, CommandKind::Trajectory] {
        let mut generator = Generator::new();
        // A command that moves begins with the tick behind the bias.
        let moves = matches!(kind, CommandKind::Move | CommandKind::Trajectory);
        let mut watch = Watch::new([0.0; 6], SPEED.map(|v| v * PERIOD), SPEED);
        let mut ticks = 0;
        let last = loop {
            let order = Command { sequence: ticks, ..command(kind, [1e-6, 0.0, 0.0, 0.0, 0.0, 0.0]) };
            let (target, status) = generator.next(&plan, &order);
            assert_eq!(watch.broken(&target), None);
            assert_eq!(target.pose[0], 0.0);
            ticks += 1;
            assert!(ticks < 20_000);
            if target == Target::at(BIAS) {
                assert_eq!(status, if moves { BUSY } else { 0 });
                break target;
            }
            assert_eq!(status, BUSY);
        };
        assert_eq!(last, Target::at(BIAS));
        // 10 µm at 100 µm/s with a rise of V/A + A/J = 20 ms.
        assert!((1200..=1210).contains(&ticks), "{ticks}");
    }
}

/// Time-optimal S-curve from rest to rest for one axis, in s: the textbook's case distinction.
fn optimal_time(way: f64, v: f64, a: f64, j: f64) -> f64 {
    // Rise to the speed `peak`, and the way that rise and fall take.
    let rise = |peak: f64| if peak * j >= a * a { peak / a + a / j } else { 2.0 * (peak / j).sqrt() };
    if v * rise(v) <= way {
        return 2.0 * rise(v) + (way - v * rise(v)) / v;
    }
    let (mut low, mut high) = (0.0, v);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle * rise(middle) <= way { low = middle } else { high = middle }
    }
    2.0 * rise(low)
}

#[test]
fn moves_keep_speed_acceleration_and_jerk_and_take_hardly_longer_than_the_optimum() {
    let mut random = Random(7);
    let mut worst = 0.0_f64;
    for _ in 0..400 {
        let log = |random: &mut Random, low: f64, high: f64| low * (high / low).powf(random.unit());
        let (v, a, j) = (log(&mut random, 1e-5, 1e-2), log(&mut random, 1e-3, 10.0), log(&mut random, 0.1, 1e3));
        let way = log(&mut random, 1e-9, 1e-4);
        let delta = [way, -way / 3.0, 0.0, 0.0, 0.0, 0.0];
        let t = PERIOD;
        let limits = MoveLimits {
            speed: [1.0 / (v * t); 6],
            acceleration: [1.0 / (a * t * t); 6],
            jerk: [1.0 / (j * t * t * t); 6],
        };
        let profile = Profile::<f64>::plan(&delta, &limits).unwrap();
        let ticks = profile.ticks();
        let optimum = optimal_time(way, v, a, j) / t;
        // Rounding up of three phases, and what it costs where one limit no longer binds.
        assert!(f64::from(ticks) <= 1.02 * optimum + 8.0, "{ticks} for {optimum}: {way:e} {v:e} {a:e} {j:e}");
        assert!(f64::from(ticks) >= optimum - 1e-6, "{ticks} beats {optimum}");
        if optimum > 200.0 {
            worst = worse(worst, f64::from(ticks) / optimum);
        }

        let mut plan = plan(Parallel, vec![]);
        plan.limits = limits;
        plan.bound = [1.0; 6];
        plan.bias = [0.0; 6];
        let mut generator = ready(&plan);
        let targets = run(&mut generator, &plan, &command(CommandKind::Move, delta));
        assert_eq!(targets.len(), ticks as usize);
        assert_eq!(targets.last(), Some(&Target::at(delta)));
        let mut last = Target::<f64>::new();
        for target in &targets {
            let slack = 1.0 + 1e-9;
            assert!(target.rate[0].abs() <= v * slack && target.acceleration[0].abs() <= a * slack);
            assert!((target.acceleration[0] - last.acceleration[0]).abs() <= j * t * slack + 1e-9 * a);
            assert!((target.pose[0] - last.pose[0]).abs() <= v * t * slack);
            // Straight: all axes in proportion.
            assert!((target.pose[1] + target.pose[0] / 3.0).abs() <= 1e-15 * way.max(1e-6));
            last = *target;
        }
        assert!(inconsistency(&targets, [j; 6]) <= 1.000_001);
    }
    println!("longest against the time-optimal S-curve, beyond 200 ticks: {worst:.4}");
}

#[test]
fn a_move_has_continuous_rate_and_acceleration_that_belong_to_its_pose() {
    let plan = plan64();
    let mut generator = ready(&plan);
    let goal = [20e-6, -10e-6, 15e-6, 100e-6, 0.0, -50e-6];
    let targets = run(&mut generator, &plan, &command(CommandKind::Move, goal));
    assert_eq!(targets.last(), Some(&Target::at(biased(goal))));
    assert!(inconsistency(&targets, JERK) <= 1.000_001);
    assert!(inconsistency(&targets, JERK.map(|j| j / 10.0)) > 1.0, "the comparison is blind");
    for w in targets.windows(2) {
        for (after, before) in w[1].acceleration.iter().zip(&w[0].acceleration).take(3) {
            assert!((after - before).abs() <= JERK[0] * PERIOD * 1.000_001);
        }
    }
}

#[test]
fn a_move_to_where_it_is_or_to_no_place_moves_nothing() {
    let plan = plan64();
    let mut generator = ready(&plan);
    assert_eq!(generator.next(&plan, &command(CommandKind::Move, [0.0; 6])), (Target::at(BIAS), 0));
    for bad in [f64::NAN, f64::INFINITY, 1e300, 51e-6, -51e-6] {
        let order = command(CommandKind::Move, [bad, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(generator.next(&plan, &order), (Target::at(BIAS), REFUSED), "{bad}");
    }
    let unknown = command(CommandKind::from_word(4), [0.0; 6]);
    assert_eq!(generator.next(&plan, &unknown), (Target::at(BIAS), REFUSED));
}

#[test]
fn arrival_is_exact_in_single_precision_too_and_then_nothing_moves() {
    let plan = plan::<f32, _>(Parallel, vec![]);
    let mut random = Random(3);
    let mut generator = ready(&plan);
    for _ in 0..200 {
        let goal = std::array::from_fn(|axis| (BOUND[axis] - BIAS[axis].abs()) * (2.0 * random.unit() - 1.0) * 0.1);
        let order = command::<f32>(CommandKind::Move, goal);
        while generator.next(&plan, &order).1 != 0 {}
        let (target, status) = generator.next(&plan, &order);
        assert_eq!(status, 0);
        for axis in 0..6 {
            assert_eq!(target.pose[axis], goal[axis] as f32 + BIAS[axis] as f32);
        }
    }
}

#[test]
fn another_goal_is_gone_to_after_the_move() {
    let plan = plan64();
    let mut generator = ready(&plan);
    let first = command(CommandKind::Move, [5e-6, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let second = command(CommandKind::Move, [0.0, 5e-6, 0.0, 0.0, 0.0, 0.0]);
    for _ in 0..100 {
        generator.next(&plan, &first);
    }
    let targets = run(&mut generator, &plan, &second);
    assert_eq!(targets.last().unwrap().pose, biased(second.target.pose));
    assert!(targets.contains(&Target::at(biased(first.target.pose))));
}

#[test]
fn a_stop_goes_on_without_a_step_in_pose_or_rate_and_keeps_its_limits() {
    let plan = plan64();
    for interrupted_after in [1, 50, 100, 150, 500, 1000] {
        let mut generator = ready(&plan);
        let order = command(CommandKind::Move, [30e-6, 0.0, -5e-6, 0.0, 0.0, 0.0]);
        let mut before = Target::at(BIAS);
        for _ in 0..interrupted_after {
            before = generator.next(&plan, &order).0;
        }
        let stop = run(&mut generator, &plan, &hold());
        assert!((stop[0].rate[0] - before.rate[0]).abs() <= STOP_ACCELERATION[0] * PERIOD, "{interrupted_after}");
        let mut last = before;
        for target in &stop {
            let step = target.pose[0] - last.pose[0];
            assert!(step >= 0.0 && step <= before.rate[0] * PERIOD * (1.0 + 1e-9), "{step:e}");
            assert!(target.acceleration[0].abs() <= STOP_ACCELERATION[0] * (1.0 + 1e-9));
            last = *target;
        }
        assert_eq!(last, Target::at(last.pose));
        assert_eq!(generator.next(&plan, &hold()), (last, 0));
    }
}

#[test]
fn a_stop_before_a_wall_is_as_short_as_it_must_be_and_stays_inside() {
    let mut plan = plan64();
    // 4 mm/s towards the wall at 50 µm: within these limits it would take 0.6 s and 1.2 mm.
    plan.stop = StopLimits { acceleration: plan.limits.acceleration, jerk: plan.limits.jerk, shortest: 1 };
    let mut generator = ready(&plan);
    let v = 4e-3;
    let mut last = Target::at(BIAS);
    for sequence in 1..=100 {
        let x = v * PERIOD * f64::from(sequence);
        if x > 40e-6 {
            break;
        }
        let (target, status) = generator.next(&plan, &streamed(sequence, x, v));
        assert_eq!(status, 0);
        last = target;
    }
    let stop = run(&mut generator, &plan, &hold());
    let end = stop.last().unwrap().pose[0];
    assert!(end <= BOUND[0] && end > last.pose[0] + 4e-6, "{end:e}");
    let mut watch = Watch::new(last.pose, [v * PERIOD; 6], [v; 6]);
    assert!(stop.iter().all(|target| watch.broken(target).is_none()));
}

#[test]
fn a_trajectory_starts_from_its_first_pose_plays_once_and_ends_in_hold() {
    let plan = plan64();
    let mut generator = ready(&plan);
    let order = command(CommandKind::Trajectory, [0.0; 6]);
    let targets = run(&mut generator, &plan, &order);
    assert_eq!(targets.len(), 25_000);
    assert_eq!(targets.last(), Some(&Target::at(biased([2.5e-6, 0.0, 0.0, 0.0, 0.0, 0.0]))));
    // Finished: the same command plays it no second time, ...
    for _ in 0..10 {
        assert_eq!(generator.next(&plan, &order), (*targets.last().unwrap(), 0));
    }
    // ... but another one in between does, and it first goes back to the start.
    generator.next(&plan, &hold());
    let again = run(&mut generator, &plan, &order);
    let (approach, played) = again.split_at(again.len() - targets.len());
    assert_eq!(approach.last(), Some(&Target::at(BIAS)));
    assert_eq!(played, targets);
    let none = Command { selector: 3, ..order };
    assert_eq!(generator.next(&plan, &none).1, REFUSED);
}

#[test]
fn segments_follow_their_formula_and_its_derivatives() {
    let plan = plan64();
    let mut generator = ready(&plan);
    let targets = run(&mut generator, &plan, &command(CommandKind::Trajectory, [0.0; 6]));
    let mut worst = 0.0_f64;
    for (k, target) in (1..).zip(&targets[..24_999]) {
        let t = f64::from(k) * PERIOD;
        let (x, y) = if k < 5000 {
            (5e-6 * t, 0.0)
        } else {
            let (w, (s, c)) = ((t - 0.5) / 2.0, (core::f64::consts::TAU * (t - 0.5)).sin_cos());
            (5.5e-6 + 2e-6 * w - (3e-6 + 2e-6 * w) * c, (3e-6 + 2e-6 * w) * s)
        };
        worst = worse(worse(worst, (target.pose[0] - x).abs()), (target.pose[1] - y).abs());
    }
    println!("f64 segments against the formula: {worst:.1e} m");
    assert!(worst < 1e-18, "{worst:e}");
    // Within the second segment: the third derivative is (2π)³ · amplitude.
    let third = [7e-6, 7e-6, 1e-6, 40e-6, 1e-6, 1e-6].map(|size| size * core::f64::consts::TAU.powi(3));
    assert!(inconsistency(&targets[5000..24_990], third) < 1.0);
    assert!(inconsistency(&targets[4990..5010], third) > 1.0, "the comparison is blind");
}

#[test]
fn a_table_is_a_spline_and_repeats_without_a_seam() {
    let plan = plan64();
    let mut generator = ready(&plan);
    let order = trajectory(2);
    run(&mut generator, &plan, &command(CommandKind::Move, [5e-6, 0.0, 0.0, 0.0, 0.0, 0.0]));
    let mut targets = Vec::new();
    for _ in 0..3 * 3200 {
        let (target, status) = generator.next(&plan, &order);
        assert_eq!(status, BUSY);
        targets.push(target);
    }
    // A cubic spline through 64 samples of a turn: error h⁴/384 of the fourth derivative, here ± 4 %.
    let step = core::f64::consts::TAU / 64.0;
    let expected = 5e-6 * step.powi(4) / 384.0;
    let mut worst = 0.0_f64;
    for (k, target) in (1..).zip(&targets) {
        let angle = core::f64::consts::TAU * f64::from(k) / 3200.0;
        worst = worse(worst, (target.pose[0] - 5e-6 * angle.cos()).abs());
        assert!((target.pose[1] - 5e-6 * angle.sin()).abs() <= 1.05 * expected);
    }
    assert!(worst <= 1.05 * expected && worst > 0.5 * expected, "{worst:e} {expected:e}");
    let omega = core::f64::consts::TAU / 0.32;
    // The third derivative of a cubic spline steps at its nodes, by (node step) · fourth derivative.
    assert!(inconsistency(&targets, [5e-6 * omega.powi(3) * 1.1; 6]) < 1.0);
    assert_eq!(targets[0], targets[3200]);
    // Left early, it stops.
    let stop = run(&mut generator, &plan, &hold());
    assert!(stop.len() > 1);
}

#[test]
fn a_stream_is_followed_at_once_and_a_jump_is_refused_and_held() {
    let plan = plan64();
    let mut generator = ready(&plan);
    let sample = |sequence: u32, x: f64, rate: f64| {
        let mut command = streamed(sequence, x, rate);
        command.target.acceleration[0] = 1e-3;
        command
    };
    let (target, status) = generator.next(&plan, &sample(1, 0.4e-6, 0.0));
    assert_eq!((target.pose, target.acceleration[0], status), (biased([0.4e-6, 0.0, 0.0, 0.0, 0.0, 0.0]), 1e-3, 0));
    // 0.5 µm a tick is the limit.
    let (held, status) = generator.next(&plan, &sample(2, 1.0e-6, 0.0));
    assert_eq!((held, status), (Target::at(target.pose), REFUSED));
    for (sequence, bad) in (3..).zip([f64::NAN, f64::NEG_INFINITY, 1e9]) {
        assert_eq!(generator.next(&plan, &sample(sequence, bad, 0.0)), (held, REFUSED));
        assert_eq!(generator.next(&plan, &sample(100 + sequence, 0.4e-6, bad)), (held, REFUSED));
    }
    // Data near the held pose is followed again.
    let (target, status) = generator.next(&plan, &sample(50, 0.8e-6, 0.0));
    assert_eq!((target.pose[0], status), (0.8e-6, 0));
    // Out of the workspace, step by step: held at the last one inside.
    let mut x = 0.8e-6;
    let refused = (51..).find(|sequence| {
        x += 0.49e-6;
        generator.next(&plan, &sample(*sequence, x, 0.0)).1 == REFUSED
    });
    assert!(refused.is_some() && x > BOUND[0] && x < BOUND[0] + 0.49e-6);
}

#[test]
fn a_stream_that_pauses_is_continued_then_stale_and_comes_back_near_where_it_stopped() {
    let plan = plan64();
    let mut generator = ready(&plan);
    let v = 1e-3;
    let sample = |sequence: u32, x: f64| streamed(sequence, x, v);
    let mut x = 0.0;
    for sequence in 1..=20 {
        x += v * PERIOD;
        assert_eq!(generator.next(&plan, &sample(sequence, x)).1, 0);
    }
    let old = sample(20, x);
    for k in 1..STALE_TICKS {
        let (target, status) = generator.next(&plan, &old);
        assert_eq!((status, target.rate[0]), (0, v));
        assert!((target.pose[0] - x - f64::from(k) * v * PERIOD).abs() < 1e-18);
    }
    let (mut target, status) = generator.next(&plan, &old);
    assert_eq!(status, STALE | BUSY);
    loop {
        let (next, status) = generator.next(&plan, &old);
        assert!(next.pose[0] >= target.pose[0] && next.pose[0] - target.pose[0] <= v * PERIOD);
        target = next;
        if status == STALE {
            break;
        }
    }
    assert_eq!(target, Target::at(target.pose));
    assert_eq!(generator.next(&plan, &sample(21, x)).1, REFUSED | STALE, "far from where it stopped");
    let (back, status) = generator.next(&plan, &sample(22, target.pose[0] + 0.1e-6));
    assert_eq!(status, 0);
    assert!((back.pose[0] - target.pose[0] - 0.1e-6).abs() < 1e-18);
}

#[test]
fn equal_commands_give_equal_digests_and_any_difference_of_state_another() {
    let plan = plan64();
    let digest = |ticks: u32, x: f64| {
        let mut generator = ready(&plan);
        for _ in 0..ticks {
            generator.next(&plan, &command(CommandKind::Move, [x, 0.0, 0.0, 0.0, 0.0, 0.0]));
        }
        let mut digest = specgen_runtime::Digest::new();
        generator.digest(&mut digest);
        digest.finish()
    };
    assert_eq!(digest(10, 5e-6), digest(10, 5e-6));
    assert_ne!(digest(10, 5e-6), digest(11, 5e-6));
    assert_ne!(digest(10, 5e-6), digest(10, f64::from_bits(5e-6_f64.to_bits() + 1)));
}
