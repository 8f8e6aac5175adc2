//! Plays that widen with the rate: the forward model against one written from the equations, and the inverse of it.

use crate::common::*;
use specgen_runtime::plays::PLAYS;
use specgen_runtime::{DriveMemory, HysteresisMemory, LastLine, PlayMemory, Plays, Real};

/// A leg of about 60 µm over 32 cells.
fn plays<T: Real>(widening: f64) -> Plays<T> {
    of(
        widening,
        |k| 16.0 * k as f64 / PLAYS as f64,
        |k| if k == 0 { 1e-6 } else { 1.5e-7 * (-(k as f64) / 12.0).exp() },
    )
}

fn of<T: Real>(widening: f64, threshold: impl Fn(usize) -> f64, weight: impl Fn(usize) -> f64) -> Plays<T> {
    let sum = |of: &dyn Fn(usize) -> f64| (0..PLAYS).map(of).sum::<f64>();
    Plays {
        full_scale: T::from_f64(32.0),
        thresholds: std::array::from_fn(|k| T::from_f64(threshold(k))),
        weights: std::array::from_fn(|k| T::from_f64(weight(k))),
        slope: T::from_f64(sum(&weight)),
        rest: T::from_f64(sum(&|k| weight(k) * threshold(k))),
        widening: T::from_f64(widening),
        per_rate: T::from_f64(1500.0),
        decay: T::from_f64((-0.05_f64).exp()),
    }
}

fn fresh<T: Real>(plays: &Plays<T>) -> PlayMemory<T> {
    PlayMemory::new(plays.thresholds)
}

/// The model as its equations are written, with states p_i and the standard library's logarithm.
struct Written {
    states: [f64; PLAYS],
    drive: f64,
    rate: f64,
}

impl Written {
    fn apply(&mut self, plays: &Plays<f64>, drive: f64) -> f64 {
        // s follows from the steps before this one.
        let scale = 1.0 + plays.widening * (1.0 + self.rate.abs() * plays.per_rate).ln();
        let step = drive - self.drive;
        self.rate = step + (self.rate - step) * plays.decay;
        self.drive = drive;
        let mut sum = 0.0;
        for (k, p) in self.states.iter_mut().enumerate() {
            let width = scale * plays.thresholds[k];
            *p = p.max(drive - width).min(drive + width);
            sum += plays.weights[k] * (*p - plays.thresholds[k]);
        }
        sum
    }
}

#[test]
fn the_displacement_is_that_of_the_equations() {
    let plays = plays::<f64>(0.05);
    let (mut memory, mut random) = (fresh(&plays), Random(3));
    let mut written = Written { states: plays.thresholds, drive: 0.0, rate: 0.0 };
    let mut drive = 0.0_f64;
    for tick in 0..20_000 {
        // Stretches of motion, of rest and of jumps.
        drive = match tick / 500 % 4 {
            0 => 32.0 * random.unit(),
            1 => drive,
            _ => (drive + 0.4 * (random.unit() - 0.5)).clamp(0.0, 32.0),
        };
        let expected = written.apply(&plays, drive);
        assert!((memory.apply(&&plays, drive) - expected).abs() < 2e-12, "tick {tick}");
        assert_eq!(memory.drive(), drive);
    }
}

/// Most that the inverse misses, m, over a sum of sines with noise and jumps of these sizes, m.
fn missed<T: Real>(widening: f64, hertz: f64, noise: f64, jump: f64) -> f64 {
    let plays = plays::<T>(widening);
    let (mut memory, mut random) = (fresh(&plays), Random(3));
    let (mut most, mut level) = (0.0_f64, 0.0);
    for tick in 0..20_000 {
        let turn = std::f64::consts::TAU * f64::from(tick) * 1e-4;
        let fade = (f64::from(tick) / 2000.0).min(1.0);
        if tick % 50 == 0 {
            level = jump * (random.unit() - 0.5);
        }
        let sines = 25e-6 - 12e-6 * (hertz * turn).cos() - 5e-6 * (0.37 * hertz * turn).sin();
        let demand = fade * (sines + level + noise * (random.unit() - 0.5));
        let beyond = memory.follow_within(&&plays, T::from_f64(demand), |drive| drive);
        assert!(!beyond, "tick {tick}");
        let word = memory.displacement().to_word();
        let got = if T::SINGLE { f64::from(f32::from_bits(word as u32)) } else { f64::from_bits(word) };
        most = most.max((got - demand).abs());
    }
    most
}

