//! The pin assignment. The table in docs/bring-up.md describes it.

use specgen_stm32::burst::Device;
use specgen_stm32::converters::{ADC_MODE, AdcPins, DAC_MODE, DacPins, TriggerPins, trigger_pins};
use specgen_stm32::enable::{self, Stop};
use specgen_stm32::pins::{Input, Pin, spi_bus};
use specgen_stm32::pulses::Pulses;
use specgen_stm32::serial::{self, Port};
use stm32_metapac::gpio::vals::{Ospeedr, Pupdr};
use stm32_metapac::iwdg::Iwdg;
use stm32_metapac::{
    DMAMUX1, GPIOA, GPIOB, GPIOD, GPIOE, GPIOF, GPIOG, IWDG1, Interrupt, SPI1, SPI4, TIM4, USART3, interrupt,
};

use crate::clocks::{self, DELAY};
use crate::spi::Registers;

/// Interrupt of the voltage detector.
pub const SUPPLY: Interrupt = Interrupt::PVD_AVD;
/// The watchdog.
pub const WATCHDOG: Iwdg = IWDG1;
/// Channel of TIM4 that drives LDAC, counted from 0: CH2.
pub const OUTPUT: usize = 1;
/// Channel of CONVST: CH4.
const SAMPLING: usize = 3;

/// All pins of the program.
pub struct Wiring {
    /// ADC.
    pub adc: AdcPins<Registers, DELAY>,
    /// DACs and amplifiers.
    pub dac: DacPins<Registers, OUTPUT, DELAY>,
    /// Triggers of the spec, in their order.
    pub lines: TriggerPins,
    /// Emergency stop: a closed contact to ground at the break input of TIM1; open means stop.
    pub stop: Stop,
    /// Amplifier fault: closed to ground while all are healthy; open means fault.
    pub fault: Input,
}

/// Configures the pins; `hertz` is the clock of TIM4. The enable line comes first and is driven low: channel 2 of TIM1, with its
/// break input.
pub fn take(hertz: u32) -> Wiring {
    let (enable, stop) = enable::guarded::<2>(Pin(GPIOE, 11), Pin(GPIOE, 15));
    // The lines are idle before the pins are connected to the timer.
    let (start, load) = Pulses::edges::<SAMPLING, OUTPUT>(TIM4, hertz, clocks::OUTPUT);
    for pin in [Pin(GPIOD, 15), Pin(GPIOD, 13)] {
        pin.function(2, Ospeedr::VERY_HIGH_SPEED, Pupdr::FLOATING);
    }
    spi_bus([Pin(GPIOA, 5), Pin(GPIOB, 5), Pin(GPIOA, 6)], 5, Pupdr::PULL_UP);
    let adc = Registers::new(SPI1, ADC_MODE, [clocks::ADC; 2]);
    spi_bus([Pin(GPIOE, 2), Pin(GPIOE, 6), Pin(GPIOE, 5)], 5, Pupdr::PULL_DOWN);
    let dac = Registers::new(SPI4, DAC_MODE, [clocks::DAC, clocks::READ_BACK]);
    let select = |pin: Pin| pin.output(true, Ospeedr::VERY_HIGH_SPEED);
    Wiring {
        adc: AdcPins {
            spi: Device { bus: adc, select: select(Pin(GPIOD, 14)) },
            start,
            busy: Pin(GPIOF, 3).latched(Pupdr::PULL_UP),
            reset: Pin(GPIOE, 9).output(false, Ospeedr::LOW_SPEED),
        },
        dac: DacPins {
            spi: [
                Device { bus: dac.again(), select: select(Pin(GPIOD, 2)) },
                Device { bus: dac, select: select(Pin(GPIOG, 2)) },
            ],
            load,
            enable,
        },
        lines: trigger_pins([Pin(GPIOE, 7), Pin(GPIOE, 8), Pin(GPIOE, 10), Pin(GPIOE, 12)], Pin(GPIOE, 14)),
        stop,
        fault: Pin(GPIOB, 11).input(Pupdr::PULL_UP),
    }
}

/// The USART of the link: USART3.
pub struct Link;

impl Port for Link {
    const SEND: usize = 0;
    const RECEIVE: usize = 1;
    /// TRBUFF, without which a stream may lock up with a USART (ES0392). DMAMUX1 selects the request.
    const STREAM: u32 = 1 << 20;
    const INTERRUPTS: [Interrupt; 3] = [Interrupt::USART3, Interrupt::DMA1_STREAM0, Interrupt::DMA1_STREAM1];

    fn data() -> [u32; 2] {
        [USART3.tdr().as_ptr() as u32, USART3.rdr().as_ptr() as u32]
    }

    fn prepare() {
        Pin(GPIOD, 9).function(7, Ospeedr::LOW_SPEED, Pupdr::FLOATING);
        Pin(GPIOD, 8).function(7, Ospeedr::MEDIUM_SPEED, Pupdr::FLOATING);
        // Requests of USART3: 45 received, 46 to send (RM0433, table of DMAMUX1).
        DMAMUX1.ccr(Self::RECEIVE).write(|w| w.set_dmareq_id(45));
        DMAMUX1.ccr(Self::SEND).write(|w| w.set_dmareq_id(46));
    }

    fn start(clocks: u32) {
        USART3.brr().write(|w| w.0 = clocks);
        USART3.cr3().write(|w| {
            w.set_eie(true);
            w.set_dmar(true);
            w.set_dmat(true);
        });
        USART3.cr1().write(|w| {
            w.set_ue(true);
            w.set_re(true);
            w.set_te(true);
            w.set_idleie(true);
            w.set_fifoen(true);
        });
    }

    fn acknowledge() -> bool {
        let status = USART3.isr().read();
        // Writing 1 clears a flag.
        USART3.icr().write(|w| w.0 = status.0);
        status.fe() || status.ne() || status.ore()
    }
}

#[interrupt]
fn USART3() {
    serial::interrupt::<Link>();
}

#[interrupt]
fn DMA1_STREAM1() {
    serial::interrupt::<Link>();
}

#[interrupt]
fn DMA1_STREAM0() {
    serial::interrupt::<Link>();
}
