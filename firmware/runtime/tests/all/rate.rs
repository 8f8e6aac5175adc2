//! The rate-dependent models: dynamic Preisach (6) against brute-force relays, creep against a fine-step integration.

use crate::common;
use crate::common::*;
use specgen_runtime::{
    Creep, CreepEverett, CreepMemory, Digest, DynamicEverett, DynamicMemory, ReversalMemory, Snapshot,
};

const EXACT: f64 = 1e-18;
/// An eighth of a code of 1365 codes a cell, over 60 µm on 32 cells.
const TOLERANCE: f64 = 60e-6 / (32.0 * 1365.0) / 8.0;

type Dynamic = DynamicMemory<f64, 64>;

/// Weights of either sign, `size` times the mean weight of a 60 µm table.
fn signed_weights(seed: u64, size: f64) -> Weights {
    let mut random = Random(seed);
    let mean = 60e-6 / (N * (N + 1) / 2) as f64;
    (0..=N).map(|up| (0..up).map(|_| size * mean * (2.0 * random.unit() - 1.0)).collect()).collect()
}

fn dynamic(seed: u64, size: f64) -> (Weights, Weights, DynamicEverett<f64, Table>) {
    let (still, rate) = (random_weights(seed, N), signed_weights(seed + 50, size));
    let table = DynamicEverett { still: table(&still), rate: table(&rate), tolerance: TOLERANCE };
    (still, rate, table)
}

#[test]
fn the_dynamic_model_is_relays_of_both_weights_with_the_second_times_the_rate() {
    for seed in 0..3 {
        let (still, rate, table) = dynamic(seed, 5.0);
        let refine = 4;
        let (mut relays, mut rate_relays) = (Relays::new(&still, refine), Relays::new(&rate, refine));
        let (mut memory, mut random, mut last) = (Dynamic::new(), Random(seed + 9), 0.0);
        let mut worst = 0.0_f64;
        for tick in 0..4000 {
            let step = match tick % 13 {
                0 => 0,
                1 => refine * random.below(N + 1) as i64,
                _ => random.below(N * refine as usize + 1) as i64,
            };
            let drive = step as f64 / refine as f64;
            let exact = relays.apply(step) + (drive - last) * rate_relays.apply(step);
            worst = worse(worst, (memory.apply(&table, drive) - exact).abs());
            last = drive;
        }
        assert!(worst < 100.0 * EXACT, "{worst:e}");
    }
}

/// With four extrema the memory overflows all the time; what Γ₁ then is follows from the extrema that are left.
#[test]
fn after_pairs_were_dropped_both_parts_belong_to_the_same_extrema() {
    let (_, _, table) = dynamic(5, 5.0);
    let mut plain = PlainStaircase::new(6, Rule::LeastRectangle);
    let (mut memory, mut random, mut last) = (DynamicMemory::<f64, 6>::new(), Random(3), 0.0);
    for tick in 0..3000 {
        let drive = if tick % 50 == 0 { 0.0 } else { N as f64 * random.unit() };
        let still = plain.apply(&table.still, drive);
        let path: Vec<f64> = plain.extrema.iter().copied().chain([drive]).collect();
        let along = |w: &[f64]| if w[1] >= w[0] { table.rate.value(w[1], w[0]) } else { -table.rate.value(w[0], w[1]) };
        let rate: f64 = path.windows(2).map(along).sum();
        let exact = still + (drive - last) * rate;
        let got = memory.apply(&table, drive);
        assert!((got - exact).abs() < 1e4 * EXACT, "tick {tick}: {got:e} {exact:e}");
        last = drive;
    }
}

