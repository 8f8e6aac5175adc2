//! Gauges and amplifiers of a platform, as a control tick needs them, and drivers of real converters.
//!
//! A driver moves codes and finds out whether its part answers as its data sheet says. What a code means, and what
//! becomes of a machine whose converter answers garbage, is the controller's business.
//!
//! | trait | drivers |
//! | --- | --- |
//! | [`Gauges`] | [`ad7606`]: AD7606, AD7606B (16 bits), AD7608, AD7606C-18 (18 bits) |
//! | [`Amplifiers`] | [`ad5686r`]: two AD5686R (16 bits) |
//! | [`Lines`] | pins of a microcontroller |
//!
//! Nothing here allocates, panics or waits without a bound: a wait for a part is counted out and ends in a [`Fault`].
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

pub mod ad5686r;
pub mod ad7606;
mod edge;
mod fault;
mod lines;

pub use edge::{Edge, Pulse};
pub use fault::Fault;
pub use lines::Lines;

/// Legs of a platform, and gauges.
pub const CHANNELS: usize = 6;

/// Six gauges that are sampled at the same instant.
pub trait Gauges {
    /// Bits of a code.
    const BITS: u32;

    /// Brings the parts into their working state and finds out whether they answer. Called once at power-up, and again after a
    /// fault while the amplifiers are disabled. May take a millisecond.
    ///
    /// # Errors
    /// The first [`Fault`] found.
    fn start(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    /// Samples all gauges at once, now or where a timer did in this tick, and returns while they are converted.
    ///
    /// # Errors
    /// The [`Fault`] that leaves nothing to read.
    fn begin(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    /// The codes of what [`Self::begin`] sampled, 0 to 2^[`Self::BITS`] − 1: 0 at the lowest input, not in two's
    /// complement. Blocks until they are there, for a time that does not depend on what the part answers by more than
    /// its driver says.
    ///
    /// # Errors
    /// The [`Fault`] that makes the codes unbelievable. The next call starts anew.
    fn read(&mut self) -> Result<[i32; CHANNELS], Fault>;
}

/// Six amplifiers behind converters, and the line that enables them.
pub trait Amplifiers {
    /// Bits of a code.
    const BITS: u32;

    /// Disables the amplifiers, brings the parts into their working state with all outputs at code 0, and finds out whether
    /// they answer. Called once at power-up, and again after a fault while the amplifiers are disabled. May take a millisecond.
    ///
    /// # Errors
    /// The first [`Fault`] found. The amplifiers are disabled all the same.
    fn start(&mut self) -> Result<(), Fault> {
        self.enable(false)
    }

    /// Looks, while the gauges are converted, whether the parts hold what was written. At most once between two writes.
    ///
    /// # Errors
    /// [`Fault::ReadBack`] if one does not, [`Fault::Bus`] or [`Fault::Pin`].
    fn ask(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    /// Gives out six codes, 0 to 2^[`Self::BITS`] − 1; all outputs change at the same instant, after the last is written:
    /// at once, or at the instant of the tick that a timer keeps.
    ///
    /// # Errors
    /// A [`Fault`] says that an output may not be what was asked for. A code out of range is one, and then nothing is written.
    fn write(&mut self, codes: &[i32; CHANNELS]) -> Result<(), Fault>;

    /// Enables (true) or disables the amplifiers; enables them only when the outputs have changed. Disabled is the state after power-up and reset, before any call.
    ///
    /// # Errors
    /// [`Fault::Pin`] if the line cannot be driven.
    fn enable(&mut self, on: bool) -> Result<(), Fault>;
}

impl<G: Gauges> Gauges for &mut G {
    const BITS: u32 = G::BITS;

    fn start(&mut self) -> Result<(), Fault> {
        (**self).start()
    }

    fn begin(&mut self) -> Result<(), Fault> {
        (**self).begin()
    }

    fn read(&mut self) -> Result<[i32; CHANNELS], Fault> {
        (**self).read()
    }
}

impl<A: Amplifiers> Amplifiers for &mut A {
    const BITS: u32 = A::BITS;

    fn start(&mut self) -> Result<(), Fault> {
        (**self).start()
    }

    fn ask(&mut self) -> Result<(), Fault> {
        (**self).ask()
    }

    fn write(&mut self, codes: &[i32; CHANNELS]) -> Result<(), Fault> {
        (**self).write(codes)
    }

    fn enable(&mut self, on: bool) -> Result<(), Fault> {
        (**self).enable(on)
    }
}
