//! Makes undefined symbols an error of the linker. By default a shared library may have them, and the proof that no panic path
//! remains (see `src/lib.rs`) would never fail.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-z,defs");
        // For `memcpy` and `memset`, which the compiler calls by itself.
        println!("cargo::rustc-cdylib-link-arg=-lc");
    }
}
