//! Simulated buses, pins, delays and parts for the drivers of `../hal`, as far as the drivers need them. They count the operations
//! that take time on a board.

use core::cell::Cell;
use core::convert::Infallible;

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};
use specgen_board::GAUGE_BITS;
use specgen_hal::ad7606::{CONVERSION, INPUTS, Window};
use specgen_hal::{CHANNELS, Edge, Fault};

/// As in `../stm32`: 16 bits if they are enough, else 18.
pub const ADC_BITS: usize = if GAUGE_BITS <= 16 { 16 } else { 18 };
/// Expected range of V8.
pub const REFERENCE: Window = Window::around(2500, 50, 5000, ADC_BITS as u32);

/// Times of a board's buses, ns.
#[derive(Clone, Copy)]
pub struct Rates {
    /// Time per byte on the ADC's bus, and additional time per frame.
    pub adc: [u64; 2],
    /// The same for the bus of the DACs.
    pub dac: [u64; 2],
    /// Time to poll a pin.
    pub look: u64,
    /// Additional time per byte of a read-back.
    pub back: u64,
}

/// Operations of a tick: bytes and frames of the ADC, of the DACs, ns of waits, polls of pins and edges of pins.
pub const COUNTS: usize = 7;
const ADC: usize = 0;
const DAC: usize = 2;
const WAITS: usize = 4;
const LOOKS: usize = 5;
const EDGES: usize = 6;

/// State shared by the simulated parts.
pub struct Bench {
    rates: Cell<Rates>,
    /// Elapsed time, ns.
    now: Cell<u64>,
    converted: Cell<u64>,
    counts: Cell<[u64; COUNTS]>,
    /// Codes of the gauges' converter.
    pub codes: Cell<[i32; CHANNELS]>,
    /// Input and DAC registers of both parts, and the answer to the next frame.
    registers: Cell<[[[u16; 4]; 2]; 2]>,
    answers: Cell<[u16; 2]>,
}

impl Bench {
    /// The initial state.
    pub const fn new(rates: Rates) -> Self {
        Self {
            rates: Cell::new(rates),
            now: Cell::new(0),
            converted: Cell::new(0),
            counts: Cell::new([0; COUNTS]),
            codes: Cell::new([0; CHANNELS]),
            registers: Cell::new([[[0; 4]; 2]; 2]),
            answers: Cell::new([0; 2]),
        }
    }

    /// The counts since the last call.
    pub fn take(&self) -> [u64; COUNTS] {
        self.counts.replace([0; COUNTS])
    }

    fn count(&self, what: usize, by: u64) {
        let mut counts = self.counts.get();
        if let Some(count) = counts.get_mut(what) {
            *count += by;
        }
        self.counts.set(counts);
    }

    fn pass(&self, time: u64) {
        self.now.set(self.now.get() + time);
    }

    fn frame(&self, bus: usize, bytes: usize) {
        let rates = self.rates.get();
        let [byte, frame] = if bus == ADC { rates.adc } else { rates.dac };
        self.count(bus, bytes as u64);
        self.count(bus + 1, 1);
        self.pass(bytes as u64 * byte + frame);
    }

    /// Bytes that are read back take longer than others.
    fn slower(&self, bytes: u64) {
        let more = bytes * self.rates.get().back;
        self.count(WAITS, more);
        self.pass(more);
    }

    /// Executes a frame of a DAC; returns its answer.
    fn exchange(&self, part: usize, frame: [u8; 3]) -> [u8; 2] {
        let [command, high, low] = frame;
        let mut back = [0; 2];
        let (mut registers, mut answers) = (self.registers.get(), self.answers.get());
        if let (Some([input, output]), Some(answer)) = (registers.get_mut(part), answers.get_mut(part)) {
            let data = u16::from_be_bytes([high, low]);
            back = answer.to_be_bytes();
            let channel = (command & 0xf).trailing_zeros() as usize;
            match command >> 4 {
                1 => input.iter_mut().skip(channel).take(1).for_each(|slot| *slot = data),
                // One channel immediately, or all.
                3 if command & 0xf == 0xf => (*input, *output) = ([data; 4], [data; 4]),
                3 => output.iter_mut().skip(channel).take(1).for_each(|slot| *slot = data),
                9 => *answer = output.get(channel).copied().unwrap_or(0),
                _ => {}
            }
        }
        self.registers.set(registers);
        self.answers.set(answers);
        back
    }

    /// LDAC.
    fn load(&self) {
        let mut registers = self.registers.get();
        for [input, output] in &mut registers {
            let [a, b, c, _] = *input;
            let [.., kept] = *output;
            *output = [a, b, c, kept];
        }
        self.registers.set(registers);
    }

