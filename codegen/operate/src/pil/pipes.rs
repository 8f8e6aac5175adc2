//! The image in QEMU, reached through two named pipes that its firmware opens by semihosting.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use rustix::event::PollFlags;
use rustix::fs::{CWD, Mode, mkfifoat};
use specgen_link::client::Port;

use super::wait::ready;
use specgen_language::interrupt::Scratch;
use specgen_toolchain::emulator::{self, Emulator};
use specgen_toolchain::{Image, TargetError};

/// Interval of checks that the emulator is running.
const LOOK: Duration = Duration::from_millis(20);
/// How long the emulator may take to exit.
const END: Duration = Duration::from_secs(2);

/// A running emulator. Dropping it closes the pipe, on which the firmware exits; otherwise the process is killed.
pub struct Pipes {
    emulator: Child,
    /// None once the emulator should exit.
    to: Option<File>,
    from: File,
    /// Image, pipes and output of the emulator.
    folder: Scratch,
}

impl Pipes {
    /// Starts an image of [`specgen_toolchain::build_pil`].
    ///
    /// # Errors
    /// [`TargetError::Io`] if the system refuses a folder, a pipe or the program.
    pub fn start(emulator: &Emulator, image: &Image) -> Result<Self, TargetError> {
        let folder = Scratch::new().map_err(|e| TargetError::io("creating a folder in", std::env::temp_dir(), e))?;
        let pipe = |name: &str| {
            let path = folder.path().join(name);
            mkfifoat(CWD, &path, Mode::RUSR | Mode::WUSR)
                .map_err(|e| TargetError::io("creating the pipe", &path, e.into()))?;
            // For reading and writing, so that opening does not wait for the other side.
            let file = OpenOptions::new().read(true).write(true).open(&path);
            file.map_err(|e| TargetError::io("opening the pipe", &path, e))
        };
        let (to, from) = (pipe("pil.in")?, pipe("pil.out")?);
        let printed = folder.path().join("printed.txt");
        let file = File::create(&printed).map_err(|e| TargetError::io("creating", &printed, e))?;
        let mut command = emulator.command(image, folder.path())?;
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(file);
        // In its own process group, so that Ctrl-C does not reach it; we close the pipe instead.
        command.process_group(0);
        let child = command.spawn().map_err(|e| TargetError::io("running", &emulator.program, e))?;
        Ok(Self { emulator: child, to: Some(to), from, folder })
    }

    /// The emulator's process.
    #[must_use]
    pub fn process(&self) -> u32 {
        self.emulator.id()
    }

    /// An error if the emulator has ended.
    fn alive(&mut self) -> io::Result<()> {
        match self.emulator.try_wait()? {
            None => Ok(()),
            Some(status) => {
                let printed = printed(self.folder.path());
                let text = format!("the emulator ended: {}", emulator::ended(status, &printed));
                Err(io::Error::new(ErrorKind::UnexpectedEof, text))
            }
        }
    }
}

fn printed(folder: &Path) -> String {
    std::fs::read(folder.join("printed.txt"))
        .map(|text| String::from_utf8_lossy(&text).into_owned())
        .unwrap_or_default()
}

impl Port for Pipes {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.alive()?;
        // The client waits for each answer, so the pipe, with room for 64 KiB, is never full.
        self.to.as_mut().map_or(Ok(()), |to| to.write_all(bytes))
    }

    fn receive(&mut self, buffer: &mut [u8], limit: Duration) -> io::Result<usize> {
        let start = Instant::now();
        loop {
            let left = limit.saturating_sub(start.elapsed());
            if ready(&self.from, PollFlags::IN, if left < LOOK { left } else { LOOK })? {
                return self.from.read(buffer);
            }
            self.alive()?;
            if left.is_zero() {
                return Ok(0);
            }
        }
    }
}

impl Drop for Pipes {
    fn drop(&mut self) {
        self.to = None;
        let start = Instant::now();
        while start.elapsed() < END {
            if !matches!(self.emulator.try_wait(), Ok(None)) {
                return;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        // If it has exited meanwhile, this does nothing.
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}
