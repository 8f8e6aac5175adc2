//! Runs an image in QEMU, in a folder of its own, with a time limit.

use super::build::Image;
use super::error::TargetError;
use super::process::{self, find_in_path, first_line};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus};
use std::time::Duration;

/// QEMU for ARM.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Emulator {
    /// `qemu-system-arm`.
    pub program: PathBuf,
    /// The first line of `--version`.
    pub version: String,
}

/// How the firmware says why it ended: the codes of `firmware/qemu/src/semihosting.rs`.
const EXITS: [(i32, &str); 7] = [
    (10, "the firmware cannot open config.bin"),
    (11, "config.bin does not hold as many words as the controller's Config"),
    (12, "the firmware cannot open input.bin"),
    (13, "input.bin ends within a row: rows must hold as many words as the controller's TickInput"),
    (14, "the firmware cannot write output.bin or stats.bin; is the disk full?"),
    (15, "the processor took a fault"),
    (20, "tables or settings in the image are not what specgen wrote: it was changed after the link"),
];
/// Statuses from here on name the word of the configuration that the controller refuses.
const CONFIG_REFUSED: i32 = 64;

impl Emulator {
    /// Finds it on `PATH`.
    ///
    /// # Errors
    /// [`TargetError::MissingTool`] with the command that installs it.
    pub fn find() -> Result<Self, TargetError> {
        let missing = || TargetError::MissingTool {
            tool: "QEMU for ARM".into(),
            looked: "qemu-system-arm on PATH".into(),
            command: "apt-get install qemu-system-arm".into(),
        };
        let program = find_in_path("qemu-system-arm").ok_or_else(missing)?;
        let version = first_line(Command::new(&program).arg("--version")).ok_or_else(missing)?;
        Ok(Self { program, version })
    }

    /// Runs the image to its end with `folder` as its working folder: semihosting files live there.
    ///
    /// `-icount shift=10` makes the run repeatable and lets the firmware count instructions.
    ///
    /// # Errors
    /// [`TargetError::EmulatorTimeout`] at the limit, [`TargetError::EmulatorFailed`] for any other end than
    /// the firmware's own "done".
    pub fn run(&self, image: &Image, folder: &Path, limit: Duration) -> Result<(), TargetError> {
        let mut command = self.command(image, folder)?;
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

    /// What starts the image with `folder` as its working folder.
    pub(crate) fn command(&self, image: &Image, folder: &Path) -> Result<Command, TargetError> {
        let kernel = folder.join("image.elf");
        std::fs::write(&kernel, &image.elf).map_err(|e| TargetError::io("writing", &kernel, e))?;
        let mut command = Command::new(&self.program);
        command
            .current_dir(folder)
            .args(["-machine", image.mcu.machine(), "-cpu", image.mcu.core()])
            .args(["-icount", "shift=10", "-semihosting-config", "enable=on,target=native"])
            .args(["-display", "none", "-monitor", "none", "-serial", "none"])
            .args(["-kernel", "image.elf"]);
        Ok(command)
    }
}

/// Why it ended, and what it printed.
pub(crate) fn ended(status: ExitStatus, stderr: &str) -> String {
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
