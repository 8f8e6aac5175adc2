//! Installs what is needed to build and run for a microcontroller, using the first method that works.
//!
//! 1. The installed tool, if it works.
//! 2. `rustup target add` for the compiler.
//! 3. Debian's packages, installed as root or through sudo without a password.
//! 4. The same packages, [unpacked] into a folder of the user's cache.
//!
//! It removes no installed package, edits no configuration and asks for no password.

use super::apt::{Apt, Refusal};
use super::emulator::{self, Emulator};
use super::error::TargetError;
use super::places::Places;
use super::process::{self, clean_command};
use super::toolchain::{self, Toolchain};
use super::{TRIPLE, Tools, engine, unpacked};
use specgen_language::interrupt::Scratch;
use std::path::PathBuf;
use std::time::Duration;

/// Time limit of rustup, which downloads some megabytes.
const RUSTUP_LIMIT: Duration = Duration::from_secs(600);

/// Installs missing tools and returns all tools. `say` receives each step before it starts.
///
/// # Errors
/// [`TargetError::SetUpFailed`] with the methods that were tried and what to do manually.
pub fn provision(say: &mut dyn FnMut(&str)) -> Result<Tools, TargetError> {
    provision_in(&Places::here(), say)
}

/// [`provision`] in the given places.
fn provision_in(places: &Places, say: &mut dyn FnMut(&str)) -> Result<Tools, TargetError> {
    let toolchain = compiler(places, say);
    // The emulator is useful without a compiler: `pil --elf`.
    let emulator = emulator(places, say);
    if let (Err(_), Err(second)) = (&toolchain, &emulator) {
        // Only the first error is returned, so report the second here.
        say(&second.to_string());
    }
    let tools = Tools { toolchain: toolchain?, emulator: emulator? };
    say(&format!("cross compiler: {} ({})", tools.toolchain.version, tools.toolchain.rustc.display()));
    say(&format!("emulator: {} ({})", tools.emulator.version, tools.emulator.program.display()));
    Ok(tools)
}

fn compiler(places: &Places, say: &mut dyn FnMut(&str)) -> Result<Toolchain, TargetError> {
    let find = || toolchain::find_in(places);
    let mut search = Search { places, say, tried: Vec::new() };
    let found = search.already(&find).or_else(|| search.way("rustup target add", &find, rustup));
    if let Some(found) = found {
        return Ok(found);
    }
    let mut packages = toolchain::PACKAGES.to_vec();
    if !toolchain::has_linker(places) {
        packages.push(toolchain::LINKER_PACKAGE);
    }
    search.debian(&packages, &find).ok_or_else(|| search.failed("a Rust compiler", toolchain::install_command()))
}

fn emulator(places: &Places, say: &mut dyn FnMut(&str)) -> Result<Emulator, TargetError> {
    let find = || Emulator::find_in(places);
    let mut search = Search { places, say, tried: Vec::new() };
    let found = search.already(&find).or_else(|| search.debian(&[emulator::PROGRAM], &find));
    found.ok_or_else(|| search.failed("QEMU for ARM", emulator::install_command()))
}

/// Installs the engine of the emulated boards and returns its path. Not part of [`Tools`]: only this repository's tests need it.
///
/// # Errors
/// As [`provision`].
pub fn engine(say: &mut dyn FnMut(&str)) -> Result<PathBuf, TargetError> {
    let places = Places::here();
    let find = || engine::find_in(&places);
    let mut search = Search { places: &places, say, tried: Vec::new() };
    let found = search.already(&find).or_else(|| search.debian(&[engine::PACKAGE], &find));
    found.ok_or_else(|| search.failed("the Unicorn engine", engine::install_command()))
}

/// Looks for a tool; decides whether a method worked.
type Find<'a, T> = &'a dyn Fn() -> Result<T, TargetError>;

/// The search for one tool.
struct Search<'a> {
    places: &'a Places,
    say: &'a mut dyn FnMut(&str),
    /// Each method that was tried, and why it failed.
    tried: Vec<String>,
}

impl Search<'_> {
    /// The installed tool; reports if it is missing.
    fn already<T>(&mut self, find: Find<'_, T>) -> Option<T> {
        find().map_err(|missing| (self.say)(&missing.to_string())).ok()
    }

    /// Installs or unpacks Debian's packages.
    fn debian<T>(&mut self, packages: &[&str], find: Find<'_, T>) -> Option<T> {
        let mut offline = false;
        let installed = self.way("apt-get install", find, |places, say| {
            let apt = Apt::of_the_system(places)?;
            say(&format!("running: {}", apt.shown(packages)));
            let done = apt.install(packages);
            offline = done == Err(Refusal::NoNetwork);
            done
        });
        if installed.is_some() || offline {
            return installed;
        }
        self.way("unpacked packages", find, |places, say| {
            unpacked::fetch(packages[0], packages, places, &|| find().is_ok(), say)
        })
    }

    /// Tries one method. If the tool is still missing, returns `None` and records why.
    fn way<T>(
        &mut self,
        name: &str,
        find: Find<'_, T>,
        go: impl FnOnce(&Places, &mut dyn FnMut(&str)) -> Result<(), Refusal>,
    ) -> Option<T> {
        let why = match go(self.places, &mut *self.say) {
            Ok(()) => match find() {
                Ok(found) => return Some(found),
                Err(_) => "the installed tool does not work".to_owned(),
            },
            Err(refusal) => refusal.to_string(),
        };
        (self.say)(&format!("{name}: {why}"));
        self.tried.push(format!("{name}: {why}"));
        None
    }

    fn failed(&self, tool: &str, command: String) -> TargetError {
        TargetError::SetUpFailed { tool: tool.to_owned(), tried: self.tried.clone(), command }
    }
}

fn rustup(places: &Places, say: &mut dyn FnMut(&str)) -> Result<(), Refusal> {
    let rustup = places.program("rustup").ok_or_else(|| Refusal::other("rustup was not found"))?;
    say(&format!("running: rustup target add {TRIPLE}"));
    let failed = |error: std::io::Error| Refusal::other(format!("rustup cannot be run: {error}"));
    let scratch = Scratch::new().map_err(failed)?;
    let mut command = clean_command(rustup);
    let done = process::run(command.args(["target", "add", TRIPLE]), scratch.path(), RUSTUP_LIMIT).map_err(failed)?;
    if done.success() {
        return Ok(());
    }
    let why = done.stderr.lines().find_map(|line| line.strip_prefix("error: ")).unwrap_or("no reason given");
    // The rest are addresses and nested causes.
    Err(Refusal::other(why.split(": ").next().unwrap_or(why)))
}

#[cfg(test)]
mod tests;
