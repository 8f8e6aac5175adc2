//! Caches and memory protection: only existing memory is accessible, so that speculative reads of the core do not go to addresses
//! where nothing answers. Memory shared with the DMA, and code in ITCM, have their own attributes.

#![allow(unsafe_code)] // Registers of the MPU.

use cortex_m::asm;
use cortex_m::peripheral::{CPUID, MPU, SCB};

use crate::clocks;

/// RASR: enable, with a size of 2^bits bytes.
const fn size(bits: u32) -> u32 {
    (bits - 1) << 1 | 1
}

/// RASR: execute never, for any access.
const NO_CODE: u32 = 1 << 28;
const READ_ONLY: u32 = 0b110 << 24;
const FULL: u32 = 0b011 << 24;
/// TEX 1 C 0 B 0: normal memory, not cached. C alone: write-through, as flash in the default map.
const NOT_CACHED: u32 = 0b001 << 19;
const CACHED: u32 = 1 << 17;
/// Disabled eighths of a region, 512 MB of the whole: there the default map applies, for devices and the core's registers.
const DEVICES: u32 = 1 << (8 + 2) | 1 << (8 + 7);

/// Base and RASR of the regions by number; where regions overlap, the highest number applies.
const REGIONS: [[u32; 2]; 5] = [
    // No access.
    [0, NO_CODE | DEVICES | size(32)],
    [0x0800_0000, READ_ONLY | CACHED | size(21)],
    // ITCM; a write through a null pointer is a fault.
    [0, READ_ONLY | NOT_CACHED | size(16)],
    // DTCM, which is never cached.
    [0x2000_0000, NO_CODE | FULL | NOT_CACHED | size(17)],
    // AXI SRAM, with the buffers of the DMA.
    [0x2400_0000, NO_CODE | FULL | NOT_CACHED | size(19)],
];
/// RBAR: the region number of the same write is valid.
const VALID: u32 = 1 << 4;
/// READ_ISS_OVERRIDE of the AXI SRAM's port, AXI_TARG7_FN_MOD.
const AXI_SRAM_READS: *mut u32 = 0x5100_8108 as *mut u32;
/// CTRL: enable, with the default map elsewhere.
const ENABLED: u32 = 1 << 2 | 1;

/// Sets the regions and enables both caches: flash has wait states for code and constants.
pub fn enable(mpu: &mut MPU, scb: &mut SCB, cpuid: &mut CPUID) {
    asm::dmb();
    // SAFETY: memory that memory.x uses keeps the access that the program needs; AXI SRAM is not used yet.
    unsafe {
        for ([base, rights], number) in REGIONS.into_iter().zip(0..) {
            mpu.rbar.write(base | VALID | number);
            mpu.rasr.write(rights);
        }
        mpu.ctrl.write(ENABLED);
    }
    if !clocks::is_revision_v() {
        // ES0392, revision Y: reads of AXI SRAM may be corrupt unless they are issued one at a time.
        // SAFETY: writes only this register, before anything reads AXI SRAM.
        unsafe { AXI_SRAM_READS.write_volatile(1) };
    }
    asm::dsb();
    asm::isb();
    scb.enable_icache();
    scb.enable_dcache(cpuid);
}
