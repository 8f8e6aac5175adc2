//! AD7606 family, serial, one data line. Times are those of the slowest part that fits: AD7606, AD7606B, AD7608, AD7606C-18.

use crate::spi::Byte;
use crate::time::{Time, nanoseconds};
use crate::violations::Violations;

/// CONVST low.
const CONVST_LOW: Time = nanoseconds(25);
/// From the rising edge of CONVST until BUSY is high.
const BUSY_RISES: Time = nanoseconds(45);
/// The longest conversion.
const CONVERSION: Time = nanoseconds(4_200);
/// RESET high, and from its end until the first start: AD7606B.
const RESET_HIGH: Time = nanoseconds(3_000);
const SETUP: Time = nanoseconds(253_000);
/// A cycle of SCLK at 3.3 V: 17 MHz.
const CLOCK: Time = nanoseconds(58);
/// CS low until the first edge of SCLK, and its last edge until CS is high.
const SELECT: Time = nanoseconds(30);
/// DOUTA is valid so long after SCLK rises, for VDRIVE of 2.7 V and more, and before SCLK falls: set-up of the microcontroller's input.
const DOUT: Time = nanoseconds(27) + nanoseconds(2);
/// CPOL 1, CPHA 0.
const MODE: u8 = 2;
const NAME: &str = "ADC";

/// What is wrong with the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// BUSY never rises.
    Dead,
    /// BUSY never falls.
    Endless,
    /// One bit late.
    Shifted,
    /// V8 sees 0 V.
    NoReference,
    /// Zeros.
    Blank,
    /// Another edge of CONVST while it is read.
    Again,
}

#[derive(Default)]
pub struct Ad7606 {
    /// 16 or 18.
    bits: u32,
    /// Codes of V1 to V8, two's complement; those of the last conversion.
    codes: [u32; 8],
    convst: Option<(bool, Time)>,
    reset: Option<(bool, Time)>,
    /// Ready for a start from here on; none before a reset.
    ready: Option<Time>,
    converted: Option<Time>,
    selected: Option<Time>,
    /// Bits given since CS fell, and the end of the last byte.
    given: u32,
    last: Time,
    pub fault: Option<Fault>,
    /// It is whole again after a RESET.
    wants_reset: bool,
    /// Rising edges of CONVST.
    pub conversions: u64,
    /// Conversions that ended before the last one began.
    ended: u64,
}

impl Ad7606 {
    pub fn new(bits: u32) -> Self {
        Self { bits, ..Self::default() }
    }

    /// CONVST changed. True: it samples now, and wants [`Ad7606::sample`].
    pub fn convst(&mut self, high: bool, now: Time, violations: &mut Violations) -> bool {
        let before = self.convst.replace((high, now));
        let Some((false, fell)) = before else { return false };
        if !high {
            return false;
        }
        violations.shorter(NAME, "CONVST low", now - fell, CONVST_LOW, now);
        match self.ready {
            None => violations.note(NAME, "a start before the first RESET", now),
            Some(ready) if now < ready => {
                violations.shorter(NAME, "from RESET to CONVST", (now + SETUP).saturating_sub(ready), SETUP, now);
            }
            Some(_) => {}
        }
        if self.busy(now) && self.fault != Some(Fault::Endless) {
            violations.note(NAME, "CONVST while BUSY", now);
        }
        if self.selected.is_some() {
            violations.note(NAME, "CONVST while CS is low", now);
        }
        self.begin(now);
        self.conversions += 1;
        true
    }

    /// The inputs V1 to V6 as codes from 0 at the lowest input, and whether V8 sees its 2.5 V.
    pub fn sample(&mut self, gauges: [u32; 6], reference: bool) {
        let half = 1 << (self.bits - 1);
        // 2.5 V at ±5 V.
        let seen = if reference && self.fault != Some(Fault::NoReference) { half + half / 2 } else { half };
        let inputs = [gauges[0], gauges[1], gauges[2], gauges[3], gauges[4], gauges[5], half, seen];
        self.codes = inputs.map(|code| (code ^ half) & ((1 << self.bits) - 1));
    }

    fn begin(&mut self, now: Time) {
        self.ended = self.falls(now);
        self.converted = (self.fault != Some(Fault::Dead)).then_some(now);
    }

    /// How often BUSY has fallen.
    pub fn falls(&self, now: Time) -> u64 {
        let ends = |since: Time| now >= since + CONVERSION && self.fault != Some(Fault::Endless);
        self.ended + u64::from(self.converted.is_some_and(ends))
    }

    pub fn busy(&self, now: Time) -> bool {
        let Some(since) = self.converted else { return false };
        now >= since + BUSY_RISES && (now < since + CONVERSION || self.fault == Some(Fault::Endless))
    }

