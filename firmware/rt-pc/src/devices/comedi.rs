//! Data acquisition cards by libcomedi: single synchronous readings and outputs, no streams.
//!
//! Gauges are the first six differential inputs of one card. Amplifiers are the first outputs of one or more cards (an
//! NI PCI-6229 has four). The enable line is the first digital line of the first card, high for on. The next lines are
//! the triggers of the spec, then its input, then the heartbeat, which changes in every tick, then emergency stop and
//! amplifier fault, both high in normal operation, so that a broken wire stops the machine. Codes are straight binary
//! over the range of the channel; the spec sets their volts.

pub mod library;

use std::path::PathBuf;

use controller::limits::CODES;
use controller::sensing::CONVERTER;
use controller::triggers::{INPUT, LINES};
use specgen_hal::{Amplifiers, CHANNELS, Fault, Gauges, Lines};

use super::{Contacts, Device};
use library::{ANALOG_INPUT, ANALOG_OUTPUT, Card, Comedilib, DIGITAL, Reference, channel};

#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Card of the gauges and of the enable line.
    pub input: PathBuf,
    /// Cards of the amplifiers, in order; that of the gauges if none is named.
    pub outputs: Vec<PathBuf>,
    /// Voltages that a gauge's input range must contain, V.
    pub input_volts: [f64; 2],
    /// Voltages that an output's range must contain, V.
    pub output_volts: [f64; 2],
}

/// Digital line of the input, after the enable line and the outputs.
const INPUT_LINE: u32 = LINES as u32 + 1;
/// Digital lines of heartbeat, emergency stop and amplifier fault, behind those.
const HEARTBEAT: u32 = INPUT_LINE + INPUT as u32;
const STOP: u32 = HEARTBEAT + 1;
const FAULT: u32 = STOP + 1;

/// Outputs of one card.
struct Bank<'a> {
    card: Card<'a>,
    subdevice: u32,
    channels: [u32; CHANNELS],
    /// First leg, and how many.
    first: usize,
    count: usize,
}

/// Cards as a machine.
pub struct Comedi<'a> {
    input: Card<'a>,
    gauges: (u32, [u32; CHANNELS]),
    line: u32,
    /// Triggers as they are set, bit by bit.
    high: u32,
    /// The heartbeat as it is set.
    beat: bool,
    banks: Vec<Bank<'a>>,
    name: String,
}

impl<'a> Comedi<'a> {
    /// Opens the cards; amplifiers are off.
    ///
    /// # Errors
    /// As text: what is missing, and how to fix it.
    pub fn open(library: &'a Comedilib, settings: &Settings) -> Result<Self, String> {
        let path = settings.input.display();
        let input = library.card(&settings.input)?;
        let name = input.name();
        let (line, lines) = input
            .subdevice(DIGITAL)
            .ok_or_else(|| format!("{path}: {name} has no digital line to enable amplifiers"))?;
        let configure = |number: u32, direction: u32| {
            let what = if direction == library::OUTPUT { "output" } else { "input" };
            let done = input.configure_line(line, number, direction);
            done.map_err(|error| format!("{path}: digital line {number} as an {what}: {error}"))
        };
        configure(0, library::OUTPUT)?;
        // Before anything else.
        if !input.set_line(line, 0, false) {
            return Err(format!("{path}: digital line 0 cannot be set: amplifiers could not be switched off"));
        }
        if lines <= FAULT {
            return Err(format!(
                "{path}: {name} has {lines} digital lines; {} are needed: for the amplifiers, {} for triggers of the spec, heartbeat, emergency \
                 stop and amplifier fault",
                FAULT + 1,
                HEARTBEAT - 1
            ));
        }
        for number in [STOP, FAULT].into_iter().chain(INPUT.then_some(INPUT_LINE)) {
            configure(number, library::INPUT)?;
        }
        for number in (1..=LINES as u32).chain([HEARTBEAT]) {
            configure(number, library::OUTPUT)?;
            if !input.set_line(line, number, false) {
                return Err(format!("{path}: digital line {number} cannot be set"));
            }
        }
        let (subdevice, count) =
            input.subdevice(ANALOG_INPUT).ok_or_else(|| format!("{path}: {name} has no analog inputs"))?;
        if count < CHANNELS as u32 {
            return Err(format!("{path}: {name} has {count} analog inputs; six gauges need {CHANNELS}"));
        }
        let mut channels = [0; CHANNELS];
        for (number, slot) in (0..).zip(&mut channels) {
            let highest = input.highest(subdevice, number);
            if i64::from(highest) != i64::from(CONVERTER.highest) {
                return Err(format!(
                    "{path}: input {number} of {name} counts to {highest}, the spec's sensor.bits to {}; set sensor.bits to the card's",
                    CONVERTER.highest
                ));
            }
            let [low, high] = settings.input_volts;
            let range = input.range(subdevice, number, settings.input_volts);
            let range =
                range.ok_or_else(|| format!("{path}: input {number} of {name} has no range of {low} V to {high} V"))?;
            *slot = channel(number, range, Reference::Differential);
        }
        let outputs =
            if settings.outputs.is_empty() { std::slice::from_ref(&settings.input) } else { &settings.outputs };
        let mut banks = Vec::new();
        let mut first = 0;
        for output in outputs {
            let bank = Bank::open(library.card(output)?, first, settings.output_volts);
            let bank = bank.map_err(|error| format!("{}: {error}", output.display()))?;
            first += bank.count;
            banks.push(bank);
        }
        if first < CHANNELS {
            return Err(format!(
                "the cards have {first} analog outputs, six amplifiers need {CHANNELS}: name more cards, such as --comedi-out {path} --comedi-out /dev/comedi1"
            ));
        }
        Ok(Self {
            input,
            gauges: (subdevice, channels),
            line,
            high: 0,
            beat: false,
            banks,
            name: format!("{name} at {path}"),
        })
    }
}

