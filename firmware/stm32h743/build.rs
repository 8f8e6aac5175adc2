//! Tells the linker where the memory map is and which layout to use, and refuses a build that would be too slow for a tick.

use std::env::var;
use std::path::PathBuf;
use std::process::exit;

fn main() {
    let flags = var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    let is_meant = var("TARGET").is_ok_and(|target| target == "thumbv7em-none-eabihf")
        && flags.contains("target-cpu=cortex-m7")
        && var("PROFILE").is_ok_and(|profile| profile == "release");
    if !is_meant {
        eprintln!(
            "error: this would compute floating-point numbers in software, or without optimisation: no tick would be in time\n\
             = help: `specgen build SPEC --target stm32h743`, or in this folder, whose .cargo/config.toml says the rest:\n        \
             cargo build --release"
        );
        exit(1);
    }
    // Cargo always sets it for a build script.
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    println!("cargo:rustc-link-search={}", root.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    // What finds no room in ITCM or DTCM stays in flash, see memory.x.
    println!("cargo:rustc-link-arg-bins=--enable-non-contiguous-regions");
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed=build.rs");
}
