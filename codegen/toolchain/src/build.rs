//! Builds `DIR/qemu` of an emitted workspace into an image.

use super::cache;
use super::error::TargetError;
use super::panics;
use super::process::{self, ProgramOutput};
use super::toolchain::{self, Toolchain};
use specgen_language::interrupt::Scratch;
use specgen_language::model::Mcu;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// A clean build of `core`, the dependencies and the image takes about a minute on two cores.
const LIMIT: Duration = Duration::from_secs(900);

/// A linked image, ready for [`replay`](super::replay()) and the analyses.
#[derive(Debug, Clone)]
pub struct Image {
    /// The part that it was built for.
    pub mcu: Mcu,
    /// The ELF file.
    pub elf: Vec<u8>,
    /// Where cargo put it; the next build into the same folder overwrites it.
    pub path: PathBuf,
    /// `rustc --version` of its compiler.
    pub compiler: String,
}

/// Folder of the image that runs in QEMU.
pub const EMULATED: &str = "qemu";

/// Builds `dir/qemu` for the core of `mcu`, with the toolchain that [`toolchain::find`] finds.
///
/// `target_dir` holds reusable build products: share it between builds. It is locked during a build.
/// `Cargo.lock` is respected; nothing is downloaded if the crates are in cargo's cache.
///
/// # Errors
/// [`TargetError::MissingTool`] without a cross compiler, [`TargetError::BrokenTool`] if a crate or a component of it is missing,
/// [`TargetError::PanicPath`] if the controller can panic, [`TargetError::BuildFailed`] for any other error of cargo.
pub fn build_image(dir: &Path, mcu: Mcu, target_dir: &Path) -> Result<Image, TargetError> {
    build_image_with(&toolchain::find()?, dir, mcu, target_dir)
}

/// [`build_image`] with a given toolchain.
///
/// # Errors
/// As [`build_image`].
pub fn build_image_with(toolchain: &Toolchain, dir: &Path, mcu: Mcu, target_dir: &Path) -> Result<Image, TargetError> {
    build_program(toolchain, dir, EMULATED, mcu, target_dir, &["--bin", "replay"])
}

/// Like [`build_image`], but builds the image that `specgen_operate::pil` talks to.
///
/// # Errors
/// As [`build_image`].
pub fn build_pil(dir: &Path, mcu: Mcu, target_dir: &Path) -> Result<Image, TargetError> {
    build_program(&toolchain::find()?, dir, EMULATED, mcu, target_dir, &["--bin", "pil", "--features", "pil"])
}

/// Builds the firmware in `dir/folder` for `mcu`; with `lockstep`, a host can step the machine tick by tick.
///
/// # Errors
/// As [`build_image`].
pub fn build_folder(
    toolchain: &Toolchain,
    dir: &Path,
    folder: &str,
    mcu: Mcu,
    target_dir: &Path,
    lockstep: bool,
) -> Result<Image, TargetError> {
    let features: &[&str] = if lockstep { &["--features", "lockstep"] } else { &[] };
    build_program(toolchain, dir, folder, mcu, target_dir, features)
}

fn build_program(
    toolchain: &Toolchain,
    dir: &Path,
    folder: &str,
    mcu: Mcu,
    target_dir: &Path,
    program: &[&str],
) -> Result<Image, TargetError> {
    let package = dir.join(folder);
    let place = if folder == EMULATED { mcu.part().emulated } else { mcu.part().name };
    let what = format!("{} for {place}", package.display());
    // All parts share one target folder: cargo keeps builds with other flags apart and compiles host tools only once.
    let request = BuildRequest { package: &package, target_dir, rustc_args: &[], locked: true };
    let cpu = format!("-Ctarget-cpu={}", mcu.part().core);
    // A package may have several images; the requested one comes last.
    let link = |command: &mut Command| {
        cargo_artifact(command, &request, &what, |message| message["executable"].as_str().map(PathBuf::from))
    };
    let cargo = || {
        let mut command = toolchain.cargo_build(&[&cpu]);
        command.args(program);
        command
    };
    let executable = link(&mut cargo()).map_err(|error| match error {
        TargetError::PanicPath { what, text } => {
            // Link again without the panic check, to locate the panic paths.
            let traced = link(cargo().env("SPECGEN_LOCATE_PANICS", "1"));
            let sites = traced.and_then(|image| panics::sites(&image.bytes));
            // Report the original error even if the search fails.
            let text = sites.map_or(text, |sites| sites.join("\n"));
            TargetError::PanicPath { what, text }
        }
        other => other,
    })?;
    Ok(Image { mcu, elf: executable.bytes, path: executable.path, compiler: toolchain.version.clone() })
}

/// A file that cargo built.
pub(super) struct Artifact {
    /// Where cargo put it, or where a [cached](cache) build was restored. Another build into the same folder overwrites it.
    pub path: PathBuf,
    /// Its content, read before another build can replace it.
    pub bytes: Vec<u8>,
}

