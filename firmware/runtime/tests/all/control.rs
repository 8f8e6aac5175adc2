//! Kernels of the control law in task space: modal notch, integral, bumpless transfer, adaptation by innovations.

use core::f64::consts::TAU;

use specgen_runtime::feedback::winds_up;
use specgen_runtime::pass::{Course, MOST_TICKS, Player, Stage};
use specgen_runtime::playback::{self, Knot};
use specgen_runtime::{
    ControlMode, Correction, CorrectionLimit, Damping, Estimate, Integral, Law, ModalDamping as _, NotchState,
    RequestCorrection as _, Resonator, Section, Transfer,
};

/// The notch of a mode at `frequency` (Hz) by the bilinear transformation with prewarping, sampled at 10 kHz.
fn section(frequency: f64, damping: f64, notch_damping: f64) -> Section<f64> {
    let k = (TAU * frequency / 2.0 / 10_000.0).tan();
    let a0 = 1.0 + 2.0 * notch_damping * k + k * k;
    Section {
        depth: 2.0 * (notch_damping - damping) * k / a0,
        a: [2.0 * (k * k - 1.0) / a0, (1.0 - 2.0 * notch_damping * k + k * k) / a0],
    }
}

const MODES: [f64; 6] = [361.0, 361.5, 428.0, 428.5, 615.0, 795.0];

/// Amplitude and phase of the settled answer of every mode to a sine of `frequency`.
fn answer(sections: &[Section<f64>; 6], frequency: f64) -> [(f64, f64); 6] {
    let mut notch = NotchState::new();
    let step = TAU * frequency / 10_000.0;
    let (settle, periods) = (4000, 20);
    let count = (10_000.0 / frequency * f64::from(periods)).round() as u32;
    let mut sums = [(0.0, 0.0); 6];
    for tick in 0..settle + count {
        let phase = step * f64::from(tick);
        let out = notch.filter(sections, &[phase.sin(); 6]);
        if tick >= settle {
            for (sum, value) in sums.iter_mut().zip(out) {
                sum.0 += value * phase.sin();
                sum.1 += value * phase.cos();
            }
        }
    }
    sums.map(|(sine, cosine)| {
        let (re, im) = (2.0 * sine / f64::from(count), 2.0 * cosine / f64::from(count));
        (re.hypot(im), im.atan2(re))
    })
}

/// The analogue notch (s² + 2ζωs + ω²)/(s² + 2ζ_dωs + ω²) at the frequency that the prewarped bilinear map puts there.
#[test]
fn the_notch_has_the_response_of_its_formula() {
    let sections = MODES.map(|mode| section(mode, 0.02, 1.0));
    for frequency in [1.0, 50.0, 250.0, 500.0, 1000.0] {
        for ((gain, phase), mode) in answer(&sections, frequency).into_iter().zip(MODES) {
            let warped = (TAU * frequency / 20_000.0).tan() / (TAU * mode / 20_000.0).tan();
            let square = 1.0 - warped * warped;
            let expected = (square.hypot(0.04 * warped)) / (square.hypot(2.0 * warped));
            let angle = (0.04 * warped).atan2(square) - (2.0 * warped).atan2(square);
            assert!((gain - expected).abs() < 1e-6, "{mode} Hz at {frequency} Hz: {gain}, {expected}");
            let turn = (phase - angle) / TAU;
            assert!((turn - turn.round()).abs() < 1e-6, "{mode} Hz at {frequency} Hz: {phase}, {angle}");
        }
    }
}

/// y_n = b₀x_n + b₁x_{n−1} + b₂x_{n−2} − a₁y_{n−1} − a₂y_{n−2}, by its definition, for an input without a pattern.
#[test]
fn active_damping_is_the_difference_equation_of_its_sections() {
    let sections: [Resonator<f64>; 6] = std::array::from_fn(|k| {
        let k = k as f64;
        Resonator { b: [0.6 + 0.1 * k, -1.1 - 0.2 * k, 0.5 - 0.05 * k], a: [-1.6 + 0.2 * k, 0.8 - 0.1 * k] }
    });
    let mut damping = Damping::<f64, 6>::new();
    let (mut inputs, mut outputs) = (vec![[0.0; 6]; 2], vec![[0.0; 6]; 2]);
    for tick in 0..200_u32 {
        let error: [f64; 6] = std::array::from_fn(|k| f64::from((tick * 37 + k as u32 * 11) % 101) * 1e-8 - 5e-7);
        damping.update(&sections, &error);
        inputs.push(error);
        let (x, y) = (&inputs[inputs.len() - 3..], &outputs[outputs.len() - 2..]);
        let expected: [f64; 6] = std::array::from_fn(|k| {
            let Resonator { b, a } = sections[k];
            b[0] * x[2][k] + b[1] * x[1][k] + b[2] * x[0][k] - a[0] * y[1][k] - a[1] * y[0][k]
        });
        for (found, expected) in damping.request.iter().zip(&expected) {
            assert!((found - expected).abs() < 1e-18, "tick {tick}: {found:e}, {expected:e}");
        }
        assert_eq!(damping.add_to([1.0; 6]), damping.request.map(|request| 1.0 + request));
        outputs.push(expected);
    }
    // Without sections nothing is asked for, and nothing takes room.
    let mut none = Damping::<f64, 0>::new();
    none.update(&[], &[1.0; 6]);
    assert_eq!((none.add_to([1.0; 6]), size_of_val(&none)), ([1.0; 6], 0));
}