#[test]
fn inverse_then_forward_is_the_identity_wherever_the_inverse_says_so() {
    for (seed, size) in [(0, 0.05), (1, 0.3), (2, 2.0)] {
        let (_, _, table) = dynamic(seed, size);
        let full = table.still.full_displacement();
        let (mut memory, mut random, mut demand) = (Dynamic::new(), Random(seed), 0.3 * full);
        let (mut found, mut fell_back, mut worst) = (0, 0, 0.0_f64);
        for tick in 0..20_000 {
            demand = match tick % 500 {
                0 => full * random.unit(),
                _ => (demand + 0.02 * full * (random.unit() - 0.5)).clamp(0.0, full),
            };
            let drive = memory.solve(&table, demand);
            let back = memory.fell_back();
            assert!((0.0..=N as f64).contains(&drive), "{drive}");
            let error = (memory.apply(&table, drive) - demand).abs();
            if back {
                fell_back += 1;
            } else {
                found += 1;
                worst = worse(worst, error);
            }
        }
        println!("size {size}: {found} found, {fell_back} fell back, worst {worst:e} m");
        assert!(worst <= 1.01 * TOLERANCE, "{worst:e}");
        assert!(found > 5000, "{found}");
        assert!(size < 1.0 || fell_back > 100, "{fell_back}");
    }
}

#[test]
fn without_a_second_weight_the_inverse_is_the_static_one() {
    let (_, _, mut table) = dynamic(4, 1.0);
    table.rate = common::table(&signed_weights(1, 0.0));
    let full = table.still.full_displacement();
    let (mut memory, mut still, mut random) = (Dynamic::new(), ReversalMemory::<f64, 64>::new(), Random(8));
    for _ in 0..5000 {
        let demand = full * random.unit();
        let (drive, plain) = (memory.solve(&table, demand), still.solve(&table.still, demand));
        assert!(!memory.fell_back());
        assert_eq!(drive.to_bits(), plain.to_bits());
        assert_eq!(memory.apply(&table, drive).to_bits(), still.apply(&table.still, plain).to_bits());
    }
}

/// The same path in n times the steps: the rate term falls as 1/n.
#[test]
fn as_the_rate_goes_to_zero_the_model_goes_to_the_static_one() {
    let (_, _, table) = dynamic(6, 3.0);
    let worst = |ticks: usize| {
        let (mut memory, mut still) = (Dynamic::new(), ReversalMemory::<f64, 64>::new());
        (0..=ticks).fold(0.0_f64, |worst, k| {
            let drive = 32.0 * (9.0 * k as f64 / ticks as f64).sin().abs() * (k as f64 / ticks as f64);
            worse(worst, (memory.apply(&table, drive) - still.apply(&table.still, drive)).abs())
        })
    };
    let (coarse, fine) = (worst(1000), worst(100_000));
    assert!(coarse > 1e-9, "{coarse:e}");
    assert!((coarse / fine / 100.0 - 1.0).abs() < 0.1, "{coarse:e} {fine:e}");
}

/// Γ₁ = −0.8 f': each tick would correct the one before by four times as much. The guard must see it.
#[test]
fn an_inverse_that_would_grow_from_tick_to_tick_falls_back() {
    let slope = 60e-6 / N as f64;
    let line = |slope: f64| {
        let nodes: Box<[f64; NODES]> = (0..=N)
            .flat_map(|up| (0..=up).map(move |down| slope * (up - down) as f64))
            .collect::<Vec<_>>()
            .try_into()
            .expect("all nodes");
        Box::leak(nodes)
    };
    let constant = |value: f64| {
        let nodes: Box<[f64; NODES]> = (0..=N)
            .flat_map(|up| (0..=up).map(move |down| if up > down && down == 0 { value } else { 0.0 }))
            .collect::<Vec<_>>()
            .try_into()
            .expect("all nodes");
        Box::leak(nodes)
    };
    for (share, expected) in [(-0.8, true), (-0.4, false), (0.4, false), (3.0, false)] {
        let table = DynamicEverett {
            still: Table { nodes: line(slope) },
            rate: Table { nodes: constant(share * slope) },
            tolerance: TOLERANCE,
        };
        let mut memory = Dynamic::new();
        memory.apply(&table, 10.0);
        memory.apply(&table, 10.0);
        memory.solve(&table, memory.displacement() + 1e-6);
        assert_eq!(memory.fell_back(), expected, "{share}");
    }
}

