//! Exceptions: what is pending, enabled and active, and which one comes next.

/// Exception numbers.
pub const NMI: usize = 2;
pub const HARD_FAULT: usize = 3;
pub const PEND_SV: usize = 14;
const SYS_TICK: usize = 15;
/// Of interrupt 0.
pub const FIRST: usize = 16;
/// Exceptions that are kept.
const COUNT: usize = FIRST + 160;
/// Lower than every priority.
const THREAD: u16 = 256;

const ICSR: u32 = 0xe000_ed04;
const AIRCR: u32 = 0xe000_ed0c;
const SHPR: u32 = 0xe000_ed18;

/// The controller.
pub struct Nvic {
    enabled: [bool; COUNT],
    pending: [bool; COUNT],
    /// Lines of peripherals, which pend again as long as they are high.
    lines: [bool; COUNT],
    priority: [u8; COUNT],
    active: Vec<usize>,
    /// The pending exception of highest priority that the active one does not hold off.
    next: Option<usize>,
    /// The program asked for a reset.
    pub reset: bool,
}

impl Nvic {
    pub fn new() -> Self {
        let mut enabled = [false; COUNT];
        enabled[..FIRST].fill(true);
        Self {
            enabled,
            pending: [false; COUNT],
            lines: [false; COUNT],
            priority: [0; COUNT],
            active: Vec::new(),
            next: None,
            reset: false,
        }
    }

    fn update(&mut self) {
        let running = self.active.iter().map(|n| u16::from(self.priority[*n])).min().unwrap_or(THREAD);
        self.next = (0..COUNT)
            .filter(|n| self.pending[*n] && self.enabled[*n] && u16::from(self.priority[*n]) < running)
            .min_by_key(|n| (self.priority[*n], *n));
    }

    /// What would be taken if nothing were masked.
    pub fn next(&self) -> Option<usize> {
        self.next
    }

    /// What is taken with these masks.
    pub fn ready(&self, primask: u32, basepri: u32) -> Option<usize> {
        let next = self.next?;
        let masked = primask & 1 == 1 || (basepri > 0 && u32::from(self.priority[next]) >= basepri);
        (!masked).then_some(next)
    }

    /// How many are active.
    pub fn depth(&self) -> usize {
        self.active.len()
    }

    /// The exception that runs.
    pub fn running(&self) -> Option<usize> {
        self.active.last().copied()
    }

    pub fn enter(&mut self, exception: usize) {
        self.pending[exception] = false;
        self.active.push(exception);
        self.update();
    }

    pub fn leave(&mut self) {
        if let Some(exception) = self.active.pop() {
            self.pending[exception] |= self.lines[exception];
        }
        self.update();
    }

    /// The line of a peripheral.
    pub fn line(&mut self, interrupt: usize, high: bool) {
        let exception = FIRST + interrupt;
        if high != self.lines[exception] {
            self.lines[exception] = high;
            if high {
                self.pending[exception] = true;
                self.update();
            }
        }
    }

    /// Whether registers at this address are here.
    pub fn has(address: u32) -> bool {
        matches!(address, 0xe000_e100..=0xe000_e4ff | 0xe000_ef00 | ICSR | AIRCR | SHPR..=0xe000_ed23)
    }

    pub fn read(&self, address: u32, size: u32) -> u32 {
        let bits = |flags: &[bool; COUNT], base: u32| {
            let first = FIRST + (address - base) as usize * 8;
            (0..32).filter(|k| flags.get(first + k) == Some(&true)).fold(0, |word, k| word | 1 << k)
        };
        let bytes = |first: usize| {
            (0..size as usize)
                .rev()
                .fold(0, |word, k| word << 8 | u32::from(*self.priority.get(first + k).unwrap_or(&0)))
        };
        match address {
            0xe000_e100..=0xe000_e17f => bits(&self.enabled, 0xe000_e100),
            0xe000_e180..=0xe000_e1ff => bits(&self.enabled, 0xe000_e180),
            0xe000_e200..=0xe000_e27f => bits(&self.pending, 0xe000_e200),
            0xe000_e280..=0xe000_e2ff => bits(&self.pending, 0xe000_e280),
            0xe000_e400..=0xe000_e4ff => bytes(FIRST + (address - 0xe000_e400) as usize),
            SHPR..=0xe000_ed23 => bytes(4 + (address - SHPR) as usize),
            ICSR => self.running().unwrap_or(0) as u32,
            AIRCR => 0xfa05_0000,
            _ => 0,
        }
    }