    /// The codes as the ADC sends them: two's complement, without a gap; the reference last.
    fn sample(&self, frame: &mut [u8]) {
        let middle = 1 << (ADC_BITS - 1);
        let mut inputs = [(REFERENCE.low + REFERENCE.high) / 2; INPUTS];
        for (input, code) in inputs.iter_mut().zip(self.codes.get()) {
            *input = code << (ADC_BITS as u32 - GAUGE_BITS);
        }
        let bit = |at: usize| {
            let code = inputs.get(at / ADC_BITS).copied().unwrap_or(0) ^ middle;
            (code >> (ADC_BITS - 1 - at % ADC_BITS) & 1) as u8
        };
        for (index, byte) in frame.iter_mut().enumerate() {
            *byte = (0..8).fold(0, |bits, k| bits << 1 | bit(8 * index + k));
        }
    }
}

/// The bus of the ADC, or of a DAC by its number.
pub struct Bus<'b> {
    pub bench: &'b Bench,
    pub dac: Option<usize>,
}

impl spi::ErrorType for Bus<'_> {
    type Error = Infallible;
}

impl SpiDevice for Bus<'_> {
    // The work of simulated parts is not part of the tick and excluded from its time.
    #[inline(never)]
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        specgen_aside(|| {
            for operation in operations {
                match (operation, self.dac) {
                    (Operation::TransferInPlace(frame), None) => {
                        self.bench.frame(ADC, frame.len());
                        self.bench.sample(frame);
                    }
                    (Operation::Write([command, high, low]), Some(part)) => {
                        self.bench.frame(DAC, 3);
                        self.bench.exchange(part, [*command, *high, *low]);
                    }
                    (Operation::TransferInPlace([command, high, low]), Some(part)) => {
                        self.bench.frame(DAC, 3);
                        self.bench.slower(3);
                        [*high, *low] = self.bench.exchange(part, [*command, *high, *low]);
                    }
                    _ => {}
                }
            }
        });
        Ok(())
    }
}

/// An edge from a timer: one write.
pub struct Line<'b> {
    pub bench: &'b Bench,
    pub role: Role,
}

/// Effect of an edge.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Samples the inputs.
    Convst,
    /// Updates the outputs.
    Ldac,
}

impl Edge for Line<'_> {
    fn give(&mut self) -> Result<(), Fault> {
        specgen_aside(|| {
            self.bench.count(EDGES, 1);
            match self.role {
                Role::Convst => self.bench.converted.set(self.bench.now.get() + CONVERSION),
                Role::Ldac => self.bench.load(),
            }
        });
        Ok(())
    }
}

/// A pin: BUSY, or one that is not connected.
pub struct Pin<'b> {
    pub bench: &'b Bench,
}

impl ErrorType for Pin<'_> {
    type Error = Infallible;
}

impl OutputPin for Pin<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        specgen_aside(|| self.bench.count(EDGES, 1));
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.set_low()
    }
}

impl InputPin for Pin<'_> {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        let mut high = false;
        specgen_aside(|| {
            self.bench.count(LOOKS, 1);
            self.bench.pass(self.bench.rates.get().look);
            high = self.bench.now.get() < self.bench.converted.get();
        });
        Ok(high)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!self.is_high()?)
    }
}

/// Waits.
pub struct Delay<'b>(pub &'b Bench);

impl DelayNs for Delay<'_> {
    fn delay_ns(&mut self, ns: u32) {
        specgen_aside(|| {
            self.0.count(WAITS, u64::from(ns));
            self.0.pass(u64::from(ns));
        });
    }
}

/// Calls `f`, which is not part of the tick, between two marker functions for the trace.
#[inline(always)]
fn specgen_aside(action: impl FnOnce()) {
    specgen_aside_begin();
    action();
    specgen_aside_end();
}

#[unsafe(no_mangle)]
#[inline(never)]
#[allow(unsafe_code)] // `no_mangle`: specgen looks this symbol up in the image.
extern "C" fn specgen_aside_begin() {
    // A different number in each marker, because the compiler may merge equal functions.
    // SAFETY: `nop`s.
    unsafe { core::arch::asm!("nop", "nop") };
}

#[unsafe(no_mangle)]
#[inline(never)]
#[allow(unsafe_code)] // As above.
extern "C" fn specgen_aside_end() {
    // SAFETY: `nop`s.
    unsafe { core::arch::asm!("nop", "nop", "nop") };
}
