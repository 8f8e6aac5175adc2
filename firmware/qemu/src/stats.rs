//! `stats.bin`: the measurements, as little-endian 64-bit words. This table is the only
//! description of the format; `codegen/toolchain/src/replay.rs` of specgen reads it and refuses other versions.
//!
//! | word | meaning |
//! | --- | --- |
//! | 0 | the bytes `SPECSTAT` |
//! | 1 | layout version, 1 |
//! | 2 | ticks replayed |
//! | 3, 4, 5 | CONFIG_WORDS, INPUT_WORDS, OUTPUT_WORDS of the controller |
//! | 6, 7 | bytes of `State`, bytes of `Config` |
//! | 8 | peak stack use of one `step`, bytes |
//! | 9 | painted window, bytes: word 8 at this value means "this or more" |
//! | 10 | overhead subtracted from every count, instructions |
//! | 11 to 14 | counted for 0, 1, 100, 1000 `nop`s |
//! | 15 | measurements that overflowed |
//! | 16 | number of stages S; then S records of six words |
//! | +0, +1 | stage name, 16 bytes of ASCII, zero padded |
//! | +2 | calls |
//! | +3, +4, +5 | instructions per call: smallest, sum over the calls, largest |

use crate::instructions::{InstructionCounter, SelfTest};
use crate::semihosting::{Exit, File};

const MAGIC: u64 = u64::from_le_bytes(*b"SPECSTAT");
const VERSION: u64 = 1;

/// Instruction counts of one stage.
#[derive(Clone, Copy)]
pub struct Stage {
    name: [u8; 16],
    calls: u64,
    smallest: u64,
    sum: u64,
    largest: u64,
}

impl Stage {
    /// No calls yet. `name` is ASCII and truncated to 16 bytes.
    pub const fn new(name: &str) -> Self {
        let mut padded = [0; 16];
        let bytes = name.as_bytes();
        let mut i = 0;
        while i < bytes.len() && i < padded.len() {
            padded[i] = bytes[i];
            i += 1;
        }
        Self { name: padded, calls: 0, smallest: u64::MAX, sum: 0, largest: 0 }
    }

    /// Adds one call with so many instructions.
    pub fn add(&mut self, instructions: u32) {
        let instructions = u64::from(instructions);
        self.calls += 1;
        self.sum += instructions;
        if instructions < self.smallest {
            self.smallest = instructions;
        }
        if instructions > self.largest {
            self.largest = instructions;
        }
    }

    /// Its name.
    #[allow(dead_code)] // `pil` says it over the link.
    pub fn name(&self) -> &str {
        let length = self.name.iter().position(|byte| *byte == 0).unwrap_or(self.name.len());
        core::str::from_utf8(self.name.get(..length).unwrap_or_default()).unwrap_or_default()
    }

    /// Calls; fewest instructions of a call, sum over all calls, most of a call.
    pub fn counts(&self) -> [u64; 4] {
        [self.calls, if self.calls == 0 { 0 } else { self.smallest }, self.sum, self.largest]
    }

    fn words(&self) -> [u64; 6] {
        let name = u128::from_le_bytes(self.name);
        let [calls, smallest, sum, largest] = self.counts();
        [name as u64, (name >> 64) as u64, calls, smallest, sum, largest]
    }
}

/// Closes `output` and writes all of it: `sizes` are words 3 to 7, `stack` words 8 and 9.
pub fn finish(
    output: File,
    counter: &InstructionCounter,
    self_test: SelfTest,
    ticks: u64,
    sizes: [usize; 5],
    stack: [usize; 2],
    stages: &[Stage],
) -> Result<(), Exit> {
    let file = File::create(b"stats.bin\0").ok_or(Exit::CannotWrite)?;
    let mut good = file.write(&[MAGIC, VERSION, ticks]);
    good &= file.write(&sizes.map(|size| size as u64));
    good &= file.write(&stack.map(|bytes| bytes as u64));
    good &= file.write(&[u64::from(counter.overhead())]);
    good &= file.write(&self_test);
    good &= file.write(&[counter.overflows(), stages.len() as u64]);
    for stage in stages {
        good &= file.write(&stage.words());
    }
    if good && file.close() && output.close() { Ok(()) } else { Err(Exit::CannotWrite) }
}
