//! Tightly coupled memories: code of the tick in ITCM, constants in DTCM, both without wait states and without cache misses. They
//! are copied from flash before anything else runs; `memory.x` assigns their contents.

#![allow(unsafe_code)] // Reads of memory by its address.

use core::ptr::{addr_of, read_volatile};

// Called by cortex-m-rt before variables are initialised: no Rust code may run that early. ITCM is written in words, which the reset
// value of ITCMCR permits (read-modify-write of the 64 bits that a check word covers).
core::arch::global_asm!(
    ".section .text.__pre_init,\"ax\",%progbits",
    ".global __pre_init",
    ".type __pre_init,%function",
    ".thumb_func",
    "__pre_init:",
    "ldr r0, =__sitcm",
    "ldr r1, =__eitcm",
    "ldr r2, =__litcm",
    "1:",
    "cmp r0, r1",
    "bhs 2f",
    "ldmia r2!, {{r3}}",
    "stmia r0!, {{r3}}",
    "b 1b",
    "2:",
    "ldr r0, =__sconstants",
    "ldr r1, =__econstants",
    "ldr r2, =__lconstants",
    "3:",
    "cmp r0, r1",
    "bhs 4f",
    "ldmia r2!, {{r3}}",
    "stmia r0!, {{r3}}",
    "b 3b",
    "4:",
    "dsb",
    "isb",
    "bx lr",
    ".pool",
    ".size __pre_init, . - __pre_init",
);

// SAFETY: linker symbols; their types only express the alignment.
unsafe extern "C" {
    // Start, end and source of each copy: symbols of memory.x; only their addresses are used.
    static __sitcm: u32;
    static __eitcm: u32;
    static __litcm: u32;
    static __sconstants: u32;
    static __econstants: u32;
    static __lconstants: u32;
}

/// Whether both copies equal the flash.
pub fn is_intact() -> bool {
    let code = [addr_of!(__sitcm), addr_of!(__eitcm), addr_of!(__litcm)];
    let constants = [addr_of!(__sconstants), addr_of!(__econstants), addr_of!(__lconstants)];
    [code, constants].into_iter().all(|[begin, end, from]| {
        let words = (end as usize - begin as usize) / size_of::<u32>();
        // SAFETY: memory.x puts this many words at both addresses; volatile, because the compiler knows neither.
        (0..words).all(|k| unsafe { read_volatile(begin.add(k)) == read_volatile(from.add(k)) })
    })
}
