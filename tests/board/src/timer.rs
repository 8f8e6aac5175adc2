//! TIM2: a counter of 32 bits with one compare channel.

use crate::time::{Time, cycle};

/// CC1 in SR, DIER and EGR.
const CC1: u32 = 1 << 1;

#[derive(Default)]
pub struct Timer {
    control: u32,
    /// CR2.
    leads: u32,
    interrupts: u32,
    status: u32,
    /// Counter at `since`; it runs from there.
    count: u32,
    since: Time,
    compare: u32,
    reload: u32,
    /// Of a count.
    step: Time,
}

impl Timer {
    /// Its clock, Hz.
    pub fn clock(&mut self, now: Time, hertz: u64) {
        self.count = self.now(now);
        self.since = now;
        self.step = cycle(hertz);
    }

    fn runs(&self) -> bool {
        self.control & 1 == 1
    }

    fn now(&self, now: Time) -> u32 {
        if self.runs() { self.count.wrapping_add(((now - self.since) / self.step) as u32) } else { self.count }
    }

    /// When the comparison comes true next.
    pub fn next(&self, now: Time) -> Option<Time> {
        let ahead = self.compare.wrapping_sub(self.now(now));
        let ahead = if ahead == 0 { 1 << 32 } else { u64::from(ahead) };
        let whole = (now - self.since) / self.step * self.step + self.since;
        self.runs().then(|| whole + ahead * self.step)
    }

    /// What happened from `before` (not with it) to `now`.
    pub fn advance(&mut self, before: Time, now: Time) {
        if self.next(before).is_some_and(|at| at <= now) {
            self.status |= CC1;
        }
    }

    /// Whether each match is its trigger output.
    pub fn leads(&self) -> bool {
        self.leads >> 4 & 7 == 3
    }

    /// Its interrupt.
    pub fn line(&self) -> bool {
        self.status & self.interrupts & 0x1f != 0
    }

    pub fn read(&self, offset: u32, now: Time) -> u32 {
        match offset {
            0 => self.control,
            4 => self.leads,
            0xc => self.interrupts,
            0x10 => self.status,
            0x24 => self.now(now),
            0x2c => self.reload,
            0x34 => self.compare,
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, value: u32, now: Time) {
        match offset {
            0 => {
                self.count = self.now(now);
                self.since = now;
                self.control = value;
            }
            4 => self.leads = value,
            0xc => self.interrupts = value,
            0x10 => self.status &= value,
            0x14 => self.status |= value & CC1,
            0x24 => (self.count, self.since) = (value, now),
            0x2c => self.reload = value,
            0x34 => self.compare = value,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::MICROSECOND;

    #[test]
    fn it_counts_and_compares() {
        let mut timer = Timer::default();
        timer.clock(0, 200_000_000);
        timer.write(0x34, 200, 0);
        timer.write(0xc, CC1, 0);
        timer.write(0, 1, 0);
        assert_eq!(timer.read(0x24, MICROSECOND / 2), 100);
        assert_eq!(timer.next(0), Some(MICROSECOND));
        timer.advance(0, MICROSECOND - 1);
        assert!(!timer.line());
        timer.advance(MICROSECOND - 1, MICROSECOND);
        assert!(timer.line());
        timer.write(0x10, !CC1, MICROSECOND);
        assert!(!timer.line());
    }
}
