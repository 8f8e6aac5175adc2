//! Replays recorded ticks through the emitted controller on an emulated Cortex-M.
//!
//! Reads `config.bin` (CONFIG_WORDS words) and `input.bin` (rows of INPUT_WORDS words) from the emulator's
//! working folder; writes `output.bin` (rows of OUTPUT_WORDS words and the digest of the state after the
//! tick) and `stats.bin` (see [`stats`]). If there is a `machine.bin`, it replays supervised ticks from that instead, see
//! [`machine`]. All words are 64 bits, little endian. No control decision is made here.

#![no_std]
#![no_main]

mod counted;
mod instructions;
mod machine;
mod panic;
mod semihosting;
mod stack;
mod stages;
mod start;
mod stats;

use controller::{
    CONFIG_WORDS, Config, INPUT_WORDS, OUTPUT_WORDS, State, TickInput, TickOutput, output_words, state_at_reset, step,
};
use instructions::InstructionCounter;
use semihosting::{Exit, File, exit};
use stages::Stages;

/// The target of this image, padded to the length of a board's name.
static BOARD: [u8; 25] = *b"specgen-board: qemu     \n";
/// Ticks per file access.
const BATCH: usize = 256;

extern "C" fn main() -> ! {
    // Keeps the symbol in the image.
    core::hint::black_box(&raw const BOARD);
    exit(match replay() {
        Ok(()) => Exit::Done,
        Err(code) => code,
    })
}

/// The whole run: files in, files out.
#[allow(unsafe_code)] // The step is called from assembly that counts it.
fn replay() -> Result<(), Exit> {
    if !controller::integrity::intact() {
        return Err(Exit::Corrupt);
    }
    let mut counter = InstructionCounter::new();
    let self_test = counter.self_test();

    let config = read_config()?;
    if let Some(input) = File::open(b"machine.bin\0") {
        return machine::replay(&mut counter, self_test, &config, &input);
    }
    let input = File::open(b"input.bin\0").ok_or(Exit::NoInput)?;
    let output = File::create(b"output.bin\0").ok_or(Exit::CannotWrite)?;

    let mut state = state_at_reset();
    let mut stages = Stages::new();
    let mut rows = [[0; INPUT_WORDS]; BATCH];
    let mut results = [[0; OUTPUT_WORDS + 1]; BATCH];
    let mut ticks = 0;
    let mut deepest = 0;
    loop {
        let bytes = input.read(rows.as_flattened_mut());
        let count = bytes / size_of::<[u64; INPUT_WORDS]>();
        if count * size_of::<[u64; INPUT_WORDS]>() != bytes {
            return Err(Exit::InputSize);
        }
        if count == 0 {
            break;
        }
        for (row, result) in rows.iter().zip(&mut results).take(count) {
            let tick_input = TickInput::from_words(row);
            let due = is_due(ticks);
            if due {
                stages.measure(&mut counter, &config, &state, &tick_input);
            }
            let arguments = [(&raw const config) as usize, (&raw mut state) as usize, (&raw const tick_input) as usize];
            // SAFETY: a C function of these three references.
            let (tick_output, instructions, depth) =
                unsafe { stack::measure::<TickOutput>(&mut counter, specgen_step as *const (), arguments, due) };
            stages.add_step(instructions);
            if depth > deepest {
                deepest = depth;
            }
            let words = output_words(&tick_output, &state);
            for (slot, word) in result.iter_mut().zip(words) {
                *slot = word;
            }
            result[OUTPUT_WORDS] = state.digest();
            ticks += 1;
        }
        if !output.write(results.get(..count).unwrap_or_default().as_flattened()) {
            return Err(Exit::CannotWrite);
        }
    }

    let sizes = [CONFIG_WORDS, INPUT_WORDS, OUTPUT_WORDS, size_of::<State>(), size_of::<Config>()];
    stats::finish(output, &counter, self_test, ticks, sizes, [deepest, stack::WINDOW], stages.all())
}

fn read_config() -> Result<Config, Exit> {
    let file = File::open(b"config.bin\0").ok_or(Exit::NoConfig)?;
    // One word more than expected, to detect a file that is too long.
    let mut words = [0; CONFIG_WORDS + 1];
    if file.read(&mut words) != size_of::<[u64; CONFIG_WORDS]>() {
        return Err(Exit::ConfigSize);
    }
    let words = words.first_chunk().ok_or(Exit::ConfigSize)?;
    Config::from_words(words).map_err(|error| Exit::ConfigRefused(error.word))
}

/// Whether stages and stack are measured on this tick. That takes longer than the tick, so it is done on every eighth of the first
/// 20,000 and every 64th of later ones.
const fn is_due(tick: u64) -> bool {
    tick.is_multiple_of(if tick < 20_000 { 8 } else { 64 })
}

/// The function to which instruction count, painted stack and static stack bound refer.
#[unsafe(no_mangle)]
#[inline(never)]
#[allow(unsafe_code)] // `no_mangle`: specgen looks this symbol up in the image.
#[allow(improper_ctypes_definitions)] // Caller and callee are compiled together; only the registers matter.
extern "C" fn specgen_step(config: &Config, state: &mut State, input: &TickInput) -> TickOutput {
    step(config, state, input)
}
