//! Waves: their shapes against textbook formulas, their derivatives against differences, their limits, and their ends.

use crate::common::worse;
use specgen_runtime::Motion;
use specgen_runtime::setpoint::{MoveLimits, Parallel, Setpoints, StopLimits};
use specgen_runtime::wave::{AxisWave, Limits, Refusal, Settings, Shape, Stage, TONES, Tone, WORDS, Wave, step_of};

const PERIOD: f64 = 1e-4;

fn wide<T: specgen_runtime::Real>() -> Limits<T> {
    let all = |value: f64| [T::from_f64(value); 6];
    Limits {
        low: all(-1.0),
        high: all(1.0),
        rate: all(1e3),
        acceleration: all(1e7),
        ticks_per_second: T::from_f64(1.0 / PERIOD),
    }
}

fn tone(amplitude: f64, frequency: f64) -> Tone<f64> {
    Tone { amplitude, phase: 1 << 60, step: step_of(frequency, PERIOD) }
}

fn run(settings: &Settings<f64>, limits: Limits<f64>) -> Vec<Motion<f64>> {
    let mut wave = Wave::new(limits);
    wave.set(settings).unwrap_or_else(|refused| panic!("{refused:?}"));
    wave.start();
    let all: Vec<_> = std::iter::from_fn(|| wave.advance()).take(1_000_000).collect();
    assert_eq!(wave.stage(), Stage::Idle);
    assert_eq!(wave.sequence() as usize, all.len());
    all
}

/// Every shape at once, one an axis.
fn every_shape() -> Settings<f64> {
    let mut settings = Settings::still();
    settings.tones[3] = tone(1e-5, 50.0);
    settings.tones[4] = tone(2e-5, 130.0);
    let axis = |offset, shape| AxisWave { offset, shape };
    let sweep = (step_of(150.0, PERIOD) - step_of(5.0, PERIOD)) as i64 / 3000;
    settings.axes = [
        axis(1e-5, Shape::Constant),
        axis(0.0, Shape::Ramp { amplitude: -3e-5, ticks: 2500 }),
        axis(0.0, Shape::Triangle { amplitude: 4e-5, step: step_of(7.0, PERIOD) }),
        axis(-1e-5, Shape::Sine { tone: tone(3e-5, 60.0) }),
        axis(0.0, Shape::Chirp { tone: tone(3e-5, 5.0), sweep, ticks: 3000 }),
        axis(0.0, Shape::Multisine { first: 3, count: 2 }),
    ];
    settings.center = [1e-6, 0.0, -2e-6, 0.0, 0.0, 3e-6];
    settings.ramp_ticks = 1000;
    settings.ticks = 5000;
    settings
}

#[test]
#[allow(clippy::needless_range_loop)] // Ticks by number: the time is computed from them.
fn shapes_are_those_of_the_textbook() {
    let settings = every_shape();
    let all = run(&settings, wide());
    assert_eq!(all.len(), 5000);
    let turn = core::f64::consts::TAU;
    // At full amplitude.
    for tick in 1001..3999 {
        let t = (tick + 1) as f64 * PERIOD;
        let phase = 1.0 / 16.0;
        let swept = (t / 0.3).min(1.0) * t.min(0.3) / 2.0 + (t - 0.3).max(0.0);
        let triangle = (2.0 / core::f64::consts::PI) * (turn * 7.0 * t).sin().asin();
        let expected = [
            1e-6 + 1e-5,
            -3e-5 * (t / 0.25).min(1.0),
            -2e-6 + 4e-5 * triangle,
            -1e-5 + 3e-5 * (turn * (60.0 * t + phase)).sin(),
            3e-5 * (turn * (5.0 * t + 145.0 * swept + phase)).sin(),
            3e-6 + 1e-5 * (turn * (50.0 * t + phase)).sin() + 2e-5 * (turn * (130.0 * t + phase)).sin(),
        ];
        for (axis, (found, expected)) in all[tick].pose.iter().zip(expected).enumerate() {
            assert!((found - expected).abs() < 1e-12, "axis {axis}, tick {tick}: {found} {expected}");
        }
    }
}

