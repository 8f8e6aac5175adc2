//! An allocator that detects its use by a real-time thread.
//!
//! Every binary with a control loop installs it. It is the system's allocator with a counter of allocations,
//! reallocations and releases by a thread between [`enter`] and [`leave`]. The summary of every run has the count,
//! which must be 0.
#![allow(unsafe_code)] // An allocator is unsafe by its interface; every call is passed on as it came.

use core::alloc::{GlobalAlloc, Layout};
use core::cell::Cell;
use core::sync::atomic::{AtomicU64, Ordering};
use std::alloc::System;

thread_local! {
    // No destructor, and a constant initial value, so that reading it never allocates.
    static WATCHED: Cell<bool> = const { Cell::new(false) };
}
static NOTICED: AtomicU64 = AtomicU64::new(0);

/// The system's allocator with a counter. Install it with `#[global_allocator]`.
#[derive(Debug, Clone, Copy, Default)]
pub struct WatchedAllocator;

/// From now on the calling thread must not allocate or release memory.
pub fn enter() {
    WATCHED.set(true);
}

/// From now on it may.
pub fn leave() {
    WATCHED.set(false);
}

/// Allocations, reallocations and releases by threads that must not make them; always 0 if [`WatchedAllocator`] is not
/// installed.
#[must_use]
pub fn noticed() -> u64 {
    NOTICED.load(Ordering::Relaxed)
}

fn notice() {
    if WATCHED.get() {
        NOTICED.fetch_add(1, Ordering::Relaxed);
    }
}

// SAFETY: every call is passed to the system's allocator with its arguments unchanged.
unsafe impl GlobalAlloc for WatchedAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        notice();
        // SAFETY: the caller's duty.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        notice();
        // SAFETY: the caller's duty.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        notice();
        // SAFETY: the caller's duty.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        notice();
        // SAFETY: the caller's duty.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[global_allocator]
    static ALLOCATOR: WatchedAllocator = WatchedAllocator;

    #[test]
    fn an_allocation_is_noticed_between_enter_and_leave_and_only_there() {
        let before = noticed();
        drop(std::hint::black_box(Box::new(1)));
        assert_eq!(noticed(), before);
        enter();
        let kept = std::hint::black_box(Box::new(2));
        leave();
        assert_eq!(noticed(), before + 1);
        enter();
        drop(kept);
        leave();
        assert_eq!(noticed(), before + 2);
        // Other threads are not affected.
        enter();
        let count = noticed();
        leave();
        std::thread::spawn(|| drop(std::hint::black_box(vec![0_u8; 100]))).join().unwrap();
        assert_eq!(noticed(), count);
    }
}
