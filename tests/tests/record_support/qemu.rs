//! Stands in for `qemu/src/main.rs` in the test `record`: supervised ticks with a recorder, the machine as words after every
//! tick, and what each costs. Reads and writes the files of the replay harness; rows are those of the supervised tick.

#![no_std]
#![no_main]
#![allow(dead_code, unsafe_code)] // The modules are those of the image; functions are called from assembly that counts them.

mod instructions;
mod panic;
mod semihosting;
mod start;
mod stats;

use controller::snapshot::recorder::{Recorder, Settings};
use controller::snapshot::{MACHINE_STATE_WORDS, RECORD_LAYOUT, supervise_recorded};
use controller::supervised::{MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, Machine, MachineInput, MachineOutput, machine_at_reset, machine_output_words, supervise};
use controller::{CONFIG_WORDS, Config};
use core::mem::MaybeUninit;
use instructions::InstructionCounter;
use semihosting::{Exit, File, exit};
use stats::Stage;

const BATCH: usize = 64;
/// Words of a block; the host's test has the same.
const BLOCK: usize = 8192;

extern "C" fn main() -> ! {
    exit(match replay() {
        Ok(()) => Exit::Done,
        Err(code) => code,
    })
}

fn replay() -> Result<(), Exit> {
    let mut counter = InstructionCounter::new();
    let self_test = counter.self_test();
    let config = read_config()?;
    let input = File::open(b"input.bin\0").ok_or(Exit::NoInput)?;
    let output = File::create(b"output.bin\0").ok_or(Exit::CannotWrite)?;

    let mut memory = [0; 2 * BLOCK];
    let mut recorder = Recorder::new(&mut memory, 2, RECORD_LAYOUT).map_err(|_| Exit::ConfigSize)?;
    recorder.start(Settings::STREAM);
    let mut words = [0; MACHINE_STATE_WORDS];
    let mut machine = machine_at_reset();
    let mut stages = [Stage::new("step"), Stage::new("recorded"), Stage::new("opening"), Stage::new("save"), Stage::new("digest")];
    let mut rows = [[0; MACHINE_INPUT_WORDS]; BATCH];
    let mut results = [[0; MACHINE_OUTPUT_WORDS + 3]; BATCH];
    let mut ticks: u64 = 0;
    loop {
        let bytes = input.read(rows.as_flattened_mut());
        let count = bytes / size_of::<[u64; MACHINE_INPUT_WORDS]>();
        if count == 0 {
            break;
        }
        for (row, result) in rows.iter().zip(&mut results).take(count) {
            let tick_input = MachineInput::from_words(row);
            let opens = recorder.opens();
            let mut twin = machine;
            let (_, plain) = call(&mut counter, specgen_step as *const (), &config, &mut twin, &tick_input, core::ptr::null_mut());
            stages[0].add(plain);
            let place = (&raw mut recorder).cast();
            let (out, cost) = call(&mut counter, specgen_recorded as *const (), &config, &mut machine, &tick_input, place);
            stages[if opens { 2 } else { 1 }].add(cost);
            // SAFETY: both are C functions of these references.
            unsafe {
                let machine_at = (&raw const machine) as usize;
                stages[3].add(counter.measure_call(specgen_save as *const (), [machine_at, (&raw mut words) as usize, 0, 0]));
                stages[4].add(counter.measure_call(specgen_digest as *const (), [machine_at, 0, 0, 0]));
            }
            // Every so often the machine goes on as the one that its words give.
            if ticks % 97 == 0 {
                machine = Machine::load(&words).map_err(|invalid| Exit::ConfigRefused(invalid.word))?;
            }
            let all = hash(&words);
            let block = recorder.block(0).map_or(0, hash);
            recorder.release();
            let [outputs @ .., of_words, of_block, digest] = result;
            for (slot, word) in outputs.iter_mut().zip(machine_output_words(&out, &machine)) {
                *slot = word;
            }
            *of_words = all;
            *of_block = block;
            *digest = machine.digest();
            ticks += 1;
        }
        if !output.write(results.get(..count).unwrap_or_default().as_flattened()) {
            return Err(Exit::CannotWrite);
        }
    }
    let sizes =
        [CONFIG_WORDS, MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS + 2, size_of::<Machine>(), size_of::<Config>()];
    stats::finish(output, &counter, self_test, ticks, sizes, [0, 0], &stages)
}

/// The host's test has the same.
fn hash(words: &[u64]) -> u64 {
    let mut sum: u64 = 0;
    for word in words {
        sum = (sum ^ *word).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    }
    sum
}

fn read_config() -> Result<Config, Exit> {
    let file = File::open(b"config.bin\0").ok_or(Exit::NoConfig)?;
    let mut words = [0; CONFIG_WORDS];
    if file.read(&mut words) != size_of::<[u64; CONFIG_WORDS]>() {
        return Err(Exit::ConfigSize);
    }
    Config::from_words(&words).map_err(|error| Exit::ConfigRefused(error.word))
}

/// What a counted tick takes besides the machine.
#[repr(C)]
struct More<'a> {
    config: &'a Config,
    input: &'a MachineInput,
    recorder: *mut core::ffi::c_void,
}

#[inline(never)]
fn call(
    counter: &mut InstructionCounter,
    function: *const (),
    config: &Config,
    machine: &mut Machine,
    input: &MachineInput,
    recorder: *mut core::ffi::c_void,
) -> (MachineOutput, u32) {
    let mut output = MaybeUninit::<MachineOutput>::uninit();
    let more = More { config, input, recorder };
    let arguments = [(&raw mut output) as usize, (&raw mut *machine) as usize, (&raw const more) as usize, 0];
    // SAFETY: both functions write the result through the first and take the other two.
    unsafe {
        let cost = counter.measure_call(function, arguments);
        (output.assume_init(), cost)
    }
}

#[inline(never)]
#[allow(improper_ctypes_definitions)]
extern "C" fn specgen_step(output: &mut MaybeUninit<MachineOutput>, machine: &mut Machine, more: &More<'_>) {
    output.write(supervise(more.config, machine, more.input));
}

#[inline(never)]
#[allow(improper_ctypes_definitions)]
extern "C" fn specgen_recorded(output: &mut MaybeUninit<MachineOutput>, machine: &mut Machine, more: &More<'_>) {
    // SAFETY: `replay` passes its recorder, and nothing else uses it meanwhile.
    let recorder = unsafe { &mut *more.recorder.cast::<Recorder<'_>>() };
    output.write(supervise_recorded(more.config, machine, more.input, recorder));
}

#[inline(never)]
#[allow(improper_ctypes_definitions)]
extern "C" fn specgen_save(machine: &Machine, words: &mut [u64; MACHINE_STATE_WORDS]) {
    machine.save(words);
}

#[inline(never)]
#[allow(improper_ctypes_definitions)]
extern "C" fn specgen_digest(machine: &Machine) -> u64 {
    machine.digest()
}
