//! Build targets, by the names that `--target` takes.

use specgen_language::model::{BOARDS, Mcu};

/// How a target is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A shared library for this machine.
    Host,
    /// An image for the emulated machine of the spec's core.
    Emulated,
    /// An image for a board with this part.
    Board(Mcu),
    /// A program for this machine.
    Program,
}

/// A target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Target {
    /// Its name for `--target`, and its folder in the workspace.
    pub name: &'static str,
    /// How it is built.
    pub kind: Kind,
}

const PROGRAM: Target = Target { name: "rt-pc", kind: Kind::Program };

/// Every target.
pub const TARGETS: [Target; 3 + BOARDS.len()] = {
    let mut all = [PROGRAM; 3 + BOARDS.len()];
    all[0] = Target { name: "host", kind: Kind::Host };
    all[1] = Target { name: "qemu", kind: Kind::Emulated };
    let mut k = 0;
    while k < BOARDS.len() {
        all[2 + k] = Target { name: BOARDS[k].folder, kind: Kind::Board(Mcu::Board(BOARDS[k])) };
        k += 1;
    }
    all
};

/// Their names.
pub const NAMES: [&str; TARGETS.len()] = {
    let mut names = [""; TARGETS.len()];
    let mut k = 0;
    while k < names.len() {
        names[k] = TARGETS[k].name;
        k += 1;
    }
    names
};

impl Target {
    /// The target called `name`.
    pub fn named(name: &str) -> Option<Self> {
        TARGETS.into_iter().find(|target| target.name == name)
    }

    /// The board of a part; the emulated machine if there is none.
    pub fn of(mcu: Mcu) -> Self {
        let board = TARGETS.into_iter().find(|target| target.kind == Kind::Board(mcu));
        board.unwrap_or(TARGETS[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_and_every_name_has_a_target() {
        for target in TARGETS {
            assert_eq!(Target::named(target.name), Some(target));
        }
        for board in BOARDS {
            assert_eq!(Target::of(Mcu::Board(board)).name, board.folder);
        }
        assert_eq!(Target::of(Mcu::Mps2An386).name, "qemu");
        assert_eq!(Target::named("esp32"), None);
    }
}
