//! Host time of the kernels: `cargo bench -p specgen-benches`. Quote ratios: machines are noisy.

use divan::{Bencher, black_box};
use specgen_runtime::{Everett, ReversalMemory};

const N: usize = 32;
const NODES: usize = (N + 1) * (N + 2) / 2;

fn main() {
    divan::main();
}

/// A smooth monotone table of a 60 µm leg with a loop of about 15 %.
fn table() -> Everett<f64, N, NODES> {
    let mut nodes = [0.0; NODES];
    for up in 0..=N {
        for down in 0..=up {
            let x = (up - down) as f64 / N as f64;
            nodes[up * (up + 1) / 2 + down] = 60e-6 * (0.7 * x + 0.3 * x * x);
        }
    }
    Everett { nodes: Box::leak(Box::new(nodes)) }
}

/// Requests of a tracking leg: a sine with noise of 2.2 nm, so that the drive reverses all the time.
fn requests() -> Vec<f64> {
    let mut state = 1_u64;
    let mut unit = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1u64 << 31) as f64 - 0.5
    };
    (0..4096).map(|k| 30e-6 + 20e-6 * (f64::from(k) * 0.0126).sin() + 7.6e-9 * unit()).collect()
}

/// Γ⁻¹ and the memory brought up to date, per request.
#[divan::bench]
fn inverse_preisach(bencher: Bencher) {
    let (table, requests) = (table(), requests());
    let mut memory = ReversalMemory::<f64, 64>::new();
    bencher.counter(requests.len()).bench_local(|| {
        for request in &requests {
            let drive = memory.solve(&table, black_box(*request));
            black_box(memory.apply(&table, drive));
        }
    });
}

/// The same by bisecting the forward model on a copy of the memory, which is what one writes first: the ratio is the gain.
#[divan::bench]
fn inverse_by_bisecting_the_forward_model(bencher: Bencher) {
    let (table, requests) = (table(), requests());
    let mut memory = ReversalMemory::<f64, 64>::new();
    bencher.counter(requests.len()).bench_local(|| {
        for request in &requests {
            let (mut low, mut high) = (0.0, 32.0);
            for _ in 0..45 {
                let middle = 0.5 * (low + high);
                let mut copy = memory;
                if copy.apply(&table, middle) < *request { low = middle } else { high = middle }
            }
            black_box(memory.apply(&table, 0.5 * (low + high)));
        }
    });
}
