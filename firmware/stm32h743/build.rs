//! Tells the linker where the memory map is and which layout to use.

use std::path::PathBuf;

fn main() {
    // Cargo always sets it for a build script.
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    println!("cargo:rustc-link-search={}", root.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rerun-if-changed=memory.x");
}
