//! Files of the emulator's working folder, and the end of the run.
//!
//! ARM semihosting calls (ARM IHI 0074), without a panic path: every failure is an [`Exit`] code.

#![allow(unsafe_code)] // A semihosting call passes raw addresses to the emulator.

use cortex_m_semihosting::{nr, syscall};

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
    /// 20: tables or settings are not what specgen wrote.
    Corrupt,
    /// 64 and more: `Config::from_words` refuses the word of that index, 0 to 63.
    ConfigRefused(u32),
}

impl Exit {
    fn status(self) -> u32 {
        match self {
            Self::Done => 0,
            Self::NoConfig => 10,
            Self::ConfigSize => 11,
            Self::NoInput => 12,
            Self::InputSize => 13,
            Self::CannotWrite => 14,
            Self::Fault => 15,
            Self::Corrupt => 20,
            // An exit status of the host has eight bits.
            Self::ConfigRefused(word) => 64 + word % 64,
        }
    }
}

/// Ends the emulator with that exit status.
pub fn exit(code: Exit) -> ! {
    const SYS_EXIT_EXTENDED: usize = 0x20;
    const APPLICATION_EXIT: u32 = 0x2_0026;
    let block = [APPLICATION_EXIT, code.status()];
    loop {
        // SAFETY: SYS_EXIT_EXTENDED reads the two words of the block and does not come back.
        unsafe { cortex_m_semihosting::syscall1(SYS_EXIT_EXTENDED, block.as_ptr() as usize) };
    }
}

/// Opens what has that `name`, which ends with a zero byte, on the emulator's host; its handle.
pub fn open(name: &'static [u8], mode: usize) -> Option<usize> {
    let length = name.len().saturating_sub(1);
    // SAFETY: SYS_OPEN reads `length` bytes and the zero byte at `name`.
    let handle = unsafe { syscall!(OPEN, name.as_ptr(), mode, length) };
    (handle != usize::MAX).then_some(handle)
}

/// An open file of the emulator's host.
pub struct File {
    handle: usize,
}

impl File {
    /// Opens a file for reading; `name` ends with a zero byte.
    pub fn open(name: &'static [u8]) -> Option<Self> {
        Some(Self { handle: open(name, nr::open::R_BINARY)? })
    }

    /// Creates a file, or empties it; `name` ends with a zero byte.
    pub fn create(name: &'static [u8]) -> Option<Self> {
        Some(Self { handle: open(name, nr::open::W_TRUNC_BINARY)? })
    }

    /// Fills `words` (little endian) as far as the file goes; returns the bytes read.
    pub fn read(&self, words: &mut [u64]) -> usize {
        let size = size_of_val(words);
        let start = words.as_mut_ptr().cast::<u8>();
        let mut done = 0;
        while done < size {
            // SAFETY: at most `size - done` bytes are written, all within `words`; any bit pattern is a u64.
            let missing = unsafe { syscall!(READ, self.handle, start.add(done), size - done) };
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
        // SAFETY: SYS_WRITE reads the bytes of `words`.
        unsafe { syscall!(WRITE, self.handle, words.as_ptr(), size_of_val(words)) == 0 }
    }

    /// Closes the file; false if the host could not store all of it.
    pub fn close(self) -> bool {
        // SAFETY: the handle came from SYS_OPEN and is not used again.
        unsafe { syscall!(CLOSE, self.handle) == 0 }
    }
}
