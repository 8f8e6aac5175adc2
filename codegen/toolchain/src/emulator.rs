//! Runs an image in QEMU, in its own folder, with a time limit.

use super::build::Image;
use super::error::TargetError;
use super::places::Places;
use super::process::{self, first_line, with_libraries};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::Duration;

/// QEMU for ARM.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Emulator {
    /// `qemu-system-arm`.
    pub program: PathBuf,
    /// The first line of `--version`.
    pub version: String,
    /// Folders of its libraries, if the loader does not find them.
    pub libraries: Vec<PathBuf>,
}

/// Name of the program and of Debian's package.
pub(super) const PROGRAM: &str = "qemu-system-arm";
/// A machine that every sufficiently recent version has.
const MACHINE: &str = "mps2-an500";

/// Exit codes of the firmware: see `firmware/qemu/src/semihosting.rs`.
const EXITS: [(i32, &str); 8] = [
    (10, "the firmware cannot open config.bin"),
    (11, "config.bin does not have the number of words of the controller's Config"),
    (12, "the firmware cannot open input.bin"),
    (13, "input.bin ends within a row: a row must have the number of words of the controller's TickInput"),
    (14, "the firmware cannot write output.bin or stats.bin; is the disk full?"),
    (15, "the processor raised a fault"),
    (16, "the machine under timing left the phase Running"),
    (20, "tables or settings in the image were changed after linking"),
];
/// Exit codes from here on give the index of the configuration word that the controller refuses.
const CONFIG_REFUSED: i32 = 64;

impl Emulator {
    /// The first working emulator on `PATH`, in the usual folders, or unpacked by [`provision`](super::provision).
    ///
    /// # Errors
    /// [`TargetError::MissingTool`] with the command that installs it.
    pub fn find() -> Result<Self, TargetError> {
        Self::find_in(&Places::here())
    }

    /// [`Emulator::find`] in the given places.
    ///
    /// # Errors
    /// As [`Emulator::find`].
    pub fn find_in(places: &Places) -> Result<Self, TargetError> {
        let unpacked = places.unpacked(PROGRAM).and_then(|at| Some((at.program(PROGRAM)?, at.libraries())));
        let candidates: Vec<_> = places.all(PROGRAM).map(|program| (program, Vec::new())).chain(unpacked).collect();
        let found = candidates.iter().find_map(|(program, libraries)| Self::at(program, libraries));
        found.ok_or_else(|| TargetError::MissingTool {
            tool: "QEMU for ARM".into(),
            looked: match candidates.first() {
                None => format!("{PROGRAM} on PATH and in specgen's cache"),
                Some((broken, _)) => {
                    format!("a working {PROGRAM}; {} does not run or does not support {MACHINE}", broken.display())
                }
            },
            command: format!("{}   (manually: {})", super::SET_UP, install_command()),
        })
    }

    /// The program, if it runs and supports the machine.
    fn at(program: &Path, libraries: &[PathBuf]) -> Option<Self> {
        let version = first_line(with_libraries(Command::new(program).arg("--version"), libraries))?;
        let mut machines = Command::new(program);
        let listed =
            with_libraries(machines.args(["-machine", "help"]), libraries).stdin(Stdio::null()).output().ok()?;
        let knows = String::from_utf8_lossy(&listed.stdout).lines().any(|line| line.starts_with(MACHINE));
        knows.then(|| Self { program: program.to_owned(), version, libraries: libraries.to_vec() })
    }

    /// Runs the image to its end in `folder`, which holds the semihosting files.
    ///
    /// `-icount shift=10` makes the run repeatable and lets the firmware count instructions. `more` are additional arguments.
    ///
    /// # Errors
    /// [`TargetError::EmulatorTimeout`] at the limit, [`TargetError::EmulatorFailed`] for any exit other than
    /// the firmware's own "done".
    pub fn run(&self, image: &Image, folder: &Path, more: &[&str], limit: Duration) -> Result<(), TargetError> {
        let mut command = self.command(image, folder)?;
        command.args(more);
        let finished =
            process::run(&mut command, folder, limit).map_err(|e| TargetError::io("running", &self.program, e))?;
        let Some(status) = finished.status else {
            return Err(TargetError::EmulatorTimeout { seconds: limit.as_secs() });
        };
        if status.success() {
            return Ok(());
        }
        Err(TargetError::EmulatorFailed { text: ended(status, &finished.stderr) })
    }

    /// The command that runs the image in `folder`.
    pub fn command(&self, image: &Image, folder: &Path) -> Result<Command, TargetError> {
        let kernel = folder.join("image.elf");
        std::fs::write(&kernel, &image.elf).map_err(|e| TargetError::io("writing", &kernel, e))?;
        let mut command = Command::new(&self.program);
        with_libraries(&mut command, &self.libraries)
            .current_dir(folder)
            .args(["-machine", image.mcu.part().emulated, "-cpu", image.mcu.part().core])
            .args(["-icount", "shift=10", "-semihosting-config", "enable=on,target=native"])
            .args(["-display", "none", "-monitor", "none", "-serial", "none"])
            .args(["-kernel", "image.elf"]);
        Ok(command)
    }
}

/// The command that installs it.
pub fn install_command() -> String {
    if cfg!(target_os = "macos") { "brew install qemu".into() } else { format!("apt-get install {PROGRAM} on Debian") }
}

/// Reason of the exit, and what the emulator printed.
pub fn ended(status: ExitStatus, stderr: &str) -> String {
    let mut text = match status.code() {
        Some(code) if code >= CONFIG_REFUSED => format!(
            "the controller refuses word {} of the configuration (see its CONFIG_NAMES and Config::from_words)",
            code - CONFIG_REFUSED
        ),
        Some(code) => {
            let words = EXITS.iter().find(|(known, _)| *known == code).map(|(_, words)| *words);
            words.map_or_else(|| format!("{status}"), ToOwned::to_owned)
        }
        None => format!("{status}"),
    };
    let stderr = stderr.trim();
    if !stderr.is_empty() {
        text = format!("{text}; it printed: {stderr}");
    }
    text
}
