//! Exact instruction counts from SysTick under `-icount shift=10`.
//!
//! There the emulator lets every instruction take 2^10 ns of virtual time. SysTick counts the 25 MHz core
//! clock, 40 ns a count, so one instruction is 25.6 counts and the count tells instructions apart exactly.
//! Its 24 bits hold 655,000 instructions. Instructions are not cycles: an M7 issues up to two in one.
//!
//! The two readings and the call between them are one piece of assembly, so that the compiler cannot put
//! anything between: what is counted is the called function, without the call and the return.

#![allow(unsafe_code)] // Assembly, and calls from it.

use core::arch::{asm, naked_asm};

/// SysTick's registers: control and status, value to begin anew with, current value.
const CONTROL: *mut u32 = 0xe000_e010 as *mut u32;
const START: *mut u32 = 0xe000_e014 as *mut u32;
const CURRENT: *mut u32 = 0xe000_e018 as *mut u32;
/// In the control register: counts, of the core clock; has come to zero since it was read.
const COUNTS: u32 = 1;
const OF_CORE: u32 = 1 << 2;
const WRAPPED: u32 = 1 << 16;
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
    /// What measuring an empty function costs: the call, its return, one reading. Instructions.
    overhead: u32,
    /// Measurements that did not fit into the 24 bits.
    overflows: u64,
}

impl InstructionCounter {
    /// Starts the timer (no interrupt) and calibrates the overhead by an empty function.
    pub fn new() -> Self {
        // SAFETY: registers of the core, which nothing else uses.
        unsafe {
            START.write_volatile(RELOAD);
            CURRENT.write_volatile(0);
            CONTROL.write_volatile(COUNTS | OF_CORE);
        }
        let mut counter = Self { overhead: 0, overflows: 0 };
        // SAFETY: it does nothing.
        counter.overhead = unsafe { counter.measure_call(no_nops as *const (), [0; 4]) };
        counter
    }

    /// Calls `function` and counts its instructions, the return left out. Pushes nothing onto the stack.
    ///
    /// # Safety
    /// It must be a function of the C ABI that takes at most four words in registers, and these must be what it
    /// expects.
    #[inline(always)]
    pub unsafe fn measure_call(&mut self, function: *const (), arguments: [usize; 4]) -> u32 {
        let (start, end): (u32, u32);
        // SAFETY: resets and reads the timer; the call is the caller's promise.
        let control = unsafe {
            CURRENT.write_volatile(0);
            asm!(
                "ldr r4, [r8]",
                "blx r5",
                "ldr r5, [r8]",
                in("r8") CURRENT,
                inout("r5") function => end,
                out("r4") start,
                inout("r0") arguments[0] => _,
                inout("r1") arguments[1] => _,
                inout("r2") arguments[2] => _,
                inout("r3") arguments[3] => _,
                clobber_abi("C"),
            );
            CONTROL.read_volatile()
        };
        if control & WRAPPED != 0 {
            self.overflows += 1;
        }
        let counts = start.wrapping_sub(end) & RELOAD;
        let instructions =
            (counts * NANOSECONDS_PER_COUNT + NANOSECONDS_PER_INSTRUCTION / 2) / NANOSECONDS_PER_INSTRUCTION;
        instructions.saturating_sub(self.overhead)
    }

    /// What measuring an empty function costs and every other one is relieved of, instructions.
    pub fn overhead(&self) -> u32 {
        self.overhead
    }

    /// Measurements that took more than 655,000 instructions and are therefore wrong.
    pub fn overflows(&self) -> u64 {
        self.overflows
    }

    /// Counts `nop`s, see [`SelfTest`].
    pub fn self_test(&mut self) -> SelfTest {
        let mut count = |function: unsafe extern "C" fn()| {
            // SAFETY: it does nothing.
            u64::from(unsafe { self.measure_call(function as *const (), [0; 4]) })
        };
        [count(no_nops), count(one_nop), count(hundred_nops), count(thousand_nops)]
    }
}

// SAFETY: these four take nothing, leave every register but the program counter as it was, and return.
#[unsafe(naked)]
unsafe extern "C" fn no_nops() {
    naked_asm!("bx lr")
}

// SAFETY: as above.
#[unsafe(naked)]
unsafe extern "C" fn one_nop() {
    naked_asm!("nop", "bx lr")
}

// SAFETY: as above.
#[unsafe(naked)]
unsafe extern "C" fn hundred_nops() {
    naked_asm!(".rept 100", "nop", ".endr", "bx lr")
}

// SAFETY: as above.
#[unsafe(naked)]
unsafe extern "C" fn thousand_nops() {
    naked_asm!(".rept 1000", "nop", ".endr", "bx lr")
}
