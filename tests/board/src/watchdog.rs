//! IWDG: counts down at 32 kHz; a reset when it gets to zero.

use crate::time::{Time, cycle};

pub struct Watchdog {
    prescaler: u32,
    reload: u32,
    /// When it bites, once it runs.
    pub due: Option<Time>,
}

impl Watchdog {
    pub fn new() -> Self {
        Self { prescaler: 0, reload: 0xfff, due: None }
    }

    pub fn read(&self, offset: u32) -> u32 {
        match offset {
            4 => self.prescaler,
            8 => self.reload,
            0x10 => 0xfff,
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, value: u32, now: Time) {
        match (offset, value) {
            (0, 0xcccc) => self.due = Some(now + self.timeout()),
            (0, 0xaaaa) if self.due.is_some() => self.due = Some(now + self.timeout()),
            (4, _) => self.prescaler = value & 7,
            (8, _) => self.reload = value & 0xfff,
            _ => {}
        }
    }

    /// A debugger that holds the core for so long stops it, too.
    pub fn frozen(&mut self, time: Time) {
        self.due = self.due.map(|due| due + time);
    }

    fn timeout(&self) -> Time {
        cycle(32_000) * (4 << self.prescaler.min(6)) * u64::from(self.reload + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::MICROSECOND;

    #[test]
    fn feeding_puts_the_reset_off() {
        let mut watchdog = Watchdog::new();
        watchdog.write(0, 0xaaaa, 5);
        assert_eq!(watchdog.due, None);
        watchdog.write(8, 159, 5);
        watchdog.write(0, 0xcccc, 5);
        assert_eq!(watchdog.due, Some(5 + 20_000 * MICROSECOND));
        watchdog.write(0, 0xaaaa, 7);
        assert_eq!(watchdog.due, Some(7 + 20_000 * MICROSECOND));
    }
}
