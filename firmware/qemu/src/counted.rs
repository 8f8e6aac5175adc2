//! The supervised tick of both programs, with its cost.

use controller::Config;
use controller::supervised::{Machine, MachineInput, MachineOutput, supervise};

use crate::instructions::InstructionCounter;
use crate::stack;

/// One supervised tick with its instructions and, if `painted`, its stack use, bytes; else 0.
#[allow(unsafe_code)] // The tick is called from assembly that counts it.
pub fn counted_tick(
    counter: &mut InstructionCounter,
    config: &Config,
    machine: &mut Machine,
    input: &MachineInput,
    painted: bool,
) -> (MachineOutput, u32, usize) {
    let arguments = [(&raw const *config) as usize, (&raw mut *machine) as usize, (&raw const *input) as usize];
    // SAFETY: a C function of these three references.
    unsafe { stack::measure(counter, specgen_supervise as *const (), arguments, painted) }
}

/// The function to which instruction count, painted stack and static stack bound refer.
#[unsafe(no_mangle)]
#[inline(never)]
#[allow(unsafe_code)] // `no_mangle`: specgen looks this symbol up in the image.
#[allow(improper_ctypes_definitions)] // Caller and callee are compiled together; only the registers matter.
extern "C" fn specgen_supervise(config: &Config, machine: &mut Machine, input: &MachineInput) -> MachineOutput {
    supervise(config, machine, input)
}
