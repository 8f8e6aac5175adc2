//! What the loop reads and writes: gauges and amplifiers behind the traits of `hal`, and what a PC needs beyond.

#[cfg(feature = "comedi")]
pub mod comedi;
pub mod simulated;

use specgen_hal::{Amplifiers, CHANNELS, Fault, Gauges, Lines};

/// What the contacts of a machine show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Contacts {
    /// The emergency stop is open.
    pub stop: bool,
    /// An amplifier reports a fault.
    pub fault: bool,
}

/// A machine as the loop sees it.
pub trait Device: Gauges + Amplifiers + Lines {
    /// Tick `tick`, counted from 0, begins. Called once before its [`Gauges::read`]; numbers rise, and leave out skipped ticks.
    fn tick(&mut self, tick: u64);

    /// Shows outside that this tick is run, and reads the contacts. Called once a tick.
    ///
    /// # Errors
    /// The lines cannot be set or read.
    fn beat(&mut self) -> Result<Contacts, Fault>;

    /// Force and torque on the platform that were read with the gauges, N and N m; zeros without a sensor.
    fn wrench(&self) -> [f64; CHANNELS];

    /// What it is, for the summary.
    fn describe(&self) -> String;
}
