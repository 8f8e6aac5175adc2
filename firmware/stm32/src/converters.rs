//! The converters on their pins: types and construction.

use core::mem::MaybeUninit;

use controller::supervised::{Machine, machine_at_reset};
use controller::triggers::{INPUT, LINES, MOST};
use embedded_hal::spi::{MODE_1, MODE_2, Mode};
use specgen_board::{Board, GAUGE_BITS, MachineSnapshot};
use specgen_hal::ad5686r::Ad5686rPair;
use specgen_hal::ad7606::{Ad7606, Window};
use stm32_metapac::gpio::vals::{Ospeedr, Pupdr};

use crate::CycleDelay;
use crate::burst::{Burst, Device};
use crate::enable::Enable;
use crate::pins::{Input, LatchedInput, Output, Pin};
use crate::pulses::{self, Sampling};

/// AD7606 for gauges of up to 16 bits; the pin-compatible AD7608 or AD7606C-18 for up to 18.
pub const ADC_BITS: usize = if GAUGE_BITS <= 16 { 16 } else { 18 };
/// Expected range of V8: the 2.5 V reference ± 2 % at ±5 V (RANGE low).
const REFERENCE: Window = Window::around(2500, 50, 5000, ADC_BITS as u32);

/// The ADC.
pub type Adc<BUS, const CYCLES: u32> =
    Ad7606<ADC_BITS, Device<BUS, CYCLES>, Sampling, LatchedInput, Output, CycleDelay<CYCLES>>;
/// The DACs.
pub type Dacs<BUS, const OUTPUT: usize, const CYCLES: u32> =
    Ad5686rPair<Device<BUS, CYCLES>, Device<BUS, CYCLES>, pulses::Output<OUTPUT>, Enable, CycleDelay<CYCLES>>;
/// Pins of the triggers in the spec.
pub type TriggerPins = ([Option<Output>; MOST], Option<Input>);
/// The machine with these converters. `OUTPUT`: the channel of LDAC, see [`pulses`].
pub type OnBoard<BUS, const OUTPUT: usize, const CYCLES: u32> =
    Board<'static, Adc<BUS, CYCLES>, Dacs<BUS, OUTPUT, CYCLES>, TriggerPins>;

/// The pins of the ADC.
pub struct AdcPins<BUS, const CYCLES: u32> {
    /// SPI in [`ADC_MODE`], with CS.
    pub spi: Device<BUS, CYCLES>,
    /// CONVST A and B.
    pub start: Sampling,
    /// BUSY with pull-up, so that a missing part is detected.
    pub busy: LatchedInput,
    /// RESET, low.
    pub reset: Output,
}

/// The pins of the DACs.
pub struct DacPins<BUS, const OUTPUT: usize, const CYCLES: u32> {
    /// SPI in [`DAC_MODE`], with SYNC of each part.
    pub spi: [Device<BUS, CYCLES>; 2],
    /// LDAC of both parts.
    pub load: pulses::Output<OUTPUT>,
    /// Enable of the amplifiers, active high: low.
    pub enable: Enable,
}

/// SPI of the ADC: SCLK idles high, bits are sampled on its falling edge.
pub const ADC_MODE: Mode = MODE_2;
/// SPI of the DACs: SCLK idles low, bits are sampled on its falling edge.
pub const DAC_MODE: Mode = MODE_1;

/// The pins of the spec's triggers: outputs, low, and the input, pulled down; the others keep their reset state.
#[must_use]
pub fn trigger_pins(outputs: [Pin; MOST], input: Pin) -> TriggerPins {
    let mut lines = [(); LINES].into_iter();
    let outputs = outputs.map(|pin| lines.next().map(|()| pin.output(false, Ospeedr::MEDIUM_SPEED)));
    (outputs, INPUT.then(|| input.input(Pupdr::PULL_DOWN)))
}

/// Creates the machine at reset in place. A separate function, so that the compiler initialises the memory directly instead of a
/// copy on the stack; `tests/tests/boards.rs` adds up the stack.
#[inline(never)]
pub fn at_reset(memory: &'static mut MaybeUninit<Machine>) -> &'static mut Machine {
    memory.write(machine_at_reset())
}

/// Creates in place the memory into which the background copies the machine for the recorder.
#[inline(never)]
pub fn kept(memory: &'static mut MaybeUninit<MachineSnapshot>, machine: &Machine) -> &'static mut MachineSnapshot {
    memory.write(MachineSnapshot::of(machine))
}

/// Combines the machine at reset with the converters. `intact`: result of `controller::integrity`.
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
