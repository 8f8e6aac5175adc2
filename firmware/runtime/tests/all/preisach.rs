//! Properties of the reversal memory, by the names of the theorems, against brute-force relays.

use crate::common::*;
use specgen_runtime::{Digest, ReversalMemory, Snapshot};

/// 1e-12 µm.
const EXACT: f64 = 1e-18;

type Memory = ReversalMemory<f64, 64>;

fn digest<const CAP: usize>(memory: &ReversalMemory<f64, CAP>) -> u64 {
    let mut digest = Digest::new();
    memory.digest(&mut digest);
    digest.finish()
}

#[test]
fn agrees_with_brute_force_relays_on_and_between_nodes() {
    for seed in 0..4 {
        let weights = random_weights(seed, N);
        let table = table(&weights);
        let refine = 4;
        let mut relays = Relays::new(&weights, refine);
        let mut memory = Memory::new();
        let mut random = Random(seed + 100);
        let mut worst = 0.0f64;
        for tick in 0..4000 {
            let step = if tick % 7 == 0 {
                refine * random.below(N + 1) as i64
            } else {
                random.below(N * refine as usize + 1) as i64
            };
            let exact = relays.apply(step);
            let stack = memory.apply(&table, step as f64 / refine as f64);
            worst = worse(worst, (exact - stack).abs());
        }
        assert!(worst <= EXACT, "seed {seed}: {worst:e} m");
        assert_eq!(memory.dropped(), 0);
    }
}

#[test]
fn wiping_out_a_larger_excursion_erases_smaller_ones() {
    let table = table(&random_weights(1, N));
    let mut random = Random(7);
    let (mut with_loops, mut without) = (Memory::new(), Memory::new());
    for memory in [&mut with_loops, &mut without] {
        memory.apply(&table, 28.0);
        memory.apply(&table, 3.0);
    }
    for _ in 0..500 {
        with_loops.apply(&table, 3.5 + 20.0 * random.unit());
    }
    assert!(with_loops.depth() > without.depth());
    with_loops.apply(&table, 26.0);
    without.apply(&table, 26.0);
    for drive in [10.25, 29.5] {
        let a = with_loops.apply(&table, drive);
        let b = without.apply(&table, drive);
        assert_eq!(a.to_bits(), b.to_bits(), "drive {drive}");
        assert_eq!(digest(&with_loops), digest(&without), "drive {drive}");
    }
}

#[test]
fn congruency_loops_between_the_same_extrema_have_the_same_shape() {
    let table = table(&random_weights(2, N));
    let gain_after = |history: &[f64]| {
        let mut memory = Memory::new();
        for &drive in history {
            memory.apply(&table, drive);
        }
        let low = memory.apply(&table, 9.3);
        let middle = memory.apply(&table, 14.1) - low;
        let high = memory.apply(&table, 17.7) - low;
        [middle, high]
    };
    let first = gain_after(&[20.0]);
    let second = gain_after(&[32.0, 1.0, 30.0, 4.0, 28.5]);
    assert!(first[0] > 1e-6 && first[1] > first[0], "{first:?}");
    for (a, b) in first.iter().zip(&second) {
        assert!((a - b).abs() <= EXACT, "{a} {b}");
    }
}

#[test]
fn inverse_then_forward_is_the_identity() {
    for seed in 0..4 {
        let table = table(&random_weights(seed, N));
        let mut memory = Memory::new();
        let mut random = Random(seed);
        let mut worst = 0.0f64;
        let mut q = 0.0;
        for tick in 0..20_000 {
            // Smooth motion, noise, jumps and exact ends.
            q = match tick % 11 {
                0 => table.full_displacement() * random.unit(),
                1 => 0.0,
                2 => table.full_displacement(),
                _ => q + 1e-7 * (random.unit() - 0.5),
            };
            let wanted = q.clamp(0.0, table.full_displacement());
            let drive = memory.solve(&table, q);
            assert!((0.0..=32.0).contains(&drive));
            worst = worse(worst, (memory.apply(&table, drive) - wanted).abs());
        }
        assert!(worst <= EXACT, "seed {seed}: {worst:e} m");
    }
}

#[test]
fn monotone_more_drive_never_gives_less_displacement() {
    let table = table(&random_weights(3, N));
    let mut memory = Memory::new();
    let mut random = Random(5);
    let (mut drive, mut displacement) = (0.0, 0.0);
    for _ in 0..50_000 {
        let next = 32.0 * random.unit();
        let after = memory.apply(&table, next);
        assert!((after - displacement) * (next - drive) >= 0.0);
        (drive, displacement) = (next, after);
    }
}

