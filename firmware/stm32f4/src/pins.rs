//! The wiring: which pin goes where. The table in docs/bring-up.md is this file in words.

use embassy_stm32::Peripherals;
use embassy_stm32::gpio::{AnyPin, Flex, Input, Level, Output, OutputType, Pull, Speed};
pub use embassy_stm32::interrupt::USART2 as LINK;
use embassy_stm32::mode::Async;
pub use embassy_stm32::peripherals::IWDG as Watchdog;
use embassy_stm32::peripherals::{TIM3, USART2};
use embassy_stm32::spi::Spi;
use embassy_stm32::timer::simple_pwm::PwmPin;
use embassy_stm32::timer::{Ch1, Ch2};
use embassy_stm32::usart::{ConfigError, Uart};
use embassy_stm32::{Peri, bind_interrupts, dma, pac, peripherals, rcc, usart};
use specgen_stm32::burst::Device;
use specgen_stm32::converters::{AdcPins, DacPins, TriggerPins, adc_spi, dac_spi, trigger_pins};
use specgen_stm32::enable::{self, Stop};
use specgen_stm32::pulses::Pulses;
use specgen_stm32::serial;

use crate::clocks::{self, DELAY};
use crate::spi::Registers;

bind_interrupts!(
    /// Interrupts of the link.
    pub struct Irqs {
        USART2 => usart::InterruptHandler<USART2>;
        DMA1_STREAM6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
        DMA1_STREAM5 => dma::InterruptHandler<peripherals::DMA1_CH5>;
    }
);

/// Interrupt of the voltage detector.
pub const SUPPLY: pac::Interrupt = pac::Interrupt::PVD;
/// Channel of TIM3 that drives LDAC, counted from 0: CH1.
pub const OUTPUT: usize = 0;
/// That of CONVST: CH2.
const SAMPLING: usize = 1;

/// All that the program uses.
pub struct Wiring {
    /// ADC.
    pub adc: AdcPins<Registers, DELAY>,
    /// DACs and amplifiers.
    pub dac: DacPins<Registers, OUTPUT, DELAY>,
    /// Triggers of the spec, in their order.
    pub lines: TriggerPins,
    /// Emergency stop: a closed contact to ground, at the break input of TIM1; open is stop.
    pub stop: Stop,
    /// Virtual COM port of the ST-LINK.
    pub link: Link,
    /// Watchdog.
    pub watchdog: Peri<'static, Watchdog>,
}

/// Takes the pins. The enable line comes first and is driven low: channel 1 of TIM1, with its break input.
pub fn take(p: Peripherals) -> Wiring {
    let (enable, stop) = enable::guarded::<1>(Flex::new(p.PA8), Flex::new(p.PB12));
    let high = Level::High;
    rcc::enable_and_reset::<TIM3>();
    let clock = rcc::frequency::<TIM3>().0;
    // At rest before the pins are the timer's.
    let (start, load) = Pulses::edges::<SAMPLING, OUTPUT>(pac::TIM3, clock, clocks::OUTPUT);
    core::mem::forget(PwmPin::<TIM3, Ch2>::new(p.PC7, OutputType::PushPull));
    core::mem::forget(PwmPin::<TIM3, Ch1>::new(p.PC6, OutputType::PushPull));
    let adc = Registers::new(Spi::new_blocking(p.SPI1, p.PA5, p.PA7, p.PA6, adc_spi(clocks::ADC)), pac::SPI1);
    let dac = Registers::new(Spi::new_blocking(p.SPI3, p.PC10, p.PC12, p.PC11, dac_spi(clocks::DAC)), pac::SPI3);
    let select = |pin: Peri<'static, AnyPin>| Output::new(pin, high, Speed::VeryHigh);
    Wiring {
        adc: AdcPins {
            spi: Device { bus: adc, select: select(p.PB6.into()) },
            start,
            busy: Input::new(p.PA9, Pull::Up),
            reset: Output::new(p.PB10, Level::Low, Speed::Low),
        },
        dac: DacPins {
            spi: [
                Device { bus: dac.again(), select: select(p.PD2.into()) },
                Device { bus: dac, select: select(p.PC8.into()) },
            ],
            load,
            enable,
        },
        lines: trigger_pins([p.PC0.into(), p.PC1.into(), p.PC2.into(), p.PC3.into()], p.PC4.into()),
        stop,
        link: Link { usart: p.USART2, pins: (p.PA3, p.PA2), channels: (p.DMA1_CH6, p.DMA1_CH5) },
        watchdog: p.IWDG,
    }
}

/// The USART of the link, its pins RX and TX, its DMA for sending and receiving.
pub struct Link {
    usart: Peri<'static, USART2>,
    pins: (Peri<'static, peripherals::PA3>, Peri<'static, peripherals::PA2>),
    channels: (Peri<'static, peripherals::DMA1_CH6>, Peri<'static, peripherals::DMA1_CH5>),
}

impl serial::Line for Link {
    fn open(&mut self) -> Result<Uart<'_, Async>, ConfigError> {
        let Self { usart, pins: (rx, tx), channels: (send, receive) } = self;
        let (rx, tx, send, receive) = (rx.reborrow(), tx.reborrow(), send.reborrow(), receive.reborrow());
        Uart::new(usart.reborrow(), rx, tx, send, receive, Irqs, serial::config())
    }
}
