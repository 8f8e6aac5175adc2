//! The microcontrollers that specgen knows.

/// A microcontroller that specgen can build for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mcu {
    /// Cortex-M7 with double-precision FPU, emulated.
    Mps2An500,
    /// Cortex-M4F, single-precision FPU, emulated.
    Mps2An386,
    /// Cortex-M7 with double-precision FPU.
    Stm32H743Zi,
    /// Cortex-M4F, single-precision FPU.
    Stm32F446Re,
}

/// What is known of a microcontroller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// As the spec names it.
    pub name: &'static str,
    /// Name of the core, for compiler and emulator.
    pub core: &'static str,
    /// Whether the FPU computes `f64`; else the compiler calls software for it.
    pub double: bool,
    /// Bytes of flash.
    pub flash: u64,
    /// Bytes of the RAM that images are linked into: one region, where a part has several.
    pub ram: u64,
    /// The board that specgen has firmware for.
    pub board: &'static str,
    /// As probe-rs names the chip; none for an emulated one.
    pub chip: Option<&'static str>,
    /// QEMU's board with this core, where instructions are counted.
    pub emulated: &'static str,
}

const KIB: u64 = 1024;

const M7: Part = Part {
    name: "mps2-an500",
    core: "cortex-m7",
    double: true,
    flash: 4096 * KIB,
    ram: 4096 * KIB,
    board: "QEMU mps2-an500",
    chip: None,
    emulated: "mps2-an500",
};

const M4F: Part = Part {
    name: "mps2-an386",
    core: "cortex-m4",
    double: false,
    board: "QEMU mps2-an386",
    emulated: "mps2-an386",
    ..M7
};

impl Mcu {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Mps2An500, Self::Mps2An386, Self::Stm32H743Zi, Self::Stm32F446Re];

    /// What is known of it.
    #[must_use]
    pub fn part(self) -> Part {
        match self {
            Self::Mps2An500 => M7,
            Self::Mps2An386 => M4F,
            // DS12110: 2 MiB of flash; of its RAM the 128 KiB of DTCM, which the core reads without waiting.
            Self::Stm32H743Zi => Part {
                name: "stm32h743zi",
                flash: 2048 * KIB,
                ram: 128 * KIB,
                board: "NUCLEO-H743ZI2",
                chip: Some("STM32H743ZITx"),
                ..M7
            },
            // DS10693: 512 KiB of flash, 128 KiB of SRAM.
            Self::Stm32F446Re => Part {
                name: "stm32f446re",
                flash: 512 * KIB,
                ram: 128 * KIB,
                board: "NUCLEO-F446RE",
                chip: Some("STM32F446RETx"),
                ..M4F
            },
        }
    }

    /// The one that the spec calls `name`.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mcu| mcu.part().name == name)
    }

    /// Those whose FPU computes in double precision, by name.
    #[must_use]
    pub fn doubles() -> Vec<&'static str> {
        Self::ALL.iter().map(|mcu| mcu.part()).filter(|part| part.double).map(|part| part.name).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::keys::{Item, Shape, key};

    #[test]
    fn the_spec_offers_exactly_these() {
        let Some(Shape::One(Item::Choice(offered))) = key("target.mcu").map(|key| key.shape) else {
            unreachable!("target.mcu is a choice");
        };
        assert_eq!(offered.to_vec(), Mcu::ALL.map(|mcu| mcu.part().name));
        for mcu in Mcu::ALL {
            let part = mcu.part();
            assert_eq!(Mcu::named(part.name), Some(mcu));
            // Counted on a board of the same core, and flashed only where there is something to flash.
            let emulated = Mcu::named(part.emulated).unwrap().part();
            assert_eq!((emulated.core, emulated.double), (part.core, part.double));
            assert_eq!(part.chip.is_none(), part.name == part.emulated);
        }
        assert_eq!(Mcu::named("z80"), None);
    }
}
