//! What differs between the two microcontrollers and their wiring; the pins are those of `docs/bring-up.md`.

/// A pin: port (0 is A) and number.
pub type Pin = (usize, u32);

pub use specgen_cycles::Family;

/// A microcontroller with its board.
#[derive(Debug)]
pub struct Part {
    pub family: Family,
    /// Begin and length, multiples of 4 KiB.
    pub memories: &'static [[u32; 2]],
    pub flash: u32,
    /// FLASH_ACR.
    pub flash_access: u32,
    pub gpio: u32,
    pub rcc: u32,
    /// Devices, and by which bit of RCC each has its clock: base, offset, bit.
    pub clocks: &'static [[u32; 3]],
    pub pwr: u32,
    pub dma: u32,
    pub usart: u32,
    pub usart_interrupt: usize,
    pub watchdog: u32,
    /// SPI of the DACs; that of the ADC is [`SPI1`].
    pub dac_spi: u32,
    /// The timer that drives CONVST and LDAC, and its channels for them, counted from 0.
    pub pulses: u32,
    pub channels: [usize; 2],
    /// Register with the bit that stops TIM1 while a debugger holds the core: bit 0.
    pub freeze: u32,
    /// Why the part was reset: the register, its bits after power-up, by the watchdog, by the program, and the bit that clears them.
    pub reset_cause: ResetCause,
    /// CFGR of RCC.
    pub switch: u32,
    /// DBGMCU_IDCODE, where the program reads it.
    pub identity: Option<[u32; 2]>,
    pub convst: Pin,
    pub busy: Pin,
    /// Of BUSY: EXTICR with its line, FTSR and IMR of the core; and the pending register.
    pub exti: [u32; 3],
    pub pending: u32,
    pub adc_select: Pin,
    pub adc_reset: Pin,
    pub dac_select: [Pin; 2],
    pub ldac: Pin,
    /// With its channel of TIM1.
    pub enable: (Pin, usize),
    /// Triggers, in their order, and the input.
    pub triggers: [Pin; 4],
    pub input: Pin,
    /// Fault of an amplifier.
    pub fault: Pin,
}

/// Bits of [`Part::reset_cause`].
#[derive(Debug)]
pub struct ResetCause {
    pub register: u32,
    pub power: u32,
    pub brown_out: u32,
    pub pin: u32,
    pub software: u32,
    pub watchdog: u32,
    pub clear: u32,
}

/// CR of RCC: HSE on, clock security system, PLLs on.
pub const HSE_ON: u32 = 1 << 16;
pub const SECURED: u32 = 1 << 19;
pub const PLLS_ON: u32 = 0x1500_0000;
/// The interrupt of the voltage detector.
pub const SUPPLY_INTERRUPT: usize = 1;
/// The same on both.
pub const TIM1: u32 = 0x4001_0000;
pub const TIM2: u32 = 0x4000_0000;
pub const TIM2_INTERRUPT: usize = 28;
pub const SPI1: u32 = 0x4001_3000;
/// Alternate function of the pins of [`Part::pulses`].
pub const PULSES_FUNCTION: u32 = 2;
/// DMA1 streams 0 to 7.
pub const DMA_INTERRUPTS: [usize; 8] = [11, 12, 13, 14, 15, 16, 17, 47];
/// The crystal's clock from the ST-LINK, Hz.
pub const HSE: u64 = 8_000_000;
/// Where registers are.
pub const DEVICES: [[u32; 2]; 2] = [[0x4000_0000, 0x2000_0000], [0xe000_0000, 0x10_0000]];

const A: usize = 0;
const B: usize = 1;
const C: usize = 2;
const D: usize = 3;
const E: usize = 4;
const F: usize = 5;
const G: usize = 6;

/// By the name of the board's target.
pub const PARTS: [(&str, &Part); 2] = [("stm32h743", &H743), ("stm32f4", &F446)];

