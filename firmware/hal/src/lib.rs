//! Traits for gauges and amplifiers in a control tick, and drivers of real converters.
//!
//! A driver transfers codes and checks that its part answers as its data sheet says. The controller interprets the codes, and
//! decides what happens if a converter fails.
//!
//! | trait | drivers |
//! | --- | --- |
//! | [`Gauges`] | [`ad7606`]: AD7606, AD7606B (16 bits), AD7608, AD7606C-18 (18 bits) |
//! | [`Amplifiers`] | [`ad5686r`]: two AD5686R (16 bits) |
//! | [`Lines`] | pins of a microcontroller |
//!
//! Nothing here allocates, panics or waits without a bound: a wait for a part times out with a [`Fault`].
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

/// Six gauges that are sampled simultaneously.
pub trait Gauges {
    /// Bits of a code.
    const BITS: u32;

    /// Initialises the parts and checks that they answer. Called once at power-up, and again after a
    /// fault while the amplifiers are disabled. May take a millisecond.
    ///
    /// # Errors
    /// The first [`Fault`] found.
    fn start(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    /// Samples all gauges simultaneously, now or by the timer in this tick, and returns during the conversion.
    ///
    /// # Errors
    /// The [`Fault`] after which there is nothing to read.
    fn begin(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    /// The codes that [`Self::begin`] sampled, 0 to 2^[`Self::BITS`] − 1: 0 at the lowest input, not in two's
    /// complement. Blocks until they are available. The driver documents how much this time may vary.
    ///
    /// # Errors
    /// The [`Fault`] that makes the codes invalid. The next call starts from the beginning.
    fn read(&mut self) -> Result<[i32; CHANNELS], Fault>;
}

/// Six amplifiers behind converters, and the line that enables them.
pub trait Amplifiers {
    /// Bits of a code.
    const BITS: u32;

    /// Disables the amplifiers, initialises the parts with all outputs at code 0, and checks that they answer. Called once at
    /// power-up, and again after a fault while the amplifiers are disabled. May take a millisecond.
    ///
    /// # Errors
    /// The first [`Fault`] found. The amplifiers are disabled in any case.
    fn start(&mut self) -> Result<(), Fault> {
        self.enable(false)
    }

    /// Checks, during the conversion of the gauges, that the parts hold the written codes. At most once between two writes.
    ///
    /// # Errors
    /// [`Fault::ReadBack`] if one does not, [`Fault::Bus`] or [`Fault::Pin`].
    fn ask(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    /// Outputs six codes, 0 to 2^[`Self::BITS`] − 1. All outputs change simultaneously after the last is written: immediately, or at
    /// the timer's instant in the tick.
    ///
    /// # Errors
    /// A [`Fault`] means that an output may differ from its code. For a code out of range nothing is written.
    fn write(&mut self, codes: &[i32; CHANNELS]) -> Result<(), Fault>;

    /// Enables (true) or disables the amplifiers; enables them only after the outputs have changed. They are disabled after
    /// power-up and reset.
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
