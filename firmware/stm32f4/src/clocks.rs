//! Clocks of the NUCLEO-F446RE from 8 MHz at the HSE pin, or from HSI: 180 MHz core, 90 MHz timers, 45 and 90 MHz SPI.

use specgen_link::reset_cause;
use specgen_stm32::oscillator;
use specgen_stm32::times::Times;
use stm32_metapac::flash::vals::Latency;
use stm32_metapac::pwr::vals::Vos;
use stm32_metapac::rcc::vals::{Hpre, Pllm, Plln, Pllp, Pllsrc, Ppre, Sw};
use stm32_metapac::{DBGMCU, FLASH, PWR, RCC};

/// Clock of TIM2 and TIM3, Hz.
pub const TIMER: u32 = 90_000_000;
/// Twice the longest time of a copy of the machine, in counts of TIM2: 40 µs.
pub const COPY: u32 = TIMER / 1_000_000 * 40;
/// The most that `cortex_m::asm::delay` counts in a microsecond.
pub const DELAY: u32 = 180;
/// Divider from 90 MHz to SCLK of the ADC: at most 17 MHz at 3.3 V, and dividers are powers of two.
pub const ADC: u32 = 8;
/// Divider from 45 MHz to SCLK of the DACs for writing.
pub const DAC: u32 = 2;
/// The same for read-back: 5.625 MHz. Half a cycle, 88 ns, is longer than the delay of SDO with its resistor: docs/bring-up.md.
pub const READ_BACK: u32 = 8;
/// Time from sampling to the change of the outputs, ns. Codes written later are output when they are written.
pub const OUTPUT: u32 = 95_000;

/// Figures for the estimate of a tick: 180 MHz; five wait states of the flash, its accelerator on.
pub const TIMES: Times =
    Times::new(180_000_000, [0b111 << 8 | 5, 0], [90_000_000 / ADC, 45_000_000 / DAC, 45_000_000 / READ_BACK]);

/// Starts all clocks, including those of the devices. Returns that of TIM2 and TIM3, Hz, which is twice that of their bus. Until then
/// the core runs from HSI, as after every reset. Names: RM0390, chapters 3 (flash), 5 (PWR) and 6 (RCC).
pub fn start() -> u32 {
    // While a debugger halts the core, TIM1 stops with its outputs off, including ENABLE (RM0390, debug mode of TIM1).
    DBGMCU.apb2fzr().modify(|w| w.set_tim1(true));
    // Keeps the debug interface active while the core sleeps.
    DBGMCU.cr().modify(|w| {
        w.set_dbg_sleep(true);
        w.set_dbg_stop(true);
        w.set_dbg_standby(true);
    });
    devices();
    // Scale 1 and over-drive mode, while HSI is the clock: 180 MHz need both.
    PWR.cr1().modify(|w| w.set_vos(Vos::SCALE1));
    PWR.cr1().modify(|w| w.set_oden(true));
    while !PWR.csr1().read().odrdy() {}
    PWR.cr1().modify(|w| w.set_odswen(true));
    while !PWR.csr1().read().odswrdy() {}

    // 2 MHz * 180 / 2; Q and R are not used.
    let (source, divider) = if oscillator::external() { (Pllsrc::HSE, Pllm::DIV4) } else { (Pllsrc::HSI, Pllm::DIV8) };
    RCC.pllcfgr().write(|w| {
        w.set_pllsrc(source);
        w.set_pllm(divider);
        w.set_plln(Plln::MUL180);
        w.set_pllp(Pllp::DIV2);
    });
    RCC.cr().modify(|w| w.set_pllon(true));
    while !RCC.cr().read().pllrdy() {}

    // Set the wait states of the flash before increasing the clock.
    FLASH.acr().write(|w| w.set_latency(Latency::WS5));
    while FLASH.acr().read().latency() != Latency::WS5 {}
    RCC.cfgr().modify(|w| {
        w.set_sw(Sw::PLL1_P);
        w.set_hpre(Hpre::DIV1);
        w.set_ppre1(Ppre::DIV4);
        w.set_ppre2(Ppre::DIV2);
    });
    while RCC.cfgr().read().sws() != Sw::PLL1_P {}
    oscillator::secure();
    accelerate();
    TIMER
}

/// Cause of the last reset, and whether the part runs on HSI.
pub fn reset_cause() -> u8 {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    reset_cause::of([
        flags.porrstf(),
        flags.borrstf(),
        flags.padrstf(),
        flags.sftrstf(),
        flags.wdgrstf(),
        flags.wwdgrstf(),
        flags.lpwrrstf(),
        RCC.pllcfgr().read().pllsrc() == Pllsrc::HSI,
    ])
}

/// Enables the clocks of devices. Reading the registers back ensures that they run.
fn devices() {
    RCC.ahb1enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_gpioben(true);
        w.set_gpiocen(true);
        w.set_gpioden(true);
        w.set_dma1en(true);
    });
    RCC.apb1enr().modify(|w| {
        w.set_tim2en(true);
        w.set_tim3en(true);
        w.set_spi3en(true);
        w.set_usart2en(true);
        w.set_pwren(true);
    });
    RCC.apb2enr().modify(|w| {
        w.set_tim1en(true);
        w.set_spi1en(true);
        w.set_syscfgen(true);
    });
    let _ = RCC.apb2enr().read();
}

/// Enables the accelerator of the flash, which caches code and constants and prefetches the next line. Its caches are flushed first,
/// which is possible only while it is off.
fn accelerate() {
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
}
