//! Clocks of the NUCLEO-F446RE: 8 MHz of the ST-LINK, 180 MHz core, 90 MHz timers, 45 and 90 MHz SPI.

use embassy_stm32::interrupt::Priority;
use embassy_stm32::pac::FLASH;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals};
use specgen_stm32::times::Times;

/// Clock of TIM2 and TIM3, Hz.
pub const TIMER: u32 = 90_000_000;
/// Counts of TIM2 that a copy of the machine takes at most, with as much again: 40 µs.
pub const COPY: u32 = TIMER / 1_000_000 * 40;
/// What `cortex_m::asm::delay` gets through in a microsecond at most.
pub const DELAY: u32 = 180;
/// SCLK of the ADC: 17 MHz at most at 3.3 V, and 90 MHz can only be divided by powers of two.
pub const ADC: Hertz = Hertz(11_250_000);
/// SCLK of the DACs: 25 MHz at most where something is read back.
pub const DAC: Hertz = Hertz(22_500_000);
/// From sampling to the change of the outputs, ns: codes that are written by then are out at this instant, later ones when they are
/// written.
pub const OUTPUT: u32 = 95_000;

/// For the estimate of a tick: 180 MHz; five wait states of the flash, its accelerator on.
pub const TIMES: Times = Times::new(180_000_000, [0b111 << 8 | 5, 0], [ADC, DAC]);

/// Clocks as above, all DMA below the tick, and the accelerator of the flash, which the HAL leaves off: lines of code and constants are
/// kept, and the next line is fetched ahead of time. What it keeps is emptied first, which is possible only while it is off (RM0390).
pub fn start() -> Peripherals {
    let peripherals = embassy_stm32::init(config());
    FLASH.acr().modify(|w| {
        w.set_icrst(true);
        w.set_dcrst(true);
    });
    FLASH.acr().modify(|w| {
        w.set_icrst(false);
        w.set_dcrst(false);
        w.set_prften(true);
        w.set_icen(true);
        w.set_dcen(true);
    });
    peripherals
}

fn config() -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
    config.rcc.pll_src = PllSource::HSE;
    config.rcc.pll =
        Some(Pll { prediv: PllPreDiv::DIV4, mul: PllMul::MUL180, divp: Some(PllPDiv::DIV2), divq: None, divr: None });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.dma_interrupt_priority = Priority::P8;
    config
}
