//! The build script of every board: gives the linker the memory map and the layout, and refuses a build that
//! would be too slow for a tick.

use std::env::var;
use std::path::PathBuf;
use std::process::exit;

fn main() {
    // Cargo always sets this for a build script.
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let manifest = std::fs::read_to_string(root.join("Cargo.toml")).unwrap_or_default();
    let value = |key: &str| {
        let found = manifest.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "));
        found.map(|value| value.trim_matches('"'))
    };
    let flags = var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    let is_meant = var("TARGET").is_ok_and(|target| target == "thumbv7em-none-eabihf")
        && value("core").is_some_and(|core| flags.contains(&format!("target-cpu={core}")))
        && var("PROFILE").is_ok_and(|profile| profile == "release");
    if !is_meant {
        let target = root.file_name().unwrap_or_default().to_string_lossy();
        eprintln!(
            "error: this would compute floating-point numbers in software, or without optimisation: no tick would be in time\n\
             = help: `specgen build SPEC --target {target}`, or in this folder, whose .cargo/config.toml says the rest:\n        \
             cargo build --release"
        );
        exit(1);
    }
    println!("cargo:rustc-link-search={}", root.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    if let Some(argument) = value("link-arg") {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    for file in ["Cargo.toml", "memory.x"] {
        println!("cargo:rerun-if-changed={file}");
    }
}
