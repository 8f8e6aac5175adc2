//! The pin assignment. The table in docs/bring-up.md describes it.

use specgen_stm32::burst::Device;
use specgen_stm32::converters::{ADC_MODE, AdcPins, DAC_MODE, DacPins, TriggerPins, trigger_pins};
use specgen_stm32::enable::{self, Stop};
use specgen_stm32::pins::{Input, Pin, spi_bus};
use specgen_stm32::pulses::Pulses;
use specgen_stm32::serial::{self, Port};
use stm32_metapac::gpio::vals::{Ospeedr, Pupdr};
use stm32_metapac::iwdg::Iwdg;
use stm32_metapac::{GPIOA, GPIOB, GPIOC, GPIOD, IWDG, Interrupt, SPI1, SPI3, TIM3, USART2, interrupt};

use crate::clocks::{self, DELAY};
use crate::spi::Registers;

/// Interrupt of the voltage detector.
pub const SUPPLY: Interrupt = Interrupt::PVD;
/// The watchdog.
pub const WATCHDOG: Iwdg = IWDG;
/// Channel of TIM3 that drives LDAC, counted from 0: CH1.
pub const OUTPUT: usize = 0;
/// Channel of CONVST: CH2.
const SAMPLING: usize = 1;

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

/// Configures the pins; `hertz` is the clock of TIM3. The enable line comes first and is driven low: channel 1 of TIM1, with its
/// break input.
pub fn take(hertz: u32) -> Wiring {
    let (enable, stop) = enable::guarded::<1>(Pin(GPIOA, 8), Pin(GPIOB, 12));
    // The lines are idle before the pins are connected to the timer.
    let (start, load) = Pulses::edges::<SAMPLING, OUTPUT>(TIM3, hertz, clocks::OUTPUT);
    for pin in [Pin(GPIOC, 7), Pin(GPIOC, 6)] {
        pin.function(2, Ospeedr::VERY_HIGH_SPEED, Pupdr::FLOATING);
    }
    spi_bus([Pin(GPIOA, 5), Pin(GPIOA, 7), Pin(GPIOA, 6)], 5, Pupdr::PULL_UP);
    let adc = Registers::new(SPI1, ADC_MODE, [clocks::ADC; 2]);
    spi_bus([Pin(GPIOC, 10), Pin(GPIOC, 12), Pin(GPIOC, 11)], 6, Pupdr::PULL_DOWN);
    let dac = Registers::new(SPI3, DAC_MODE, [clocks::DAC, clocks::READ_BACK]);
    let select = |pin: Pin| pin.output(true, Ospeedr::VERY_HIGH_SPEED);
    Wiring {
        adc: AdcPins {
            spi: Device { bus: adc, select: select(Pin(GPIOB, 6)) },
            start,
            busy: Pin(GPIOA, 9).latched(Pupdr::PULL_UP),
            reset: Pin(GPIOB, 10).output(false, Ospeedr::LOW_SPEED),
        },
        dac: DacPins {
            spi: [
                Device { bus: dac.again(), select: select(Pin(GPIOD, 2)) },
                Device { bus: dac, select: select(Pin(GPIOC, 8)) },
            ],
            load,
            enable,
        },
        lines: trigger_pins([Pin(GPIOC, 0), Pin(GPIOC, 1), Pin(GPIOC, 2), Pin(GPIOC, 3)], Pin(GPIOC, 4)),
        stop,
        fault: Pin(GPIOB, 13).input(Pupdr::PULL_UP),
    }
}

/// The USART of the link: USART2.
pub struct Link;

impl Port for Link {
    const SEND: usize = 6;
    const RECEIVE: usize = 5;
    /// CHSEL: USART2 is channel 4 of both streams (RM0390, table of DMA1's requests).
    const STREAM: u32 = 4 << 25;
    const INTERRUPTS: [Interrupt; 3] = [Interrupt::USART2, Interrupt::DMA1_STREAM5, Interrupt::DMA1_STREAM6];

    fn data() -> [u32; 2] {
        [USART2.dr().as_ptr() as u32; 2]
    }

    fn prepare() {
        Pin(GPIOA, 3).function(7, Ospeedr::LOW_SPEED, Pupdr::FLOATING);
        Pin(GPIOA, 2).function(7, Ospeedr::MEDIUM_SPEED, Pupdr::FLOATING);
    }

    fn start(clocks: u32) {
        USART2.brr().write(|w| w.0 = clocks);
        USART2.cr3().write(|w| {
            w.set_eie(true);
            w.set_dmar(true);
            w.set_dmat(true);
        });
        USART2.cr1().write(|w| {
            w.set_ue(true);
            w.set_re(true);
            w.set_te(true);
            w.set_idleie(true);
        });
    }

    fn acknowledge() -> bool {
        let status = USART2.sr().read();
        let failed = status.fe() || status.ne() || status.ore();
        // Cleared by reading the data after the status; only in this case, because the read may take a byte from the DMA.
        if failed || status.idle() {
            let _ = USART2.dr().read();
        }
        failed
    }
}

#[interrupt]
fn USART2() {
    serial::interrupt::<Link>();
}

#[interrupt]
fn DMA1_STREAM5() {
    serial::interrupt::<Link>();
}

#[interrupt]
fn DMA1_STREAM6() {
    serial::interrupt::<Link>();
}
