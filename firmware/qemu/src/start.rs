//! Startup code from reset to `main`, and the fault handler.
//!
//! The emulator needs no other runtime: no interrupt is ever enabled, and `link.x` defines the memory layout.

#![allow(unsafe_code)] // Before memory is set up there is only assembly; the processor finds its vectors by their section.

use core::arch::naked_asm;

use crate::semihosting::{Exit, exit};

/// Vectors from the second word of memory on: reset, then every exception of the core.
#[used]
#[unsafe(link_section = ".vector_table")]
static VECTORS: [unsafe extern "C" fn() -> !; 15] = {
    let mut vectors: [unsafe extern "C" fn() -> !; 15] = [fault; 15];
    vectors[0] = reset;
    vectors
};

/// Initialises memory, enables the FPU, jumps to `main`.
// SAFETY: runs first, with only a stack, and leaves memory as Rust functions expect it.
#[unsafe(naked)]
unsafe extern "C" fn reset() -> ! {
    naked_asm!(
        "movw r0, #:lower16:__sbss",
        "movt r0, #:upper16:__sbss",
        "movw r1, #:lower16:__ebss",
        "movt r1, #:upper16:__ebss",
        "movs r2, #0",
        "2:",
        "cmp r0, r1",
        "beq 3f",
        "str r2, [r0], #4",
        "b 2b",
        "3:",
        "movw r0, #:lower16:__sdata",
        "movt r0, #:upper16:__sdata",
        "movw r1, #:lower16:__edata",
        "movt r1, #:upper16:__edata",
        "movw r2, #:lower16:__sidata",
        "movt r2, #:upper16:__sidata",
        "4:",
        "cmp r0, r1",
        "beq 5f",
        "ldr r3, [r2], #4",
        "str r3, [r0], #4",
        "b 4b",
        "5:",
        // CPACR: full access to coprocessors 10 and 11.
        "movw r0, #0xed88",
        "movt r0, #0xe000",
        "ldr r1, [r0]",
        "orr r1, r1, #0xf00000",
        "str r1, [r0]",
        "dsb",
        "isb",
        "b {main}",
        main = sym crate::main,
    )
}

/// Handler of processor faults and unexpected exceptions.
extern "C" fn fault() -> ! {
    exit(Exit::Fault)
}
