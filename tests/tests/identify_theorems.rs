//! Properties that the identification's memory, regressor and solver must have, each against an independent basis.

use crate::identify_support::{Relays, generator, random_table, uniform};
use nalgebra::DMatrix;
use specgen::identify::Staircase;
use specgen::identify::regressor::{Plane, evaluate};
use specgen_numerics::nnls;

const RANGE: [f64; 2] = [-90.0, 90.0];

fn output(plane: &Plane, memory: &Staircase, nodes: &[f64]) -> f64 {
    let mut row = Vec::new();
    plane.row(memory, &mut row);
    evaluate(&row, nodes)
}

#[test]
fn rows_equal_brute_force_relays_on_grid_values() {
    let grid = 12;
    let plane = Plane { grid, range: RANGE };
    let table = random_table(grid, RANGE, 40.0, 1.0, 7);
    let mut random = generator(1);
    let mut relays = Relays::off(grid);
    let mut memory = Staircase::negative_saturation(RANGE);
    for _ in 0..5_000 {
        let k = (uniform(&mut random) * (grid + 1) as f64) as usize;
        relays.push(k);
        memory.push(table.threshold(k));
        let (wanted, found) = (relays.output(&table), output(&plane, &memory, &table.nodes));
        assert!((wanted - found).abs() <= 1e-12, "at grid value {k}: relays {wanted}, row {found}");
    }
}

#[test]
fn wiping_out_makes_the_inner_history_irrelevant() {
    let mut random = generator(2);
    for _ in 0..500 {
        let mut with = Staircase::negative_saturation(RANGE);
        let (high, low) = (20.0 + 60.0 * uniform(&mut random), -80.0 + 60.0 * uniform(&mut random));
        with.push(high);
        with.push(low);
        let without = with.clone();
        for _ in 0..20 {
            with.push(low + (high - low) * uniform(&mut random));
        }
        for end in [high, low] {
            let (mut a, mut b) = (with.clone(), without.clone());
            a.push(end);
            b.push(end);
            assert_eq!(a, b);
        }
    }
}

#[test]
fn congruency_loops_between_the_same_drives_have_the_same_height() {
    let plane = Plane { grid: 16, range: RANGE };
    let table = random_table(16, RANGE, 40.0, 1.0, 3);
    let mut random = generator(3);
    let (low, high) = (-13.7, 31.4);
    let mut heights = Vec::new();
    for _ in 0..200 {
        let mut memory = Staircase::negative_saturation(RANGE);
        for _ in 0..10 {
            memory.push(RANGE[0] + 180.0 * uniform(&mut random));
        }
        memory.push(high);
        memory.push(low);
        let bottom = output(&plane, &memory, &table.nodes);
        memory.push(high);
        heights.push(output(&plane, &memory, &table.nodes) - bottom);
    }
    assert!(heights[0].abs() > 1e-3, "{}", heights[0]);
    for height in &heights {
        assert!((height - heights[0]).abs() <= 1e-12, "{height} against {}", heights[0]);
    }
}

#[test]
fn output_is_continuous_when_the_drive_crosses_grid_lines() {
    let plane = Plane { grid: 9, range: RANGE };
    let table = random_table(9, RANGE, 40.0, 1.0, 5);
    let mut memory = Staircase::negative_saturation(RANGE);
    memory.push(71.0);
    let steps = 18_000;
    let mut before = output(&plane, &memory, &table.nodes);
    for k in 1..=steps {
        memory.push(71.0 - 150.0 * f64::from(k) / f64::from(steps));
        let now = output(&plane, &memory, &table.nodes);
        assert!(now <= before && before - now < 0.05, "step {k}: {before} to {now}");
        before = now;
    }
}

/// Random positive definite problem whose unconstrained solution has weights of both signs.
fn problem(n: usize, seed: u64) -> (DMatrix<f64>, Vec<f64>) {
    let mut random = generator(seed);
    let a = DMatrix::from_fn(2 * n, n, |_, _| uniform(&mut random) - 0.3);
    let y: Vec<f64> = (0..2 * n).map(|_| uniform(&mut random) - 0.5).collect();
    let gram = a.transpose() * &a;
    let rhs = (0..n).map(|c| (0..2 * n).map(|r| a[(r, c)] * y[r]).sum()).collect();
    (gram, rhs)
}

fn cost(gram: &DMatrix<f64>, rhs: &[f64], w: &[f64]) -> f64 {
    let mut cost = 0.0;
    for (i, wi) in w.iter().enumerate() {
        cost -= rhs[i] * wi;
        for (j, wj) in w.iter().enumerate() {
            cost += 0.5 * wi * gram[(i, j)] * wj;
        }
    }
    cost
}

#[test]
fn nnls_finds_the_best_of_all_active_sets() {
    let n = 9;
    for seed in 0..20 {
        let (gram, rhs) = problem(n, seed);
        let solution = nnls::solve(&gram, &rhs).unwrap();
        let mut best = 0.0;
        for set in 1u32..1 << n {
            let chosen: Vec<usize> = (0..n).filter(|k| set >> k & 1 == 1).collect();
            let part = DMatrix::from_fn(chosen.len(), chosen.len(), |r, c| gram[(chosen[r], chosen[c])]);
            let b = nalgebra::DVector::from_iterator(chosen.len(), chosen.iter().map(|&k| rhs[k]));
            let x = part.lu().solve(&b).unwrap();
            if x.iter().all(|w| *w >= 0.0) {
                let mut w = vec![0.0; n];
                chosen.iter().zip(x.iter()).for_each(|(&k, v)| w[k] = *v);
                best = f64::min(best, cost(&gram, &rhs, &w));
            }
        }
        let found = cost(&gram, &rhs, &solution.weights);
        assert!((found - best).abs() <= 1e-12 * best.abs().max(1e-3), "seed {seed}: {found} against {best}");
    }
}

#[test]
fn nnls_satisfies_karush_kuhn_tucker_and_the_check_can_fail() {
    for seed in 0..5 {
        let (gram, rhs) = problem(120, 100 + seed);
        let mut solution = nnls::solve(&gram, &rhs).unwrap();
        let zeros = solution.weights.iter().filter(|w| **w == 0.0).count();
        assert!(zeros > 0 && zeros < 120, "the problem must have active and passive weights, has {zeros} zeros");
        assert!(nnls::kkt_violation(&gram, &rhs, &solution.weights) < 1e-10);
        let k = solution.weights.iter().position(|w| *w > 0.0).unwrap();
        solution.weights[k] *= 1.01;
        assert!(nnls::kkt_violation(&gram, &rhs, &solution.weights) > 1e-6);
    }
}

#[test]
fn nnls_refuses_a_singular_problem() {
    let gram = DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 1.0, 1.0]);
    assert_eq!(nnls::solve(&gram, &[1.0, 1.0]), Err(nnls::Failure::Singular));
    assert_eq!(nnls::solve(&DMatrix::zeros(2, 2), &[1.0, 1.0]), Err(nnls::Failure::Singular));
}
