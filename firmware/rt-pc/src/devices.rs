//! What the loop reads and writes: gauges and amplifiers behind the traits of `hal`, and what a PC needs beyond.

#[cfg(feature = "comedi")]
pub mod comedi;
pub mod simulated;

use specgen_hal::{Amplifiers, CHANNELS, Gauges, Lines};

/// A machine as the loop sees it.
pub trait Device: Gauges + Amplifiers + Lines {
    /// Tick `tick`, counted from 0, begins. Called once before its [`Gauges::read`]; numbers rise, and leave out skipped ticks.
    fn tick(&mut self, tick: u64);

    /// Force and torque on the platform that were read with the gauges, N and N m; zeros without a sensor.
    fn wrench(&self) -> [f64; CHANNELS];

    /// What it is, for the summary.
    fn describe(&self) -> String;
}
