//! What decides about the time of a tick, for specgen, which reads it from the image.

/// Registers that are read and written, and instructions.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Work {
    /// Reads of registers of devices.
    pub reads: u32,
    /// Writes to them.
    pub writes: u32,
    /// Instructions besides.
    pub instructions: u32,
}

/// Words in this order; `codegen/toolchain/src/time.rs` of specgen reads them.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Times {
    version: u32,
    /// Clock of the core, Hz.
    core: u32,
    /// FLASH_ACR and CCR, as they are while ticks run.
    registers: [u32; 2],
    /// SCLK of ADC and DACs, and of these where they are read back, Hz.
    sclk: [u32; 3],
    /// What a byte on a bus takes of the core, while the next one is on the wires.
    byte: Work,
    /// A frame beside its bytes: select, the first bytes, the end of the last one.
    frame: Work,
    /// The interrupt around the tick: what holds it off, the timer, the watchdog, the stop contact; what a frame that is read back has besides.
    interrupt: Work,
}

impl Times {
    /// Clock of the core, Hz; FLASH_ACR and CCR; SCLK of ADC and DACs, and of these where they are read back.
    #[must_use]
    pub const fn new(core: u32, registers: [u32; 2], sclk: [u32; 3]) -> Self {
        Self {
            version: 2,
            core,
            registers,
            sclk,
            byte: Work { reads: 3, writes: 1, instructions: 16 },
            frame: Work { reads: 3, writes: 6, instructions: 60 },
            // With two changes of the DACs' clock; and what the background holds a tick off for longest: 20 knots that it takes from
            // the link, or 16 words of a record. The copy of the machine is taken only where no tick is due meanwhile.
            interrupt: Work { reads: 12 + 30, writes: 14, instructions: 190 + 150 },
        }
    }
}
