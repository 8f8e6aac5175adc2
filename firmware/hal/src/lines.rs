//! Digital lines of triggers.

use embedded_hal::digital::{InputPin, OutputPin};

use crate::Fault;

/// Digital outputs that a controller sets in every tick, and an input that it samples.
pub trait Lines {
    /// Number of outputs.
    const COUNT: usize;
    /// Whether there is an input.
    const INPUT: bool = false;

    /// Sets line k high if bit k of `high` is set, else low; ignores bits beyond [`Self::COUNT`].
    ///
    /// # Errors
    /// [`Fault::Pin`] if a line cannot be driven.
    fn set(&mut self, high: u32) -> Result<(), Fault>;

    /// Whether the input is high; low without one.
    ///
    /// # Errors
    /// [`Fault::Pin`] if it cannot be read.
    #[inline]
    fn input(&mut self) -> Result<bool, Fault> {
        Ok(false)
    }
}

/// No lines.
impl Lines for () {
    const COUNT: usize = 0;

    #[inline]
    fn set(&mut self, _high: u32) -> Result<(), Fault> {
        Ok(())
    }
}

/// Optional pins.
impl<PIN: OutputPin, const N: usize> Lines for [Option<PIN>; N] {
    const COUNT: usize = N;

    #[inline]
    fn set(&mut self, high: u32) -> Result<(), Fault> {
        let mut left = high;
        for pin in self.iter_mut() {
            if let Some(pin) = pin {
                let driven = if left & 1 == 1 { pin.set_high() } else { pin.set_low() };
                driven.map_err(|_| Fault::Pin)?;
            }
            left >>= 1;
        }
        Ok(())
    }
}

/// Outputs, and an optional input pin.
impl<L: Lines, PIN: InputPin> Lines for (L, Option<PIN>) {
    const COUNT: usize = L::COUNT;
    const INPUT: bool = true;

    #[inline]
    fn set(&mut self, high: u32) -> Result<(), Fault> {
        self.0.set(high)
    }

    #[inline]
    fn input(&mut self) -> Result<bool, Fault> {
        self.1.as_mut().map_or(Ok(false), |pin| pin.is_high().map_err(|_| Fault::Pin))
    }
}
