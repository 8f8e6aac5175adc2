//! EXTI and what SYSCFG chooses for it: falls of BUSY, latched.

use crate::ad7606::Ad7606;
use crate::part::Part;
use crate::store::Store;
use crate::time::Time;

/// Falls of BUSY up to the one that was cleared last.
#[derive(Default)]
pub struct Exti {
    cleared: u64,
}

impl Exti {
    /// The pending register, of the line of BUSY alone.
    pub fn read(&self, part: &Part, store: &Store, adc: &Ad7606, now: Time) -> u32 {
        let (port, pin) = part.busy;
        let [selection, falls, mask] = part.exti.map(|register| store.word(register));
        let chosen = selection >> (4 * (pin % 4)) & 0xf == port as u32;
        let latched = chosen && (falls & mask) >> pin & 1 == 1 && adc.falls(now) != self.cleared;
        u32::from(latched) << pin
    }

    /// Ones clear.
    pub fn write(&mut self, part: &Part, value: u32, adc: &Ad7606, now: Time) {
        if value >> part.busy.1 & 1 == 1 {
            self.cleared = adc.falls(now);
        }
    }
}
