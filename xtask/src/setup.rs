//! What has to be on the machine before anything can be tested. Cross compiler and QEMU: `maintain setup`.

use crate::run::Outcome;
use std::path::Path;
use std::process::{Command, Stdio};

/// The target of microcontrollers.
pub const TRIPLE: &str = "thumbv7em-none-eabihf";
/// Set to `1`, a test that misses a tool fails.
pub const REQUIRE_TOOLS: &str = "SPECGEN_REQUIRE_TOOLS";
/// Set to `1`, what needs a tool that cannot be installed is skipped, and said so.
const ALLOW_MISSING: &str = "SPECGEN_ALLOW_MISSING";

/// A part of the Rust toolchain that comes on its own, such as `clippy`; installed if need be.
///
/// # Errors
/// It is missing, and rustup does not bring it.
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
    // Whether it helped is asked of cargo itself.
    let _ = Command::new("rustup").args(["component", "add", name]).status();
    if works() {
        return Ok(());
    }
    Err(missing(format!("{name} is not installed; install it with: rustup component add {name}")))
}

/// Whether the compiler that cargo takes here has the library of microcontrollers: another one may be the cross compiler.
#[must_use]
pub fn has_target() -> bool {
    let printed = Command::new("rustc").args(["--print", "target-libdir", "--target", TRIPLE]).output();
    printed.is_ok_and(|output| Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir())
}

/// A failure, unless the user allows that something is missing.
#[must_use]
pub fn missing(why: String) -> Outcome {
    if std::env::var_os(ALLOW_MISSING).is_some_and(|value| value == "1") {
        Outcome::Skipped(why)
    } else {
        Outcome::Failed(format!("{why}   ({ALLOW_MISSING}=1 skips what needs it)"))
    }
}