/// Tables that no actuator has, and any demand: the drive stays within the grid and everything finite.
#[test]
fn whatever_the_tables_drives_stay_within_the_grid() {
    for size in [0.0, 1.0, 1e3, 1e9] {
        let (_, _, table) = dynamic(7, size);
        let (mut memory, mut random) = (Dynamic::new(), Random(77));
        for tick in 0..5000 {
            let demand = match tick % 7 {
                0 => 1e30,
                1 => -1e30,
                2 => 1e-300,
                _ => 60e-6 * random.unit(),
            };
            let drive = memory.solve(&table, demand);
            assert!((0.0..=N as f64).contains(&drive));
            assert!(memory.apply(&table, drive).is_finite());
        }
        let mut digest = Digest::new();
        memory.digest(&mut digest);
    }
}

const TICK: f64 = 1e-3;
const TIMES: [f64; 3] = [2.0, 0.05, 4e-3];
const WEIGHTS: [f64; 3] = [0.03, 0.05, 0.08];

fn creep() -> &'static Creep<f64, 3> {
    let gains = TIMES.map(|tau| 1.0 - (-TICK / tau).exp());
    let carried = std::array::from_fn(|j| WEIGHTS[j] * (1.0 - gains[j]));
    let direct = 1.0 + gains.iter().zip(WEIGHTS).map(|(g, w)| g * w).sum::<f64>();
    Box::leak(Box::new(Creep { gains, weights: WEIGHTS, carried, direct }))
}

#[test]
fn creep_inverse_then_a_fine_step_integration_gives_the_demand() {
    let table = CreepEverett { still: table(&random_weights(1, N)), creep: creep() };
    let full = table.still.full_displacement();
    let mut memory = CreepMemory::<f64, 64, 3>::new();
    // The oracle: static model of its own, creep integrated in 2000 steps a tick by the midpoint rule.
    let mut plain = PlainStaircase::new(64, Rule::LeastRectangle);
    let mut states = [0.0_f64; 3];
    let (mut random, mut demand, mut worst) = (Random(5), 0.4 * full, 0.0_f64);
    for _ in 0..1500 {
        demand = (demand + 0.05 * full * (random.unit() - 0.5)).clamp(0.25 * full, 0.75 * full);
        assert!(memory.reaches(&table, demand));
        let drive = memory.solve(&table, demand);
        let claimed = memory.apply(&table, drive);
        let f = plain.apply(&table.still, drive);
        let dt = TICK / 2000.0;
        for (state, tau) in states.iter_mut().zip(TIMES) {
            for _ in 0..2000 {
                let half = *state + 0.5 * dt * (f - *state) / tau;
                *state += dt * (f - half) / tau;
            }
        }
        let exact = f + states.iter().zip(WEIGHTS).map(|(x, w)| x * w).sum::<f64>();
        worst = worse(worse(worst, (exact - demand).abs()), (claimed - demand).abs());
    }
    println!("worst {worst:e} m");
    assert!(worst < 1e-13, "{worst:e}");
}

/// A held drive creeps by Σ w_j f, and not beyond.
#[test]
fn a_held_drive_creeps_to_its_static_gain() {
    let table = CreepEverett { still: table(&random_weights(2, N)), creep: creep() };
    let mut memory = CreepMemory::<f64, 64, 3>::new();
    let first = memory.apply(&table, 20.0);
    let mut last = first;
    for _ in 0..40_000 {
        let now = memory.apply(&table, 20.0);
        assert!(now >= last - EXACT);
        last = now;
    }
    let mut still = ReversalMemory::<f64, 64>::new();
    let f = still.apply(&table.still, 20.0);
    assert!((last / f - 1.0 - WEIGHTS.iter().sum::<f64>()).abs() < 1e-6, "{last:e} {f:e}");
}

