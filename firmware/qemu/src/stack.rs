//! Stack use, by painting.
//!
//! The words below the stack pointer are filled with a pattern; after the code has run, the lowest changed word gives the depth.
//! No interrupt is enabled, so nothing else writes there.

#![allow(unsafe_code)] // Writes and reads memory below the stack pointer.

use core::arch::asm;
use core::mem::MaybeUninit;
use core::sync::atomic::{Ordering, compiler_fence};

use crate::instructions::InstructionCounter;

/// Size of the painted area below the stack pointer, bytes: 8 KiB, a multiple of 4.
/// A use of this much or more is reported as exactly this much.
pub const WINDOW: usize = 8192;

const PAINT: u32 = 0x5AFE_C0DE;

/// Larger results are returned through memory of the caller in the C ABI, whatever their fields.
const LARGEST_RESULT_IN_REGISTERS: usize = 32;

/// Calls a C function. Returns its result, its instructions and, if `painted`, its stack use, bytes; else 0. Not inlined, so that the
/// stack pointer does not change around the call.
///
/// # Safety
/// `function` returns an `R`, so it first takes the address of the result, then the three `arguments`.
#[inline(never)]
pub unsafe fn measure<R>(
    counter: &mut InstructionCounter,
    function: *const (),
    arguments: [usize; 3],
    painted: bool,
) -> (R, u32, usize) {
    const { assert!(size_of::<R>() > LARGEST_RESULT_IN_REGISTERS) };
    let mut result = MaybeUninit::<R>::uninit();
    let [first, second, third] = arguments;
    let arguments = [(&raw mut result) as usize, first, second, third];
    // SAFETY: guaranteed by the caller; the function writes the result.
    unsafe {
        let (instructions, depth) = if painted {
            measure_depth(|| counter.measure_call(function, arguments))
        } else {
            (counter.measure_call(function, arguments), 0)
        };
        (result.assume_init(), instructions, depth)
    }
}

/// Runs `f` and returns the bytes that it used below the stack pointer of the enclosing function.
#[inline(always)]
pub fn measure_depth<T>(f: impl FnOnce() -> T) -> (T, usize) {
    let top: usize;
    // In assembly, because a called function would paint over its own frame.
    // SAFETY: the words below the stack pointer are unused while no interrupt is enabled, and the stack is much larger than
    // WINDOW.
    unsafe {
        asm!(
            "mov {top}, sp",
            "sub {low}, {top}, {window}",
            "mov {word}, {top}",
            "2:",
            "str {paint}, [{word}, #-4]!",
            "cmp {word}, {low}",
            "bhi 2b",
            top = out(reg) top,
            low = out(reg) _,
            word = out(reg) _,
            paint = in(reg) PAINT,
            window = in(reg) WINDOW,
        );
    }
    let value = f();
    compiler_fence(Ordering::SeqCst);
    let mut word = top - WINDOW;
    // SAFETY: aligned words of RAM, read as volatile because other code wrote them.
    while word < top && unsafe { (word as *const u32).read_volatile() } == PAINT {
        word += 4;
    }
    (value, top - word)
}
