//! Stack use, by painting.
//!
//! The words below the stack pointer are filled with a pattern; after the code has run, the lowest word
//! that changed tells how deep it went. No interrupt is enabled, so nothing else writes there.

#![allow(unsafe_code)] // Writes and reads memory below the stack pointer.

use core::arch::asm;
use core::sync::atomic::{Ordering, compiler_fence};

/// How far below the stack pointer the paint reaches, bytes: 8 KiB, a multiple of 4.
/// A use of this much or more is reported as exactly this much.
pub const WINDOW: usize = 8192;

const PAINT: u32 = 0x5AFE_C0DE;

/// Runs `f` and returns the bytes that it used below the stack pointer of the function this is inlined into.
#[inline(always)]
pub fn measure_depth<T>(f: impl FnOnce() -> T) -> (T, usize) {
    let top: usize;
    // In assembly, as a called function would paint over its own frame.
    // SAFETY: the words below the stack pointer belong to nobody while no interrupt is enabled, and
    // memory.x gives the stack far more than WINDOW.
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
