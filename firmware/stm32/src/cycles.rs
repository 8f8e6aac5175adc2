//! The cycle counter of the core's debug unit.

use cortex_m::peripheral::{DCB, DWT};
use specgen_board::Stopwatch;
use specgen_link::CostUnit;

/// DWT CYCCNT.
pub const CYCLES: Stopwatch = Stopwatch { counted: CostUnit::Cycles, now: DWT::cycle_count };

/// Enables the counter. On an M7 it must be unlocked first; an M4 has no lock.
pub fn start(dcb: &mut DCB, dwt: &mut DWT) {
    dcb.enable_trace();
    DWT::unlock();
    dwt.enable_cycle_counter();
}
