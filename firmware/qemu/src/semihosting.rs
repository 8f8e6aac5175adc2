//! Files of the emulator's working folder, and the end of the run.
//!
//! ARM semihosting calls (ARM IHI 0074), without a panic path: every failure is an [`Exit`] code.

#![allow(unsafe_code)] // A semihosting call passes raw addresses to the emulator.

use core::arch::asm;

/// Operations of the emulator.
const OPEN: usize = 0x01;
const CLOSE: usize = 0x02;
const WRITE: usize = 0x05;
const READ: usize = 0x06;
const EXIT_EXTENDED: usize = 0x20;
/// How a file is opened: as C's "rb" and "wb".
pub const FOR_READING: usize = 1;
pub const FOR_WRITING: usize = 5;

/// One operation with its words.
///
/// # Safety
/// The words are what the operation expects: memory that it may read or write.
unsafe fn call(operation: usize, words: &[usize]) -> usize {
    let result;
    // SAFETY: the caller's promise; the emulator changes nothing but what the words name.
    unsafe {
        asm!("bkpt #0xab", inout("r0") operation => result, in("r1") words.as_ptr(), options(nostack, preserves_flags));
    }
    result
}

/// Reads at most `length` bytes; how many did not come.
///
/// # Safety
/// `start` may be written for `length` bytes.
pub unsafe fn read(handle: usize, start: *mut u8, length: usize) -> usize {
    // SAFETY: the caller's promise.
    unsafe { call(READ, &[handle, start as usize, length]) }
}

/// Writes bytes; how many were not taken.
///
/// # Safety
/// `start` may be read for `length` bytes.
pub unsafe fn write(handle: usize, start: *const u8, length: usize) -> usize {
    // SAFETY: the caller's promise.
    unsafe { call(WRITE, &[handle, start as usize, length]) }
}

/// Why the run ended: the emulator's exit status. `codegen/toolchain/src/emulator.rs` of specgen has the words.
#[derive(Clone, Copy)]
pub enum Exit {
    /// 0: all ticks ran and all files are written.
    Done,
    /// 10: `config.bin` cannot be opened.
    NoConfig,
    /// 11: `config.bin` does not hold CONFIG_WORDS words.
    ConfigSize,
    /// 12: `input.bin` cannot be opened.
    NoInput,
    /// 13: `input.bin` ends within a row.
    InputSize,
    /// 14: `output.bin` or `stats.bin` cannot be written.
    CannotWrite,
    /// 15: the processor took a fault or an unexpected exception.
    Fault,
    /// 16: the machine of `firmware/tick` does not run on.
    #[allow(dead_code)] // Not of `replay`.
    NotRunning,
    /// 20: tables or settings are not what specgen wrote.
    Corrupt,
    /// 64 and more: `Config::from_words` refuses the word of that index, 0 to 63.
    ConfigRefused(usize),
}

impl Exit {
    fn status(self) -> usize {
        match self {
            Self::Done => 0,
            Self::NoConfig => 10,
            Self::ConfigSize => 11,
            Self::NoInput => 12,
            Self::InputSize => 13,
            Self::CannotWrite => 14,
            Self::Fault => 15,
            Self::NotRunning => 16,
            Self::Corrupt => 20,
            // An exit status of the host has eight bits.
            Self::ConfigRefused(word) => 64 + word % 64,
        }
    }
}

/// Ends the emulator with that exit status.
pub fn exit(code: Exit) -> ! {
    const APPLICATION_EXIT: usize = 0x2_0026;
    loop {
        // SAFETY: it reads the two words and does not come back.
        unsafe { call(EXIT_EXTENDED, &[APPLICATION_EXIT, code.status()]) };
    }
}

/// Opens what has that `name`, which ends with a zero byte, on the emulator's host; its handle.
pub fn open(name: &'static [u8], mode: usize) -> Option<usize> {
    let length = name.len().saturating_sub(1);
    // SAFETY: it reads `length` bytes and the zero byte at `name`.
    let handle = unsafe { call(OPEN, &[name.as_ptr() as usize, mode, length]) };
    (handle != usize::MAX).then_some(handle)
}

/// An open file of the emulator's host.
pub struct File {
    handle: usize,
}

impl File {
    /// Opens a file for reading; `name` ends with a zero byte.
    pub fn open(name: &'static [u8]) -> Option<Self> {
        Some(Self { handle: open(name, FOR_READING)? })
    }

    /// Creates a file, or empties it; `name` ends with a zero byte.
    pub fn create(name: &'static [u8]) -> Option<Self> {
        Some(Self { handle: open(name, FOR_WRITING)? })
    }

    /// Fills `words` (little endian) as far as the file goes; returns the bytes read.
    pub fn read(&self, words: &mut [u64]) -> usize {
        let size = size_of_val(words);
        let start = words.as_mut_ptr().cast::<u8>();
        let mut done = 0;
        while done < size {
            // SAFETY: at most `size - done` bytes are written, all within `words`; any bit pattern is a u64.
            let missing = unsafe { read(self.handle, start.add(done), size - done) };
            let end = size.saturating_sub(missing);
            if end <= done {
                break;
            }
            done = end;
        }
        done
    }

    /// Appends `words` (little endian); false if the file does not take them all.
    pub fn write(&self, words: &[u64]) -> bool {
        // SAFETY: they are read as bytes.
        unsafe { write(self.handle, words.as_ptr().cast(), size_of_val(words)) == 0 }
    }

    /// Closes the file; false if the host could not store all of it.
    pub fn close(self) -> bool {
        // SAFETY: the handle came from opening and is not used again.
        unsafe { call(CLOSE, &[self.handle]) == 0 }
    }
}
