//! The supervised tick that both programs call, with what it costs.

use controller::Config;
use controller::supervised::{Machine, MachineInput, MachineOutput, supervise};
use core::mem::MaybeUninit;

use crate::instructions::InstructionCounter;
use crate::stack;

/// One supervised tick with its instructions and, if it is to be `painted`, its stack, bytes; else 0. In a frame of its own, so
/// that the stack pointer stands still around the call.
#[inline(never)]
#[allow(unsafe_code)] // The tick is called from assembly that counts it.
pub fn counted_tick(
    counter: &mut InstructionCounter,
    config: &Config,
    machine: &mut Machine,
    input: &MachineInput,
    painted: bool,
) -> (MachineOutput, u32, usize) {
    let mut output = MaybeUninit::<MachineOutput>::uninit();
    let arguments = [
        (&raw mut output) as usize,
        (&raw const *config) as usize,
        (&raw mut *machine) as usize,
        (&raw const *input) as usize,
    ];
    // SAFETY: C passes the address of a result this large first, then the three references; the tick writes it.
    unsafe {
        let tick = specgen_supervise as *const ();
        let (instructions, depth) = if painted {
            stack::measure_depth(|| counter.measure_call(tick, arguments))
        } else {
            (counter.measure_call(tick, arguments), 0)
        };
        (output.assume_init(), instructions, depth)
    }
}

/// C returns what is larger through memory of the caller, whatever its fields.
const LARGEST_RESULT_IN_REGISTERS: usize = 32;
const _: () = assert!(size_of::<MachineOutput>() > LARGEST_RESULT_IN_REGISTERS);

/// What the instruction count, the painted stack and the static stack bound all refer to.
#[unsafe(no_mangle)]
#[inline(never)]
#[allow(unsafe_code)] // `no_mangle`: specgen looks this symbol up in the image.
#[allow(improper_ctypes_definitions)] // Caller and callee are compiled together; only the registers matter.
extern "C" fn specgen_supervise(config: &Config, machine: &mut Machine, input: &MachineInput) -> MachineOutput {
    supervise(config, machine, input)
}