#[test]
fn rates_and_accelerations_are_the_derivatives_and_nothing_jumps() {
    let settings = every_shape();
    let all = run(&settings, wide());
    // Corners of triangle and ramp have no derivative.
    for axis in [0, 3, 4, 5] {
        for tick in 1..all.len() - 1 {
            let [before, now, after] = [&all[tick - 1], &all[tick], &all[tick + 1]];
            let rate = (after.pose[axis] - before.pose[axis]) / (2.0 * PERIOD);
            let acceleration = (after.rate[axis] - before.rate[axis]) / (2.0 * PERIOD);
            // The chirp's last tick of change has the acceleration of one side.
            if axis == 4 && (2998..=3001).contains(&tick) {
                continue;
            }
            assert!((rate - now.rate[axis]).abs() < 6e-5, "axis {axis}, tick {tick}: {rate} {}", now.rate[axis]);
            let miss = (acceleration - now.acceleration[axis]).abs();
            assert!(miss < 0.06, "axis {axis}, tick {tick}: {acceleration} {}", now.acceleration[axis]);
        }
    }
    // It begins and ends at the center, at rest.
    for axis in 0..6 {
        let (first, last) = (&all[0], &all[all.len() - 1]);
        assert!((first.pose[axis] - settings.center[axis]).abs() < 1e-12, "axis {axis}");
        assert!(first.rate[axis].abs() < 1e-6, "axis {axis}: {}", first.rate[axis]);
        assert_eq!(last.pose[axis], settings.center[axis]);
        assert_eq!((last.rate[axis], last.acceleration[axis]), (0.0, 0.0));
    }
}

/// The limits that a wave is checked against are never passed, and just hold: a tighter one refuses it.
#[test]
fn limits_hold_and_are_not_wasted() {
    let settings = every_shape();
    let all = run(&settings, wide());
    for axis in 0..6 {
        let most = |of: &dyn Fn(&Motion<f64>) -> f64| all.iter().map(of).fold(f64::MIN, worse);
        let high = most(&|motion| motion.pose[axis]);
        let rate = most(&|motion| motion.rate[axis].abs());
        let acceleration = most(&|motion| motion.acceleration[axis].abs());
        let with = |change: &dyn Fn(&mut Limits<f64>)| {
            let mut limits = wide();
            change(&mut limits);
            Wave::new(limits).set(&settings)
        };
        assert_eq!(with(&|limits| limits.high[axis] = high - 1e-12 + 0.0), Err(Refusal::Range(axis)), "axis {axis}");
        assert_eq!(
            with(&|limits| limits.low[axis] = settings.center[axis] + 1e-9),
            Err(Refusal::Range(axis)),
            "axis {axis}"
        );
        assert_eq!(with(&|limits| limits.rate[axis] = rate * 0.999), Err(Refusal::Rate(axis)), "axis {axis}");
        assert_eq!(with(&|limits| limits.rate[axis] = rate * 2.0 + 1e-9), Ok(()), "axis {axis}");
        let refused = with(&|limits| limits.acceleration[axis] = acceleration * 0.999);
        assert_eq!(refused, Err(Refusal::Acceleration(axis)), "axis {axis}");
        assert_eq!(with(&|limits| limits.acceleration[axis] = acceleration * 3.0 + 1.0), Ok(()), "axis {axis}");
    }
}

#[test]
fn reversal_curves_are_those_that_identify_reads() {
    let mut settings = Settings::still();
    let (levels, ticks) = (4, 5);
    settings.axes[2].shape = Shape::Reversals { amplitude: 4e-5, levels, ticks, hold: 0, corner: 0 };
    settings.ticks = 150;
    let all = run(&settings, wide());
    // For k = 1..=N from 0 to k/N and back.
    let path: Vec<f64> = (1..=levels)
        .flat_map(|k| (1..=k * ticks).chain((0..k * ticks).rev()))
        .map(|step| 4e-5 * f64::from(step) / f64::from(levels * ticks))
        .collect();
    for (tick, expected) in path.iter().enumerate() {
        assert!((all[tick].pose[2] - expected).abs() < 1e-18, "tick {tick}: {} {expected}", all[tick].pose[2]);
    }
    assert!(all[path.len()..].iter().all(|motion| motion.pose[2] == 0.0));
}

