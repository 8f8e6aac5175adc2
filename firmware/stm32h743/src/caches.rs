//! Caches, and the regions that are special: what the DMA shares with the core, and the code in ITCM.

#![allow(unsafe_code)] // Registers of the MPU.

use cortex_m::asm;
use cortex_m::peripheral::{CPUID, MPU, SCB};

use crate::clocks;

/// AXI SRAM, where the buffers of the DMA are.
const BASE: u32 = 0x2400_0000;
/// 512 KiB: 2^(18 + 1) bytes.
const SIZE: u32 = 18;

/// RBAR: the region number of the same write is valid.
const VALID: u32 = 1 << 4;
/// RASR: execute never, full access, TEX 1 C 0 B 0 (normal memory that no cache keeps), enabled.
const NOT_CACHED: u32 = 1 << 28 | 0b011 << 24 | 0b001 << 19 | SIZE << 1 | 1;
/// ITCM as region 1: 64 KiB, read-only (AP 110), normal memory that no cache keeps, enabled. A write through a null pointer is a fault.
const ITCM: u32 = VALID | 1;
const READ_ONLY: u32 = 0b110 << 24 | 0b001 << 19 | 15 << 1 | 1;
/// READ_ISS_OVERRIDE of the AXI SRAM's port, AXI_TARG7_FN_MOD.
const AXI_SRAM_READS: *mut u32 = 0x5100_8108 as *mut u32;
/// CTRL: on, the default map elsewhere.
const ENABLED: u32 = 1 << 2 | 1;

/// AXI SRAM out of the caches, ITCM read-only, then both caches on: code and constants come from flash with wait states.
pub fn enable(mpu: &mut MPU, scb: &mut SCB, cpuid: &mut CPUID) {
    asm::dmb();
    // SAFETY: one region over memory that nothing has used yet, with the access rights that it had; one over code that nobody writes.
    unsafe {
        mpu.rbar.write(BASE | VALID);
        mpu.rasr.write(NOT_CACHED);
        mpu.rbar.write(ITCM);
        mpu.rasr.write(READ_ONLY);
        mpu.ctrl.write(ENABLED);
    }
    if !clocks::is_revision_v() {
        // ES0392, revision Y: reads of AXI SRAM may be corrupt unless one is issued at a time.
        // SAFETY: this register alone, before anything reads AXI SRAM.
        unsafe { AXI_SRAM_READS.write_volatile(1) };
    }
    asm::dsb();
    asm::isb();
    scb.enable_icache();
    scb.enable_dcache(cpuid);
}
