//! AD5686R, stand-alone: frames of 24 bits under SYNC, LDAC, read-back.

use crate::spi::Byte;
use crate::time::{Time, nanoseconds};
use crate::violations::Violations;

/// SYNC low until the first falling edge of SCLK, with read-back.
const SELECT: Time = nanoseconds(20);
/// SYNC high between frames.
const HIGH: Time = nanoseconds(30);
/// A cycle of SCLK with read-back: 25 MHz.
const CLOCK: Time = nanoseconds(40);
/// SDO is valid so long after SCLK rises, through 1 kΩ into 40 pF to 0.7 of the level, and before SCLK falls: the data sheet, 1.2 RC, the
/// set-up time of the microcontroller's input.
const SDO: Time = nanoseconds(25) + nanoseconds(48) + nanoseconds(5);
/// LDAC low.
const LDAC_LOW: Time = nanoseconds(15);
/// From the end of a frame until LDAC falls.
const LOAD: Time = nanoseconds(30);
/// CPOL 0, CPHA 1.
const MODE: u8 = 1;

/// What is wrong with the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Outputs stay where they are.
    Stuck,
    /// Nothing comes back.
    Mute,
}

pub struct Ad5686r {
    name: &'static str,
    /// A to D.
    input: [u16; 4],
    pub output: [u16; 4],
    reference: bool,
    selected: Option<Time>,
    /// When SYNC rose last.
    ended: Option<Time>,
    frame: u32,
    bits: u32,
    /// Comes out with the next frame.
    answer: u16,
    /// The last bit on SDO, which is there until the next one is.
    shown: u8,
    ldac: Option<(bool, Time)>,
    pub fault: Option<Fault>,
}

impl Ad5686r {
    /// At power-up with RSTSEL low.
    pub fn new(name: &'static str) -> Self {
        Self {
            name,
            input: [0; 4],
            output: [0; 4],
            reference: true,
            selected: None,
            ended: None,
            frame: 0,
            bits: 0,
            answer: 0,
            shown: 0,
            ldac: None,
            fault: None,
        }
    }

    /// Whether its 2.5 V are there.
    pub fn reference(&self) -> bool {
        self.reference
    }

    /// SYNC changed; `moving`: SCLK is running.
    pub fn select(&mut self, low: bool, moving: bool, now: Time, violations: &mut Violations) {
        if moving {
            violations.note(self.name, "SYNC changes within a byte", now);
        }
        match (low, self.selected) {
            (true, None) => {
                if let Some(ended) = self.ended {
                    violations.shorter(self.name, "SYNC high", now - ended, HIGH, now);
                }
                (self.selected, self.frame, self.bits) = (Some(now), 0, 0);
            }
            (false, Some(_)) => {
                (self.selected, self.ended) = (None, Some(now));
                if self.bits == 24 {
                    self.obey();
                } else {
                    violations.note(self.name, &format!("a frame of {} bits", self.bits), now);
                }
            }
            _ => {}
        }
    }

    /// What comes back for a byte; none if the part is not addressed and lets the line go.
    pub fn exchange(&mut self, byte: Byte, violations: &mut Violations) -> Option<u8> {
        let since = self.selected?;
        if byte.mode != MODE {
            violations.note(self.name, &format!("SPI mode {} instead of {MODE}", byte.mode), byte.begin);
        }
        violations.shorter(self.name, "a cycle of SCLK", byte.period(), CLOCK, byte.begin);
        if self.bits == 0 {
            violations.shorter(self.name, "SYNC to SCLK", byte.begin - since, SELECT, byte.begin);
        }
        let back = match (self.fault, self.bits) {
            (Some(Fault::Mute), _) | (_, 0) => 0,
            (_, 8) => (self.answer >> 8) as u8,
            _ => self.answer as u8,
        };
        self.frame = self.frame << 8 | u32::from(byte.value);
        self.bits += 8;
        // Taken in the middle of a cycle: before it is valid it is the bit before.
        let seen = if byte.period() / 2 < SDO { back >> 1 | self.shown << 7 } else { back };
        self.shown = back & 1;
        Some(seen)
    }

    /// LDAC changed.
    pub fn ldac(&mut self, high: bool, now: Time, violations: &mut Violations) {
        let before = self.ldac.replace((high, now));
        if high && let Some((false, fell)) = before {
            violations.shorter(self.name, "LDAC low", now - fell, LDAC_LOW, now);
        }
        if !high && !matches!(before, Some((false, _))) {
            if self.selected.is_some() {
                violations.note(self.name, "LDAC within a frame", now);
            }
            if let Some(ended) = self.ended {
                violations.shorter(self.name, "SYNC to LDAC", now - ended, LOAD, now);
            }
            self.load();
        }
    }

    fn load(&mut self) {
        if self.fault != Some(Fault::Stuck) {
            self.output = self.input;
        }
    }