/// With a hold at each turn and rounded corners: peaks and returns are exact, and nothing jumps.
#[test]
fn reversal_curves_hold_at_their_turns_and_round_their_corners() {
    let mut settings = Settings::still();
    let (levels, ticks, hold) = (3, 40, 30);
    for corner in [20, 21, 30] {
        settings.axes[2].shape = Shape::Reversals { amplitude: 3e-5, levels, ticks, hold, corner };
        settings.ramp_ticks = 100;
        let length = levels * (levels + 1) * ticks + 2 * levels * hold;
        settings.ticks = length + 3 * 100;
        let all = run(&settings, wide());
        let at = |tick: i32| &all[(99 + tick - 1) as usize];
        // They begin with the end of the smooth start.
        assert!((-50..=hold - corner / 2 - 1).all(|tick| at(tick).pose[2] == 0.0));
        let mut begin = 0;
        for curve in 1..=levels {
            let peak = 1e-5 * f64::from(curve);
            let high = begin + hold + curve * ticks;
            for tick in high + corner / 2 + 1..high + hold - corner / 2 {
                assert!((at(tick).pose[2] - peak).abs() < 1e-18, "curve {curve}, tick {tick}");
            }
            // A quarter of half a corner is lost at the kink itself.
            let lost = peak - at(high).pose[2];
            let expected = 1e-5 / f64::from(ticks) * f64::from(corner) / 8.0;
            assert!((lost - expected).abs() < 1e-15, "{lost:e} {expected:e}");
            begin = high + hold + curve * ticks;
            assert!(at(begin + hold / 2).pose[2].abs() < 1e-18);
        }
        assert_eq!(begin, length);
        let mut bends = [0.0, 0.0];
        for tick in -90..length + 90 {
            let [before, now, after] = [at(tick - 1), at(tick), at(tick + 1)];
            let rate = (after.pose[2] - before.pose[2]) / (2.0 * PERIOD);
            let bend = (after.rate[2] - before.rate[2]) / (2.0 * PERIOD);
            let most = 1e-5 / f64::from(ticks * corner) / (PERIOD * PERIOD);
            // At the ends of a corner a central difference has the curvature of one side for a tick.
            assert!((rate - now.rate[2]).abs() <= 0.51 * most * PERIOD, "corner {corner}, tick {tick}");
            assert!(bend.abs() < most * 1.001 && now.acceleration[2].abs() < most * 1.001, "tick {tick}");
            bends = [worse(bends[0], bend), worse(bends[1], -bend)];
            let speed = 1e-5 / f64::from(ticks) / PERIOD;
            assert!(now.rate[2].abs() <= speed * (1.0 + 1e-9));
        }
        assert!(bends.iter().all(|bend| *bend > 0.0));
    }
}

#[test]
fn a_wave_is_stopped_smoothly_and_changed_only_at_rest() {
    let mut wave = Wave::new(wide());
    let mut settings = every_shape();
    settings.ticks = 0;
    wave.set(&settings).unwrap();
    wave.start();
    for _ in 0..10_000 {
        assert!(wave.advance().is_some());
    }
    assert_eq!(wave.set(&settings), Err(Refusal::Busy));
    wave.stop();
    let rest: Vec<_> = std::iter::from_fn(|| wave.advance()).collect();
    assert_eq!((rest.len(), rest[999].pose), (1000, settings.center));
    assert_eq!(wave.set(&settings), Ok(()));
    // Stopped while it starts, it starts first.
    wave.start();
    wave.advance();
    wave.stop();
    assert_eq!(std::iter::from_fn(|| wave.advance()).count(), 1999);
}

fn random(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    *state
}

