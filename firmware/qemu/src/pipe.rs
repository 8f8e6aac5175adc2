//! Named pipes of the emulator's working folder, with the host at their other ends.
//!
//! A read blocks until the host has sent something. Meanwhile processor and virtual time are stopped: the run is in lock-step with
//! the host, and its instruction counts do not depend on the waiting time.

#![allow(unsafe_code)] // A semihosting call passes raw addresses to the emulator.

use crate::semihosting::{FOR_READING, FOR_WRITING, open, read, write};

/// An open pipe.
pub struct Pipe {
    handle: usize,
}

impl Pipe {
    /// Opens the read end; `name` ends with a zero byte. Waits for the host.
    pub fn reader(name: &'static [u8]) -> Option<Self> {
        Some(Self { handle: open(name, FOR_READING)? })
    }

    /// Opens the write end; `name` ends with a zero byte. Waits for the host.
    pub fn writer(name: &'static [u8]) -> Option<Self> {
        Some(Self { handle: open(name, FOR_WRITING)? })
    }

    /// Waits for bytes and reads those available. Returns their number; 0 if the host has closed its end.
    pub fn receive(&self, bytes: &mut [u8]) -> usize {
        let size = bytes.len();
        // SAFETY: at most `size` bytes are written, all within `bytes`.
        let missing = unsafe { read(self.handle, bytes.as_mut_ptr(), size) };
        size.saturating_sub(missing)
    }

    /// Sends all of the bytes; false if the host has closed its end.
    pub fn send(&self, bytes: &[u8]) -> bool {
        // SAFETY: the bytes are only read.
        unsafe { write(self.handle, bytes.as_ptr(), bytes.len()) == 0 }
    }
}
