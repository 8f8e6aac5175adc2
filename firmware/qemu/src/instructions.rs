//! Exact instruction counts from SysTick under `-icount shift=10`.
//!
//! With that option every instruction takes 2^10 ns of virtual time. SysTick counts the 25 MHz core clock, 40 ns per count, so one
//! instruction is 25.6 counts, and the count gives the exact number of instructions. Its 24 bits are enough for 655,000
//! instructions. Instructions are not cycles: an M7 issues up to two per cycle.
//!
//! The two readings and the call between them are one piece of assembly, so that the compiler cannot insert anything: the count
//! is that of the called function without call and return.

#![allow(unsafe_code)] // Assembly, and calls from it.

use core::arch::{asm, naked_asm};

/// SysTick's registers: control and status, reload value, current value.
const CONTROL: *mut u32 = 0xe000_e010 as *mut u32;
const START: *mut u32 = 0xe000_e014 as *mut u32;
const CURRENT: *mut u32 = 0xe000_e018 as *mut u32;
/// Bits of the control register: enable, core clock; has counted to zero since it was last read.
const COUNTS: u32 = 1;
const OF_CORE: u32 = 1 << 2;
const WRAPPED: u32 = 1 << 16;
/// 24 bits.
const RELOAD: u32 = 0x00ff_ffff;
/// Period of the core clock of the AN500 and the AN386, ns.
const NANOSECONDS_PER_COUNT: u32 = 40;
/// 2^10 ns, from `shift=10`.
const NANOSECONDS_PER_INSTRUCTION: u32 = 1024;

/// Instructions measured for 0, 1, 100 and 1000 `nop`s. Any other result means that the emulator was not run with
/// `-icount shift=10` and counts are invalid.
pub type SelfTest = [u64; 4];

/// Counts the instructions of a piece of code.
pub struct InstructionCounter {
    /// Instructions measured for an empty function: the call, its return, one reading.
    overhead: u32,
    /// Measurements that overflowed the 24 bits.
    overflows: u64,
}

impl InstructionCounter {
    /// Starts the timer (without interrupt) and measures the overhead with an empty function.
    pub fn new() -> Self {
        // SAFETY: registers of the core that nothing else uses.
        unsafe {
            START.write_volatile(RELOAD);
            CURRENT.write_volatile(0);
            CONTROL.write_volatile(COUNTS | OF_CORE);
        }
        let mut counter = Self { overhead: 0, overflows: 0 };
        // SAFETY: the function does nothing.
        counter.overhead = unsafe { counter.measure_call(no_nops as *const (), [0; 4]) };
        counter
    }

    /// Calls `function` and counts its instructions without the return. Pushes nothing onto the stack.
    ///
    /// # Safety
    /// It must be a function of the C ABI with at most four words in registers, and `arguments` must be valid for it.
    #[inline(always)]
    pub unsafe fn measure_call(&mut self, function: *const (), arguments: [usize; 4]) -> u32 {
        let (start, end): (u32, u32);
        // SAFETY: resets and reads the timer; the caller guarantees that the call is valid.
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

    /// Instructions measured for an empty function, which are subtracted from every count.
    pub fn overhead(&self) -> u32 {
        self.overhead
    }

    /// Measurements of more than 655,000 instructions, which are wrong.
    pub fn overflows(&self) -> u64 {
        self.overflows
    }

    /// Counts `nop`s, see [`SelfTest`].
    pub fn self_test(&mut self) -> SelfTest {
        let mut count = |function: unsafe extern "C" fn()| {
            // SAFETY: the function contains only `nop`s.
            u64::from(unsafe { self.measure_call(function as *const (), [0; 4]) })
        };
        [count(no_nops), count(one_nop), count(hundred_nops), count(thousand_nops)]
    }
}

// SAFETY: these four take no arguments, change no register, and return.
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