const H743: Part = Part {
    family: Family::H7,
    memories: &[[0x0800_0000, 0x20_0000], [0, 0x1_0000], [0x2000_0000, 0x2_0000], [0x2400_0000, 0x8_0000]],
    flash: 0x0800_0000,
    flash_access: 0x5200_2000,
    gpio: 0x5802_0000,
    rcc: 0x5802_4400,
    // Ports A, B, D to G; DMA1; TIM2, TIM4, USART3; TIM1, SPI1, SPI4; SYSCFG.
    clocks: &[
        [0x5802_0000, 0xe0, 0],
        [0x5802_0400, 0xe0, 1],
        [0x5802_0c00, 0xe0, 3],
        [0x5802_1000, 0xe0, 4],
        [0x5802_1400, 0xe0, 5],
        [0x5802_1800, 0xe0, 6],
        [0x4002_0000, 0xd8, 0],
        [TIM2, 0xe8, 0],
        [0x4000_0800, 0xe8, 2],
        [0x4000_4800, 0xe8, 18],
        [TIM1, 0xf0, 0],
        [SPI1, 0xf0, 12],
        [0x4001_3400, 0xf0, 13],
        [0x5800_0400, 0xf4, 1],
    ],
    pwr: 0x5802_4800,
    dma: 0x4002_0000,
    usart: 0x4000_4800,
    usart_interrupt: 39,
    watchdog: 0x5800_4800,
    dac_spi: 0x4001_3400,
    pulses: 0x4000_0800,
    channels: [3, 1],
    freeze: 0x5c00_104c,
    reset_cause: ResetCause {
        register: 0x5802_44d0,
        power: 1 << 23,
        brown_out: 1 << 21,
        pin: 1 << 22,
        software: 1 << 24,
        watchdog: 1 << 26,
        clear: 1 << 16,
    },
    switch: 0x10,
    // Revision V.
    identity: Some([0x5c00_1000, 0x2003_6450]),
    convst: (D, 15),
    busy: (F, 3),
    exti: [0x5800_0408, 0x5800_0004, 0x5800_0080],
    pending: 0x5800_0088,
    adc_select: (D, 14),
    adc_reset: (E, 9),
    dac_select: [(D, 2), (G, 2)],
    ldac: (D, 13),
    enable: ((E, 11), 2),
    triggers: [(E, 7), (E, 8), (E, 10), (E, 12)],
    input: (E, 14),
    fault: (B, 11),
};

const F446: Part = Part {
    family: Family::F4,
    memories: &[[0x0800_0000, 0x8_0000], [0x2000_0000, 0x2_0000]],
    flash: 0x0800_0000,
    flash_access: 0x4002_3c00,
    gpio: 0x4002_0000,
    rcc: 0x4002_3800,
    // Ports A to D, DMA1; TIM2, TIM3, SPI3, USART2, PWR; TIM1, SPI1.
    clocks: &[
        [0x4002_0000, 0x30, 0],
        [0x4002_0400, 0x30, 1],
        [0x4002_0800, 0x30, 2],
        [0x4002_0c00, 0x30, 3],
        [0x4002_6000, 0x30, 21],
        [TIM2, 0x40, 0],
        [0x4000_0400, 0x40, 1],
        [0x4000_3c00, 0x40, 15],
        [0x4000_4400, 0x40, 17],
        [0x4000_7000, 0x40, 28],
        [TIM1, 0x44, 0],
        [SPI1, 0x44, 12],
    ],
    pwr: 0x4000_7000,
    dma: 0x4002_6000,
    usart: 0x4000_4400,
    usart_interrupt: 38,
    watchdog: 0x4000_3000,
    dac_spi: 0x4000_3c00,
    pulses: 0x4000_0400,
    channels: [1, 0],
    freeze: 0xe004_200c,
    reset_cause: ResetCause {
        register: 0x4002_3874,
        power: 1 << 27,
        brown_out: 1 << 25,
        pin: 1 << 26,
        software: 1 << 28,
        watchdog: 1 << 29,
        clear: 1 << 24,
    },
    switch: 8,
    identity: None,
    convst: (C, 7),
    busy: (A, 9),
    exti: [0x4001_3810, 0x4001_3c0c, 0x4001_3c00],
    pending: 0x4001_3c14,
    adc_select: (B, 6),
    adc_reset: (B, 10),
    dac_select: [(D, 2), (C, 8)],
    ldac: (C, 6),
    enable: ((A, 8), 1),
    triggers: [(C, 0), (C, 1), (C, 2), (C, 3)],
    input: (C, 4),
    fault: (B, 13),
};