    pub fn reset(&mut self, high: bool, now: Time, violations: &mut Violations) {
        let before = self.reset.replace((high, now));
        if let Some((true, rose)) = before
            && !high
        {
            violations.shorter(NAME, "RESET high", now - rose, RESET_HIGH, now);
            self.ready = Some(now + SETUP);
            self.ended = self.falls(now);
            self.converted = None;
            if self.wants_reset {
                (self.fault, self.wants_reset) = (None, false);
            }
        }
    }

    /// What was wrong is over. A part whose conversions hung needs a RESET as well.
    pub fn heal(&mut self) {
        match self.fault {
            Some(Fault::Dead | Fault::Endless) => self.wants_reset = true,
            _ => self.fault = None,
        }
    }

    /// CS changed; `moving`: SCLK is running.
    pub fn select(&mut self, low: bool, moving: bool, now: Time, violations: &mut Violations) {
        if moving {
            violations.note(NAME, "CS changes within a byte", now);
        }
        match (low, self.selected) {
            (true, None) => {
                if self.converted.is_some_and(|since| now < since + CONVERSION) && self.fault.is_none() {
                    violations.note(NAME, "read while it converts", now);
                }
                (self.selected, self.given) = (Some(now), 0);
            }
            (false, Some(_)) => {
                self.selected = None;
                if self.given != 8 * self.bits {
                    violations.note(NAME, &format!("{} bits read of {}", self.given, 8 * self.bits), now);
                }
                violations.shorter(NAME, "last SCLK to CS", now.saturating_sub(self.last), 0, now);
            }
            _ => {}
        }
    }

    /// What comes back for a byte.
    pub fn exchange(&mut self, byte: Byte, violations: &mut Violations) -> u8 {
        let Some(since) = self.selected else {
            violations.note(NAME, "SCLK without CS", byte.begin);
            return 0xff;
        };
        if byte.mode != MODE {
            violations.note(NAME, &format!("SPI mode {} instead of {MODE}", byte.mode), byte.begin);
        }
        violations.shorter(NAME, "a cycle of SCLK", byte.period(), CLOCK, byte.begin);
        if self.given == 0 {
            violations.shorter(NAME, "CS to SCLK", byte.begin - since, SELECT, byte.begin);
        }
        if self.given == 0 && self.fault == Some(Fault::Again) {
            self.begin(byte.begin);
        }
        // The first bit is there before SCLK; each one after it, taken in the middle of a cycle before it is valid, is the one before.
        let late = u32::from(byte.period() / 2 < DOUT);
        let shift = u32::from(self.fault == Some(Fault::Shifted));
        let shown = |index: u32| self.bit(index.checked_sub(shift + late.min(index)));
        let value = (self.given..self.given + 8).fold(0, |value, index| value << 1 | shown(index));
        self.given += 8;
        self.last = byte.end;
        if self.fault == Some(Fault::Blank) { 0 } else { value }
    }

