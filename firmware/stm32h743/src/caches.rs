//! Caches, and the region that the DMA shares with the core.

#![allow(unsafe_code)] // Registers of the MPU.

use cortex_m::asm;
use cortex_m::peripheral::{CPUID, MPU, SCB};

/// AXI SRAM, where the buffers of the DMA are.
const BASE: u32 = 0x2400_0000;
/// 512 KiB: 2^(18 + 1) bytes.
const SIZE: u32 = 18;

/// RBAR: the region number of the same write is valid.
const VALID: u32 = 1 << 4;
/// RASR: execute never, full access, TEX 1 C 0 B 0 (normal memory that no cache keeps), enabled.
const NOT_CACHED: u32 = 1 << 28 | 0b011 << 24 | 0b001 << 19 | SIZE << 1 | 1;
/// CTRL: on, the default map elsewhere.
const ENABLED: u32 = 1 << 2 | 1;

/// AXI SRAM out of the caches, then both caches on: code and constants come from flash with wait states.
pub fn enable(mpu: &mut MPU, scb: &mut SCB, cpuid: &mut CPUID) {
    asm::dmb();
    // SAFETY: one region over memory that nothing has used yet, with the access rights that it had.
    unsafe {
        mpu.rbar.write(BASE | VALID);
        mpu.rasr.write(NOT_CACHED);
        mpu.ctrl.write(ENABLED);
    }
    asm::dsb();
    asm::isb();
    scb.enable_icache();
    scb.enable_dcache(cpuid);
}