#[test]
fn words_read_back_and_any_words_are_refused_or_keep_their_limits() {
    let settings = every_shape();
    let words = settings.to_words();
    assert_eq!(Settings::<f64>::from_words(&words), Ok(settings));
    let mut reversals = Settings::<f32>::still();
    reversals.axes[1].shape = Shape::Reversals { amplitude: -1e-5, levels: 32, ticks: 100, hold: 60, corner: 50 };
    assert_eq!(Settings::from_words(&reversals.to_words()), Ok(reversals));
    // One word is the wrong number of tones.
    let mut bad = words;
    bad[6 + 5 * 7 + 4] = TONES as u64;
    assert_eq!(Settings::<f64>::from_words(&bad), Err(Refusal::Word(6 + 5 * 7 + 4)));

    let limits = Limits {
        low: [-5e-5; 6],
        high: [5e-5; 6],
        rate: [0.05; 6],
        acceleration: [100.0; 6],
        ticks_per_second: 1.0 / PERIOD,
    };
    let (mut state, mut taken) = (88_172_645_463_325_252, 0);
    for round in 0..20_000 {
        let mut words: [u64; WORDS] = words;
        for _ in 0..1 + round % 3 {
            let place = random(&mut state) as usize % WORDS;
            words[place] = match random(&mut state) % 5 {
                0 => random(&mut state),
                1 => random(&mut state) % 5000,
                2 => (f64::from_bits(words[place]) * 1.1).to_bits(),
                3 => words[place] ^ 1 << (random(&mut state) % 64),
                _ => u64::MAX,
            };
        }
        let mut wave = Wave::new(limits);
        if wave.load(&words).is_err() {
            continue;
        }
        taken += 1;
        wave.start();
        for _ in 0..200 {
            let Some(motion) = wave.advance() else { break };
            for axis in 0..6 {
                assert!(motion.pose[axis].abs() <= 5.0001e-5, "{:?}", motion.pose);
                assert!(motion.rate[axis].abs() <= 0.0501, "{:?}", motion.rate);
                assert!(motion.acceleration[axis].abs() <= 100.1, "{:?}", motion.acceleration);
            }
        }
    }
    assert!(taken > 500, "{taken}");
}

/// Words of an axis: kind, offset, amplitude, four more.
const AXIS: usize = 7;

#[test]
fn what_is_refused_is_named_by_a_word_and_told_from_it() {
    assert_eq!(Refusal::Busy.word(), None);
    for axis in 0..6 {
        let first = 6 + axis * AXIS;
        for (behind, refused) in [(1, Refusal::Range(axis)), (2, Refusal::Rate(axis)), (3, Refusal::Acceleration(axis))]
        {
            assert_eq!(refused.word(), Some(first + behind));
            assert_eq!(Refusal::of_word(first + behind), refused);
        }
        for behind in [0, 4, 5, 6] {
            assert_eq!(Refusal::of_word(first + behind), Refusal::Word(first + behind));
        }
    }
    for word in [0, 5, 6 + 6 * AXIS + 1, 6 + 6 * AXIS + 2, 6 + 6 * AXIS + 3, WORDS] {
        assert_eq!(Refusal::of_word(word), Refusal::Word(word));
        assert_eq!(Refusal::Word(word).word(), Some(word));
    }
}

