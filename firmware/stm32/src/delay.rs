//! Short waits by counting cycles.

use embedded_hal::delay::DelayNs;

/// Waits at least as long as asked for. `CYCLES` is what `cortex_m::asm::delay` gets through in a microsecond at most: the
/// core's MHz on an M4, twice that on an M7, which takes one cycle for a turn of two.
#[derive(Debug, Clone, Copy, Default)]
pub struct CycleDelay<const CYCLES: u32>;

impl<const CYCLES: u32> DelayNs for CycleDelay<CYCLES> {
    #[inline]
    fn delay_ns(&mut self, ns: u32) {
        // At 960 cycles a microsecond it saturates at 4 ms, more than any driver here asks for at once.
        cortex_m::asm::delay(ns.saturating_mul(CYCLES) / 1000 + 1);
    }
}
