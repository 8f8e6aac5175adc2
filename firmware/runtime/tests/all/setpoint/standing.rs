//! Where a generator begins, when it may stand still at once, and when it has to stop first.

use specgen_runtime::setpoint::{
    BUSY, Command, CommandKind, Frames, Generator, LONGEST, MoveLimits, Parallel, Profile, REFUSED, Target, Tool,
};
use specgen_runtime::snapshot::{Field, Reader, Snapshot, Writer};

use super::support::*;
use super::{Setpoints64, biased, plan64};

/// Ticks of one command.
fn go(generator: &mut Generator<f64>, plan: &Setpoints64, order: &Command<f64>, ticks: u32) -> (Target<f64>, u32) {
    let mut last = (*generator.target(), 0);
    for _ in 0..ticks {
        last = generator.next(plan, order);
    }
    last
}

/// A generator in each of its phases, whether it has to stop, and whether the bias is behind it.
fn phases(plan: &Setpoints64) -> Vec<(&'static str, Generator<f64>, bool, bool)> {
    let reset = Generator::new();
    let mut bias = reset;
    go(&mut bias, plan, &hold(), 50);
    let held = ready(plan);
    let with = |order: Command<f64>, ticks: u32| {
        let mut generator = held;
        go(&mut generator, plan, &order, ticks);
        generator
    };
    let moving = with(command(CommandKind::Move, [20e-6, 0.0, 0.0, 0.0, 0.0, 0.0]), 300);
    let mut stopping = with(streamed(1, 0.1e-6, 1e-3), 1);
    go(&mut stopping, plan, &hold(), 1);
    vec![
        ("reset", reset, false, false),
        ("bias", bias, false, false),
        ("hold", held, false, true),
        ("stream at rest", with(streamed(1, 0.1e-6, 0.0), 1), false, true),
        ("stream", with(streamed(1, 0.1e-6, 1e-3), 1), true, true),
        ("move", moving, true, true),
        ("approach", with(trajectory(1), 100), true, true),
        ("trajectory", with(trajectory(0), 100), true, true),
        ("stop", stopping, true, true),
    ]
}

#[test]
fn what_moves_has_to_stop_and_what_stands_still_at_once_is_where_it_was() {
    let plan = plan64();
    for (name, mut generator, moves, began) in phases(&plan) {
        assert_eq!(generator.can_stop(), moves, "{name}");
        let at = generator.target().pose;
        generator.stand_still();
        assert!(!generator.can_stop(), "{name}");
        assert_eq!(*generator.target(), Target::at(at), "{name}");
        // The bias is gone to all the same; from there nothing moves.
        let (target, status) = go(&mut generator, &plan, &hold(), 1);
        assert_eq!(status == 0, began, "{name}");
        if began {
            assert_eq!(target, Target::at(at), "{name}");
        } else {
            let (target, status) = go(&mut generator, &plan, &hold(), 3000);
            assert_eq!((target, status), (Target::at(BIAS), 0), "{name}");
        }
    }
}

/// Bit by bit, from any phase, under the same and under other commands.
#[test]
fn a_generator_goes_on_from_its_words_as_if_nothing_had_been() {
    let plan = plan64();
    for (name, generator, ..) in phases(&plan) {
        let mut words = [0; Generator::<f64>::WORDS];
        generator.save(&mut Writer::new(&mut words));
        let mut restored = Generator::new();
        restored.restore(&mut Reader::new(&words)).unwrap();
        for order in [hold(), command(CommandKind::Trajectory, [0.0; 6]), streamed(1, 0.1e-6, 1e-3)] {
            let (mut first, mut second) = (generator, restored);
            for tick in 0..500 {
                assert_eq!(first.next(&plan, &order), second.next(&plan, &order), "{name}, tick {tick}");
            }
        }
    }
}

#[test]
fn it_begins_where_the_platform_is_brought_within_the_workspace() {
    let plan = plan64();
    let far = [1.0, -1.0, 20e-6, 0.1e-3, -9.0, 9.0];
    let mut generator = Generator::starting_at(&plan, &far);
    let [x, y, _, _, b, c] = BOUND;
    let from = [x, -y, 20e-6, 0.1e-3, -b, c];
    assert_eq!(*generator.target(), Target::at(from));
    let (first, status) = generator.next(&plan, &hold());
    assert_eq!(status, BUSY);
    for axis in 0..6 {
        assert!((first.pose[axis] - from[axis]).abs() <= SPEED[axis] * PERIOD, "axis {axis}");
    }
    let (last, _) = go(&mut generator, &plan, &hold(), 20_000);
    assert_eq!(last, Target::at(BIAS));
}