    pub fn write(&mut self, address: u32, size: u32, value: u32) {
        let bits = |flags: &mut [bool; COUNT], base: u32, to: bool| {
            let first = FIRST + (address - base) as usize * 8;
            for k in (0..32).filter(|k| value >> k & 1 == 1) {
                if let Some(flag) = flags.get_mut(first + k) {
                    *flag = to;
                }
            }
        };
        match address {
            0xe000_e100..=0xe000_e17f => bits(&mut self.enabled, 0xe000_e100, true),
            0xe000_e180..=0xe000_e1ff => bits(&mut self.enabled, 0xe000_e180, false),
            0xe000_e200..=0xe000_e27f => bits(&mut self.pending, 0xe000_e200, true),
            0xe000_e280..=0xe000_e2ff => bits(&mut self.pending, 0xe000_e280, false),
            0xe000_e400..=0xe000_e4ff => self.prioritise(FIRST + (address - 0xe000_e400) as usize, size, value),
            SHPR..=0xe000_ed23 => self.prioritise(4 + (address - SHPR) as usize, size, value),
            // STIR: one interrupt by its number.
            0xe000_ef00 => self.pending[(FIRST + (value & 0x1ff) as usize).min(COUNT - 1)] = true,
            ICSR => {
                self.pending[PEND_SV] = (self.pending[PEND_SV] || value >> 28 & 1 == 1) && value >> 27 & 1 == 0;
                self.pending[SYS_TICK] = (self.pending[SYS_TICK] || value >> 26 & 1 == 1) && value >> 25 & 1 == 0;
            }
            AIRCR => self.reset = value >> 16 == 0x05fa && value >> 2 & 1 == 1,
            _ => {}
        }
        self.update();
    }

    /// Four bits of priority are there, the upper ones.
    fn prioritise(&mut self, first: usize, size: u32, value: u32) {
        for k in 0..size as usize {
            if let Some(priority) = self.priority.get_mut(first + k) {
                *priority = (value >> (8 * k)) as u8 & 0xf0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Interrupts 28 at the highest priority and 39 at a lower one, both enabled.
    fn two() -> Nvic {
        let mut nvic = Nvic::new();
        nvic.write(0xe000_e100, 4, 1 << 28);
        nvic.write(0xe000_e104, 4, 1 << 7);
        nvic.write(0xe000_e400 + 39, 1, 0x80);
        nvic
    }

    #[test]
    fn the_higher_priority_comes_first_and_interrupts_the_lower() {
        let mut nvic = two();
        nvic.line(39, true);
        assert_eq!(nvic.next(), Some(FIRST + 39));
        nvic.enter(FIRST + 39);
        assert_eq!(nvic.next(), None);
        nvic.line(28, true);
        assert_eq!(nvic.next(), Some(FIRST + 28));
    }

    #[test]
    fn basepri_masks_its_priority_and_lower_ones() {
        let mut nvic = two();
        nvic.line(39, true);
        assert_eq!(nvic.ready(0, 0x80), None);
        assert_eq!(nvic.ready(0, 0x90), Some(FIRST + 39));
        assert_eq!(nvic.ready(1, 0), None);
    }

    #[test]
    fn a_line_that_stays_high_comes_again() {
        let mut nvic = two();
        nvic.line(28, true);
        nvic.enter(FIRST + 28);
        nvic.leave();
        assert_eq!(nvic.next(), Some(FIRST + 28));
        nvic.enter(FIRST + 28);
        nvic.line(28, false);
        nvic.leave();
        assert_eq!(nvic.next(), None);
    }
}
