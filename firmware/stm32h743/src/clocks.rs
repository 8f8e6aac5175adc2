//! Clocks of the NUCLEO-H743ZI2 from 8 MHz at the HSE pin, or from an eighth of HSI: core 480 MHz, or 400 MHz on older silicon
//! revisions; buses and timers at half of that; 33.3 and 50 MHz for the SPI of ADC and DACs.

use specgen_link::reset_cause;
use specgen_stm32::oscillator;
use specgen_stm32::times::Times;
use stm32_metapac::pwr::vals::Vos;
use stm32_metapac::rcc::vals::{Hpre, Plldiv, Pllm, Plln, Pllrge, Pllsrc, Pllvcosel, Ppre, Saisel, Spi45sel, Sw};
use stm32_metapac::{DBGMCU, FLASH, PWR, RCC, SYSCFG};

/// Highest clock of TIM2 and TIM4, Hz.
pub const TIMER: u32 = 240_000_000;
/// Twice the longest time of a copy of the machine, in counts of TIM2: 12 µs.
pub const COPY: u32 = TIMER / 1_000_000 * 12;
/// The most that `cortex_m::asm::delay` counts in a microsecond: two per cycle.
pub const DELAY: u32 = 960;
/// Divider from 33.3 MHz to SCLK of the ADC: at most 17 MHz at 3.3 V.
pub const ADC: u32 = 2;
/// Divider from 50 MHz to SCLK of the DACs for writing.
pub const DAC: u32 = 2;
/// The same for read-back: 6.25 MHz. Half a cycle, 80 ns, is longer than the delay of SDO with its resistor: docs/bring-up.md.
pub const READ_BACK: u32 = 8;
/// Time from sampling to the change of the outputs, ns. Codes written later are output when they are written.
pub const OUTPUT: u32 = 48_000;

/// Figures for the estimate of a tick: 480 MHz; four wait states of the flash, both caches.
pub const TIMES: Times =
    Times::new(480_000_000, [4, 1 << 17 | 1 << 16], [33_333_333 / ADC, 50_000_000 / DAC, 50_000_000 / READ_BACK]);

/// REV_ID of revision V, the first with voltage scale 0 and so 480 MHz (ES0392).
const REVISION_V: u16 = 0x2003;

/// Whether the silicon is revision V or newer. Older ones are Z, Y, X.
pub fn is_revision_v() -> bool {
    DBGMCU.idc().read().rev_id() >= REVISION_V
}

/// Starts all clocks, including those of the devices. Returns that of TIM2 and TIM4, Hz, which is twice that of their bus. Until then
/// the core runs from HSI, as after every reset. Names and order: RM0433, chapters 6 (PWR) and 8 (RCC).
pub fn start() -> u32 {
    let fast = is_revision_v();
    // While a debugger halts the core, TIM1 stops with its outputs off, including ENABLE (RM0433, debug mode of TIM1).
    DBGMCU.apb2fzr1().modify(|w| w.set_tim1(true));
    // Keeps the debug interface active while the core sleeps.
    DBGMCU.cr().modify(|w| {
        w.set_dbgsleep_d1(true);
        w.set_dbgstop_d1(true);
        w.set_dbgstby_d1(true);
        w.set_d1dbgcken(true);
        w.set_d3dbgcken(true);
    });
    devices();
    voltage(fast);

    plls(fast, oscillator::external());

    // Set the wait states of the flash before increasing the clock (table: FLASH recommended number of wait states and programming delay).
    let latency = if fast { 4 } else { 2 };
    FLASH.acr().write(|w| {
        w.set_latency(latency);
        w.set_wrhighfreq(2);
    });
    while FLASH.acr().read().latency() != latency {}
    // Set the prescalers before the clock, too.
    RCC.d1cfgr().modify(|w| {
        w.set_d1cpre(Hpre::DIV1);
        w.set_d1ppre(Ppre::DIV2);
        w.set_hpre(Hpre::DIV2);
    });
    RCC.d2cfgr().modify(|w| {
        w.set_d2ppre1(Ppre::DIV2);
        w.set_d2ppre2(Ppre::DIV2);
    });
    RCC.d3cfgr().modify(|w| w.set_d3ppre(Ppre::DIV2));
    RCC.cfgr().modify(|w| w.set_sw(Sw::PLL1_P));
    while RCC.cfgr().read().sws() != Sw::PLL1_P {}
    oscillator::secure();
    RCC.d2ccip1r().modify(|w| {
        w.set_spi123sel(Saisel::PLL2_P);
        w.set_spi45sel(Spi45sel::PLL2_Q);
    });
    if fast { TIMER } else { 200_000_000 }
}

