//! Makes the program smaller by 4 MB where rustc links with the linker that comes with it, and adds nothing with another linker:
//! functions with the same machine code and constants with the same bytes are kept once, and relocations are packed. The latter
//! needs the same glibc where it runs, so a build with flags of its own, such as that of a release, does without.

use std::path::Path;
use std::process::Command;
use std::{env, io};

fn main() -> io::Result<()> {
    println!("cargo:rerun-if-changed=build.rs");
    let of = |name: &str| env::var(name).unwrap_or_default();
    let rustc = Command::new(of("RUSTC")).args(["--print", "target-libdir"]).output()?;
    let folder = String::from_utf8_lossy(&rustc.stdout).trim().to_owned();
    let linker = Path::new(&folder).with_file_name("bin").join("gcc-ld/ld.lld");
    let is_chosen = !of("RUSTC_LINKER").is_empty() || of("CARGO_ENCODED_RUSTFLAGS").contains("link");
    if of("TARGET") == "x86_64-unknown-linux-gnu" && linker.is_file() && !is_chosen {
        println!("cargo:rustc-link-arg-bins=-Wl,--icf=all,--ignore-data-address-equality");
        let glibc = Command::new("getconf").arg("GNU_LIBC_VERSION").output().map(|output| output.stdout);
        let glibc = String::from_utf8_lossy(&glibc.unwrap_or_default()).trim().to_owned();
        let minor: Option<u32> = glibc.strip_prefix("glibc 2.").and_then(|minor| minor.parse().ok());
        if of("CARGO_ENCODED_RUSTFLAGS").is_empty() && minor.is_some_and(|minor| minor >= 36) {
            println!("cargo:rustc-link-arg-bins=-Wl,-z,pack-relative-relocs");
        }
    }
    Ok(())
}
