//! Tools that the tests need. Cross compiler and QEMU are installed by `maintain setup`.

use crate::run::Outcome;
use std::path::Path;
use std::process::{Command, Stdio};

/// Target triple of microcontrollers.
pub const TRIPLE: &str = "thumbv7em-none-eabihf";
/// If set to `1`, a test fails if its tool is missing.
pub const REQUIRE_TOOLS: &str = "SPECGEN_REQUIRE_TOOLS";
/// If set to `1`, steps that need a tool that cannot be installed are skipped and reported.
const ALLOW_MISSING: &str = "SPECGEN_ALLOW_MISSING";

/// Installs a component of the Rust toolchain, such as `clippy`, if it is missing.
///
/// # Errors
/// It is missing, and rustup cannot install it.
pub fn component(name: &str, subcommand: &str) -> Result<(), Outcome> {
    let works = || {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut command = Command::new(cargo);
        command.args([subcommand, "--version"]).stdout(Stdio::null()).stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    };
    if works() {
        return Ok(());
    }
    println!("running: rustup component add {name}");
    // Cargo itself shows whether it helped.
    let _ = Command::new("rustup").args(["component", "add", name]).status();
    if works() {
        return Ok(());
    }
    Err(missing(format!("{name} is not installed; install it with: rustup component add {name}")))
}

/// Whether cargo's own compiler has the library for microcontrollers; the cross compiler may be another one.
pub fn has_target() -> bool {
    let printed = Command::new("rustc").args(["--print", "target-libdir", "--target", TRIPLE]).output();
    printed.is_ok_and(|output| Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir())
}

/// A failure, or a skip if the user allows missing tools.
pub fn missing(why: String) -> Outcome {
    if std::env::var_os(ALLOW_MISSING).is_some_and(|value| value == "1") {
        Outcome::Skipped(why)
    } else {
        Outcome::Failed(format!("{why}   ({ALLOW_MISSING}=1 skips what needs it)"))
    }
}
