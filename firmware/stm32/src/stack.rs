//! Peak stack use.

#![allow(unsafe_code)] // Memory of the stack is read.

use core::ptr::{self, addr_of};

// SAFETY: symbols of the memory map; only their addresses are used.
unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

/// Peak bytes in use, and size of the stack, from the words that no longer have the value written at start (`paint-stack` of
/// `cortex-m-rt`). Words that a frame skipped, or wrote with that value, are not detected.
pub fn used() -> [u32; 2] {
    let (end, start) = (addr_of!(_stack_end), addr_of!(_stack_start));
    let size = (start as u32).wrapping_sub(end as u32);
    let mut free = 0;
    while free < size {
        // SAFETY: aligned, and within the memory of the stack, which can always be read.
        let word = unsafe { ptr::read_volatile(end.wrapping_byte_add(free as usize)) };
        if word != cortex_m_rt::STACK_PAINT_VALUE {
            break;
        }
        free += size_of::<u32>() as u32;
    }
    [size.saturating_sub(free), size]
}
