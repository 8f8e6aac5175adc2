//! The folders that are copied verbatim into a workspace, each with what it needs beside it. The build script lists their files: a new
//! file is in by being there, a new target is one more entry of [`PARTS`] and one more line of the script.

use std::collections::BTreeSet;

/// A folder of `firmware/` that is copied as it is.
#[derive(Debug)]
pub struct Part {
    /// Its name, in `firmware/` and in the workspace.
    pub folder: &'static str,
    /// A member of the workspace; else it is built for itself, because of its target or of its dependencies.
    pub member: bool,
    /// What it is, for the README.
    pub what: &'static str,
    /// What building it takes, for the README.
    pub needs: &'static str,
    /// Folders that it depends on, beside `controller`, `law` and `runtime`.
    pub with: &'static [&'static str],
    /// Path below the workspace, text.
    pub files: &'static [(&'static str, &'static str)],
}

/// The files of the folders.
mod files {
    include!(concat!(env!("OUT_DIR"), "/files.rs"));
}
pub use files::{HOST_SIM, UNIT};

/// Every folder there is. Not a constant, of which each crate that names it has a copy.
pub static PARTS: [Part; 13] = [
    Part {
        folder: "law",
        member: true,
        what: "the control law and its supervised tick: start at `src/platform/step.rs`, or `src/legs/step.rs` for six legs",
        needs: "nothing",
        with: &[],
        files: files::LAW,
    },
    Part {
        folder: "runtime",
        member: true,
        what: "the kernels it calls",
        needs: "nothing",
        with: &[],
        files: files::RUNTIME,
    },
    Part {
        folder: "host",
        member: true,
        what: "the same controller as a shared library: `cargo build --release`",
        needs: "a host toolchain",
        with: &[],
        files: files::HOST,
    },
    Part {
        folder: "qemu",
        member: false,
        what: "the same controller on an emulated Cortex-M: see its README",
        needs: "target `thumbv7em-none-eabihf`, QEMU",
        with: &["link"],
        files: files::QEMU,
    },
    Part {
        folder: "link",
        member: false,
        what: "the protocol between a board and the host",
        needs: "nothing",
        with: &[],
        files: files::LINK,
    },
    Part {
        folder: "hal",
        member: false,
        what: "gauges and amplifiers: traits and drivers",
        needs: "nothing",
        with: &[],
        files: files::HAL,
    },
    Part {
        folder: "board",
        member: false,
        what: "what all boards have in common: one tick on real converters, what is said over the link",
        needs: "nothing",
        with: &["hal", "link"],
        files: files::BOARD,
    },
    Part {
        folder: "stm32",
        member: false,
        what: "what the STM32 boards have in common",
        needs: "nothing by itself",
        with: &["board", "hal", "link"],
        files: files::STM32,
    },
    Part {
        folder: "stm32h743",
        member: false,
        what: "firmware of the NUCLEO-H743ZI2 (Cortex-M7)",
        needs: "target `thumbv7em-none-eabihf`",
        with: &["board", "hal", "link", "stm32", "tick"],
        files: files::STM32H743,
    },
    Part {
        folder: "stm32f4",
        member: false,
        what: "firmware of the NUCLEO-F446RE (Cortex-M4F, `f32`)",
        needs: "target `thumbv7em-none-eabihf`",
        with: &["board", "hal", "link", "stm32", "tick"],
        files: files::STM32F4,
    },
    Part {
        folder: "tick",
        member: false,
        what: "a board's tick between stand-ins for its converters, on an emulated Cortex-M: what its time is estimated from",
        needs: "target `thumbv7em-none-eabihf`, QEMU",
        with: &["board", "hal", "link", "qemu", "stm32"],
        files: files::TICK,
    },
    Part {
        folder: "rt",
        member: false,
        what: "what a control loop needs of Linux: clock, rights, book of late ticks, shared memory",
        needs: "Linux",
        with: &[],
        files: files::RT,
    },
    Part {
        folder: "rt-pc",
        member: false,
        what: "the controller on a real-time Linux PC",
        needs: "a host toolchain, Linux",
        with: &["hal", "link", "rt"],
        files: files::RT_PC,
    },
];

/// Folders of every workspace: with these the bits of host and emulated machine can be compared.
pub const ALWAYS: &[&str] = &["law", "runtime", "host", "qemu"];

/// [`ALWAYS`], `targets` and all that these depend on, in the order of [`PARTS`].
#[must_use]
pub fn select(targets: &[&str]) -> Vec<&'static Part> {
    let mut wanted: BTreeSet<&str> = ALWAYS.iter().chain(targets).copied().collect();
    // What is added may depend on more; a folder is added once, so this ends.
    loop {
        let needed =
            PARTS.iter().filter(|part| wanted.contains(part.folder)).flat_map(|part| part.with.iter().copied());
        let more: Vec<&str> = needed.filter(|folder| !wanted.contains(folder)).collect();
        if more.is_empty() {
            break;
        }
        wanted.extend(more);
    }
    PARTS.iter().filter(|part| wanted.contains(part.folder)).collect()
}
