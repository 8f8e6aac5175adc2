//! Pins as outputs, inputs and functions of peripherals.

use core::convert::Infallible;

use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use specgen_hal::Fault;
use specgen_hal::ad7606::BusyLine;
use stm32_metapac::gpio::Gpio;
use stm32_metapac::gpio::vals::{Moder, Ospeedr, Ot, Pupdr};
use stm32_metapac::{EXTI, GPIOA, SYSCFG};

/// A pin by port and number. The port must have its clock, and no other code may configure its pins at the same time.
#[derive(Clone, Copy)]
pub struct Pin(pub Gpio, pub u8);

impl Pin {
    /// Sets the mode last, so that the pin is driven only in its final configuration.
    fn mode(self, mode: Moder, speed: Ospeedr, pull: Pupdr) {
        let Self(port, number) = self;
        let number = usize::from(number);
        port.pupdr().modify(|w| w.set_pupdr(number, pull));
        port.otyper().modify(|w| w.set_ot(number, Ot::PUSH_PULL));
        port.ospeedr().modify(|w| w.set_ospeedr(number, speed));
        port.moder().modify(|w| w.set_moder(number, mode));
    }

    /// Connects it to a peripheral by its alternate function in the data sheet.
    pub fn function(self, function: u8, speed: Ospeedr, pull: Pupdr) {
        let number = usize::from(self.1);
        self.0.afr(number / 8).modify(|w| w.set_afr(number % 8, function));
        self.mode(Moder::ALTERNATE, speed, pull);
    }

    /// An output with this initial level.
    #[must_use]
    pub fn output(self, high: bool, speed: Ospeedr) -> Output {
        let mut output = Output(self);
        output.set(high);
        self.mode(Moder::OUTPUT, speed, Pupdr::FLOATING);
        output
    }

    /// An input.
    #[must_use]
    pub fn input(self, pull: Pupdr) -> Input {
        self.mode(Moder::INPUT, Ospeedr::LOW_SPEED, pull);
        Input(self)
    }
}

/// Distance of ports in the address space, from [`GPIOA`] on.
const PORT: usize = 0x400;

/// An input whose falling edges are latched by the EXTI, without an interrupt.
pub struct LatchedInput(Input);

impl Pin {
    /// An input with latched falling edges. No other port may use its number in the EXTI.
    #[must_use]
    pub fn latched(self, pull: Pupdr) -> LatchedInput {
        let Self(port, number) = self;
        let place = (port.as_ptr() as usize).wrapping_sub(GPIOA.as_ptr() as usize) / PORT;
        let input = self.input(pull);
        SYSCFG.exticr(usize::from(number / 4 & 3)).modify(|w| w.set_exti(usize::from(number % 4), place as u8));
        EXTI.ftsr(0).modify(|w| w.0 |= 1 << number);
        EXTI.imr(0).modify(|w| w.0 |= 1 << number);
        LatchedInput(input)
    }
}

impl BusyLine for LatchedInput {
    #[inline]
    fn is_high(&mut self) -> Result<bool, Fault> {
        Ok(self.0.level())
    }

    #[inline]
    fn watch(&mut self) {
        // A one clears.
        EXTI.pr(0).write(|w| w.0 = 1 << self.0.0.1);
    }

    #[inline]
    fn converts_again(&mut self) -> Result<bool, Fault> {
        Ok(EXTI.pr(0).read().0 >> self.0.0.1 & 1 == 1 || self.0.level())
    }
}

/// Configures the pins of an SPI: SCK, pulled to its idle level, MOSI, MISO.
pub fn spi_bus([clock, output, input]: [Pin; 3], function: u8, idle: Pupdr) {
    clock.function(function, Ospeedr::VERY_HIGH_SPEED, idle);
    output.function(function, Ospeedr::VERY_HIGH_SPEED, Pupdr::FLOATING);
    input.function(function, Ospeedr::LOW_SPEED, Pupdr::FLOATING);
}

/// A push-pull output.
pub struct Output(Pin);

impl Output {
    /// Sets its level without a read-modify-write of the port.
    #[inline]
    pub fn set(&mut self, high: bool) {
        let Pin(port, number) = self.0;
        // BSRR: the lower half sets, the upper one resets.
        port.bsrr().write(|w| w.0 = 1 << (number + if high { 0 } else { 16 }));
    }

    /// Whether it is driven high.
    #[inline]
    #[must_use]
    pub fn is_set(&self) -> bool {
        let Pin(port, number) = self.0;
        port.odr().read().0 >> number & 1 == 1
    }
}

impl ErrorType for Output {
    type Error = Infallible;
}

impl OutputPin for Output {
    #[inline]
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.set(false);
        Ok(())
    }

    #[inline]
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.set(true);
        Ok(())
    }
}

/// An input.
pub struct Input(Pin);

impl Input {
    /// Whether it is high.
    #[inline]
    #[must_use]
    pub fn level(&self) -> bool {
        let Pin(port, number) = self.0;
        port.idr().read().0 >> number & 1 == 1
    }
}

impl ErrorType for Input {
    type Error = Infallible;
}

impl InputPin for Input {
    #[inline]
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.level())
    }

    #[inline]
    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!self.level())
    }
}
