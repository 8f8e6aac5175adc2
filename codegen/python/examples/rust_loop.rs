//! Baseline for `Controller.run`: ticks of a host library over rows of words, in Rust.
//!
//! `rust_loop LIBRARY ROWS REPEATS` prints the shortest time of all rows, s, and the digest of the state after them. `tests/speed.py`
//! runs it.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::Instant;

use host_sim::controller::{Controller, TickController};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [library, rows, repeats] = &arguments[..] else { return Err("expected LIBRARY ROWS REPEATS".into()) };
    let bytes = fs::read(rows)?;
    let words: Vec<u64> = bytes.as_chunks().0.iter().map(|word| u64::from_le_bytes(*word)).collect();
    let mut controller = Controller::load(Path::new(library))?;
    let [inputs, outputs] = {
        let about = controller.description();
        [about.input_names.len(), about.output_names.len()]
    };
    let mut out = vec![0; words.len() / inputs * outputs];
    let mut shortest = f64::INFINITY;
    for _ in 0..repeats.parse()? {
        controller.reset();
        let begun = Instant::now();
        for (input, output) in words.chunks_exact(inputs).zip(out.chunks_exact_mut(outputs)) {
            controller.step(input, output);
        }
        let took = begun.elapsed().as_secs_f64();
        if took < shortest {
            shortest = took;
        }
    }
    println!("{shortest:?} {}", controller.state_digest());
    Ok(())
}
