//! The controller as a shared library with a C ABI.
//!
//! A simulator loads it and steps the same code that the microcontroller runs. The library is `no_std` and its panic
//! handler calls a function that does not exist: **it links only if no panic path remains** in the controller.
//!
//! The order of words is that of `controller::INPUT_NAMES`, `OUTPUT_NAMES`, `CONFIG_NAMES`. The caller provides memory for `Config`
//! and `State`, with the size and alignment from [`specgen_describe`].
//! Pointers are not checked: wrap the functions once in a safe language, and check [`specgen_abi_version`] first.
#![no_std]
#![deny(missing_docs)]

use core::mem::{align_of, size_of};

use controller::snapshot::MACHINE_STATE_WORDS;
use controller::supervised::{
    MACHINE_INPUT_WORDS, MACHINE_OUTPUT_WORDS, Machine, MachineInput, machine_at_reset, machine_output_words, supervise,
};
use controller::{CONFIG_WORDS, Config, INPUT_WORDS, OUTPUT_WORDS, State, TickInput, state_at_reset};
use specgen_runtime::Real;

/// Version of this interface.
const ABI_VERSION: u32 = 2;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // SAFETY: it is not defined, so code that calls it does not link.
    unsafe extern "C" {
        fn specgen_panic_path_remains() -> !;
    }
    // SAFETY: never linked; see the crate documentation.
    unsafe { specgen_panic_path_remains() }
}

/// Version of this interface; callers must refuse any version other than their own.
#[unsafe(no_mangle)]
pub extern "C" fn specgen_abi_version() -> u32 {
    ABI_VERSION
}

/// Description of this controller: `key=value` lines in UTF-8, those of `controller::DESCRIPTION` and `state_bytes`,
/// `state_align`, `config_bytes`, `config_align`, `machine_bytes`, `machine_align`, and
/// `machine_words`, the words of its snapshot.
///
/// # Safety
/// `text` and `length` point to writable memory. The text is valid while the library is loaded.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_describe(text: *mut *const u8, length: *mut usize) {
    // SAFETY: guaranteed by the caller.
    unsafe {
        text.write(DESCRIPTION.as_ptr());
        length.write(DESCRIPTION.len());
    }
}

/// Keys of the memory that the caller provides, with their values.
const MEMORY: [(&str, usize); 7] = [
    ("state_bytes=", size_of::<State>()),
    ("state_align=", align_of::<State>()),
    ("config_bytes=", size_of::<Config>()),
    ("config_align=", align_of::<Config>()),
    ("machine_bytes=", size_of::<Machine>()),
    ("machine_align=", align_of::<Machine>()),
    ("machine_words=", MACHINE_STATE_WORDS),
];
/// Decimal digits of each value, leading zeros included.
const DIGITS: usize = 8;
const DESCRIPTION_LENGTH: usize = {
    let mut length = controller::DESCRIPTION.len();
    let mut k = 0;
    while k < MEMORY.len() {
        length += MEMORY[k].0.len() + DIGITS + 1;
        k += 1;
    }
    length
};
static DESCRIPTION: [u8; DESCRIPTION_LENGTH] = describe();

/// The controller's own description, then the lines of [`MEMORY`]; evaluated at compile time.
const fn describe() -> [u8; DESCRIPTION_LENGTH] {
    let mut text = [b'\n'; DESCRIPTION_LENGTH];
    let mut end = append(&mut text, 0, controller::DESCRIPTION);
    let mut k = 0;
    while k < MEMORY.len() {
        let (key, mut value) = MEMORY[k];
        end = append(&mut text, end, key);
        let mut digit = DIGITS;
        while digit > 0 {
            digit -= 1;
            text[end + digit] = b'0' + (value % 10) as u8;
            value /= 10;
        }
        end += DIGITS + 1;
        k += 1;
    }
    text
}

const fn append(text: &mut [u8; DESCRIPTION_LENGTH], start: usize, piece: &str) -> usize {
    let mut k = 0;
    while k < piece.len() {
        text[start + k] = piece.as_bytes()[k];
        k += 1;
    }
    start + k
}

/// The spec's settings as words.
///
/// # Safety
/// `words` points to `CONFIG_WORDS` writable words.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_config_default(words: *mut u64) {
    // SAFETY: guaranteed by the caller.
    unsafe { words.cast::<[u64; CONFIG_WORDS]>().write(Config::new().to_words()) }
}

/// Whether words are a valid `Config`: 0, or one more than the index of the first word out of range.
///
/// # Safety
/// `words` points to `CONFIG_WORDS` words.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_config_check(words: *const u64) -> i32 {
    // SAFETY: guaranteed by the caller.
    match Config::from_words(&unsafe { words.cast::<[u64; CONFIG_WORDS]>().read() }) {
        Ok(_) => 0,
        Err(error) => error.word as i32 + 1,
    }
}

/// Makes a `Config` from words: returns 0, or one more than the index of the first word out of range (then `config` is
/// unchanged).
///
/// # Safety
/// `words` points to `CONFIG_WORDS` words, `config` to memory for a `Config`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_config_load(config: *mut u8, words: *const u64) -> i32 {
    // SAFETY: guaranteed by the caller.
    let words = unsafe { words.cast::<[u64; CONFIG_WORDS]>().read() };
    match Config::from_words(&words) {
        Ok(checked) => {
            // SAFETY: guaranteed by the caller.
            unsafe { config.cast::<Config>().write(checked) };
            0
        }
        Err(error) => error.word as i32 + 1,
    }
}