#[test]
fn bounded_input_bounded_output_states_stay_within_the_reach_of_the_table() {
    let table = CreepEverett { still: table(&random_weights(3, N)), creep: creep() };
    let full = table.still.full_displacement();
    let mut memory = CreepMemory::<f64, 64, 3>::new();
    let mut random = Random(9);
    for tick in 0..100_000 {
        let demand = match tick % 5 {
            0 => 1e30,
            1 => -1e30,
            _ => 3.0 * full * (random.unit() - 0.5),
        };
        let drive = memory.solve(&table, demand);
        assert!((0.0..=N as f64).contains(&drive));
        memory.apply(&table, drive);
        assert!(memory.states().iter().all(|x| (0.0..=full).contains(x)));
        assert!((0.0..=full * (1.0 + WEIGHTS.iter().sum::<f64>()) + EXACT).contains(&memory.displacement()));
    }
}

/// Positive real: at every frequency the creep moves with f, Re G ≥ 1, so no frequency gains energy from it. By Fourier sums
/// over the kernel's own response about the middle of a table without hysteresis.
#[test]
fn creep_is_passive() {
    let nodes: Box<[f64; NODES]> = (0..=N)
        .flat_map(|up| (0..=up).map(move |down| 1e-6 * (up - down) as f64))
        .collect::<Vec<_>>()
        .try_into()
        .expect("all nodes");
    let table = CreepEverett { still: Table { nodes: Box::leak(nodes) }, creep: creep() };
    for period in [2, 3, 4, 7, 20, 100, 1000] {
        let mut memory = CreepMemory::<f64, 64, 3>::new();
        let (mut re, mut im, mut power) = (0.0, 0.0, 0.0);
        let settle = 20_000 / period * period;
        for k in 0..settle + 1000 * period {
            let angle = std::f64::consts::TAU * (k % period) as f64 / period as f64;
            let y = memory.apply(&table, 16.0 + 8.0 * angle.cos());
            if k >= settle {
                let swing = 8e-6 * angle.cos();
                re += y * swing;
                im += y * 8e-6 * angle.sin();
                power += swing * swing;
            }
        }
        println!("period {period}: Re {:.5} Im {:.5}", re / power, im / power);
        assert!(re / power > 1.0, "{period}");
    }
}

#[test]
fn legs_that_have_risen_are_where_their_drive_is_and_creep_from_there() {
    let table = CreepEverett { still: table(&random_weights(4, N)), creep: creep() };
    let full = table.still.full_displacement();
    let mut risen = CreepMemory::<f64, 64, 3>::risen(12.0, table.still.value(12.0, 0.0));
    assert_eq!((risen.drive(), risen.displacement()), (12.0, table.still.value(12.0, 0.0)));
    assert_eq!(risen.states(), &[0.0; 3]);
    // All of the creep is to come, as after a first tick of a driven one.
    let mut driven = CreepMemory::<f64, 64, 3>::new();
    for _ in 0..5 {
        assert_eq!(risen.apply(&table, 12.0).to_bits(), driven.apply(&table, 12.0).to_bits());
    }
    // Reach: what the static model must make of it, from none to all.
    let carried: f64 = risen.states().iter().zip(creep().carried).map(|(x, c)| x * c).sum();
    let ends = [carried, carried + full * creep().direct];
    for (demand, reached) in [
        (ends[0] - 1e-12, false),
        (ends[0] + 1e-12, true),
        (ends[1] - 1e-12, true),
        (ends[1] + 1e-12, false),
        (f64::NAN, false),
    ] {
        assert_eq!(risen.reaches(&table, demand), reached, "{demand:e} of {ends:?}");
    }

    let (.., table) = dynamic(2, 0.3);
    let full = table.still.full_displacement();
    let (still, rate) = (table.still.value(9.0, 0.0), table.rate.value(9.0, 0.0));
    let mut risen = Dynamic::risen(9.0, still, rate);
    assert_eq!((risen.drive(), risen.displacement()), (9.0, still));
    let mut driven = Dynamic::new();
    driven.apply(&table, 9.0);
    for drive in [9.0, 11.0, 4.0, 9.5] {
        assert_eq!(risen.apply(&table, drive).to_bits(), driven.apply(&table, drive).to_bits(), "{drive}");
    }
    for (demand, reached) in [(-1e-12, false), (0.0, true), (full, true), (full + 1e-12, false), (f64::NAN, false)] {
        assert_eq!(risen.reaches(&table, demand), reached, "{demand:e}");
    }
}
