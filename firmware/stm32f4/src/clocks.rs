//! Clocks of the NUCLEO-F446RE: 8 MHz of the ST-LINK, 180 MHz core, 90 MHz timers, 45 and 90 MHz SPI.

use embassy_stm32::Config;
use embassy_stm32::interrupt::Priority;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;

/// Clock of TIM2, MHz.
pub const TIMER: u32 = 90;
/// What `cortex_m::asm::delay` gets through in a microsecond at most.
pub const DELAY: u32 = 180;

/// Clocks, and all DMA below the tick.
pub fn config() -> Config {
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
