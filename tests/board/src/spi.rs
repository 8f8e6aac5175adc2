//! SPI as master: the FIFO kind of the H7 and the plain one of the F4.

use std::collections::VecDeque;

use crate::part::Family;
use crate::time::{Time, cycle};

/// Bytes in the FIFO of an H7's SPI1 and SPI3.
const DEPTH: usize = 16;

/// A byte on the wires.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Byte {
    pub value: u8,
    /// First edge of SCLK, and the end of the last bit.
    pub begin: Time,
    pub end: Time,
    /// CPOL and CPHA as a number from 0 to 3.
    pub mode: u8,
}

impl Byte {
    /// Of SCLK.
    pub fn period(&self) -> Time {
        (self.end - self.begin) / 8
    }
}

pub struct Spi {
    family: Family,
    /// CR1, CR2, CFG1, CFG2.
    control: [u32; 4],
    send: VecDeque<u8>,
    received: VecDeque<u8>,
    moving: Option<Byte>,
    overrun: bool,
    started: bool,
    /// Kernel clock, Hz.
    clock: u64,
}

impl Spi {
    pub fn new(family: Family) -> Self {
        Self {
            family,
            control: [0; 4],
            send: VecDeque::new(),
            received: VecDeque::new(),
            moving: None,
            overrun: false,
            started: false,
            clock: 1,
        }
    }

    /// Kernel clock, Hz.
    pub fn clock(&mut self, hertz: u64) {
        self.clock = hertz;
    }

    /// Whether bits are on the wires.
    pub fn moves(&self) -> bool {
        self.moving.is_some()
    }

    /// Polarity of SCLK while it rests, and mode.
    pub fn mode(&self) -> u8 {
        match self.family {
            // CPOL 25, CPHA 24.
            Family::H7 => (self.control[3] >> 24 & 3) as u8,
            // CPOL 1, CPHA 0.
            Family::F4 => (self.control[0] & 3) as u8,
        }
    }

    fn byte_time(&self) -> Time {
        let divider = match self.family {
            Family::H7 => self.control[2] >> 28 & 7,
            Family::F4 => self.control[0] >> 3 & 7,
        };
        8 * cycle(self.clock) * (2 << divider)
    }

    fn enabled(&self) -> bool {
        match self.family {
            Family::H7 => self.control[0] & 1 == 1 && self.started,
            Family::F4 => self.control[0] >> 6 & 1 == 1,
        }
    }

    fn begin(&mut self, at: Time) {
        if self.moving.is_none()
            && self.enabled()
            && let Some(value) = self.send.pop_front()
        {
            self.moving = Some(Byte { value, begin: at, end: at + self.byte_time(), mode: self.mode() });
        }
    }

    /// Moves what is through by `now`; `exchange` gives what comes back for a byte.
    pub fn advance(&mut self, now: Time, mut exchange: impl FnMut(Byte) -> u8) {
        while let Some(byte) = self.moving.filter(|byte| byte.end <= now) {
            self.moving = None;
            let back = exchange(byte);
            let room = if self.family == Family::H7 { DEPTH } else { 1 };
            if self.received.len() < room {
                self.received.push_back(back)
            } else {
                self.overrun = true
            }
            self.begin(byte.end);
        }
    }

    pub fn read(&mut self, offset: u32) -> u32 {
        match (self.family, offset) {
            (Family::H7, 0) => self.control[0],
            (Family::H7, 4 | 8 | 0xc) | (Family::F4, 0 | 4) => self.control[offset as usize / 4],
            (Family::H7, 0x14) => {
                let rest = u32::from(self.moving.is_none() && self.send.is_empty());
                u32::from(!self.received.is_empty())
                    | u32::from(self.send.len() < DEPTH) << 1
                    | u32::from(self.overrun) << 6
                    | rest << 12
                    | (self.received.len().min(3) as u32) << 13
            }
            (Family::F4, 8) => {
                u32::from(!self.received.is_empty())
                    | u32::from(self.send.is_empty()) << 1
                    | u32::from(self.overrun) << 6
                    | u32::from(self.moving.is_some() || !self.send.is_empty()) << 7
            }
            (Family::H7, 0x30) | (Family::F4, 0xc) => {
                self.overrun &= self.family == Family::H7;
                u32::from(self.received.pop_front().unwrap_or(0))
            }
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, size: u32, value: u32, now: Time) {
        match (self.family, offset) {
            (Family::H7, 0) => {
                self.control[0] = value & !(1 << 9);
                if value & 1 == 0 {
                    self.send.clear();
                    self.received.clear();
                    (self.moving, self.started, self.overrun) = (None, false, false);
                }
                self.started |= value >> 9 & 1 == 1;
                self.begin(now);
            }
            (Family::H7, 4 | 8 | 0xc) | (Family::F4, 0 | 4) => {
                self.control[offset as usize / 4] = value;
                self.begin(now);
            }
            (Family::H7, 0x18) => self.overrun &= value >> 6 & 1 == 0,
            (Family::H7, 0x20) => {
                for k in 0..size {
                    self.send.push_back((value >> (8 * k)) as u8);
                }
                self.begin(now);
            }
            (Family::F4, 0xc) => {
                self.send.push_back(value as u8);
                self.begin(now);
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::MICROSECOND;

    #[test]
    fn a_byte_takes_eight_cycles_and_brings_one_back() {
        // 100 MHz by 8.
        let mut spi = Spi::new(Family::H7);
        spi.clock(100_000_000);
        spi.write(8, 4, 2 << 28, 0);
        spi.write(0xc, 4, 1 << 25, 0);
        spi.write(0, 4, 1, 0);
        spi.write(0x20, 1, 0xa5, 0);
        assert!(!spi.moves(), "not before CSTART");
        spi.write(0, 4, 1 | 1 << 9, 0);
        let end = 8 * MICROSECOND / 100 * 8;
        spi.advance(end - 1, |_| unreachable!());
        let mut seen = None;
        spi.advance(end, |byte| {
            seen = Some(byte);
            0x5a
        });
        assert_eq!(seen, Some(Byte { value: 0xa5, begin: 0, end, mode: 2 }));
        assert_eq!(spi.read(0x14) & 1, 1);
        assert_eq!(spi.read(0x30), 0x5a);
    }

    #[test]
    fn the_plain_kind_holds_one_byte() {
        let mut spi = Spi::new(Family::F4);
        spi.clock(90_000_000);
        spi.write(0, 2, 1 << 6 | 2 << 3 | 1, 0);
        spi.write(0xc, 1, 1, 0);
        spi.write(0xc, 1, 2, 0);
        spi.advance(MICROSECOND * 10, |byte| byte.value);
        assert_eq!(spi.read(8) >> 6 & 1, 1, "the second byte overran the first");
        assert_eq!(spi.read(0xc), 1);
    }
}
