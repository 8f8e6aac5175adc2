//! The wiring: which pin goes where. The table in docs/bring-up.md is this file in words.

use embassy_stm32::Peripherals;
use embassy_stm32::gpio::{AnyPin, Flex, Input, Level, Output, OutputType, Pull, Speed};
pub use embassy_stm32::interrupt::USART3 as LINK;
use embassy_stm32::mode::Async;
pub use embassy_stm32::peripherals::IWDG1 as Watchdog;
use embassy_stm32::peripherals::{TIM4, USART3};
use embassy_stm32::spi::Spi;
use embassy_stm32::timer::simple_pwm::PwmPin;
use embassy_stm32::timer::{Ch2, Ch4};
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
        USART3 => usart::InterruptHandler<USART3>;
        DMA1_STREAM0 => dma::InterruptHandler<peripherals::DMA1_CH0>;
        DMA1_STREAM1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
    }
);

/// Interrupt of the voltage detector.
pub const SUPPLY: pac::Interrupt = pac::Interrupt::PVD_AVD;
/// Channel of TIM4 that drives LDAC, counted from 0: CH2.
pub const OUTPUT: usize = 1;
/// That of CONVST: CH4.
const SAMPLING: usize = 3;

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

/// Takes the pins. The enable line comes first and is driven low: channel 2 of TIM1, with its break input.
pub fn take(p: Peripherals) -> Wiring {
    let (enable, stop) = enable::guarded::<2>(Flex::new(p.PE11), Flex::new(p.PE15));
    let high = Level::High;
    rcc::enable_and_reset::<TIM4>();
    let clock = rcc::frequency::<TIM4>().0;
    // At rest before the pins are the timer's.
    let (start, load) = Pulses::edges::<SAMPLING, OUTPUT>(pac::TIM4, clock, clocks::OUTPUT);
    core::mem::forget(PwmPin::<TIM4, Ch4>::new(p.PD15, OutputType::PushPull));
    core::mem::forget(PwmPin::<TIM4, Ch2>::new(p.PD13, OutputType::PushPull));
    let adc = Registers::new(Spi::new_blocking(p.SPI1, p.PA5, p.PB5, p.PA6, adc_spi(clocks::ADC)), pac::SPI1);
    let dac = Registers::new(Spi::new_blocking(p.SPI4, p.PE2, p.PE6, p.PE5, dac_spi(clocks::DAC)), pac::SPI4);
    let select = |pin: Peri<'static, AnyPin>| Output::new(pin, high, Speed::VeryHigh);
    Wiring {
        adc: AdcPins {
            spi: Device { bus: adc, select: select(p.PD14.into()) },
            start,
            busy: Input::new(p.PF3, Pull::Up),
            reset: Output::new(p.PE9, Level::Low, Speed::Low),
        },
        dac: DacPins {
            spi: [
                Device { bus: dac.again(), select: select(p.PD2.into()) },
                Device { bus: dac, select: select(p.PG2.into()) },
            ],
            load,
            enable,
        },
        lines: trigger_pins([p.PE7.into(), p.PE8.into(), p.PE10.into(), p.PE12.into()], p.PE14.into()),
        stop,
        link: Link { usart: p.USART3, pins: (p.PD9, p.PD8), channels: (p.DMA1_CH0, p.DMA1_CH1) },
        watchdog: p.IWDG1,
    }
}

/// The USART of the link, its pins RX and TX, its DMA for sending and receiving.
pub struct Link {
    usart: Peri<'static, USART3>,
    pins: (Peri<'static, peripherals::PD9>, Peri<'static, peripherals::PD8>),
    channels: (Peri<'static, peripherals::DMA1_CH0>, Peri<'static, peripherals::DMA1_CH1>),
}

impl serial::Line for Link {
    fn open(&mut self) -> Result<Uart<'_, Async>, ConfigError> {
        let Self { usart, pins: (rx, tx), channels: (send, receive) } = self;
        let (rx, tx, send, receive) = (rx.reborrow(), tx.reborrow(), send.reborrow(), receive.reborrow());
        Uart::new(usart.reborrow(), rx, tx, send, receive, Irqs, serial::config())
    }
}