#[test]
fn f32_stays_within_50_pm_of_f64() {
    let table = table(&random_weights(6, N));
    let table32 = table32(&table);
    let mut memory = Memory::new();
    let mut memory32 = ReversalMemory::<f32, 64>::new();
    let mut random = Random(11);
    let (mut worst_forward, mut worst_inverse) = (0.0f64, 0.0f64);
    for tick in 0..20_000 {
        let q = table.full_displacement() * random.unit();
        // The same request in both, the drive of the f32 inverse judged by the f64 model.
        let drive32 = memory32.solve(&table32, q as f32);
        let got = memory.apply(&table, f64::from(drive32));
        worst_inverse = worse(worst_inverse, (got - f64::from(q as f32)).abs());
        worst_forward = worse(worst_forward, (f64::from(memory32.apply(&table32, drive32)) - got).abs());
        assert!(tick < 10 || memory.depth() == memory32.depth());
    }
    assert!(worst_forward <= 0.05e-9, "forward {worst_forward:e}");
    assert!(worst_inverse <= 0.05e-9, "inverse {worst_inverse:e}");
}

#[test]
fn saturation_at_either_end_resets_the_staircase() {
    let table = table(&random_weights(8, N));
    let mut memory = Memory::new();
    for drive in [20.0, 4.0, 15.0, 9.0, 12.0] {
        memory.apply(&table, drive);
    }
    assert_eq!(memory.apply(&table, -0.0), 0.0);
    assert_eq!(digest(&memory), digest(&Memory::new()));
    memory.apply(&table, 1e300);
    assert_eq!(memory.drive(), 32.0);
    assert_eq!(memory.depth(), 1);
    assert_eq!(memory.displacement().to_bits(), table.full_displacement().to_bits());
}

#[test]
fn flat_tables_are_inverted_without_division_by_zero() {
    let zero = table(&vec![vec![0.0; N]; N + 1].iter().enumerate().map(|(up, r)| r[..up.min(N)].to_vec()).collect());
    let mut memory = Memory::new();
    for q in [1e-6, 0.0, -1e-6, 5.0] {
        let drive = memory.solve(&zero, q);
        assert!(drive.is_finite());
        assert!(memory.apply(&zero, drive) == 0.0);
    }
    // A table whose displacement sits in one corner: everything before it is flat.
    let mut corner: Weights = (0..=N).map(|up| vec![0.0; up]).collect();
    corner[N][N - 2] = 60e-6;
    let corner = table(&corner);
    let mut memory = Memory::new();
    for q in [30e-6, 10e-6, 60e-6, 0.0, 45e-6, 44e-6] {
        let drive = memory.solve(&corner, q);
        assert!(drive.is_finite() && (0.0..=32.0).contains(&drive));
        assert!((memory.apply(&corner, drive) - q).abs() <= EXACT, "{q}");
    }
}

/// A decaying oscillation of `loops` nested loops, the worst case for a bounded memory.
fn decaying(loops: usize) -> impl Iterator<Item = f64> {
    (0..2 * loops).map(move |k| {
        let amplitude = 15.9 * (1.0 - k as f64 / (2 * loops) as f64);
        if k % 2 == 0 { 16.0 + amplitude } else { 16.0 - amplitude }
    })
}

/// Largest difference from a memory without bound, while the oscillation decays and on the way out of every loop.
fn worst_error(drives: impl Iterator<Item = f64>, mut bounded: impl FnMut(&Table, f64) -> f64) -> f64 {
    let table = table(&random_weights(9, N));
    let mut exact = ReversalMemory::<f64, 8192>::new();
    let way_out = (0..400).map(|k| 16.0 + 16.0 * f64::from(k) / 400.0);
    let mut worst = 0.0f64;
    for drive in drives.chain(way_out) {
        worst = worse(worst, (bounded(&table, drive) - exact.apply(&table, drive)).abs());
    }
    assert_eq!(exact.dropped(), 0);
    worst
}

fn worst_with_capacity<const CAP: usize>(loops: usize) -> f64 {
    let mut memory = ReversalMemory::<f64, CAP>::new();
    let worst = worst_error(decaying(loops), |table, drive| memory.apply(table, drive));
    assert!(memory.dropped() as usize >= loops - CAP / 2 - 1);
    worst
}

#[test]
fn overflow_drops_the_least_everett_rectangle() {
    let mut memory = ReversalMemory::<f64, 16>::new();
    let mut plain = PlainStaircase::new(16, Rule::LeastRectangle);
    let table = table(&random_weights(9, N));
    let mut random = Random(3);
    let noisy = decaying(300).map(|drive| drive + 0.3 * random.unit() - 0.15);
    for (tick, drive) in noisy.enumerate() {
        let (a, b) = (memory.apply(&table, drive), plain.apply(&table, drive));
        assert!((a - b).abs() <= 1e-17, "tick {tick}: {a:e} {b:e}");
        assert_eq!(memory.depth(), plain.extrema.len(), "tick {tick}");
    }
    assert!(memory.dropped() > 100);
}

