//! The controller as a shared library for this computer.

use super::{Part, files};

pub static PART: Part = Part {
    folder: "host",
    member: true,
    what: "the same controller as a shared library: `cargo build --release`",
    needs: "a host toolchain",
    with: &[],
    files: files! { "host":
        "Cargo.toml",
        "build.rs",
        "src/lib.rs",
    },
};
