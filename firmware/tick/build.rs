//! Gives the linker the memory layout, that of `../qemu`.

use std::path::PathBuf;

fn main() {
    // Cargo always sets this for a build script.
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    println!("cargo:rustc-link-search={}", root.join("../qemu").display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rerun-if-changed=../qemu/link.x");

    // See ../qemu/src/panic.rs.
    println!("cargo:rustc-check-cfg=cfg(specgen_locate_panics)");
    println!("cargo:rerun-if-env-changed=SPECGEN_LOCATE_PANICS");
    if std::env::var_os("SPECGEN_LOCATE_PANICS").is_some() {
        println!("cargo:rustc-cfg=specgen_locate_panics");
    }
}
