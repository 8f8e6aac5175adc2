//! Figures that determine the time of a tick. specgen reads them from the image.

/// Register accesses and instructions of an operation.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Work {
    /// Reads of device registers.
    pub reads: u32,
    /// Writes to device registers.
    pub writes: u32,
    /// Other instructions.
    pub instructions: u32,
}

/// Words in this order; `codegen/toolchain/src/time.rs` of specgen reads them.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Times {
    version: u32,
    /// Clock of the core, Hz.
    core: u32,
    /// FLASH_ACR and CCR while ticks run.
    registers: [u32; 2],
    /// SCLK of the ADC, of the DACs, and of the DACs for read-back, Hz.
    sclk: [u32; 3],
    /// Work of the core per byte, while the next one is on the bus.
    byte: Work,
    /// Work per frame in addition to its bytes: select, the first bytes, the end of the last one.
    frame: Work,
    /// The interrupt around the tick: its latency, timer, watchdog, stop contact; and the additional work of a frame that is read back.
    interrupt: Work,
}

impl Times {
    /// `core`: clock of the core, Hz; FLASH_ACR and CCR; SCLK of the ADC, of the DACs, and of the DACs for read-back.
    #[must_use]
    pub const fn new(core: u32, registers: [u32; 2], sclk: [u32; 3]) -> Self {
        Self {
            version: 2,
            core,
            registers,
            sclk,
            byte: Work { reads: 3, writes: 1, instructions: 16 },
            frame: Work { reads: 3, writes: 6, instructions: 60 },
            // Includes two changes of the DACs' clock, and the longest critical section of the background: 20 knots from the link, or
            // 16 words of a record. The machine is copied only if no tick is due meanwhile.
            interrupt: Work { reads: 12 + 30, writes: 14, instructions: 190 + 150 },
        }
    }
}
