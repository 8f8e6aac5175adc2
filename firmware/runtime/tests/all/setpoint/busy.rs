//! Busy stays set from the first motion of a command to its last: no tick between them says that the platform has arrived.

use specgen_runtime::setpoint::{BUSY, Command, CommandKind, Generator, Target};

use super::support::*;
use super::{Setpoints64, biased, plan64};

const AWAY: [f64; 6] = [-3e-6, 2e-6, 0.0, 20e-6, 0.0, 0.0];

fn moving(to: [f64; 6]) -> Command<f64> {
    command(CommandKind::Move, to)
}

/// A generator with its bias behind it that has had `ticks` of a command.
fn under(plan: &Setpoints64, order: &Command<f64>, ticks: u32) -> Generator<f64> {
    let mut generator = ready(plan);
    for _ in 0..ticks {
        generator.next(plan, order);
    }
    generator
}

/// What is under way when the command comes.
fn beginnings(plan: &Setpoints64) -> Vec<(&'static str, Generator<f64>)> {
    let mut bias = Generator::new();
    bias.next(plan, &hold());
    let mut stopping = under(plan, &moving(AWAY), 300);
    stopping.next(plan, &hold());
    vec![
        ("reset", Generator::new()),
        ("bias", bias),
        ("hold", ready(plan)),
        ("hold elsewhere", under(plan, &moving(AWAY), 5000)),
        ("move", under(plan, &moving(AWAY), 300)),
        ("stop", stopping),
        ("stream", under(plan, &streamed(1, 0.1e-6, 1e-3), 1)),
        ("approach", under(plan, &trajectory(1), 100)),
        ("another trajectory", under(plan, &trajectory(0), 6000)),
    ]
}

/// A command with its name, and where it ends; none for a table that repeats.
type NamedCommand = (&'static str, Command<f64>, Option<[f64; 6]>);

fn commands() -> Vec<NamedCommand> {
    let ends = |selector: u32| {
        let plan = plan64();
        let mut generator = ready(&plan);
        for _ in 0..60_000 {
            generator.next(&plan, &trajectory(selector));
        }
        *generator.place()
    };
    vec![
        ("move", moving([5e-6, -5e-6, 0.0, 0.0, 10e-6, 0.0]), Some([5e-6, -5e-6, 0.0, 0.0, 10e-6, 0.0])),
        ("trajectory from the bias", trajectory(0), Some(ends(0))),
        ("trajectory from elsewhere", trajectory(1), Some(ends(1))),
        ("trajectory that repeats", trajectory(2), None),
    ]
}

/// Ticks in which busy falls before the end; the last target, unless it is busy for ever.
fn dips(plan: &Setpoints64, generator: &mut Generator<f64>, order: &Command<f64>) -> (Vec<u32>, Option<Target<f64>>) {
    let (mut dips, mut begun) = (Vec::new(), 0);
    for tick in 0..60_000 {
        let before = *generator.target();
        let (target, status) = generator.next(plan, order);
        if target != before || status & BUSY != 0 {
            begun = tick + 1;
        }
        if status & BUSY == 0 {
            dips.push(tick);
        }
    }
    // What is left at the end is rest.
    dips.retain(|tick| tick + 1 < begun);
    (dips, (begun < 60_000).then(|| *generator.target()))
}

#[test]
fn busy_does_not_fall_between_two_motions_of_a_command() {
    let plan = plan64();
    for (before, begun) in beginnings(&plan) {
        for (name, order, end) in commands() {
            let mut generator = begun;
            let (dips, last) = dips(&plan, &mut generator, &order);
            assert_eq!(dips, [0; 0], "{before}, then {name}");
            assert_eq!(last.map(|target| target.pose), end.map(biased), "{before}, then {name}");
        }
    }
}

#[test]
fn busy_falls_with_the_last_tick_of_a_motion_that_nothing_follows() {
    let plan = plan64();
    let outside = moving([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for order in [hold(), moving([0.0; 6]), moving([f64::NAN; 6]), outside, trajectory(7)] {
        let mut generator = Generator::new();
        let mut ticks = 0;
        while *generator.target() != Target::at(BIAS) {
            let (target, status) = generator.next(&plan, &order);
            assert_eq!(status == BUSY, target != Target::at(BIAS), "{order:?}, tick {ticks}");
            ticks += 1;
        }
        assert!(ticks > 1000);
    }
    // Given up in the tick in which the approach arrives: nothing is played.
    let mut generator = ready(&plan);
    while generator.next(&plan, &trajectory(1)).0 != Target::at(biased([5e-6, 0.0, 0.0, 0.0, 0.0, 0.0])) {}
    let arrived = *generator.target();
    assert_eq!(generator.next(&plan, &hold()), (arrived, 0));
}
