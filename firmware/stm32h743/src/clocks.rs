//! Clocks of the NUCLEO-H743ZI2 from the 8 MHz of the ST-LINK: core 480 MHz, or 400 where the revision allows no more; buses half
//! of that, timers as the buses; 33.3 and 50 MHz for the SPI of ADC and DACs.

use embassy_stm32::interrupt::Priority;
use embassy_stm32::pac::DBGMCU;
use embassy_stm32::rcc::mux::{Saisel, Spi45sel};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk, VoltageScale,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals};
use specgen_stm32::times::Times;

/// Clock of TIM2 and TIM4 at most, Hz.
pub const TIMER: u32 = 240_000_000;
/// Counts of TIM2 that a copy of the machine takes at most, with as much again: 12 µs.
pub const COPY: u32 = TIMER / 1_000_000 * 12;
/// What `cortex_m::asm::delay` gets through in a microsecond at most: two a cycle.
pub const DELAY: u32 = 960;
/// SCLK of the ADC: 17 MHz at most at 3.3 V.
pub const ADC: Hertz = Hertz(16_666_666);
/// SCLK of the DACs: 25 MHz at most where something is read back.
pub const DAC: Hertz = Hertz(25_000_000);
/// From sampling to the change of the outputs, ns: codes that are written by then are out at this instant, later ones when they are
/// written.
pub const OUTPUT: u32 = 48_000;

/// For the estimate of a tick: 480 MHz; four wait states of the flash, both caches.
pub const TIMES: Times = Times::new(480_000_000, [4, 1 << 17 | 1 << 16], [ADC, DAC]);

/// REV_ID of revision V, the first with voltage scale 0 and so 480 MHz (ES0392).
const REVISION_V: u16 = 0x2003;

/// Whether the silicon is revision V or newer. Older ones are Z, Y, X.
pub fn is_revision_v() -> bool {
    DBGMCU.idc().read().rev_id() >= REVISION_V
}

/// Clocks as above, and all DMA below the tick.
pub fn start() -> Peripherals {
    embassy_stm32::init(config())
}

fn config() -> Config {
    let fast = is_revision_v();
    let mut config = Config::default();
    config.rcc.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
    let pll = |mul, divp, divq| {
        Some(Pll { source: PllSource::HSE, prediv: PllPreDiv::DIV1, mul, fracn: None, divp, divq, divr: None })
    };
    config.rcc.pll1 = pll(if fast { PllMul::MUL120 } else { PllMul::MUL100 }, Some(PllDiv::DIV2), None);
    // 400 MHz for the SPIs, whatever the core has.
    config.rcc.pll2 = pll(PllMul::MUL50, Some(PllDiv::DIV12), Some(PllDiv::DIV8));
    // Nothing runs on it. A PLL that is not asked for makes the HAL write PLLCKSELR as a whole while PLL1 runs, which RM0433 does
    // not allow.
    config.rcc.pll3 = pll(PllMul::MUL50, Some(PllDiv::DIV12), None);
    config.rcc.mux.spi123sel = Saisel::PLL2_P;
    config.rcc.mux.spi45sel = Spi45sel::PLL2_Q;
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV2;
    config.rcc.apb1_pre = APBPrescaler::DIV2;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.rcc.apb3_pre = APBPrescaler::DIV2;
    config.rcc.apb4_pre = APBPrescaler::DIV2;
    config.rcc.voltage_scale = if fast { VoltageScale::Scale0 } else { VoltageScale::Scale1 };
    config.dma_interrupt_priority = Priority::P8;
    config.bdma_interrupt_priority = Priority::P8;
    config.mdma_interrupt_priority = Priority::P8;
    config
}
