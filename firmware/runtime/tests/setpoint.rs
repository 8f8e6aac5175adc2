//! The set-point generator: what it does on command, what it refuses, and what it promises whatever the command.

mod common;
mod setpoint_support;

use common::Random;
use setpoint_support::*;
use specgen_runtime::Real;
use specgen_runtime::setpoint::{
    BUSY, Command, CommandKind, Frames, Generator, MoveLimits, Parallel, Plan, Profile, REFUSED, STALE, Target, Tool,
    Work,
};

type Plan64 = Plan<f64, Parallel>;

fn plan64() -> Plan64 {
    plan(Parallel, vec![spiral(), ring(false), ring(true)])
}

fn biased(pose: [f64; 6]) -> [f64; 6] {
    std::array::from_fn(|axis| pose[axis] + BIAS[axis])
}

/// Steps with one command until it is no longer busy; every set-point on the way.
fn run(generator: &mut Generator<f64>, plan: &Plan64, command: &Command<f64>) -> Vec<Target<f64>> {
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
            worst = worst.max((by_pose.abs() - rounding) / (third * PERIOD * PERIOD / 2.0));
            worst = worst.max((by_rate.abs() - rounding) / (third * PERIOD / 2.0));
        }
    }
    worst
}

#[test]
fn after_reset_the_bias_is_approached_slowly_whatever_the_command() {
    let plan = plan64();
    for kind in [CommandKind::Hold, CommandKind::Stream, CommandKind::Move, CommandKind::Trajectory] {
        let mut generator = Generator::new();
        let mut watch = Watch::new([0.0; 6], SPEED.map(|v| v * PERIOD), SPEED);
        let mut ticks = 0;
        let last = loop {
            let order = Command { sequence: ticks, ..command(kind, [1e-6, 0.0, 0.0, 0.0, 0.0, 0.0]) };
            let (target, status) = generator.next(&plan, &order);
            assert_eq!(watch.broken(&target), None);
            assert_eq!(target.pose[0], 0.0);
            ticks += 1;
            assert!(ticks < 20_000);
            if status == 0 {
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
            worst = worst.max(f64::from(ticks) / optimum);
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
    assert_eq!(targets.last().unwrap().pose, biased(first.target.pose));
    assert_eq!(run(&mut generator, &plan, &second).last().unwrap().pose, biased(second.target.pose));
}

#[test]
fn a_stop_goes_on_without_a_step_in_pose_or_rate_and_keeps_the_limits_of_moves() {
    let plan = plan64();
    for interrupted_after in [1, 50, 100, 150, 500, 1000] {
        let mut generator = ready(&plan);
        let order = command(CommandKind::Move, [30e-6, 0.0, -5e-6, 0.0, 0.0, 0.0]);
        let mut before = Target::at(BIAS);
        for _ in 0..interrupted_after {
            before = generator.next(&plan, &order).0;
        }
        let stop = run(&mut generator, &plan, &hold());
        assert!((stop[0].rate[0] - before.rate[0]).abs() <= ACCELERATION[0] * PERIOD, "{interrupted_after}");
        let mut last = before;
        for target in &stop {
            let step = target.pose[0] - last.pose[0];
            assert!(step >= 0.0 && step <= before.rate[0] * PERIOD * (1.0 + 1e-9), "{step:e}");
            assert!(target.acceleration[0].abs() <= ACCELERATION[0] * (1.0 + 1e-9));
            last = *target;
        }
        assert_eq!(last, Target::at(last.pose));
        assert_eq!(generator.next(&plan, &hold()), (last, 0));
    }
}

#[test]
fn a_stop_before_a_wall_is_as_short_as_it_must_be_and_stays_inside() {
    let plan = plan64();
    let mut generator = ready(&plan);
    // 4 mm/s towards the wall at 50 µm: the gentle stop would take 0.6 s and 1.2 mm.
    let v = 4e-3;
    let mut last = Target::at(BIAS);
    for sequence in 1..=100 {
        let x = v * PERIOD * f64::from(sequence);
        if x > 40e-6 {
            break;
        }
        let mut target = Target::at([x, 0.0, 0.0, 0.0, 0.0, 0.0]);
        target.rate[0] = v;
        let order = Command { kind: CommandKind::Stream, selector: 0, sequence, target };
        let (target, status) = generator.next(&plan, &order);
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
    assert_eq!(again.last(), Some(&Target::at(BIAS)));
    assert_eq!(run(&mut generator, &plan, &order), targets);
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
        worst = worst.max((target.pose[0] - x).abs()).max((target.pose[1] - y).abs());
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
    let order = Command { selector: 2, ..command(CommandKind::Trajectory, [0.0; 6]) };
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
        worst = worst.max((target.pose[0] - 5e-6 * angle.cos()).abs());
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
        let mut target = Target::at([x, 0.0, 0.0, 0.0, 0.0, 0.0]);
        target.rate[0] = rate;
        target.acceleration[0] = 1e-3;
        Command { kind: CommandKind::Stream, selector: 0, sequence, target }
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
    let sample = |sequence: u32, x: f64| {
        let mut target = Target::at([x, 0.0, 0.0, 0.0, 0.0, 0.0]);
        target.rate[0] = v;
        Command { kind: CommandKind::Stream, selector: 0, sequence, target }
    };
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

/// Any word that a link may deliver: mostly plausible, now and then anything.
fn random_command<T: Real>(random: &mut Random, last: &Target<T>, previous: &Command<T>) -> Command<T> {
    if random.unit() < 0.9 {
        // A user keeps to one thing for a while, and a stream goes on from where it is.
        let mut command = *previous;
        if command.kind == CommandKind::Stream {
            command.sequence = command.sequence.wrapping_add(u32::from(random.unit() < 0.9));
            for axis in 0..6 {
                let step =
                    STREAM_SPEED[axis] * PERIOD * (2.2 * random.unit() - 1.1) * if axis == 2 { 1.0 } else { 0.3 };
                command.target.pose[axis] = last.pose[axis] - T::from_f64(BIAS[axis]) + T::from_f64(step);
                command.target.rate[axis] = T::from_f64(STREAM_SPEED[axis] * (2.05 * random.unit() - 1.025));
            }
        }
        return command;
    }
    let mut target = Target::new();
    for numbers in [&mut target.pose, &mut target.rate, &mut target.acceleration] {
        for (axis, number) in numbers.iter_mut().enumerate() {
            *number = match random.below(40) {
                0 => T::from_word(random.next() << 33 | random.next()),
                1 => T::from_f64(f64::NAN),
                2 => T::from_f64(f64::NEG_INFINITY),
                _ => T::from_f64(BOUND[axis] * 1.1 * (2.0 * random.unit() - 1.0)),
            };
        }
    }
    Command {
        kind: CommandKind::from_word(random.below(5) as u64),
        selector: random.below(5) as u32,
        sequence: random.below(1 << 30) as u32,
        target,
    }
}

/// Ticks under random commands; what is broken first, and how often each status bit was seen.
fn hammer<T: Real + Into<f64> + std::fmt::Debug, F: Frames<T>>(
    plan: &Plan<T, F>,
    step: [f64; 6],
    rate: [f64; 6],
    ticks: u32,
) -> (Option<String>, [u32; 4]) {
    let mut random = Random(11);
    let mut generator = Generator::<T>::new();
    let mut watch = Watch::new([0.0; 6], step, rate);
    let mut previous = hold();
    let mut last = Target::<T>::new();
    let mut seen = [0; 4];
    for tick in 0..ticks {
        previous = random_command(&mut random, &last, &previous);
        let (target, status) = generator.next(plan, &previous);
        if let Some(broken) = watch.broken(&target) {
            return (Some(format!("tick {tick}: {broken} after {previous:?}")), seen);
        }
        for (count, bit) in seen.iter_mut().zip([0, REFUSED, STALE, BUSY]) {
            *count += u32::from(if bit == 0 { status == 0 } else { status & bit != 0 });
        }
        last = target;
    }
    (None, seen)
}

fn either(a: [f64; 6], b: [f64; 6]) -> [f64; 6] {
    std::array::from_fn(|axis| f64::max(a[axis], b[axis]))
}

#[test]
fn no_command_makes_it_leave_the_workspace_jump_or_say_anything_that_is_not_a_number() {
    let rate = either(SPEED, STREAM_SPEED);
    let step = rate.map(|v| v * PERIOD * (1.0 + 1e-5));
    let (broken, seen) = hammer(&plan64(), step, rate, 1_000_000);
    println!("f64: clear, refused, stale, busy {seen:?}");
    assert_eq!(broken, None);
    assert!(seen.iter().all(|count| *count > 10_000), "{seen:?}");
    let single = plan::<f32, _>(Parallel, vec![spiral(), ring(false), ring(true)]);
    let (broken, seen) = hammer(&single, step, rate, 1_000_000);
    println!("f32: clear, refused, stale, busy {seen:?}");
    assert_eq!(broken, None);
    assert!(seen.iter().all(|count| *count > 10_000), "{seen:?}");
}

#[test]
fn frames_keep_the_workspace_and_the_numbers_too() {
    // Speeds along other axes and about another point: looser steps, the same walls.
    let rate = either(SPEED, STREAM_SPEED).map(|_| 0.2);
    let step = rate.map(|v| v * PERIOD);
    let trajectories = || vec![spiral(), ring(false), ring(true)];
    let tool = Tool { point: [0.0, 5e-3, 40e-3], largest_angle: 1e-3 };
    let (broken, seen) = hammer(&plan(tool, trajectories()), step, rate, 200_000);
    assert_eq!(broken, None);
    assert!(seen.iter().all(|count| *count > 1000), "{seen:?}");
    let work = Work {
        axes: rotation([0.3, -0.2, 0.7]).map(|row| row.map(|x| x as f32)),
        point: [0.0, 5e-3, 40e-3],
        largest_angle: 1e-3,
    };
    let single = plan::<f32, _>(work, vec![spiral(), ring(false), ring(true)]);
    let (broken, seen) = hammer(&single, step, rate, 200_000);
    assert_eq!(broken, None);
    assert!(seen.iter().all(|count| *count > 1000), "{seen:?}");
}

#[test]
fn the_watch_sees_a_step_an_ulp_too_large_a_pose_outside_and_a_nan() {
    let watch = || Watch::new([0.0; 6], [1e-6; 6], [1e-3; 6]);
    let at = |x: f64| Target::at([x, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(watch().broken(&at(1e-6)), None);
    assert!(watch().broken(&at(1.000_001e-6)).is_some());
    assert!(watch().broken(&at(f64::NAN)).is_some());
    let mut wide = Watch::new([0.0; 6], [1.0; 6], [1e-3; 6]);
    assert!(wide.broken(&at(BOUND[0])).is_none() && wide.broken(&at(BOUND[0] * (1.0 + 1e-15))).is_some());
    // A plan whose walls are too wide, or whose stream may jump, is caught by the random commands.
    let rate = either(SPEED, STREAM_SPEED);
    let step = rate.map(|v| v * PERIOD * (1.0 + 1e-5));
    let mut wide = plan64();
    wide.bound[2] *= 1.02;
    assert!(hammer(&wide, step, rate, 400_000).0.is_some());
    let mut fast = plan64();
    fast.stream_step[2] *= 1.02;
    assert!(hammer(&fast, step, rate, 400_000).0.is_some());
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

fn product(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transpose(a: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// Rz Ry Rx, factor by factor.
fn rotation(angles: [f64; 3]) -> [[f64; 3]; 3] {
    let [(sx, cx), (sy, cy), (sz, cz)] = angles.map(f64::sin_cos);
    let x = [[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]];
    let y = [[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]];
    let z = [[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]];
    product(&product(&z, &y), &x)
}

const POINT: [f64; 3] = [7e-3, -5e-3, 40e-3];
const AXES: [f64; 3] = [0.4, -0.3, 1.1];

fn work() -> Work<f64> {
    Work { axes: rotation(AXES), point: POINT, largest_angle: 0.26 }
}

/// Pose of P_C by the definition: where the tool point is, which way the platform is turned.
fn by_definition(user: [f64; 6]) -> [f64; 6] {
    let w = rotation(AXES);
    let r = product(&product(&w, &rotation([user[3], user[4], user[5]])), &transpose(&w));
    let moved = |row: usize| (0..3).map(|k| w[row][k] * user[k]).sum::<f64>();
    let turned = |row: usize| (0..3).map(|k| r[row][k] * POINT[k]).sum::<f64>();
    let t: [f64; 3] = std::array::from_fn(|row| moved(row) + POINT[row] - turned(row));
    [t[0], t[1], t[2], r[2][1].atan2(r[2][2]), (-r[2][0]).asin(), r[1][0].atan2(r[0][0])]
}

#[test]
fn work_frames_place_the_tool_point_and_turn_about_it() {
    let mut random = Random(23);
    let mut worst = 0.0_f64;
    for _ in 0..5000 {
        let size = if random.unit() < 0.5 { 1e-3 } else { 0.25 };
        let user: [f64; 6] =
            std::array::from_fn(|axis| (if axis < 3 { 50e-6 } else { size }) * (2.0 * random.unit() - 1.0));
        let pose = work().to_platform(&Target::at(user)).unwrap().pose;
        let expected = by_definition(user);
        for axis in 0..6 {
            worst = worst.max((pose[axis] - expected[axis]).abs());
        }
    }
    println!("f64 against the definition: {worst:.1e} m, rad");
    // The definition itself cancels: eps of 40 mm, of a radian.
    assert!(worst < 4e-16, "{worst:e}");
    let tool = Tool { point: POINT, largest_angle: 0.26 };
    let straight = Work { axes: rotation([0.0; 3]), ..work() };
    let user = Target {
        pose: [1e-6, 2e-6, 3e-6, 0.1, -0.2, 0.05],
        rate: [0.1; 6],
        acceleration: [0.3, 1.0, -2.0, 0.4, 0.5, 0.6],
    };
    let (a, b) = (tool.to_platform(&user).unwrap(), straight.to_platform(&user).unwrap());
    for (a, b) in [(a.pose, b.pose), (a.rate, b.rate), (a.acceleration, b.acceleration)] {
        for axis in 0..6 {
            assert!((a[axis] - b[axis]).abs() < 1e-15, "{a:?} {b:?}");
        }
    }
}

#[test]
fn rates_and_accelerations_through_frames_are_the_derivatives_of_the_pose() {
    // A smooth motion of large angles; differences of the platform's coordinates in time.
    let user = |t: f64| {
        let phase = |axis: usize| 3.0 * t + 0.7 * axis as f64;
        let size = |axis: usize| if axis < 3 { 1e-3 } else { 0.2 };
        Target {
            pose: std::array::from_fn(|axis| size(axis) * phase(axis).sin()),
            rate: std::array::from_fn(|axis| 3.0 * size(axis) * phase(axis).cos()),
            acceleration: std::array::from_fn(|axis| -9.0 * size(axis) * phase(axis).sin()),
        }
    };
    let h = 1e-4;
    for k in 0..300 {
        let t = 0.01 * f64::from(k);
        let [before, here, after] = [t - h, t, t + h].map(|t| work().to_platform(&user(t)).unwrap());
        for axis in 0..6 {
            let rate = (after.pose[axis] - before.pose[axis]) / (2.0 * h);
            let acceleration = (after.rate[axis] - before.rate[axis]) / (2.0 * h);
            assert!((rate - here.rate[axis]).abs() < 1e-7, "axis {axis}: {rate} {}", here.rate[axis]);
            assert!((acceleration - here.acceleration[axis]).abs() < 3e-7, "axis {axis}");
        }
    }
}

#[test]
fn frames_in_single_precision_keep_a_tenth_of_a_nanometre() {
    let mut random = Random(29);
    let single = Work {
        axes: work().axes.map(|row| row.map(|x| x as f32)),
        point: POINT.map(|x| x as f32),
        largest_angle: 0.01,
    };
    let exact = Work {
        axes: single.axes.map(|row| row.map(f64::from)),
        point: single.point.map(f64::from),
        largest_angle: 0.01,
    };
    let mut worst = [0.0_f64; 2];
    for _ in 0..5000 {
        let user: [f32; 6] =
            std::array::from_fn(|axis| ((if axis < 3 { 50e-6 } else { 0.4e-3 }) * (2.0 * random.unit() - 1.0)) as f32);
        let a = single.to_platform(&Target::at(user)).unwrap().pose;
        let b = exact.to_platform(&Target::at(user.map(f64::from))).unwrap().pose;
        for axis in 0..6 {
            let worst = &mut worst[axis / 3];
            *worst = worst.max((f64::from(a[axis]) - b[axis]).abs());
        }
    }
    println!("f32 frames against f64: {:.1e} m, {:.1e} rad", worst[0], worst[1]);
    assert!(worst[0] < 0.02e-9 && worst[1] < 0.2e-9, "{worst:?}");
}

#[test]
fn an_angle_beyond_what_is_meant_is_refused() {
    for bad in [0.27, -0.27, 6.3, 1e300, f64::NAN, f64::INFINITY] {
        assert!(work().to_platform(&Target::at([0.0, 0.0, 0.0, 0.0, bad, 0.0])).is_none(), "{bad}");
    }
}
