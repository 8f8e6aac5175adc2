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
/// Modes of opening a file: "rb" and "wb" of C.
pub const FOR_READING: usize = 1;
pub const FOR_WRITING: usize = 5;

/// Performs one operation with its parameter words.
///
/// # Safety
/// The words must be valid for the operation, as must the memory that it reads or writes.
unsafe fn call(operation: usize, words: &[usize]) -> usize {
    let result;
    // SAFETY: guaranteed by the caller; the emulator changes only memory named by the words.
    unsafe {
        asm!("bkpt #0xab", inout("r0") operation => result, in("r1") words.as_ptr(), options(nostack, preserves_flags));
    }
    result
}

/// Reads at most `length` bytes. Returns the number of bytes not read.
///
/// # Safety
/// `start` may be written for `length` bytes.
pub unsafe fn read(handle: usize, start: *mut u8, length: usize) -> usize {
    // SAFETY: guaranteed by the caller.
    unsafe { call(READ, &[handle, start as usize, length]) }
}

/// Writes bytes. Returns the number of bytes not written.
///
/// # Safety
/// `start` may be read for `length` bytes.
pub unsafe fn write(handle: usize, start: *const u8, length: usize) -> usize {
    // SAFETY: guaranteed by the caller.
    unsafe { call(WRITE, &[handle, start as usize, length]) }
}

/// Reason of the end of a run: the emulator's exit status. `codegen/toolchain/src/emulator.rs` of specgen has the messages.
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
    /// 16: the machine of `firmware/tick` stopped running.
    #[allow(dead_code)] // Not of `replay`.
    NotRunning,
    /// 20: tables or settings differ from those that specgen wrote.
    Corrupt,
    /// 64 and above: `Config::from_words` refuses the word with that index, 0 to 63.
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
        // SAFETY: it reads the two words and does not return.
        unsafe { call(EXIT_EXTENDED, &[APPLICATION_EXIT, code.status()]) };
    }
}

/// Opens the file `name`, which ends with a zero byte, on the emulator's host. Returns its handle.
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

    /// Fills `words` (little endian) up to the end of the file. Returns the bytes read.
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

    /// Appends `words` (little endian); false if not all could be written.
    pub fn write(&self, words: &[u64]) -> bool {
        // SAFETY: the words are read as bytes.
        unsafe { write(self.handle, words.as_ptr().cast(), size_of_val(words)) == 0 }
    }

    /// Closes the file; false if the host could not store all of it.
    pub fn close(self) -> bool {
        // SAFETY: the handle came from opening and is not used again.
        unsafe { call(CLOSE, &[self.handle]) == 0 }
    }
}
