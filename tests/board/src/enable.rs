//! TIM1 as the enable line uses it: one output, forced, behind main output and break.

/// BDTR: break enabled, active high, main output.
const ENABLED: u32 = 1 << 12;
const HIGH: u32 = 1 << 13;
const MAIN: u32 = 1 << 15;
/// Bits that LOCK level 1 keeps: break, its polarity, automatic output, dead time, LOCK itself.
const LOCKED: u32 = 0x73ff;
/// SR: the break came.
const BROKEN: u32 = 1 << 7;
/// OCxM.
const ACTIVE: u32 = 0b101;

#[derive(Default)]
pub struct Enable {
    /// CR2, CCMR1, CCMR2, CCER.
    registers: [u32; 4],
    dead_time: u32,
    status: u32,
    /// Level of the break input.
    open: bool,
    /// It stands still because a debugger holds the core.
    pub frozen: bool,
}

impl Enable {
    /// The contact, whose line a pull-up takes high when it opens. Works without the core.
    pub fn contact(&mut self, open: bool) {
        self.open = open;
        self.protect();
    }

    /// The clock security system has found no clock, which is a break, too.
    pub fn clock_failed(&mut self) {
        if self.dead_time & ENABLED != 0 {
            self.dead_time &= !MAIN;
            self.status |= BROKEN;
        }
    }

    fn breaks(&self) -> bool {
        self.dead_time & ENABLED != 0 && self.open == (self.dead_time & HIGH != 0)
    }

    fn protect(&mut self) {
        if self.breaks() {
            self.dead_time &= !MAIN;
            self.status |= BROKEN;
        }
    }

    /// The level of a channel, 1 to 4: idle is low.
    pub fn level(&self, channel: usize) -> bool {
        let place = channel - 1;
        let mode = self.registers[1 + place / 2] >> (8 * (place % 2) + 4) & 7;
        let connected = self.registers[3] >> (4 * place) & 1 == 1;
        self.dead_time & MAIN != 0 && !self.frozen && connected && mode == ACTIVE
    }

    fn register(offset: u32) -> Option<usize> {
        [4, 0x18, 0x1c, 0x20].iter().position(|known| *known == offset)
    }

    pub fn read(&self, offset: u32) -> u32 {
        match (Self::register(offset), offset) {
            (Some(place), _) => self.registers[place],
            (_, 0x10) => self.status,
            (_, 0x44) => self.dead_time,
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, value: u32) {
        match (Self::register(offset), offset) {
            (Some(place), _) => self.registers[place] = value,
            (_, 0x10) => self.status &= value,
            (_, 0x44) => {
                let kept = if self.dead_time >> 8 & 3 == 0 { 0 } else { LOCKED };
                self.dead_time = self.dead_time & kept | value & !kept;
            }
            _ => {}
        }
        self.protect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_contact_takes_the_line_and_only_a_program_gives_it_back() {
        let mut enable = Enable::default();
        enable.write(0x18, ACTIVE << 12);
        enable.write(0x20, 1 << 4);
        enable.write(0x44, 1 << 8 | ENABLED | HIGH);
        assert!(!enable.level(2));
        enable.write(0x44, MAIN);
        assert!(enable.level(2) && !enable.level(1), "locked bits stay");
        enable.contact(true);
        assert!(!enable.level(2));
        enable.write(0x44, MAIN);
        enable.write(0x10, !BROKEN);
        assert!(!enable.level(2) && enable.read(0x10) & BROKEN != 0, "not while it is open");
        enable.contact(false);
        assert!(!enable.level(2));
        enable.write(0x10, !BROKEN);
        enable.write(0x44, MAIN);
        assert!(enable.level(2) && enable.read(0x10) & BROKEN == 0);
        enable.frozen = true;
        assert!(!enable.level(2));
        enable.frozen = false;
        assert!(enable.level(2));
        enable.clock_failed();
        assert!(!enable.level(2) && enable.read(0x10) & BROKEN != 0);
    }
}