#[test]
fn overflow_costs_less_than_dropping_the_innermost_loop() {
    let innermost = |capacity| {
        let mut plain = PlainStaircase::new(capacity, Rule::Innermost);
        worst_error(decaying(2000), |table, drive| plain.apply(table, drive))
    };
    let least = [
        worst_with_capacity::<8>(2000),
        worst_with_capacity::<16>(2000),
        worst_with_capacity::<32>(2000),
        worst_with_capacity::<64>(2000),
    ];
    assert!(least.windows(2).all(|w| w[1] < 0.6 * w[0]), "about 1/capacity: {least:?}");
    assert!(least[3] < 0.05 * innermost(64), "{:e} against {:e}", least[3], innermost(64));
    assert!(least[3] < 0.3e-6);
}

#[test]
fn a_capacity_of_64_loses_nothing_under_white_noise() {
    let mut random = Random(21);
    let noise = (0..1_000_000).map(move |_| 32.0 * random.unit());
    let mut memory = Memory::new();
    let worst = worst_error(noise, |table, drive| memory.apply(table, drive));
    assert_eq!((worst, memory.dropped()), (0.0, 0));
}

#[test]
fn one_ulp_in_one_node_changes_the_digest() {
    let weights = random_weights(4, N);
    let good = table(&weights);
    let mut nodes = *good.nodes;
    let k = 20 * 21 / 2 + 7; // E(20, 7)
    nodes[k] = f64::from_bits(nodes[k].to_bits() + 1);
    let bad = Table { nodes: Box::leak(Box::new(nodes)) };
    let (mut a, mut b) = (Memory::new(), Memory::new());
    for drive in [25.0, 7.0, 20.0] {
        a.apply(&good, drive);
        b.apply(&bad, drive);
    }
    assert_ne!(digest(&a), digest(&b));
}

/// [`ReversalMemory::follow`] against its two halves, bit by bit: smooth motion, noise about a reversal, jumps, the ends of
/// the table and its nodes, through a converter that rounds and limits the step.
fn follows_as_its_halves_do<const CAP: usize>(table: &Table, seed: u64, tick_of_jumps: u32) -> u32 {
    let mut random = Random(seed);
    let (mut whole, mut halves) = (ReversalMemory::<f64, CAP>::new(), ReversalMemory::<f64, CAP>::new());
    let mut code = 0.0_f64;
    for tick in 0..40_000_u32 {
        let full = table.full_displacement();
        let reach = match tick % tick_of_jumps {
            0 => full * random.unit(),
            1 if tick % 3 == 0 => full * random.below(2) as f64,
            2..=40 => whole.displacement() + 2e-9 * (random.unit() - 0.5),
            41..=60 => table.value(random.below(N + 1) as f64, 0.0),
            _ => whole.displacement() + 3e-7 * (random.unit() - 0.5) + 1e-7 * (f64::from(tick) * 0.003).sin(),
        };
        let displacement = table.within_reach(reach);
        let (codes, step) = if tick % 1000 < 900 { (2048.0, 200.0) } else { (1.0, 1.0) };
        let permitted = |drive: f64| {
            ((drive * codes).round().clamp(code * codes - step, code * codes + step) / codes).clamp(0.0, 32.0)
        };
        let drive = permitted(halves.solve(table, displacement));
        halves.apply(table, drive);
        whole.follow(table, displacement, permitted);
        code = drive;
        assert_eq!(digest(&whole), digest(&halves), "capacity {CAP}, seed {seed}, tick {tick}");
    }
    whole.dropped()
}

#[test]
fn following_is_solving_and_applying_to_the_bit() {
    for seed in 0..4 {
        let full = table(&random_weights(seed, N));
        assert_eq!(follows_as_its_halves_do::<64>(&full, seed, 400), 0);
        let dropped = follows_as_its_halves_do::<4>(&full, seed, 37) + follows_as_its_halves_do::<6>(&full, seed, 4000);
        assert!(dropped > 100, "{dropped}");
    }
    // A table with flat cells, and one without any displacement.
    let mut weights = random_weights(7, N);
    for row in weights.iter_mut().step_by(2) {
        row.fill(0.0);
    }
    follows_as_its_halves_do::<64>(&table(&weights), 11, 400);
    for row in &mut weights {
        row.fill(0.0);
    }
    follows_as_its_halves_do::<64>(&table(&weights), 12, 400);
}

/// As if the drive had been applied after negative saturation.
#[test]
fn a_memory_that_has_risen_is_one_that_was_driven_there() {
    let table = table(&random_weights(5, N));
    for drive in [0.5, 7.0, 31.75] {
        let mut driven = Memory::new();
        let displacement = driven.apply(&table, drive);
        let risen = Memory::risen(drive, displacement);
        assert_eq!(digest(&risen), digest(&driven));
        assert_eq!((risen.drive(), risen.displacement()), (drive, displacement));
    }
}
