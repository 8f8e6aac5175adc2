//! The two edges of a tick: CONVST, at which all gauges are sampled, and LDAC, at which all outputs change.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;

use crate::Fault;

/// A line that is given one edge a tick: by the program, or by a timer at an instant that no program delays.
pub trait Edge {
    /// One edge: at once, or at the instant of this tick that the timer is set to. It has been given already where the timer came
    /// first.
    ///
    /// # Errors
    /// [`Fault::Pin`] if the line cannot be driven.
    fn give(&mut self) -> Result<(), Fault>;

    /// No timer gives an edge until [`Edge::give`] is called next. Nothing to do where there is no timer.
    fn hold(&mut self) {}

    /// Waits until the edge that was asked for is out. Nothing to do where it is given at once.
    fn settle(&mut self) {}
}

/// A low pulse of `NS` at a pin that rests high; the program gives it.
#[derive(Debug)]
pub struct Pulse<PIN, DELAY, const NS: u32> {
    /// The pin, high.
    pub pin: PIN,
    /// Waits.
    pub delay: DELAY,
}

impl<PIN: OutputPin, DELAY: DelayNs, const NS: u32> Edge for Pulse<PIN, DELAY, NS> {
    fn give(&mut self) -> Result<(), Fault> {
        self.pin.set_low().map_err(|_| Fault::Pin)?;
        self.delay.delay_ns(NS);
        self.pin.set_high().map_err(|_| Fault::Pin)
    }
}