/// What to build, and where.
pub(super) struct BuildRequest<'a> {
    /// Folder of the package.
    pub package: &'a Path,
    /// The target folder of cargo.
    pub target_dir: &'a Path,
    /// Arguments of `cargo rustc` after `--`.
    pub rustc_args: &'a [&'a str],
    /// Fail if `Cargo.lock` is absent or out of date: for packages with registry dependencies.
    pub locked: bool,
}

/// Runs a cargo build and reads the artifact that `pick` selects from cargo's messages.
pub(super) fn cargo_artifact(
    command: &mut Command,
    request: &BuildRequest<'_>,
    what: &str,
    pick: impl Fn(&serde_json::Value) -> Option<PathBuf>,
) -> Result<Artifact, TargetError> {
    let package = request.package;
    let target_dir = std::path::absolute(request.target_dir)
        .map_err(|error| TargetError::io("resolving", request.target_dir, error))?;
    let slot = cache::Slot::of(command, package, request.rustc_args);
    fs::create_dir_all(&target_dir).map_err(|e| TargetError::io("creating", &target_dir, e))?;
    let lock_path = target_dir.join("specgen.lock");
    let lock = File::create(&lock_path).map_err(|e| TargetError::io("creating", &lock_path, e))?;
    // Cargo releases its own lock when it exits; this one is held until the artifact has been read.
    lock.lock().map_err(|e| TargetError::io("locking", &lock_path, e))?;
    if let Some((path, bytes)) = slot.as_ref().map(|slot| slot.fetch(&target_dir)).transpose()?.flatten() {
        return Ok(Artifact { path, bytes });
    }
    command
        // Cargo reads its configuration from the working folder upwards, so run it in the package.
        .current_dir(package)
        .args(["--message-format=json-render-diagnostics", "--color=never"])
        .arg("--target-dir")
        .arg(&target_dir);
    if request.locked {
        command.arg("--locked");
    }
    if !request.rustc_args.is_empty() {
        command.arg("--").args(request.rustc_args);
    }
    let scratch = Scratch::new().map_err(|e| TargetError::io("creating a folder in", std::env::temp_dir(), e))?;
    let finished =
        process::run(command, scratch.path(), LIMIT).map_err(|e| TargetError::io("running cargo in", package, e))?;
    if !finished.success() {
        return Err(failure(what, &finished));
    }
    let (path, fresh) = finished
        .stdout
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter_map(|message| Some((pick(&message)?, message["fresh"] == true)))
        .next_back()
        .ok_or_else(|| TargetError::BuildFailed {
            what: what.to_owned(),
            text: "cargo succeeded but reported no artifact of the expected kind".into(),
        })?;
    let bytes = fs::read(&path).map_err(|e| TargetError::io("reading", &path, e))?;
    // If cargo considered the artifact fresh, it may have been damaged since it was built: do not cache it.
    if let Some(slot) = slot.filter(|_| !fresh) {
        slot.keep(&target_dir, &path, &bytes);
    }
    Ok(Artifact { path, bytes })
}

/// Turns cargo's output into an error, in our own words for known causes.
fn failure(what: &str, finished: &ProgramOutput) -> TargetError {
    let text = useful_part(&finished.stderr);
    if finished.status.is_none() {
        let text = format!("stopped after the limit of {} s; output so far:\n{text}", LIMIT.as_secs());
        return TargetError::BuildFailed { what: what.to_owned(), text };
    }
    let is_proof = |line: &&str| line.contains("undefined") && line.contains("specgen_panic_path_remains");
    if let Some(line) = finished.stderr.lines().find(is_proof) {
        let text = line.trim().to_owned();
        return TargetError::PanicPath { what: what.to_owned(), text };
    }
    // The machine is at fault, not the workspace: no network for a crate, or an incomplete compiler.
    const BROKEN: [&str; 5] = [
        "failed to download",
        "failed to get `",
        "failed to load source for dependency",
        "can't find crate for `core`",
        "linker `rust-lld` not found",
    ];
    let is_broken = |line: &&str| BROKEN.iter().any(|words| line.contains(words));
    if let Some(line) = finished.stderr.lines().find(is_broken) {
        return TargetError::BrokenTool { tool: format!("the compiler of {what}"), text: line.trim().to_owned() };
    }
    TargetError::BuildFailed { what: what.to_owned(), text }
}

/// The output from the first error on, without the linker's command line; at most forty lines.
fn useful_part(stderr: &str) -> String {
    let lines: Vec<&str> = stderr
        .lines()
        .skip_while(|line| !line.starts_with("error"))
        .filter(|line| line.len() < 1000)
        .take(40)
        .collect();
    if lines.is_empty() { stderr.trim_end().to_owned() } else { lines.join("\n") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_report_starts_at_the_first_error_and_leaves_out_the_link_line() {
        let stderr =
            format!("   Compiling a\nwarning: x\nerror: linking failed\n  = note: {}\n  = note: y\n", "z".repeat(2000));
        assert_eq!(useful_part(&stderr), "error: linking failed\n  = note: y");
        assert_eq!(useful_part("killed\n"), "killed");
    }
}
