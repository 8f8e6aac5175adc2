//! Clocks of the NUCLEO-H743ZI2: 8 MHz of the ST-LINK, 400 MHz core, 200 MHz timers, 100 MHz SPI.

use embassy_stm32::Config;
use embassy_stm32::interrupt::Priority;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk, VoltageScale,
};
use embassy_stm32::time::Hertz;

/// Clock of TIM2, MHz.
pub const TIMER: u32 = 200;
/// What `cortex_m::asm::delay` gets through in a microsecond at most: two a cycle.
pub const DELAY: u32 = 800;

/// Clocks, and all DMA below the tick.
pub fn config() -> Config {
    let mut config = Config::default();
    config.rcc.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
    config.rcc.pll1 = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV1,
        mul: PllMul::MUL100,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: Some(PllDiv::DIV8),
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV2;
    config.rcc.apb1_pre = APBPrescaler::DIV2;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.rcc.apb3_pre = APBPrescaler::DIV2;
    config.rcc.apb4_pre = APBPrescaler::DIV2;
    config.rcc.voltage_scale = VoltageScale::Scale1;
    config.dma_interrupt_priority = Priority::P8;
    config.bdma_interrupt_priority = Priority::P8;
    config.mdma_interrupt_priority = Priority::P8;
    config
}