    fn bit(&self, index: Option<u32>) -> u8 {
        let Some(index) = index else { return 0 };
        let Some(code) = self.codes.get((index / self.bits) as usize) else { return 0 };
        (code >> (self.bits - 1 - index % self.bits) & 1) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::MICROSECOND;

    const PERIOD: Time = nanoseconds(80);

    /// A part after RESET at time 0, its clock at the returned time.
    fn ready(violations: &mut Violations) -> (Ad7606, Time) {
        let mut adc = Ad7606::new(16);
        adc.convst(true, 0, violations);
        adc.reset(true, 0, violations);
        adc.reset(false, 4 * MICROSECOND, violations);
        (adc, 300 * MICROSECOND)
    }

    fn convert(adc: &mut Ad7606, low: Time, at: Time, violations: &mut Violations) -> Time {
        adc.convst(false, at, violations);
        assert!(adc.convst(true, at + low, violations));
        at + low
    }

    fn read(adc: &mut Ad7606, at: Time, violations: &mut Violations) -> Vec<u8> {
        read_at(adc, at, PERIOD, violations)
    }

    fn read_at(adc: &mut Ad7606, mut at: Time, period: Time, violations: &mut Violations) -> Vec<u8> {
        adc.select(true, false, at, violations);
        at += SELECT;
        let mut bytes = Vec::new();
        for _ in 0..16 {
            bytes.push(adc.exchange(Byte { value: 0, begin: at, end: at + 8 * period, mode: 2 }, violations));
            at += 8 * period;
        }
        adc.select(false, false, at, violations);
        bytes
    }

    #[test]
    fn codes_come_most_significant_bit_first_in_twos_complement() {
        let mut violations = Violations::default();
        let (mut adc, at) = ready(&mut violations);
        let at = convert(&mut adc, CONVST_LOW, at, &mut violations);
        adc.sample([0x8000, 0, 0xffff, 0x8001, 0, 0], true);
        assert!(!adc.busy(at) && adc.busy(at + BUSY_RISES) && !adc.busy(at + CONVERSION));
        let bytes = read(&mut adc, at + CONVERSION, &mut violations);
        assert_eq!(bytes[..8], [0, 0, 0x80, 0, 0x7f, 0xff, 0, 1]);
        assert_eq!(bytes[14..], [0x40, 0]);
        assert!(violations.none(), "{violations:?}");
    }

    /// 16.7 MHz leaves 30 ns from edge to edge.
    #[test]
    fn what_is_taken_before_it_is_valid_is_the_bit_before() {
        for (period, expected) in [(60, [0xa5, 0x5a]), (56, [0xd2, 0xad])] {
            let mut violations = Violations::default();
            let (mut adc, at) = ready(&mut violations);
            let at = convert(&mut adc, CONVST_LOW, at, &mut violations);
            adc.sample([0x255a, 0, 0, 0, 0, 0], true);
            let bytes = read_at(&mut adc, at + CONVERSION, nanoseconds(period), &mut violations);
            assert_eq!(bytes[..2], expected, "{period} ns");
        }
    }

    #[test]
    fn conversions_that_hung_need_a_reset() {
        let mut violations = Violations::default();
        let (mut adc, at) = ready(&mut violations);
        adc.fault = Some(Fault::Dead);
        adc.heal();
        let begun = convert(&mut adc, CONVST_LOW, at, &mut violations);
        assert!(!adc.busy(begun + BUSY_RISES));
        adc.reset(true, begun, &mut violations);
        adc.reset(false, begun + RESET_HIGH, &mut violations);
        let begun = convert(&mut adc, CONVST_LOW, begun + 2 * SETUP, &mut violations);
        assert!(adc.busy(begun + BUSY_RISES));
    }

    #[test]
    fn every_time_that_is_too_short_is_seen() {
        type Run = fn(&mut Violations);
        let cases: [(&str, Run); 6] = [
            ("CONVST low", |v| {
                let (mut adc, at) = ready(v);
                convert(&mut adc, CONVST_LOW - 1, at, v);
            }),
            ("from RESET to CONVST", |v| {
                let (mut adc, _) = ready(v);
                convert(&mut adc, CONVST_LOW, 5 * MICROSECOND, v);
            }),
            ("a start before the first RESET", |v| {
                convert(&mut Ad7606::new(16), CONVST_LOW, 0, v);
            }),
            ("CONVST while BUSY", |v| {
                let (mut adc, at) = ready(v);
                let at = convert(&mut adc, CONVST_LOW, at, v);
                convert(&mut adc, CONVST_LOW, at + BUSY_RISES, v);
            }),
            ("read while it converts", |v| {
                let (mut adc, at) = ready(v);
                let at = convert(&mut adc, CONVST_LOW, at, v);
                read(&mut adc, at + CONVERSION - 1, v);
            }),
            ("RESET high", |v| {
                let mut adc = Ad7606::new(16);
                adc.reset(true, 0, v);
                adc.reset(false, RESET_HIGH - 1, v);
            }),
        ];
        for (expected, run) in cases {
            let mut violations = Violations::default();
            run(&mut violations);
            assert!(violations.has(expected), "{expected}: {violations:?}");
        }
    }

    #[test]
    fn clocks_and_selects_that_do_not_fit_are_seen() {
        let byte = |period, mode| Byte { value: 0, begin: SELECT, end: SELECT + 8 * period, mode };
        for (expected, byte, selected) in [
            ("a cycle of SCLK", byte(CLOCK - 1, 2), Some(0)),
            ("SPI mode 0", byte(PERIOD, 0), Some(0)),
            ("SCLK without CS", byte(PERIOD, 2), None),
            ("CS to SCLK", byte(PERIOD, 2), Some(1)),
        ] {
            let mut violations = Violations::default();
            let mut adc = Ad7606 { selected, ..Ad7606::new(16) };
            adc.exchange(byte, &mut violations);
            assert!(violations.has(expected), "{expected}: {violations:?}");
        }
        let mut violations = Violations::default();
        let mut adc = Ad7606 { selected: Some(0), given: 120, ..Ad7606::new(16) };
        adc.select(false, true, 1, &mut violations);
        assert!(violations.has("CS changes within a byte") && violations.has("120 bits read of 128"));
    }
}
