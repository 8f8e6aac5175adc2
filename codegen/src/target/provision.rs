//! Installs what building and running for a microcontroller needs.
//!
//! First choice is `rustup target add`; where rustup is absent or cannot fetch, Debian's packages, as root or
//! with a `sudo` that asks no password. Nothing that is installed is removed, no configuration is edited.

use super::emulator::Emulator;
use super::error::TargetError;
use super::process::{clean_command, find_in_path, first_line};
use super::toolchain;
use super::{TRIPLE, Tools, available};
use std::process::{Command, Stdio};

const DEBIAN_COMPILER: [&str; 3] = ["rustc-web", "cargo-web", "rust-web-src"];
const DEBIAN_LINKER: &str = "lld";
const DEBIAN_EMULATOR: &str = "qemu-system-arm";

/// Installs what is missing and returns what is there then. `say` is told every step before it is taken.
///
/// # Errors
/// [`TargetError::MissingTool`] for what could not be installed, with the command for someone who may.
pub fn provision(say: &mut dyn FnMut(&str)) -> Result<Tools, TargetError> {
    if let Err(missing) = toolchain::find() {
        say(&missing.to_string());
        install_compiler(say);
    }
    if let Err(missing) = Emulator::find() {
        say(&missing.to_string());
        apt_install(&[DEBIAN_EMULATOR], say);
    }
    let tools = available()?;
    say(&format!("cross compiler: {} ({})", tools.toolchain.version, tools.toolchain.rustc.display()));
    say(&format!("emulator: {}", tools.emulator.version));
    Ok(tools)
}

/// Tries one way after the other; [`toolchain::find`] judges the result.
fn install_compiler(say: &mut dyn FnMut(&str)) {
    if let Some(rustup) = find_in_path("rustup") {
        run(clean_command(rustup).args(["target", "add", TRIPLE]), say);
        if toolchain::find().is_ok() {
            return;
        }
    }
    apt_install(&DEBIAN_COMPILER, say);
    if matches!(toolchain::find(), Err(TargetError::MissingTool { tool, .. }) if tool == toolchain::LINKER) {
        apt_install(&[DEBIAN_LINKER], say);
    }
}

fn apt_install(packages: &[&str], say: &mut dyn FnMut(&str)) {
    let Some(apt) = find_in_path("apt-get") else {
        say("there is no apt-get here, so nothing can be installed");
        return;
    };
    let Some(prefix) = become_root() else {
        say(&format!("not root, and sudo wants a password: apt-get install {} is left to you", packages.join(" ")));
        return;
    };
    let apt_command = || {
        let mut words = prefix.iter().map(String::as_str).chain([apt.to_str().unwrap_or("apt-get")]);
        let mut command = Command::new(words.next().unwrap_or("apt-get"));
        command.args(words).env("DEBIAN_FRONTEND", "noninteractive");
        command
    };
    // Package lists may be old or absent on a fresh machine; if this fails, the install may still work.
    run(apt_command().args(["update", "-qq"]), say);
    // `--no-remove`: rather fail than replace a compiler that someone installed.
    run(apt_command().args(["install", "-y", "-qq", "--no-install-recommends", "--no-remove"]).args(packages), say);
}

/// What to put before a command so that it runs as root: nothing, or sudo; `None` if neither works.
fn become_root() -> Option<Vec<String>> {
    if first_line(Command::new("id").arg("-u")).as_deref() == Some("0") {
        return Some(Vec::new());
    }
    let allowed = Command::new("sudo")
        .args(["-n", "true"])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success());
    allowed.then(|| vec!["sudo".to_owned(), "-n".to_owned()])
}

/// Runs a command in full view; says so if it fails.
fn run(command: &mut Command, say: &mut dyn FnMut(&str)) {
    let words: Vec<String> = std::iter::once(command.get_program())
        .chain(command.get_args())
        .map(|word| word.to_string_lossy().into_owned())
        .collect();
    let shown = words.join(" ");
    say(&format!("running: {shown}"));
    match command.stdin(Stdio::null()).status() {
        Ok(status) if status.success() => {}
        Ok(status) => say(&format!("{shown} failed ({status})")),
        Err(error) => say(&format!("{shown} cannot be run: {error}")),
    }
}