/// Puts a `State` at reset.
///
/// # Safety
/// `state` points to memory for a `State`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_state_reset(state: *mut u8) {
    // SAFETY: guaranteed by the caller.
    unsafe { state.cast::<State>().write(state_at_reset()) }
}

/// One control tick.
///
/// # Safety
/// `config` contains a loaded `Config`, `state` a `State` put at reset before; `input` points to `INPUT_WORDS` words,
/// `output` to `OUTPUT_WORDS` writable words. No two threads step the same state at once.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_step(config: *const u8, state: *mut u8, input: *const u64, output: *mut u64) {
    // SAFETY: guaranteed by the caller.
    let (config, state, input) =
        unsafe { (&*config.cast::<Config>(), &mut *state.cast::<State>(), &*input.cast::<[u64; INPUT_WORDS]>()) };
    let result = controller::step(config, state, &TickInput::from_words(input));
    let words = controller::output_words(&result, state);
    // SAFETY: guaranteed by the caller.
    unsafe { output.cast::<[u64; OUTPUT_WORDS]>().write(words) }
}

/// Fingerprint of a `State`.
///
/// # Safety
/// `state` contains a `State` put at reset before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_state_digest(state: *const u8) -> u64 {
    // SAFETY: guaranteed by the caller.
    unsafe { (*state.cast::<State>()).digest() }
}

/// Size of a `Machine`, the state of controller and supervisor, in bytes.
#[unsafe(no_mangle)]
pub extern "C" fn specgen_machine_bytes() -> usize {
    size_of::<Machine>()
}

/// Puts a `Machine` at reset.
///
/// # Safety
/// `machine` points to memory for a `Machine`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_machine_reset(machine: *mut u8) {
    // SAFETY: guaranteed by the caller.
    unsafe { machine.cast::<Machine>().write(machine_at_reset()) }
}

/// One supervised tick, as on the other targets.
///
/// # Safety
/// `config` contains a loaded `Config`, `machine` a `Machine` put at reset before; `input` points to `MACHINE_INPUT_WORDS` words,
/// `output` to `MACHINE_OUTPUT_WORDS` writable words. No two threads step the same machine at once.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_machine_step(
    config: *const u8,
    machine: *mut u8,
    input: *const u64,
    output: *mut u64,
) {
    // SAFETY: guaranteed by the caller.
    let (config, machine, input) = unsafe {
        (&*config.cast::<Config>(), &mut *machine.cast::<Machine>(), &*input.cast::<[u64; MACHINE_INPUT_WORDS]>())
    };
    let result = supervise(config, machine, &MachineInput::from_words(input));
    let words = machine_output_words(&result, machine);
    // SAFETY: guaranteed by the caller.
    unsafe { output.cast::<[u64; MACHINE_OUTPUT_WORDS]>().write(words) }
}

/// Change of each gauge's word per displacement of each leg, row by row, linearised at the gauges' words.
///
/// # Safety
/// `gauges` points to 6 words, `rows` to 36 writable words.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_words_per_leg(gauges: *const u64, rows: *mut u64) {
    // SAFETY: guaranteed by the caller.
    let gauges = unsafe { &*gauges.cast::<[u64; 6]>() }.map(Real::from_word);
    let words = controller::words_per_leg(&gauges).map(|row| row.map(Real::to_word));
    // SAFETY: guaranteed by the caller.
    unsafe { rows.cast::<[[u64; 6]; 6]>().write(words) }
}

/// Fingerprint of a `Machine`.
///
/// # Safety
/// `machine` contains a `Machine` put at reset before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_machine_digest(machine: *const u8) -> u64 {
    // SAFETY: guaranteed by the caller.
    unsafe { (*machine.cast::<Machine>()).digest() }
}

/// A `Machine` as words.
///
/// # Safety
/// `machine` contains a `Machine` put at reset before; `words` points to `MACHINE_STATE_WORDS` writable words.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_machine_save(machine: *const u8, words: *mut u64) {
    // SAFETY: guaranteed by the caller.
    let (machine, words) = unsafe { (&*machine.cast::<Machine>(), &mut *words.cast::<[u64; MACHINE_STATE_WORDS]>()) };
    machine.save(words);
}

/// Makes a `Machine` from words: returns 0, or one more than the index of the first word that is invalid (then `machine` is
/// unchanged).
///
/// # Safety
/// `machine` points to memory for a `Machine`, `words` to `MACHINE_STATE_WORDS` words.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_machine_load(machine: *mut u8, words: *const u64) -> i32 {
    // SAFETY: guaranteed by the caller.
    match Machine::load(unsafe { &*words.cast::<[u64; MACHINE_STATE_WORDS]>() }) {
        Ok(loaded) => {
            // SAFETY: guaranteed by the caller.
            unsafe { machine.cast::<Machine>().write(loaded) };
            0
        }
        Err(invalid) => invalid.word as i32 + 1,
    }
}
