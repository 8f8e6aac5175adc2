//! Short waits by counting cycles.

use embedded_hal::delay::DelayNs;

/// Waits at least the requested time. `CYCLES` is the most that `cortex_m::asm::delay` counts in a microsecond: the core's MHz on
/// an M4, twice that on an M7, which needs one cycle for a loop that counts two.
#[derive(Debug, Clone, Copy, Default)]
pub struct CycleDelay<const CYCLES: u32>;

impl<const CYCLES: u32> DelayNs for CycleDelay<CYCLES> {
    #[inline]
    fn delay_ns(&mut self, ns: u32) {
        // At 960 cycles per microsecond it saturates at 4 ms, more than any driver here requests.
        cortex_m::asm::delay(ns.saturating_mul(CYCLES) / 1000 + 1);
    }
}
