//! The machine for C: `plant.h` beside the sources of a unit declares these. A pointer is one of [`specgen_plant_new`] or
//! [`specgen_plant_copy`] until [`specgen_plant_free`] takes it. One machine is used by one thread at a time; there may be many.

#![allow(unsafe_code, reason = "the interface is C's: every function says what it takes")]

use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr::null_mut;

use crate::{Description, Plant, SETTINGS, Settings, UnitError};

/// A machine, prepared or not yet.
#[derive(Debug, Clone)]
pub struct Machine {
    description: Description,
    plant: Option<Plant>,
}

impl Machine {
    fn prepare(&mut self, settings: &[u64; SETTINGS.len()], outputs: &mut [u64]) -> Result<(), UnitError> {
        self.plant = Some(self.description.prepared(&Settings::of(settings)?));
        self.read(outputs)
    }

    fn step(&mut self, inputs: &[u64], outputs: &mut [u64]) -> Result<(), UnitError> {
        let inputs: Vec<f64> = inputs.iter().map(|word| f64::from_bits(*word)).collect();
        let period = self.description.period;
        self.plant()?.hold(&inputs, period)?;
        self.read(outputs)
    }

    fn read(&mut self, outputs: &mut [u64]) -> Result<(), UnitError> {
        let mut values = vec![0.0; outputs.len()];
        self.plant()?.read(&mut values);
        outputs.iter_mut().zip(values).for_each(|(word, value)| *word = value.to_bits());
        Ok(())
    }

    fn plant(&mut self) -> Result<&mut Plant, UnitError> {
        self.plant.as_mut().ok_or(UnitError(c"the machine is not prepared: leave the initialization mode first"))
    }
}

/// Null for what went well; a panic ends here, not in the program that loaded the unit.
fn answer(work: impl FnOnce() -> Result<(), UnitError>) -> *const c_char {
    let refused: &'static CStr = match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(())) => return std::ptr::null(),
        Ok(Err(UnitError(why))) => why,
        Err(_) => c"the plant failed on these inputs: reset the unit and use smaller ones",
    };
    refused.as_ptr()
}

/// A machine of a description as JSON, or null if that cannot be read.
///
/// # Safety
/// `text` points to `length` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_plant_new(text: *const u8, length: usize) -> *mut Machine {
    // SAFETY: the caller's promise.
    let text = unsafe { std::slice::from_raw_parts(text, length) };
    match serde_json::from_slice(text) {
        Ok(description) => Box::into_raw(Box::new(Machine { description, plant: None })),
        Err(_) => null_mut(),
    }
}

/// Another machine in the same state.
///
/// # Safety
/// `machine` is one of this module.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_plant_copy(machine: *const Machine) -> *mut Machine {
    // SAFETY: the caller's promise.
    Box::into_raw(Box::new(unsafe { &*machine }.clone()))
}

/// Frees a machine; null is left alone.
///
/// # Safety
/// `machine` is null or one of this module, and not used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_plant_free(machine: *mut Machine) {
    if !machine.is_null() {
        // SAFETY: it was a box, and the caller gives it up.
        drop(unsafe { Box::from_raw(machine) });
    }
}

/// Prepares the machine (pre-cycle, rest, gauges zeroed) with these settings and reads it. Null, or why not.
///
/// # Safety
/// `machine` is one of this module; `settings` points to the words of [`SETTINGS`], `outputs` to `count` words.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_plant_prepare(
    machine: *mut Machine,
    settings: *const [u64; SETTINGS.len()],
    outputs: *mut u64,
    count: usize,
) -> *const c_char {
    // SAFETY: the caller's promise, for all three.
    let (machine, settings, outputs) =
        unsafe { (&mut *machine, &*settings, std::slice::from_raw_parts_mut(outputs, count)) };
    answer(|| machine.prepare(settings, outputs))
}

/// Holds the inputs for one control period, then reads. Null, or why not.
///
/// # Safety
/// `machine` is one of this module; `inputs` points to `given` words, `outputs` to `count` others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_plant_step(
    machine: *mut Machine,
    inputs: *const u64,
    given: usize,
    outputs: *mut u64,
    count: usize,
) -> *const c_char {
    // SAFETY: the caller's promise, for all three.
    let (machine, inputs, outputs) = unsafe {
        (&mut *machine, std::slice::from_raw_parts(inputs, given), std::slice::from_raw_parts_mut(outputs, count))
    };
    answer(|| machine.step(inputs, outputs))
}
