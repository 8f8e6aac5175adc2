//! Cycles of the core, by the counter of its debug unit.

use cortex_m::peripheral::{DCB, DWT};
use specgen_board::Stopwatch;
use specgen_link::CostUnit;

/// DWT CYCCNT.
pub const CYCLES: Stopwatch = Stopwatch { counted: CostUnit::Cycles, now: DWT::cycle_count };

/// Switches the counter on. An M7 keeps it locked until it gets the key; an M4 has no lock.
pub fn start(dcb: &mut DCB, dwt: &mut DWT) {
    dcb.enable_trace();
    DWT::unlock();
    dwt.enable_cycle_counter();
}
