//! What an instruction costs, in cycles of the core.

use crate::part::Family;

pub struct Cost {
    _family: Family,
}

impl Cost {
    /// Of stacking or unstacking with floating-point registers.
    pub const EXCEPTION: u64 = 29;

    pub fn new(family: Family) -> Self {
        Self { _family: family }
    }

    /// The core's clock changed, Hz.
    pub fn clock(&mut self, _hertz: u64) {}

    /// Of the instruction.
    pub fn of(&mut self, _address: u32, _size: u32, _code: u32) -> u64 {
        1
    }

    /// Of an access to a register of a device, beyond its instruction.
    pub fn access(&self, _address: u32) -> u64 {
        4
    }
}
