//! The converters on their pins: types, and how they are put together.

use core::mem::MaybeUninit;

use controller::supervised::Machine;
use controller::triggers::{INPUT, LINES, MOST};
use embassy_stm32::gpio::{AnyPin, Input, Level, Output, Pull, Speed};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Peri, spi};
use specgen_board::{Board, GAUGE_BITS, Kept};
use specgen_hal::ad5686r::Ad5686rPair;
use specgen_hal::ad7606::{Ad7606, Window};

use crate::CycleDelay;
use crate::burst::{Burst, Device};
use crate::enable::Enable;
use crate::pulses::{self, Sampling};

/// AD7606 for gauges of up to 16 bits; the pin-compatible AD7608 or AD7606C-18 for up to 18.
pub const ADC_BITS: usize = if GAUGE_BITS <= 16 { 16 } else { 18 };
/// What V8 shows: the 2.5 V reference ± 2 % at ±5 V (RANGE low).
const REFERENCE: Window = Window::around(2500, 50, 5000, ADC_BITS as u32);

/// The ADC.
pub type Adc<BUS, const CYCLES: u32> =
    Ad7606<ADC_BITS, Device<BUS, CYCLES>, Sampling, Input<'static>, Output<'static>, CycleDelay<CYCLES>>;
/// The DACs.
pub type Dacs<BUS, const OUTPUT: usize, const CYCLES: u32> =
    Ad5686rPair<Device<BUS, CYCLES>, Device<BUS, CYCLES>, pulses::Output<OUTPUT>, Enable, CycleDelay<CYCLES>>;
/// Pins of triggers, those of the spec alone.
pub type TriggerPins = ([Option<Output<'static>>; MOST], Option<Input<'static>>);
/// The machine on them. `OUTPUT`: the channel of LDAC, see [`pulses`].
pub type OnBoard<BUS, const OUTPUT: usize, const CYCLES: u32> =
    Board<'static, Adc<BUS, CYCLES>, Dacs<BUS, OUTPUT, CYCLES>, TriggerPins>;

/// The pins of the ADC.
pub struct AdcPins<BUS, const CYCLES: u32> {
    /// SPI in mode 2, see [`adc_spi`], with CS.
    pub spi: Device<BUS, CYCLES>,
    /// CONVST A and B.
    pub start: Sampling,
    /// BUSY with pull-up, so that a part that is not there is seen.
    pub busy: Input<'static>,
    /// RESET, low.
    pub reset: Output<'static>,
}

/// The pins of the DACs.
pub struct DacPins<BUS, const OUTPUT: usize, const CYCLES: u32> {
    /// SPI in mode 1, see [`dac_spi`], with SYNC of each part.
    pub spi: [Device<BUS, CYCLES>; 2],
    /// LDAC of both parts.
    pub load: pulses::Output<OUTPUT>,
    /// Enable of the amplifiers, active high: low.
    pub enable: Enable,
}

/// SPI of the ADC: SCLK idles high, bits are taken on its falling edge.
#[must_use]
pub fn adc_spi(frequency: Hertz) -> spi::Config {
    spi_config(spi::MODE_2, frequency)
}

/// SPI of the DACs: SCLK idles low, bits are taken on its falling edge.
#[must_use]
pub fn dac_spi(frequency: Hertz) -> spi::Config {
    spi_config(spi::MODE_1, frequency)
}

/// The HAL takes a faster clock where no divider gives this one: it has to be one that a divider gives.
fn spi_config(mode: spi::Mode, frequency: Hertz) -> spi::Config {
    let mut config = spi::Config::default();
    config.mode = mode;
    config.frequency = frequency;
    config
}

/// The pins of the spec's triggers: outputs, low, and the input, pulled down; the others stay as they are after reset.
#[must_use]
pub fn trigger_pins(outputs: [Peri<'static, AnyPin>; MOST], input: Peri<'static, AnyPin>) -> TriggerPins {
    let mut lines = [(); LINES].into_iter();
    let outputs = outputs.map(|pin| lines.next().map(|()| Output::new(pin, Level::Low, Speed::Medium)));
    (outputs, INPUT.then(|| Input::new(input, Pull::Down)))
}

/// The machine at reset, made where it stays. A function of its own, so that the compiler fills the memory instead of a copy
/// of it on the stack; `tests/tests/boards.rs` adds up the stack.
#[inline(never)]
pub fn at_reset(memory: &'static mut MaybeUninit<Machine>) -> &'static mut Machine {
    memory.write(Machine::new())
}

/// What the recorder's background copies the machine into, made where it stays.
#[inline(never)]
pub fn kept(memory: &'static mut MaybeUninit<Kept>, machine: &Machine) -> &'static mut Kept {
    memory.write(Kept::of(machine))
}

/// Puts machine (at reset) and converters together. `intact`: what `controller::integrity` found.
pub fn board<BUS: Burst, const OUTPUT: usize, const CYCLES: u32>(
    adc: AdcPins<BUS, CYCLES>,
    dac: DacPins<BUS, OUTPUT, CYCLES>,
    lines: TriggerPins,
    machine: &'static mut Machine,
    intact: bool,
) -> OnBoard<BUS, OUTPUT, CYCLES> {
    let delay = CycleDelay::<CYCLES>;
    let [first, second] = dac.spi;
    let adc = Ad7606::new(adc.spi, adc.start, adc.busy, adc.reset, delay, REFERENCE);
    let dacs = Ad5686rPair::new(first, second, dac.load, dac.enable, delay);
    Board::with_lines(adc, dacs, lines, machine, intact)
}
