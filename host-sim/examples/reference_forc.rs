//! Writes the reference leg's reversal-curve record (CSV) to standard output:
//! `cargo run --release -p host-sim --example reference_forc > specs/records/reference-forc.csv`
//!
//! N = 32 at 20 V/s with the gauge's noise and quantisation, from the leg as built. The same bytes on every machine.

use std::io::Write;

use host_sim::forc::ReversalExperiment;
use host_sim::noise::Gauge;
use host_sim::plant::{LegParameters, LegPlant};

/// Seed of the record's noise.
const SEED: u64 = 1;

fn main() -> std::io::Result<()> {
    let parameters = LegParameters::reference();
    let mut leg = LegPlant::new(&parameters);
    let mut gauge = Gauge::new(&parameters.noise, SEED, 0);
    let record = ReversalExperiment::reference(32).run(&mut leg, &mut gauge);
    std::io::stdout().write_all(record.to_csv().as_bytes())
}
