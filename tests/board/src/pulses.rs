//! The timer of CONVST and LDAC: 16 bits, counts once when TIM2 or the program starts it, drives pins by its channels.

use crate::time::{Time, cycle};

#[derive(Default)]
pub struct Pulses {
    /// CR1, CR2, SMCR, DIER.
    control: [u32; 4],
    status: u32,
    /// CCMR1, CCMR2, CCER.
    outputs: [u32; 3],
    prescaler: u32,
    end: u32,
    compare: [u32; 4],
    /// When it was started, and up to when what it did is known; not while it rests.
    since: Option<Time>,
    passed: Time,
    /// Count while it rests.
    count: u32,
    /// Of a count of the timer's clock.
    step: Time,
}

/// Counts of the timer between the trigger of TIM2 and the first clock.
const TRIGGER: Time = 3;

impl Pulses {
    /// Its clock, Hz. Not while it runs.
    pub fn clock(&mut self, hertz: u64) {
        self.step = cycle(hertz);
    }

    fn period(&self) -> Time {
        self.step * Time::from(self.prescaler + 1)
    }

    fn start(&mut self, at: Time) {
        if self.since.is_none() {
            (self.since, self.passed) = (Some(at), at);
            self.control[0] |= 1;
        }
    }

    /// TIM2 gives its trigger.
    pub fn trigger(&mut self, at: Time) {
        // Trigger mode, from ITR1.
        if self.control[2] & 0x0007_0077 == 0x16 {
            self.start(at + TRIGGER * self.step);
        }
    }

    fn count(&self, now: Time) -> u32 {
        match self.since {
            Some(since) if now >= since => self.count + ((now - since) / self.period()) as u32,
            _ => self.count,
        }
    }

    /// When a pin may change next, or it ends.
    pub fn next(&self) -> Option<Time> {
        let since = self.since?;
        let at = |count: u32| since + Time::from(count.saturating_sub(self.count)) * self.period();
        let marks = self.compare.iter().map(|compare| at(*compare)).chain([at(self.end + 1)]);
        marks.filter(|mark| *mark > self.passed).min()
    }

    /// What is due at `now`, which is not after [`Pulses::next`], has happened.
    pub fn pass(&mut self, now: Time) {
        self.passed = now;
        let count = self.count(now);
        for (channel, compare) in self.compare.iter().enumerate() {
            if *compare == count {
                self.status |= 2 << channel;
            }
        }
        if count > self.end {
            // One pulse, or round and round.
            self.count = 0;
            self.since = (self.control[0] >> 3 & 1 == 0).then_some(now);
            self.control[0] &= !u32::from(self.since.is_none());
        }
    }

    /// What a channel, counted from 0, puts on its pin.
    pub fn level(&self, channel: usize, now: Time) -> bool {
        let [enabled, inverted] = [0, 1].map(|bit| self.outputs[2] >> (4 * channel + bit) & 1 == 1);
        let count = self.count(now);
        let active = match self.outputs[channel / 2] >> (8 * (channel % 2) + 4) & 7 {
            5 => true,
            6 => count < self.compare[channel],
            7 => count >= self.compare[channel],
            _ => false,
        };
        enabled && active != inverted
    }

    pub fn read(&self, offset: u32, now: Time) -> u32 {
        match offset {
            0..=0xc => self.control[offset as usize / 4],
            0x10 => self.status,
            0x18..=0x20 => self.outputs[(offset as usize - 0x18) / 4],
            0x24 => self.count(now),
            0x28 => self.prescaler,
            0x2c => self.end,
            0x34..=0x40 => self.compare[(offset as usize - 0x34) / 4],
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, value: u32, now: Time) {
        match offset {
            0 => {
                self.control[0] = value & !1;
                if value & 1 == 1 {
                    self.start(now);
                    self.control[0] |= 1;
                } else {
                    (self.count, self.since) = (self.count(now), None);
                }
            }
            4..=0xc => self.control[offset as usize / 4] = value,
            0x10 => self.status &= value,
            0x18..=0x20 => self.outputs[(offset as usize - 0x18) / 4] = value,
            0x24 => {
                self.count = value & 0xffff;
                self.since = self.since.map(|_| now);
            }
            0x28 => self.prescaler = value & 0xffff,
            0x2c => self.end = value & 0xffff,
            0x34..=0x40 => self.compare[(offset as usize - 0x34) / 4] = value & 0xffff,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::MICROSECOND;

    /// 10 MHz; CH1 rises with count 1, CH2 is low from 5 to 7; started by TIM2.
    fn timer(one_pulse: bool) -> Pulses {
        let mut timer = Pulses::default();
        timer.clock(10_000_000);
        for (offset, value) in
            [(0, u32::from(one_pulse) << 3), (8, 0x16), (0x18, 0x7070), (0x20, 0x31), (0x2c, 7), (0x34, 1), (0x38, 5)]
        {
            timer.write(offset, value, 0);
        }
        timer
    }

    /// Both levels at each mark.
    fn marks(timer: &mut Pulses, most: usize) -> Vec<(Time, [bool; 2])> {
        let mut seen = Vec::new();
        while let Some(at) = timer.next().filter(|_| seen.len() < most) {
            timer.pass(at);
            seen.push((at * 10 / MICROSECOND, [timer.level(0, at), timer.level(1, at)]));
        }
        seen
    }

    #[test]
    fn one_pulse_gives_both_edges_and_rests() {
        let mut timer = timer(true);
        assert_eq!([timer.level(0, 0), timer.level(1, 0)], [false, true]);
        timer.trigger(0);
        let expected = [(3, [false, true]), (4, [true, true]), (8, [true, false]), (11, [false, true])];
        // CCR3 and CCR4 are 0: the mark at the start.
        assert_eq!(marks(&mut timer, 9), expected[1..]);
        assert_eq!(timer.read(0, MICROSECOND * 2) & 1, 0);
        assert_eq!(timer.read(0x10, 0) & 6, 6);
    }

    #[test]
    fn a_forced_channel_stays_and_a_timer_that_does_not_follow_rests() {
        let mut timer = timer(true);
        timer.write(0x18, 0x5070, 0);
        assert!(!timer.level(1, 0), "forced active, inverted");
        timer.write(0x18, 0x4070, 0);
        assert!(timer.level(1, 0));
        timer.write(8, 0x10, 0);
        timer.trigger(0);
        assert_eq!(timer.next(), None);
    }
}
