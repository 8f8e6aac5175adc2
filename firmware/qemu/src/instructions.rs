//! Exact instruction counts from SysTick under `-icount shift=10`.
//!
//! There the emulator lets every instruction take 2^10 ns of virtual time. SysTick counts the 25 MHz core
//! clock, 40 ns a count, so one instruction is 25.6 counts and the count tells instructions apart exactly.
//! Its 24 bits hold 655,000 instructions. Instructions are not cycles: an M7 issues up to two in one.

#![allow(unsafe_code)] // `nop`s for the self-test.

use core::arch::asm;
use core::hint::black_box;
use core::sync::atomic::{Ordering, compiler_fence};
use cortex_m::peripheral::{SYST, syst::SystClkSource};

/// 24 bits.
const RELOAD: u32 = 0x00ff_ffff;
/// Period of the core clock of the AN500 and the AN386, ns.
const NANOSECONDS_PER_COUNT: u32 = 40;
/// 2^10 ns, from `shift=10`.
const NANOSECONDS_PER_INSTRUCTION: u32 = 1024;

/// Instructions measured for 0, 1, 100 and 1000 `nop`s: anything else than these four numbers says that the
/// emulator was not run with `-icount shift=10`, so that no count can be trusted.
pub type SelfTest = [u64; 4];

/// Counts the instructions of a piece of code.
pub struct InstructionCounter {
    timer: SYST,
    /// What an empty measurement costs, instructions.
    overhead: u32,
    /// Measurements that did not fit into the 24 bits.
    overflows: u64,
}

impl InstructionCounter {
    /// Starts the timer (no interrupt) and calibrates the overhead by an empty measurement.
    pub fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RELOAD);
        timer.clear_current();
        timer.enable_counter();
        let mut counter = Self {
            timer,
            overhead: 0,
            overflows: 0,
        };
        let (_, overhead) = counter.measure(|| ());
        counter.overhead = overhead;
        counter.overflows = 0;
        counter
    }

    /// Calls `f` and counts its instructions, the call included if it is not inlined.
    #[inline(always)]
    pub fn measure<T>(&mut self, f: impl FnOnce() -> T) -> (T, u32) {
        self.timer.clear_current();
        let start = SYST::get_current();
        // The fences pin loads and stores of `f` between the two readings, black_box its result.
        compiler_fence(Ordering::SeqCst);
        let value = black_box(f());
        compiler_fence(Ordering::SeqCst);
        let end = SYST::get_current();
        if self.timer.has_wrapped() {
            self.overflows += 1;
        }
        let counts = start.wrapping_sub(end) & RELOAD;
        let instructions = (counts * NANOSECONDS_PER_COUNT + NANOSECONDS_PER_INSTRUCTION / 2)
            / NANOSECONDS_PER_INSTRUCTION;
        (value, instructions.saturating_sub(self.overhead))
    }

    /// What an empty measurement costs and every other one is relieved of, instructions.
    pub fn overhead(&self) -> u32 {
        self.overhead
    }

    /// Measurements that took more than 655,000 instructions and are therefore wrong.
    pub fn overflows(&self) -> u64 {
        self.overflows
    }

    /// Counts `nop`s, see [`SelfTest`].
    pub fn self_test(&mut self) -> SelfTest {
        // SAFETY: `nop` does nothing.
        let one = self.measure(|| unsafe { asm!("nop") });
        let hundred = self.measure(|| unsafe { asm!(".rept 100", "nop", ".endr") });
        let thousand = self.measure(|| unsafe { asm!(".rept 1000", "nop", ".endr") });
        let none = self.measure(|| ());
        [none.1, one.1, hundred.1, thousand.1].map(u64::from)
    }
}