/// For each kind of shape, what its words may be and the first that each may not.
#[test]
fn every_word_of_a_shape_has_its_bounds() {
    let (half, most) = ((1_u64 << 63) - 1, 1_u64 << 30);
    let number = f64::to_bits;
    let with = |kind: u64, amplitude: f64, rest: [u64; 4]| {
        let mut words = Settings::<f64>::still().to_words();
        words[6..6 + AXIS].copy_from_slice(&[
            kind,
            number(1e-6),
            number(amplitude),
            rest[0],
            rest[1],
            rest[2],
            rest[3],
        ]);
        Settings::<f64>::from_words(&words).map(|settings| {
            assert_eq!(settings.to_words(), words);
            settings.axes[0].shape
        })
    };
    let refused = |word: usize| Err(Refusal::Word(6 + word));
    assert_eq!(with(0, 0.0, [0; 4]), Ok(Shape::Constant));
    assert_eq!(with(1, -2e-6, [most, 0, 0, 0]), Ok(Shape::Ramp { amplitude: -2e-6, ticks: 1 << 30 }));
    assert_eq!(with(2, 2e-6, [half, 0, 0, 0]), Ok(Shape::Triangle { amplitude: 2e-6, step: half }));
    let tone = Tone { amplitude: 2e-6, phase: u64::MAX, step: 1 << 40 };
    assert_eq!(with(3, 2e-6, [1 << 40, u64::MAX, 0, 0]), Ok(Shape::Sine { tone }));
    let chirp = |sweep: i64, ticks: u64| with(4, 2e-6, [1 << 40, u64::MAX, sweep as u64, ticks]);
    assert_eq!(chirp(-(1 << 38), 4), Ok(Shape::Chirp { tone, sweep: -(1 << 38), ticks: 4 }));
    // Neither below zero nor to half a turn, and no sweep that overflows on the way.
    for (sweep, ticks) in [(-(1 << 38) - 1, 4), (1 << 62, 2), (i64::MAX, 1), (i64::MAX, 2), (i64::MIN, 1)] {
        assert_eq!(chirp(sweep, ticks), refused(6), "{sweep} in {ticks}");
    }
    assert_eq!(with(5, 0.0, [4, 12, 0, 0]), Ok(Shape::Multisine { first: 4, count: 12 }));
    assert_eq!(with(5, 0.0, [TONES as u64, 0, 0, 0]), Ok(Shape::Multisine { first: TONES, count: 0 }));
    let (amplitude, hold) = (-2e-6, 1 << 28);
    let reversals = Shape::Reversals { amplitude, levels: 1 << 10, ticks: 1 << 19, hold, corner: 1 << 19 };
    assert_eq!(with(6, -2e-6, [1 << 10, 1 << 19, 1 << 28, 1 << 19]), Ok(reversals));
    for (kind, amplitude, rest, word) in [
        (7, 0.0, [0; 4], 0),
        (2, -1e-9, [1, 0, 0, 0], 2),
        (3, -1e-9, [1, 0, 0, 0], 2),
        (4, -1e-9, [1, 0, 0, 1], 2),
        (0, f64::NAN, [0; 4], 2),
        (0, 0.0, [1, 0, 0, 0], 3),
        (0, 0.0, [0, 0, 0, 1], 6),
        (1, 0.0, [0; 4], 3),
        (1, 0.0, [most + 1, 0, 0, 0], 3),
        (1, 0.0, [1, 1, 0, 0], 4),
        (2, 0.0, [half + 1, 0, 0, 0], 3),
        (2, 0.0, [half, 1, 0, 0], 4),
        (3, 0.0, [half + 1, 0, 0, 0], 3),
        (3, 0.0, [half, 0, 1, 0], 5),
        (4, 0.0, [1, 0, 0, 0], 6),
        (5, 0.0, [TONES as u64 + 1, 0, 0, 0], 3),
        (5, 0.0, [4, 13, 0, 0], 4),
        (5, 0.0, [0, 0, 1, 0], 5),
        (6, 0.0, [0, 1, 0, 0], 3),
        (6, 0.0, [1, 0, 0, 0], 4),
        (6, 0.0, [1 << 10, (1 << 19) + 1, 0, 0], 4),
        (6, 0.0, [1, 1, (1 << 28) + 1, 0], 5),
        (6, 0.0, [1, 4, 3, 4], 6),
        (6, 0.0, [1, 3, 4, 4], 6),
    ] {
        assert_eq!(with(kind, amplitude, rest), refused(word), "kind {kind}: {rest:?}");
    }
    let mut words = Settings::<f64>::still().to_words();
    for (place, bad) in [
        (0, number(17e3)),
        (6 + 6 * AXIS, number(-1e-9)),
        (6 + 6 * AXIS + 2, half + 1),
        (WORDS - 2, 0),
        (WORDS - 1, most + 1),
    ] {
        let good = std::mem::replace(&mut words[place], bad);
        assert_eq!(Settings::<f64>::from_words(&words), Err(Refusal::Word(place)));
        words[place] = good;
    }
}

/// Those of the streams: the bound less the bias, on either side.
#[test]
fn limits_are_those_of_the_streams_about_the_bias() {
    let plan = Setpoints::<f64, Parallel> {
        period: PERIOD,
        rate: 1.0 / PERIOD,
        square_rate: 1.0 / (PERIOD * PERIOD),
        bias: [0.0, 1e-6, -2e-6, 0.0, 0.0, 0.0],
        home: [0.0; 6],
        bound: [1e-5, 2e-5, 3e-5, 1e-3, 2e-3, 3e-3],
        limits: MoveLimits { speed: [1.0; 6], acceleration: [1.0; 6], jerk: [1.0; 6] },
        stop: StopLimits { acceleration: [1.0; 6], jerk: [1.0; 6], shortest: 1 },
        stream_step: [1.0; 6],
        stream_rate: [2.0; 6],
        stream_acceleration: [3.0; 6],
        stale_ticks: 1,
        frames: Parallel,
        trajectories: &[],
    };
    let expected = Limits {
        low: [-1e-5, -(2e-5 + 1e-6), -(3e-5 - 2e-6), -1e-3, -2e-3, -3e-3],
        high: [1e-5, 2e-5 - 1e-6, 3e-5 + 2e-6, 1e-3, 2e-3, 3e-3],
        rate: [2.0; 6],
        acceleration: [3.0; 6],
        ticks_per_second: 1.0 / PERIOD,
    };
    assert_eq!(Limits::of(&plan), expected);
}
