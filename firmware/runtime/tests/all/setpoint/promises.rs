//! What holds whatever the command: random commands, and a watch that keeps count of what comes out.

use specgen_runtime::Real;
use specgen_runtime::setpoint::{
    BUSY, Command, CommandKind, Frames, Generator, Parallel, REFUSED, STALE, Setpoints, Target, Tool, Work,
};

use super::plan64;
use super::support::*;
use crate::common::{Random, rotation};

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
    plan: &Setpoints<T, F>,
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