#[test]
fn the_inverse_ends_where_the_demand_is() {
    for (widening, hertz) in [(0.0, 1.0), (0.0, 20.0), (0.02, 1.0), (0.02, 20.0), (0.1, 50.0)] {
        for (noise, jump) in [(0.0, 0.0), (5e-9, 0.0), (5e-7, 0.0), (5e-9, 4e-6)] {
            let double = missed::<f64>(widening, hertz, noise, jump);
            let single = missed::<f32>(widening, hertz, noise, jump);
            let case = format!("κ {widening}, {hertz} Hz, noise {noise}, jump {jump}: {double:e}; f32 {single:e}");
            assert!(double < 1e-19 + 1e-12 * 40e-6 && single < 2e-11, "{case}");
        }
    }
}

/// Legs that are flat after a turn, with plays anywhere and some of them without weight, and demands anywhere.
#[test]
fn jumps_over_the_range_are_inverted_on_flat_legs() {
    let mut random = Random(11);
    for leg in 0..40 {
        let mut thresholds: Vec<f64> = (0..PLAYS).map(|_| 16.0 * random.unit()).collect();
        thresholds[0] = 0.0;
        thresholds.sort_by(f64::total_cmp);
        let weights: Vec<f64> = (0..PLAYS).map(|k| if k % 5 == 3 { 0.0 } else { 1e-7 * random.unit() }).collect();
        let sum = weights[1..].iter().sum::<f64>();
        let weight = |k: usize| if k == 0 { 1e-3 * sum } else { weights[k] };
        let plays: Plays<f64> = of(0.05, |k| thresholds[k], weight);
        let mut memory = fresh(&plays);
        for tick in 0..500 {
            let demand = plays.slope * 32.0 * 0.5 * random.unit();
            let (solved, reaches) = (memory.solve(&&plays, demand), memory.reaches(&&plays, demand));
            let before = memory;
            let beyond = memory.follow_within(&&plays, demand, |drive| drive);
            assert_eq!((memory.drive().to_bits(), beyond), (solved.to_bits(), !reaches), "leg {leg}, tick {tick}");
            let mut tracked = before;
            let did = tracked.track(&&plays, &mut LastLine::new(), demand, Some);
            assert_eq!(did, reaches, "leg {leg}, tick {tick}");
            if reaches {
                assert_eq!(tracked.drive().to_bits(), solved.to_bits());
                assert!((memory.displacement() - demand).abs() < 1e-15, "leg {leg}, tick {tick}");
            }
        }
    }
}

#[test]
fn a_demand_out_of_reach_is_said_and_the_drive_is_held_within_the_range() {
    let plays = plays::<f64>(0.02);
    let mut memory = fresh(&plays);
    for _ in 0..50 {
        assert!(memory.follow_within(&&plays, 1e-3, |drive| drive));
        assert!(!memory.reaches(&&plays, 1e-3));
    }
    assert_eq!(memory.drive(), 32.0);
    for _ in 0..50 {
        memory.follow_within(&&plays, -1e-3, |drive| drive);
    }
    assert_eq!(memory.drive(), 0.0);
    // At rest the thresholds are as they were: the leg is back where it began.
    for _ in 0..2000 {
        memory.apply(&&plays, 0.0);
    }
    assert!(memory.displacement().abs() < 1e-12 && memory.reaches(&&plays, 1e-9));
}

#[test]
fn a_state_just_risen_goes_on_as_one_that_rose() {
    let plays = plays::<f64>(0.02);
    let mut rose = fresh(&plays);
    for step in 0..=10_000 {
        rose.apply(&&plays, 10.25 * f64::from(step) / 1e4);
    }
    for _ in 0..3000 {
        rose.apply(&&plays, 10.25);
    }
    let states = std::array::from_fn(|k| {
        let r = plays.thresholds[k];
        if 2.0 * r <= 10.25 { -r } else { r - 10.25 }
    });
    let mut risen = PlayMemory::risen(10.25, rose.displacement(), states);
    for demand in [8e-6, 8.1e-6, 12e-6, 12.1e-6, 12.2e-6, 9e-6] {
        let [a, b] = [&mut rose, &mut risen].map(|memory| {
            memory.follow_within(&&plays, demand, |drive| drive);
            memory.drive()
        });
        assert!((a - b).abs() < 1e-3, "{a} {b}");
    }
}
