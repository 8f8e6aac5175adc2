//! The microcontrollers that specgen knows.

/// A microcontroller that specgen can build for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mcu {
    /// Cortex-M7 with double-precision FPU, emulated.
    Mps2An500,
    /// Cortex-M4F, single-precision FPU, emulated.
    Mps2An386,
    /// That of a board, one of [`BOARDS`].
    Board(&'static Part),
}

/// What is known of a microcontroller: of that of a board, the table `package.metadata.board` of its manifest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Its name in a spec.
    pub name: &'static str,
    /// Name of the core, for compiler and emulator.
    pub core: &'static str,
    /// Whether the FPU computes `f64`; otherwise the compiler calls software for it.
    pub double: bool,
    /// Bytes of flash.
    pub flash: u64,
    /// Bytes of the RAM that images are linked into: one region of it.
    pub ram: u64,
    /// The board that specgen has firmware for.
    pub board: &'static str,
    /// Its name in probe-rs; none for an emulated one.
    pub chip: Option<&'static str>,
    /// QEMU's board with this core, where instructions are counted.
    pub emulated: &'static str,
    /// Folder of the firmware, in `firmware/` and in a workspace, and what `--target` calls it.
    pub folder: &'static str,
    /// What the folder is, for the README of a workspace.
    pub readme: &'static str,
    /// Longest tick in `f32`, us: of six legs as in `specs/legs.toml`, of a platform as in `specs/reference.toml`, and of one
    /// with the whole kernel of the inverse dynamics. Empty where it is not known.
    pub ticks_f32: &'static [u32],
    /// The same in `f64`.
    pub ticks_f64: &'static [u32],
}

include!(concat!(env!("OUT_DIR"), "/boards.rs"));

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
    folder: "qemu",
    readme: "",
    ticks_f32: &[],
    ticks_f64: &[],
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
    /// All of them: the emulated ones, and those of [`BOARDS`].
    pub const ALL: [Self; 2 + BOARDS.len()] = {
        let mut all = [Self::Mps2An500; 2 + BOARDS.len()];
        all[1] = Self::Mps2An386;
        let mut k = 0;
        while k < BOARDS.len() {
            all[2 + k] = Self::Board(BOARDS[k]);
            k += 1;
        }
        all
    };

    /// Their names.
    pub const NAMES: [&str; Self::ALL.len()] = {
        let mut names = [""; Self::ALL.len()];
        let mut k = 0;
        while k < names.len() {
            names[k] = Self::ALL[k].part().name;
            k += 1;
        }
        names
    };

    /// Its data.
    pub const fn part(self) -> Part {
        match self {
            Self::Mps2An500 => M7,
            Self::Mps2An386 => M4F,
            Self::Board(part) => *part,
        }
    }

    /// The microcontroller called `name` in a spec.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mcu| mcu.part().name == name)
    }

    /// Those whose FPU computes in double precision, by name.
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
            // Instructions are counted on a board with the same core; only a real board is flashed.
            let emulated = Mcu::named(part.emulated).unwrap().part();
            assert_eq!((emulated.core, emulated.double), (part.core, part.double));
            assert_eq!(part.chip.is_none(), part.name == part.emulated);
        }
        assert_eq!(Mcu::named("z80"), None);
    }
}