/// |c| ≤ most and |Δc| ≤ step whatever is asked for; what is within both is taken as it is, and what is no number leads back to nothing.
#[test]
fn a_correction_keeps_to_its_limits_whatever_is_asked_for() {
    let limits = [CorrectionLimit { most: 2e-6, step: 3e-7 }; 6];
    let mut correction = Correction::<f64, 6>::new();
    let small: [f64; 6] = std::array::from_fn(|k| 1e-8 * k as f64);
    assert!(!correction.follow(&limits, &small));
    assert_eq!((correction.given, correction.pose()), (small, Some(small)));
    let asked = [1.0, -1.0, f64::INFINITY, f64::NEG_INFINITY, 1.9e-6, f64::NAN];
    let mut last = correction.given;
    for _ in 0..20 {
        assert!(correction.follow(&limits, &asked), "NaN is always held back");
        for (now, last) in correction.given.iter().zip(&last) {
            assert!(now.abs() <= 2e-6 && (now - last).abs() <= 3e-7 * (1.0 + 1e-9));
        }
        last = correction.given;
    }
    assert_eq!(last, [2e-6, -2e-6, 2e-6, -2e-6, 1.9e-6, 0.0]);
    let mut none = Correction::<f64, 0>::new();
    assert_eq!((none.follow(&[], &[]), none.pose(), size_of_val(&none)), (false, None, 0));
}

/// B is not negative and sums to 1, so what is played lies within its knots and moves from tick to tick by no more than their differences.
#[test]
fn a_table_is_played_within_its_knots() {
    let knots: Vec<Knot> =
        (0..40).map(|k| std::array::from_fn(|axis| ((k * 7919 + axis * 104_729) % 2001) as i32 - 1000)).collect();
    let mut last = [0.0; 6];
    for tick in 0..300 {
        let now: [f64; 6] = playback::at(&knots, 6, tick);
        for (now, last) in now.iter().zip(&last) {
            assert!(now.abs() <= 1000.0 * playback::UNIT * (1.0 + 1e-12));
            assert!(tick == 0 || (now - last).abs() <= 2000.0 / 6.0 * playback::UNIT * (1.0 + 1e-9), "{tick}");
        }
        last = now;
    }
    assert_eq!(last, [0.0; 6]);
    let level: Vec<Knot> = vec![[700; 6]; 40];
    for tick in 12..200 {
        let now: [f64; 6] = playback::at(&level, 6, tick);
        assert!(now.iter().all(|now| (now - 700.0 * playback::UNIT).abs() < 1e-24));
    }
}

