//! Inputs and outputs of the loop: gauges and amplifiers behind the traits of `hal`, and the additional lines of a PC.

#[cfg(feature = "comedi")]
pub mod comedi;
pub mod simulated;

use specgen_hal::{Amplifiers, CHANNELS, Fault, Gauges, Lines};

/// State of a machine's contacts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Contacts {
    /// The emergency stop is open.
    pub stop: bool,
    /// An amplifier reports a fault.
    pub fault: bool,
}

/// A machine as seen by the loop.
pub trait Device: Gauges + Amplifiers + Lines {
    /// Tick `tick`, counted from 0, begins. Called once before its [`Gauges::read`]; numbers increase, and skipped
    /// ticks have none.
    fn tick(&mut self, tick: u64);

    /// Toggles the heartbeat and reads the contacts. Called once a tick.
    ///
    /// # Errors
    /// The lines cannot be set or read.
    fn beat(&mut self) -> Result<Contacts, Fault>;

    /// Force and torque on the platform, read with the gauges, N and N m; zeros without a sensor.
    fn wrench(&self) -> [f64; CHANNELS];

    /// Description for the summary.
    fn describe(&self) -> String;
}
