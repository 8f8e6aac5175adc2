//! Stops: their limits are kept in every tick, they end when and where they are said to, and no sooner stop would keep them.

use specgen_runtime::Real;
use specgen_runtime::setpoint::{
    BUSY, Command, CommandKind, Generator, Parallel, STALE, Setpoints, StopLimits, Target,
};

use super::support::*;
use crate::common::Random;

/// Limits of stops at random, in SI units.
fn limits(random: &mut Random) -> [[f64; 6]; 2] {
    let mut log = |low: f64, high: f64| std::array::from_fn(|_| low * (high / low).powf(random.unit()));
    [log(1e-2, 1e3), log(1e2, 1e7)]
}

fn with<T: Real>([acceleration, jerk]: &[[f64; 6]; 2], shortest: i32) -> Setpoints<T, Parallel> {
    let mut plan = plan::<T, _>(Parallel, vec![]);
    plan.stop = StopLimits {
        acceleration: six(acceleration.map(|a| 1.0 / (a * PERIOD * PERIOD))),
        jerk: six(jerk.map(|j| 1.0 / (j * PERIOD * PERIOD * PERIOD))),
        shortest,
    };
    plan.bound = six([1.0; 6]);
    plan.bias = six([0.0; 6]);
    plan
}

/// A generator at rest that has taken one set-point of a stream at `rate`, and what it gave out.
fn streaming<T: Real>(plan: &Setpoints<T, Parallel>, rate: &[f64; 6]) -> (Generator<T>, Command<T>, Target<T>) {
    let mut generator = ready(plan);
    let mut target = Target::at(six(rate.map(|v| v * PERIOD)));
    target.rate = six(*rate);
    let order = Command { kind: CommandKind::Stream, selector: 0, sequence: 1, target };
    let (first, status) = generator.next(plan, &order);
    assert_eq!(status, 0);
    (generator, order, first)
}

fn hold_to_limits<T: Real + Into<f64> + std::fmt::Debug>(slack: f64) {
    let mut random = Random(41);
    let mut lengths = [0; 3];
    for _ in 0..2000 {
        let limits = limits(&mut random);
        let shortest = if random.unit() < 0.5 { 1 } else { 1 + random.below(20) as i32 };
        let plan = with::<T>(&limits, shortest);
        let moving = random.unit();
        let rate: [f64; 6] = std::array::from_fn(|axis| {
            let share = if random.unit() < 0.5 { moving * (2.0 * random.unit() - 1.0) } else { 0.0 };
            STREAM_SPEED[axis] * share
        });
        let (mut generator, order, first) = streaming(&plan, &rate);
        // The same set-point until it is stale: the last rate goes on.
        let mut last = first;
        for _ in 1..STALE_TICKS {
            let (target, status) = generator.next(&plan, &order);
            assert_eq!((status, doubles(target.rate)), (0, doubles(first.rate)));
            last = target;
        }
        let from = last;
        let per_tick = rate.map(|v| v * PERIOD);
        let ticks = plan.stop.ticks(&six(per_tick));
        lengths[usize::from(ticks > 3) + usize::from(ticks > 300)] += 1;
        for tick in 1..=ticks {
            let (target, status) = generator.next(&plan, &order);
            let ended = tick == ticks || rate == [0.0; 6];
            assert_eq!(status, if ended { STALE } else { STALE | BUSY }, "tick {tick} of {ticks}");
            for axis in 0..6 {
                let [a, before]: [f64; 2] = [target.acceleration[axis].into(), last.acceleration[axis].into()];
                let [v, rate_before]: [f64; 2] = [target.rate[axis].into(), last.rate[axis].into()];
                let [most, jerk] = [limits[0][axis], limits[1][axis]];
                assert!(a.abs() <= most * (1.0 + slack), "axis {axis}: {a} of {most}");
                assert!((a - before).abs() <= jerk * PERIOD * (1.0 + slack) + slack * most, "axis {axis}: jerk");
                assert!((v - rate_before).abs() <= most * PERIOD * (1.0 + slack) + slack * rate[axis].abs());
                assert!(
                    v * rate[axis] >= 0.0 && v.abs() <= rate[axis].abs() * (1.0 + slack),
                    "never back, never faster"
                );
            }
            last = target;
        }
        assert_eq!(last, Target::at(last.pose), "at rest");
        for (axis, per_tick) in per_tick.iter().enumerate() {
            let [end, begin]: [f64; 2] = [last.pose[axis].into(), from.pose[axis].into()];
            let way = per_tick * f64::from(ticks) * 0.5;
            assert!((end - begin - way).abs() <= slack * (way.abs() + 1e-3), "axis {axis}: {} {way}", end - begin);
        }
        assert!(ticks >= shortest);
        // A tick less would break a limit: 1.5 v/D of deceleration or 6 v/D² of jerk.
        let d = f64::from(ticks - 1) * PERIOD;
        let broken = |axis: usize| {
            1.5 * rate[axis].abs() / d > limits[0][axis] * (1.0 - slack)
                || 6.0 * rate[axis].abs() / (d * d) > limits[1][axis] * (1.0 - slack)
        };
        assert!(ticks == shortest || (0..6).any(broken), "{ticks} ticks are too many");
    }
    assert!(lengths.iter().all(|count| *count > 20), "short, middle and long stops: {lengths:?}");
}

#[test]
fn a_stop_keeps_its_limits_in_every_tick_and_ends_when_and_where_it_is_said_to() {
    hold_to_limits::<f64>(1e-9);
    hold_to_limits::<f32>(1e-5);
}

#[test]
fn moves_do_not_know_the_limits_of_stops_nor_stops_those_of_moves() {
    let order = command(CommandKind::Move, [20e-6, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let run = |plan: &Setpoints<f64, Parallel>, interrupted: usize| {
        let mut generator = ready(plan);
        let moved: Vec<Target<f64>> = (0..interrupted).map(|_| generator.next(plan, &order).0).collect();
        let stop: Vec<Target<f64>> = (0..4000).map(|_| generator.next(plan, &hold()).0).collect();
        (moved, stop)
    };
    let usual = plan::<f64, _>(Parallel, vec![]);
    let mut gentle = plan::<f64, _>(Parallel, vec![]);
    gentle.stop = StopLimits { acceleration: gentle.limits.acceleration, jerk: gentle.limits.jerk, shortest: 1 };
    let mut lively = plan::<f64, _>(Parallel, vec![]);
    lively.limits.jerk = lively.limits.jerk.map(|limit| 0.5 * limit);
    let [a, b, c] = [&usual, &gentle, &lively].map(|plan| run(plan, 700));
    assert!(a.0 == b.0 && a.0 != c.0);
    let way = |(moved, stop): &(Vec<Target<f64>>, Vec<Target<f64>>)| stop[3999].pose[0] - moved[699].pose[0];
    // 100 µm/s within 10 mm/s² take 15 ms and with 1 m/s³ 24.5 ms; within the limits of stops 0.3 ms.
    assert!((way(&b) - 100e-6 * 24.5e-3 / 2.0).abs() < 1e-8, "{:e}", way(&b));
    assert!((way(&a) - 100e-6 * 0.3e-3 / 2.0).abs() < 1e-9, "{:e}", way(&a));
    assert!((way(&a) - way(&c)).abs() < 1e-12);
}
