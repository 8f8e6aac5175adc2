//! The folders that are copied verbatim into a workspace. Each is declared in a file of its own, with its list of files and
//! what it needs beside it; a new target is one more file here and one more line in [`PARTS`].

mod board;
mod hal;
mod host;
mod law;
mod link;
mod qemu;
mod rt;
mod rt_pc;
mod runtime;
mod stm32;
mod stm32f4;
mod stm32h743;
mod tick;

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

/// The files of a folder by their paths in it. A lock file belongs to the list where the folder is a workspace of its own.
macro_rules! files {
    ($folder:literal: $($path:literal,)*) => {
        &[$((
            concat!($folder, "/", $path),
            include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../firmware/", $folder, "/", $path)),
        )),*]
    };
}
use files;

/// Every folder there is. Not a constant, of which each crate that names it has a copy.
pub static PARTS: &[&Part] = &[
    &law::PART,
    &runtime::PART,
    &host::PART,
    &qemu::PART,
    &link::PART,
    &hal::PART,
    &board::PART,
    &stm32::PART,
    &stm32h743::PART,
    &stm32f4::PART,
    &tick::PART,
    &rt::PART,
    &rt_pc::PART,
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
    PARTS.iter().copied().filter(|part| wanted.contains(part.folder) && !part.files.is_empty()).collect()
}