/// A pass as its definition says it, tick by tick, with f64 sums of its own: correction by the spline, errors by means of whole knot intervals.
#[test]
fn a_pass_plays_its_table_and_keeps_the_mean_error_between_knots() {
    const COURSE: Course = Course { spacing: 7, before: 5, ticks: 40, trajectory: 3 };
    let knots: Vec<Knot> = (0..6).map(|k| std::array::from_fn(|axis| (k * 100 + axis as i32) * 11 - 300)).collect();
    let mut memory = [[9; 6]; 16];
    let mut player = Player::<f64>::new(&mut memory);
    assert_eq!((player.stage(), player.capacity(), player.errors().len()), (Stage::None, 8, 0));
    assert!(player.put(0, knots.iter().copied()));
    let target =
        |tick: u32| -> [f64; 6] { std::array::from_fn(|axis| f64::from(tick * tick) * 1e-9 + axis as f64 * 1e-8) };
    let pose = |tick: u32| -> [f64; 6] { std::array::from_fn(|axis| f64::from(tick) * (3e-9 - axis as f64 * 1e-10)) };
    for (limited, last) in [(false, 40), (true, 20)] {
        assert!(player.begin(COURSE) && !player.begin(COURSE) && !player.put(0, knots.iter().copied()));
        for tick in 0..=last {
            let given = player.give().unwrap();
            assert_eq!(given.correction, playback::at::<f64>(&knots, 7, tick), "{tick}");
            assert_eq!(given.begins, (tick == 5).then_some(3), "{tick}");
            player.keep(&target(tick), &pose(tick), 1 << (tick % 3));
        }
        if limited {
            player.abort();
        }
        let (stage, count) = if limited { (Stage::Aborted, 2) } else { (Stage::Complete, 6) };
        assert_eq!((player.stage(), player.give(), player.status(), player.begun()), (stage, None, 7, Some(3)));
        assert_eq!(player.errors().len(), count);
        for (index, found) in (0_u32..).zip(player.errors()) {
            let ticks: Vec<u32> = (7 * index..(7 * index + 7).min(40)).collect();
            for (axis, found) in found.iter().enumerate() {
                // What is shown at the end of tick n is read in tick n + 1.
                let sum: f64 = ticks.iter().map(|tick| target(*tick)[axis] - pose(tick + 1)[axis]).sum();
                let mean = sum / ticks.len() as f64 / playback::UNIT;
                assert!((mean - f64::from(*found)).abs() <= 1.0, "{index} {axis}: {mean} {found}");
            }
        }
    }
}

/// What is no pass, or too long, is refused and changes nothing; numbers that are none, and hosts that count wrongly, harm nothing.
#[test]
fn what_is_no_pass_is_refused() {
    let mut memory = [[0; 6]; 5];
    let mut player = Player::<f32>::new(&mut memory);
    assert_eq!(player.capacity(), 2);
    let good = Course { spacing: 10, before: 0, ticks: 20, trajectory: u32::MAX };
    for bad in [
        Course { spacing: 0, ..good },
        Course { ticks: 0, ..good },
        Course { before: 20, ..good },
        Course { ticks: 21, ..good },
        Course { spacing: u32::MAX, ticks: u32::MAX, ..good },
        Course { spacing: 1, ticks: MOST_TICKS, ..good },
    ] {
        assert!(!player.begin(bad), "{bad:?}");
    }
    let level = [[1; 6]; 3];
    assert!(!player.put(0, level.into_iter()) && !player.put(usize::MAX, level.into_iter()));
    assert!(!player.put(1, level.into_iter().take(2)) && player.put(1, level.into_iter().take(1)));
    assert!(player.begin(good));
    for _ in 0..30 {
        let _ = player.give();
        player.keep(&[f32::NAN; 6], &[f32::INFINITY; 6], 0);
    }
    assert_eq!((player.stage(), player.errors()), (Stage::Complete, &[[0; 6]; 2][..]));
    player.abort();
    assert_eq!(player.stage(), Stage::Complete);
    assert!(player.begin(good));
    assert_eq!((player.errors().len(), player.begun()), (0, None));
    for stage in [Stage::None, Stage::Running, Stage::Complete, Stage::Aborted, Stage::Learning] {
        assert_eq!(Stage::from_word(stage.word()), Some(stage));
    }
    assert_eq!(Stage::from_word(5), None);
}

#[test]
fn the_notch_leaves_a_constant_alone_and_takes_the_resonance_out() {
    let sections = MODES.map(|mode| section(mode, 0.02, 1.0));
    let mut notch = NotchState::new();
    let mut out = [0.0; 6];
    for _ in 0..2000 {
        out = notch.filter(&sections, &[1e-6; 6]);
    }
    assert!(out.iter().all(|value| (value - 1e-6).abs() < 1e-15), "{out:?}");
    let sections = [section(400.0, 0.02, 1.0); 6];
    for (gain, _) in answer(&sections, 400.0) {
        assert!((gain - 0.02).abs() < 1e-4, "{gain}");
    }
}

#[test]
fn without_a_filter_innovations_and_model_errors_give_the_same_estimates() {
    for law in [Law::Ewma, Law::Pcc] {
        let (mut by_error, mut six) = (Estimate::<f64>::new(), [Estimate::new(); 6]);
        for run in 0..1000 {
            let model_error = 1e-6 * (f64::from(run) * 0.013).sin() + 3e-9 * f64::from(run);
            let innovation = model_error - six[0].correction();
            by_error.update(law, 0.252, 0.011, model_error);
            Estimate::correct(&mut six, law, 0.252, 0.011, &[innovation; 6]);
            let by_innovation = six[5];
            assert!((by_error.level - by_innovation.level).abs() < 1e-17, "{law:?}");
            assert!((by_error.drift - by_innovation.drift).abs() < 1e-17, "{law:?}");
        }
    }
    let mut six = [Estimate { level: 1.0, drift: 1.0 }; 6];
    Estimate::correct(&mut six, Law::Invhys, 0.5, 0.5, &[1.0; 6]);
    assert!(six.iter().all(|estimate| (estimate.level, estimate.drift) == (0.0, 0.0)));
}