/// `tick_as` is `tick` under another kind of command.
#[test]
fn a_kind_given_apart_takes_the_place_of_that_of_the_command() {
    let plan = plan64();
    let (mut first, mut second) = (ready(&plan), ready(&plan));
    let order = command(CommandKind::Move, [5e-6, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for tick in 0..2000 {
        let kind = if tick < 300 { CommandKind::Move } else { CommandKind::Hold };
        let status = first.tick_as(&plan, kind, &order);
        assert_eq!((*first.target(), status), second.next(&plan, &Command { kind, ..order }), "tick {tick}");
    }
}

/// A pose is admitted with the bias, in frames of the user too, and neither beyond the bound nor where it is no number.
#[test]
fn poses_are_admitted_with_the_bias_and_only_within_the_bound() {
    let parallel = plan::<f64, _>(Parallel, vec![]);
    let tool = plan::<f64, _>(Tool { point: [0.0, 0.0, 40e-3], largest_angle: 1e-3 }, vec![]);
    for axis in 0..6 {
        let room = BOUND[axis] - BIAS[axis];
        let at = |value: f64| -> [f64; 6] { std::array::from_fn(|k| if k == axis { value } else { 0.0 }) };
        assert_eq!(parallel.admitted(&at(0.5 * room)), Some(biased(at(0.5 * room))));
        assert_eq!(parallel.admitted(&at(room * (1.0 - 1e-12))).map(|pose| pose[axis] <= BOUND[axis]), Some(true));
        for bad in [room * (1.0 + 1e-12), -(BOUND[axis] + BIAS[axis]) * (1.0 + 1e-12), f64::NAN, f64::INFINITY] {
            assert_eq!(parallel.admitted(&at(bad)), None, "axis {axis}: {bad}");
            assert_eq!(tool.admitted(&at(bad)), None, "axis {axis}: {bad}");
        }
    }
    // The target stays as it is where a pose is not admitted, and rates come along where it is.
    let mut target = Target::at([1e-6; 6]);
    assert!(!parallel.admit(&Target::at([1.0; 6]), &mut target) && target == Target::at([1e-6; 6]));
    let user = Target { pose: [2e-6; 6], rate: [3.0; 6], acceleration: [4.0; 6] };
    assert!(parallel.admit(&user, &mut target));
    assert_eq!(target, Target { pose: biased(user.pose), ..user });
    let turned = tool.frames.to_platform(&user).unwrap();
    assert!(tool.admit(&user, &mut target));
    assert_eq!(target, Target { pose: biased(turned.pose), ..turned });
}

#[test]
fn commands_have_words_and_other_words_are_none() {
    let kinds = [CommandKind::Hold, CommandKind::Stream, CommandKind::Move, CommandKind::Trajectory];
    for (word, kind) in (0..).zip(kinds) {
        assert_eq!(CommandKind::from_word(word), kind);
    }
    assert_eq!([5, u64::MAX].map(CommandKind::from_word), [CommandKind::Unknown; 2]);
}

/// The way that takes the longest phase at full speed is one, a way that takes a tick more is none.
#[test]
fn no_way_takes_longer_than_the_longest_phase() {
    let limits = |speed: i32| MoveLimits { speed: [f64::from(speed); 6], acceleration: [1.0; 6], jerk: [1.0; 6] };
    let way = [0.0, 1.0, 0.0, -0.5, 0.0, 0.0];
    assert_eq!(Profile::plan(&way, &limits(LONGEST)).map(|profile| profile.ticks()), Some(LONGEST + 2));
    assert_eq!(Profile::plan(&way, &limits(LONGEST + 1)), None);
}

/// The words of a snapshot are checked one by one: a course may not belong to its way, or the way not to its ends.
#[test]
fn a_bias_that_a_snapshot_leads_astray_ends_at_the_bias_within_the_workspace() {
    const PHASE_AND_PLACE: usize = 2 + 12;
    let plan = plan64();
    let mut on_its_way = Generator::new();
    go(&mut on_its_way, &plan, &hold(), 600);
    let mut words = [0; Generator::<f64>::WORDS];
    on_its_way.save(&mut Writer::new(&mut words));
    let (way, profile) = (PHASE_AND_PLACE + 12, PHASE_AND_PLACE + 18 + 18);
    let changes: [(usize, u64); 4] = [
        (way, (2.0 * BOUND[0]).to_bits()),
        (way + 2, (2.0 * BOUND[2]).to_bits()),
        (profile + 2, 5_000_000),
        (profile + 3, 1.0_f64.to_bits()),
    ];
    let mut strayed = 0;
    for (place, word) in changes {
        let mut changed = words;
        changed[place] = word;
        let mut generator = Generator::new();
        generator.restore(&mut Reader::new(&changed)).unwrap();
        for _ in 0..20_000 {
            let (target, status) = generator.next(&plan, &hold());
            strayed += u32::from(status & REFUSED != 0);
            assert!(target.pose.iter().zip(BOUND).all(|(value, bound)| value.abs() <= bound), "{place}: {target:?}");
        }
        assert_eq!(*generator.target(), Target::at(BIAS), "word {place}");
    }
    assert!(strayed > 1, "no course left the workspace");
}