impl<'a> Bank<'a> {
    fn open(card: Card<'a>, first: usize, volts: [f64; 2]) -> Result<Self, String> {
        let name = card.name();
        let (subdevice, count) =
            card.subdevice(ANALOG_OUTPUT).ok_or_else(|| format!("{name} has no analog outputs"))?;
        let count = (CHANNELS - first).min(count as usize);
        let mut channels = [0; CHANNELS];
        for (number, slot) in (0..).zip(channels.iter_mut().take(count)) {
            let highest = card.highest(subdevice, number);
            if i64::from(highest) < i64::from(CODES[1]) {
                return Err(format!(
                    "output {number} of {name} counts to {highest}, but the spec's codes go to {}; set dac.bits to the card's",
                    CODES[1]
                ));
            }
            let [low, high] = volts;
            let range = card.range(subdevice, number, volts);
            let range =
                range.ok_or_else(|| format!("output {number} of {name} has no range of {low} V to {high} V"))?;
            *slot = channel(number, range, Reference::Ground);
        }
        Ok(Self { card, subdevice, channels, first, count })
    }
}

impl Gauges for Comedi<'_> {
    const BITS: u32 = u32::BITS - CONVERTER.highest.leading_zeros();

    fn read(&mut self) -> Result<[i32; CHANNELS], Fault> {
        let (subdevice, channels) = &self.gauges;
        let mut codes = [0; CHANNELS];
        if self.input.read(*subdevice, channels, &mut codes) {
            Ok(codes.map(|code| code as i32))
        } else {
            Err(Fault::Bus)
        }
    }
}

impl Amplifiers for Comedi<'_> {
    const BITS: u32 = u32::BITS - CODES[1].leading_zeros();

    fn write(&mut self, codes: &[i32; CHANNELS]) -> Result<(), Fault> {
        if codes.iter().any(|code| *code < CODES[0] || *code > CODES[1]) {
            return Err(Fault::Code);
        }
        let mut good = true;
        for bank in &self.banks {
            let own = core::array::from_fn(|k| codes.get(bank.first + k).map_or(0, |code| *code as u32));
            good &= bank.card.write(bank.subdevice, &bank.channels, bank.count, &own);
        }
        if good { Ok(()) } else { Err(Fault::Bus) }
    }

    fn enable(&mut self, on: bool) -> Result<(), Fault> {
        if self.input.set_line(self.line, 0, on) { Ok(()) } else { Err(Fault::Pin) }
    }
}

/// Each is a system call, so only changed lines are set.
impl Lines for Comedi<'_> {
    const COUNT: usize = LINES;
    const INPUT: bool = true;

    fn set(&mut self, high: u32) -> Result<(), Fault> {
        let mut good = true;
        for (number, ()) in (0_u32..).zip([(); LINES]) {
            let bit = 1 << number;
            if (high ^ self.high) & bit != 0 {
                if self.input.set_line(self.line, number + 1, high & bit != 0) {
                    self.high ^= bit;
                } else {
                    good = false;
                }
            }
        }
        if good { Ok(()) } else { Err(Fault::Pin) }
    }

    fn input(&mut self) -> Result<bool, Fault> {
        self.input.line(self.line, INPUT_LINE).ok_or(Fault::Pin)
    }
}

impl Device for Comedi<'_> {
    fn tick(&mut self, _tick: u64) {}

    fn beat(&mut self) -> Result<Contacts, Fault> {
        let beat = !self.beat;
        let high = self.input.exchange_lines(self.line, HEARTBEAT, 1, u32::from(beat)).ok_or(Fault::Pin)?;
        self.beat = beat;
        let is_open = |number: u32| high >> (number - HEARTBEAT) & 1 == 0;
        Ok(Contacts { stop: is_open(STOP), fault: is_open(FAULT) })
    }

    fn wrench(&self) -> [f64; CHANNELS] {
        [0.0; CHANNELS]
    }

    fn describe(&self) -> String {
        self.name.clone()
    }
}

impl Drop for Comedi<'_> {
    fn drop(&mut self) {
        // Whatever ended the run.
        let _ = self.set(0);
        let _ = self.input.set_line(self.line, 0, false);
    }
}