#[test]
fn the_integral_grows_by_gain_times_error_and_is_held_only_outward() {
    let mut integral = Integral::<f64>::new();
    let growth = Integral::growth(&[2.0; 6], 1e-4, &[1.0, -1.0, 0.0, 4.0, 0.5, -2.0]);
    integral.grow(&growth);
    integral.grow(&growth);
    assert_eq!(integral.force, [4e-4, -4e-4, 0.0, 1.6e-3, 2e-4, -8e-4]);

    let mut excess = [0.0; 6];
    assert!(!winds_up(&excess, &[1.0; 6]));
    excess[2] = 1e-9;
    assert!(winds_up(&excess, &[1.0; 6]));
    assert!(!winds_up(&excess, &[-1.0; 6]));
    assert!(!winds_up(&excess, &[1.0, 1.0, 0.0, 1.0, 1.0, 1.0]));
    excess[2] = -1e-9;
    assert!(winds_up(&excess, &[-1.0; 6]));
}

#[test]
fn a_transfer_fades_to_nothing_without_subnormal_numbers() {
    let mut transfer = Transfer::<f32>::new();
    transfer.begin([1e-6, -1e-6, 1e-30, 0.0, 5e-7, -3e-8]);
    let mut ticks = 0;
    assert!(transfer.is_active() && !Transfer::<f32>::new().is_active());
    while *transfer.offset() != [0.0; 6] {
        assert!(transfer.is_active());
        transfer.fade(0.99, 1e-15);
        assert!(transfer.offset().iter().all(|offset| *offset == 0.0 || offset.is_normal()));
        ticks += 1;
        assert!(ticks < 3000);
    }
    assert!(!transfer.is_active());
    // What is exactly negligible is.
    let mut exact = Transfer::<f64>::new();
    exact.begin([1.0, -1.0, 0.0, 0.0, 0.0, 0.75]);
    exact.fade(0.5, 0.5);
    assert_eq!((*exact.offset(), exact.is_active()), ([0.0; 6], false));
    exact.begin([2.0, -1.0, 0.0, 0.0, 0.0, 0.75]);
    exact.fade(0.5, 0.5);
    assert_eq!((*exact.offset(), exact.is_active()), ([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], true));
    // ln(1e-9)/ln(0.99)
    assert!((2000..2100).contains(&ticks), "{ticks}");
}

#[test]
fn modes_say_what_is_at_work() {
    assert!(ControlMode::P.feeds_back() && !ControlMode::P.inverts());
    assert!(!ControlMode::F(Law::Ewma).feeds_back() && ControlMode::F(Law::Ewma).inverts());
    assert!(ControlMode::PF(Law::Pcc).feeds_back() && ControlMode::PF(Law::Pcc).inverts());
    assert_eq!(ControlMode::PF(Law::Pcc).law(), Law::Pcc);
    assert_eq!(ControlMode::P.law(), Law::Invhys);
    // A mode has one name: with capitals for people, without for commands.
    let names: Vec<String> = ControlMode::all().map(|mode| mode.to_string()).collect();
    assert_eq!((names.first().map(String::as_str), names.last().map(String::as_str)), (Some("P"), Some("P/F pcc")));
    let plain = names.iter().map(|name| name.replace('/', "").replace(' ', "-").to_lowercase());
    assert!(plain.eq(ControlMode::WORDS.map(|(name, _)| name)), "{names:?}");
}

/// The largest gains take the integral to its bound and no further, and errors of the other sign lead back from there.
#[test]
fn an_integral_grows_no_further_than_a_state_may() {
    let growth = specgen_runtime::Integral::growth(
        &[1e15_f32, 1e15, 0.0, 1.0, 2e14, 1e15],
        1e-4,
        &[1e-3, -1e-3, 1.0, 0.0, 1e-3, 16.0],
    );
    let mut integral = specgen_runtime::Integral::<f32>::new();
    for _ in 0..1000 {
        integral.grow(&growth);
        assert!(integral.force.iter().all(|force| force.abs() <= 1e9), "{:?}", integral.force);
    }
    assert_eq!(integral.force.map(f32::abs), [1e9, 1e9, 0.0, 0.0, 1e9, 1e9]);
    integral.grow(&growth.map(|value| -value));
    assert!(integral.force[0] < 1e9 && integral.force[1] > -1e9 && integral.force[5] < 0.0);
}