    fn obey(&mut self) {
        let (command, address, data) = (self.frame >> 20, self.frame >> 16 & 0xf, self.frame as u16);
        let chosen: Vec<usize> = (0..4).filter(|k| address >> k & 1 == 1).collect();
        self.answer = 0;
        match command {
            1 => chosen.iter().for_each(|k| self.input[*k] = data),
            3 => {
                for k in chosen {
                    self.input[k] = data;
                    if self.fault != Some(Fault::Stuck) {
                        self.output[k] = data;
                    }
                }
            }
            6 => (self.input, self.output, self.reference) = ([0; 4], [0; 4], true),
            // Bit 0 switches the reference off.
            7 => self.reference = data & 1 == 0,
            9 => self.answer = chosen.first().map_or(0, |k| self.output[*k]),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Time = nanoseconds(160);

    /// Sends a frame from `at` on; the lower 16 bits that came back.
    fn frame(dac: &mut Ad5686r, word: u32, at: Time, violations: &mut Violations) -> (u16, Time) {
        frame_at(dac, word, at, PERIOD, violations)
    }

    fn frame_at(dac: &mut Ad5686r, word: u32, at: Time, period: Time, violations: &mut Violations) -> (u16, Time) {
        dac.select(true, false, at, violations);
        let mut at = at + SELECT;
        let mut back = 0;
        for value in &word.to_be_bytes()[1..] {
            let byte = Byte { value: *value, begin: at, end: at + 8 * period, mode: MODE };
            back = back << 8 | u16::from(dac.exchange(byte, violations).unwrap());
            at = byte.end;
        }
        dac.select(false, false, at, violations);
        (back, at)
    }

    #[test]
    fn codes_go_out_with_ldac_and_come_back_with_the_next_frame() {
        let mut violations = Violations::default();
        let mut dac = Ad5686r::new("DAC");
        dac.ldac(true, 0, &mut violations);
        let (_, at) = frame(&mut dac, 0x12_abcd, 0, &mut violations);
        assert_eq!(dac.output[1], 0);
        dac.ldac(false, at + LOAD, &mut violations);
        dac.ldac(true, at + LOAD + LDAC_LOW, &mut violations);
        assert_eq!(dac.output[1], 0xabcd);
        let (_, at) = frame(&mut dac, 0x92_0000, at + 100 * HIGH, &mut violations);
        let (back, _) = frame(&mut dac, 0, at + HIGH, &mut violations);
        assert_eq!(back, 0xabcd);
        assert!(violations.none(), "{violations:?}");
    }

    /// 6.25 and 5.625 MHz are slow enough for SDO and its resistor, 25, 22.5 and 12.5 MHz are not.
    #[test]
    fn what_is_taken_before_it_is_valid_is_the_bit_before() {
        for (period, expected) in [(160, 0xa55a), (177, 0xa55a), (40, 0x52ad), (44, 0x52ad), (80, 0x52ad)] {
            let mut violations = Violations::default();
            let mut dac = Ad5686r::new("DAC");
            let (_, at) = frame(&mut dac, 0x38_a55a, 0, &mut violations);
            let (_, at) = frame(&mut dac, 0x98_0000, at + HIGH, &mut violations);
            let (back, _) = frame_at(&mut dac, 0, at + HIGH, nanoseconds(period), &mut violations);
            assert_eq!(back, expected, "{period} ns");
            assert!(violations.none(), "{violations:?}");
        }
    }

    #[test]
    fn every_time_that_is_too_short_is_seen() {
        type Run = fn(&mut Ad5686r, &mut Violations);
        let cases: [(&str, Run); 6] = [
            ("SYNC high", |dac, v| {
                let (_, at) = frame(dac, 0, 0, v);
                frame(dac, 0, at + HIGH - 1, v);
            }),
            ("a frame of 8 bits", |dac, v| {
                dac.select(true, false, 0, v);
                dac.exchange(Byte { value: 0, begin: SELECT, end: SELECT + 8 * PERIOD, mode: MODE }, v);
                dac.select(false, false, 1000, v);
            }),
            ("SYNC changes within a byte", |dac, v| dac.select(true, true, 0, v)),
            ("SPI mode 0", |dac, v| {
                dac.select(true, false, 0, v);
                dac.exchange(Byte { value: 0, begin: SELECT, end: SELECT + 8 * PERIOD, mode: 0 }, v);
            }),
            ("a cycle of SCLK", |dac, v| {
                dac.select(true, false, 0, v);
                dac.exchange(Byte { value: 0, begin: SELECT, end: SELECT + 8 * (CLOCK - 1), mode: MODE }, v);
            }),
            ("SYNC to LDAC", |dac, v| {
                let (_, at) = frame(dac, 0, 0, v);
                dac.ldac(false, at + LOAD - 1, v);
            }),
        ];
        for (expected, run) in cases {
            let mut violations = Violations::default();
            run(&mut Ad5686r::new("DAC"), &mut violations);
            assert!(violations.has(expected), "{expected}: {violations:?}");
        }
        let mut violations = Violations::default();
        let mut dac = Ad5686r::new("DAC");
        dac.ldac(false, 0, &mut violations);
        dac.ldac(true, LDAC_LOW - 1, &mut violations);
        assert!(violations.has("LDAC low"));
    }

    #[test]
    fn a_part_that_is_not_addressed_lets_the_line_go() {
        let mut violations = Violations::default();
        let byte = Byte { value: 0, begin: 0, end: 8 * PERIOD, mode: MODE };
        assert_eq!(Ad5686r::new("DAC").exchange(byte, &mut violations), None);
    }
}
