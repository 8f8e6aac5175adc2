//! The folders that are copied into a workspace, with their dependencies. The build script finds their files and all boards. Another
//! new folder needs an entry in `PARTS` and a line in the script.

use std::collections::BTreeSet;
use std::sync::LazyLock;

use specgen_language::model;

/// A folder of `firmware/` that is copied as it is.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    /// Its name, in `firmware/` and in the workspace.
    pub folder: &'static str,
    /// Whether it is a member of the workspace; others are built separately because of their target or dependencies.
    pub member: bool,
    /// Description for the README.
    pub what: &'static str,
    /// Requirements of a build, for the README.
    pub needs: &'static str,
    /// Folders that it depends on, except `controller`, `law` and `runtime`.
    pub with: &'static [&'static str],
}

impl Part {
    /// Path below the workspace, text.
    pub fn files(&self) -> &'static [(&'static str, &'static str)] {
        files(self.folder)
    }
}

include!(concat!(env!("OUT_DIR"), "/files.rs"));

/// A folder, and of each of its files: path below the workspace, text.
type Texts = (&'static str, Vec<(&'static str, &'static str)>);

/// [`FOLDERS`] with their texts, unpacked when a command first asks for one.
static TEXTS: LazyLock<Vec<Texts>> = LazyLock::new(|| {
    let packed = include_bytes!(concat!(env!("OUT_DIR"), "/files.deflate"));
    let all = miniz_oxide::inflate::decompress_to_vec(packed).unwrap_or_default();
    let mut rest: &'static str = String::from_utf8(all).unwrap_or_default().leak();
    let mut text = |bytes| {
        let (text, behind) = rest.split_at_checked(bytes).unwrap_or_default();
        rest = behind;
        text
    };
    FOLDERS
        .iter()
        .map(|(folder, files)| (*folder, files.iter().map(|(path, bytes)| (*path, text(*bytes))).collect()))
        .collect()
});

/// Of each file of a folder of `firmware`, of `host-sim` or of `unit`: path below the workspace, text.
pub fn files(folder: &str) -> &'static [(&'static str, &'static str)] {
    TEXTS.iter().find(|(name, _)| *name == folder).map_or(&[], |(_, files)| files)
}

/// Text of a file of the repository that studies write: a record, `Cargo.lock`.
pub fn text(path: &str) -> &'static str {
    files("repository").iter().find(|(name, _)| *name == path).map_or("", |(_, text)| text)
}

/// All folders except boards.
const PARTS: [Part; 11] = [
    Part {
        folder: "law",
        member: true,
        what: "the control law and its supervised tick, of platforms and of six legs",
        needs: "nothing",
        with: &[],
    },
    Part { folder: "runtime", member: true, what: "the kernels it calls", needs: "nothing", with: &[] },
    Part {
        folder: "host",
        member: true,
        what: "the same controller as a shared library: `cargo build --release`",
        needs: "nothing",
        with: &[],
    },
    Part {
        folder: "qemu",
        member: false,
        what: "the same controller on an emulated Cortex-M: see its README",
        needs: "target `thumbv7em-none-eabihf`, QEMU, Rust 1.88, packages of `link`",
        with: &["link"],
    },
    Part {
        folder: "link",
        member: false,
        what: "the protocol between a board and the host",
        needs: "packages `cobs`, `crc`, `heapless`, `postcard`, `serde`",
        with: &[],
    },
    Part {
        folder: "hal",
        member: false,
        what: "gauges and amplifiers: traits and drivers",
        needs: "package `embedded-hal`",
        with: &[],
    },
    Part {
        folder: "board",
        member: false,
        what: "code shared by all boards: one tick on real converters, the messages of the link",
        needs: "packages of `hal` and `link`",
        with: &["hal", "link"],
    },
    Part {
        folder: "stm32",
        member: false,
        what: "code shared by the STM32 boards",
        needs: "packages of `hal` and `link`, `cortex-m`, `cortex-m-rt`, `stm32-metapac`",
        with: &["board", "hal", "link"],
    },
    Part {
        folder: "tick",
        member: false,
        what: "a board's tick with simulated converters on an emulated Cortex-M, to estimate its time",
        needs: "target `thumbv7em-none-eabihf`, QEMU, Rust 1.88, packages of `hal` and `link`",
        with: &["board", "hal", "link", "qemu", "stm32"],
    },
    Part {
        folder: "rt",
        member: false,
        what: "what a control loop needs from Linux: clock, privileges, log of late ticks, shared memory",
        needs: "Linux, package `libc`",
        with: &[],
    },
    Part {
        folder: "rt-pc",
        member: false,
        what: "the controller on a real-time Linux PC",
        needs: "Linux, packages of its `Cargo.toml`; feature `comedi`: Rust 1.88",
        with: &["board", "hal", "link", "rt"],
    },
];

/// The folder of a board.
const fn of_board(board: &model::Part) -> Part {
    Part {
        folder: board.folder,
        member: false,
        what: board.readme,
        needs: "target `thumbv7em-none-eabihf`",
        with: &["board", "hal", "link", "stm32", "tick"],
    }
}

/// All folders: boards after the folders that they share.
pub fn all() -> Vec<Part> {
    let (before, behind) = PARTS.split_at(PARTS.iter().take_while(|part| part.folder != "tick").count());
    before.iter().copied().chain(model::BOARDS.map(of_board)).chain(behind.iter().copied()).collect()
}

/// Folders of every workspace: with these the bits of host and emulated machine can be compared.
pub const ALWAYS: &[&str] = &["law", "runtime", "host", "qemu"];

/// [`ALWAYS`], `targets` and all that these depend on, in the order of [`all`].
pub fn select(targets: &[&str]) -> Vec<Part> {
    let mut parts = all();
    let mut wanted: BTreeSet<&str> = ALWAYS.iter().chain(targets).copied().collect();
    // Added folders may have dependencies; each folder is added once, so this ends.
    loop {
        let needed =
            parts.iter().filter(|part| wanted.contains(part.folder)).flat_map(|part| part.with.iter().copied());
        let more: Vec<&str> = needed.filter(|folder| !wanted.contains(folder)).collect();
        if more.is_empty() {
            break;
        }
        wanted.extend(more);
    }
    parts.retain(|part| wanted.contains(part.folder));
    parts
}
