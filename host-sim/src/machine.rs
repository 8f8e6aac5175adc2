//! A simulated machine with its sensors and amplifiers: a platform or six separate legs.

use crate::closed_loop::{LEGS, Rig};
use crate::platform::PlatformRig;

/// A prepared machine: pre-cycled, at rest, with its gauges zeroed.
#[derive(Debug, Clone)]
pub enum Machine {
    /// Six gauges see a platform.
    Platform(Box<PlatformRig>),
    /// Six legs, each with its own gauge.
    Legs(Box<Rig>),
}

impl Machine {
    /// Holds six voltages (V) for `interval` (s).
    pub fn hold(&mut self, voltages: &[f64; LEGS], interval: f64) {
        match self {
            Self::Platform(rig) => rig.hold(voltages, interval),
            Self::Legs(rig) => rig.hold(voltages, interval),
        }
    }

    /// Reads the six gauges, in m or V.
    pub fn read_gauges(&mut self) -> [f64; LEGS] {
        match self {
            Self::Platform(rig) => rig.read_gauges(),
            Self::Legs(rig) => rig.read(),
        }
    }

    /// Reads the force sensor, N and N m; legs have none.
    pub fn read_wrench(&mut self) -> [f64; LEGS] {
        match self {
            Self::Platform(rig) => rig.read_wrench(),
            Self::Legs(_) => [0.0; LEGS],
        }
    }
}
