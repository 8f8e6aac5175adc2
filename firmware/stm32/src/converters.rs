//! The converters on their pins: types, and how they are put together.

use core::mem::MaybeUninit;

use controller::supervised::Machine;
use embassy_stm32::gpio::{Input, Output};
use embassy_stm32::mode::Blocking;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embedded_hal_bus::spi::{AtomicDevice, ExclusiveDevice};
use embedded_hal_bus::util::AtomicCell;
use specgen_board::{Board, GAUGE_BITS};
use specgen_hal::ad5686r::Ad5686rPair;
use specgen_hal::ad7606::{Ad7606, Window};

use crate::CycleDelay;
use crate::enable::Enable;

/// AD7606 for gauges of up to 16 bits; the pin-compatible AD7608 or AD7606C-18 for up to 18.
pub const ADC_BITS: usize = if GAUGE_BITS <= 16 { 16 } else { 18 };
/// What V8 shows: the 2.5 V reference ± 2 % at ±5 V (RANGE low).
const REFERENCE: Window = Window::around(2500, 50, 5000, ADC_BITS as u32);

/// An SPI that waits for each word. DMA would not pay: a tick moves 40 bytes in nine frames and waits for the
/// codes before it can compute, and setting up a transfer takes about as long as three bytes.
pub type Bus = Spi<'static, Blocking, Master>;
/// A converter's SPI with its chip select.
pub type AdcSpi<const CYCLES: u32> = ExclusiveDevice<Bus, Output<'static>, CycleDelay<CYCLES>>;
/// One of two DACs on one SPI.
pub type DacSpi<const CYCLES: u32> = AtomicDevice<'static, Bus, Output<'static>, CycleDelay<CYCLES>>;
/// The ADC.
pub type Adc<const CYCLES: u32> =
    Ad7606<ADC_BITS, AdcSpi<CYCLES>, Output<'static>, Input<'static>, Output<'static>, CycleDelay<CYCLES>>;
/// The DACs.
pub type Dacs<const CYCLES: u32> =
    Ad5686rPair<DacSpi<CYCLES>, DacSpi<CYCLES>, Output<'static>, Enable, CycleDelay<CYCLES>>;
/// The machine on them.
pub type OnBoard<const CYCLES: u32> = Board<'static, Adc<CYCLES>, Dacs<CYCLES>>;
/// Where the bus of the DACs lives.
pub type BusCell = MaybeUninit<AtomicCell<Bus>>;

/// The pins of the ADC.
pub struct AdcPins {
    /// SPI in mode 2, see [`adc_spi`].
    pub spi: Bus,
    /// CS, high.
    pub select: Output<'static>,
    /// CONVST A and B, high.
    pub start: Output<'static>,
    /// BUSY with pull-up, so that a part that is not there is seen.
    pub busy: Input<'static>,
    /// RESET, low.
    pub reset: Output<'static>,
}

/// The pins of the DACs.
pub struct DacPins {
    /// SPI in mode 1, see [`dac_spi`].
    pub spi: Bus,
    /// SYNC of both parts, high.
    pub select: [Output<'static>; 2],
    /// LDAC of both parts, high.
    pub load: Output<'static>,
    /// Enable of the amplifiers, active high: low.
    pub enable: Enable,
}

/// SPI of the ADC: SCLK idles high, bits are taken on its falling edge.
#[must_use]
pub fn adc_spi() -> spi::Config {
    spi_config(spi::MODE_2)
}

/// SPI of the DACs: SCLK idles low, bits are taken on its falling edge.
#[must_use]
pub fn dac_spi() -> spi::Config {
    spi_config(spi::MODE_1)
}

fn spi_config(mode: spi::Mode) -> spi::Config {
    let mut config = spi::Config::default();
    config.mode = mode;
    // The next lower frequency that the part's clocks give.
    config.frequency = Hertz(12_500_000);
    config
}

/// The machine at reset, made where it stays. A function of its own, so that the compiler fills the memory instead of a copy
/// of it on the stack; `tests/tests/boards.rs` adds up the stack.
#[inline(never)]
pub fn at_reset(memory: &'static mut MaybeUninit<Machine>) -> &'static mut Machine {
    memory.write(Machine::new())
}

/// Puts machine (at reset) and converters together. `intact`: what `controller::integrity` found. None if a chip select cannot be
/// driven, which a pin of these parts never reports.
pub fn board<const CYCLES: u32>(
    adc: AdcPins,
    dac: DacPins,
    cell: &'static mut BusCell,
    machine: &'static mut Machine,
    intact: bool,
) -> Option<OnBoard<CYCLES>> {
    let delay = CycleDelay::<CYCLES>;
    let bus: &'static AtomicCell<Bus> = cell.write(AtomicCell::new(dac.spi));
    let [first, second] = dac.select;
    let first = AtomicDevice::new(bus, first, delay).ok()?;
    let second = AtomicDevice::new(bus, second, delay).ok()?;
    let adc_spi = ExclusiveDevice::new(adc.spi, adc.select, delay).ok()?;
    let adc = Ad7606::new(adc_spi, adc.start, adc.busy, adc.reset, delay, REFERENCE);
    let dacs = Ad5686rPair::new(first, second, dac.load, dac.enable, delay);
    Some(Board::new(adc, dacs, machine, intact))
}