/// Cause of the last reset, and whether the part runs on HSI.
pub fn reset_cause() -> u8 {
    let flags = RCC.rsr().read();
    RCC.rsr().modify(|w| w.set_rmvf(true));
    RCC.rsr().modify(|w| w.set_rmvf(false));
    reset_cause::of([
        flags.porrstf(),
        flags.borrstf(),
        flags.pinrstf(),
        flags.sftrstf(),
        flags.iwdg1rstf(),
        flags.wwdg1rstf(),
        flags.lpwrrstf(),
        RCC.pllckselr().read().pllsrc() == Pllsrc::HSI,
    ])
}

/// Enables the clocks of devices. Reading the registers back ensures that they run.
fn devices() {
    RCC.ahb4enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_gpioben(true);
        w.set_gpioden(true);
        w.set_gpioeen(true);
        w.set_gpiofen(true);
        w.set_gpiogen(true);
    });
    RCC.ahb1enr().modify(|w| w.set_dma1en(true));
    RCC.apb1lenr().modify(|w| {
        w.set_tim2en(true);
        w.set_tim4en(true);
        w.set_usart3en(true);
    });
    RCC.apb2enr().modify(|w| {
        w.set_tim1en(true);
        w.set_spi1en(true);
        w.set_spi4en(true);
    });
    RCC.apb4enr().modify(|w| w.set_syscfgen(true));
    let _ = RCC.apb4enr().read();
}

/// Sets the core's supply to the LDO, which can be written once after power-up, and its voltage to scale 1, then to scale 0 by the
/// overdrive, which is possible only from scale 1.
fn voltage(fast: bool) {
    PWR.cr3().modify(|w| {
        w.set_scuen(true);
        w.set_ldoen(true);
        w.set_bypass(false);
    });
    while !PWR.csr1().read().actvosrdy() {}
    PWR.d3cr().modify(|w| w.set_vos(Vos::SCALE1));
    while !PWR.d3cr().read().vosrdy() {}
    if fast {
        SYSCFG.pwrcr().modify(|w| w.set_oden(1));
        while !PWR.d3cr().read().vosrdy() {}
    }
}

/// Starts PLL1 for the core: 960 MHz / 2, or 800 / 2; and PLL2 for the SPIs, independently of the core: 400 MHz / 12 and / 8. Source
/// and dividers must be written before any PLL runs; afterwards they are locked.
fn plls(fast: bool, external: bool) {
    let (source, divider) = if external { (Pllsrc::HSE, Pllm::DIV1) } else { (Pllsrc::HSI, Pllm::DIV8) };
    RCC.pllckselr().modify(|w| {
        w.set_pllsrc(source);
        w.set_divm(0, divider);
        w.set_divm(1, divider);
    });
    RCC.pllcfgr().modify(|w| {
        for (pll, oscillator) in [Pllvcosel::WIDE_VCO, Pllvcosel::MEDIUM_VCO].into_iter().enumerate() {
            w.set_pllvcosel(pll, oscillator);
            w.set_pllrge(pll, Pllrge::RANGE8);
            w.set_divpen(pll, true);
            w.set_divqen(pll, pll == 1);
            w.set_divren(pll, false);
        }
    });
    RCC.plldivr(0).write(|w| {
        w.set_plln(if fast { Plln::MUL120 } else { Plln::MUL100 });
        w.set_pllp(Plldiv::DIV2);
        w.set_pllq(Plldiv::DIV2);
        w.set_pllr(Plldiv::DIV2);
    });
    RCC.plldivr(1).write(|w| {
        w.set_plln(Plln::MUL50);
        w.set_pllp(Plldiv::DIV12);
        w.set_pllq(Plldiv::DIV8);
        w.set_pllr(Plldiv::DIV2);
    });
    for pll in 0..2 {
        RCC.cr().modify(|w| w.set_pllon(pll, true));
        while !RCC.cr().read().pllrdy(pll) {}
    }
}
