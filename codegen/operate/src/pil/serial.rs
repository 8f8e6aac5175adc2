//! A serial line: raw bytes, no flow control, a timeout for every wait.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::Duration;

use rustix::event::PollFlags;
use rustix::fs::OFlags;
use rustix::termios::{ControlModes, OptionalActions, QueueSelector, ioctl_tiocexcl, tcflush, tcgetattr, tcsetattr};
use specgen_link::client::Port;

use super::wait::{ready, receive};

/// Default baud rate. A board's USB serial port ignores it.
pub const BAUD: u32 = 921_600;
/// Timeout of sending.
const SEND: Duration = Duration::from_secs(2);

/// An open serial line, in exclusive use.
pub struct SerialLine {
    file: File,
}

impl SerialLine {
    /// Opens a serial device, 8 data bits, no parity, one stop bit.
    ///
    /// # Errors
    /// No such device, no permission, in use, not a serial device, or an unsupported rate.
    pub fn open(path: &Path, baud: u32) -> Result<Self, String> {
        let name = path.display();
        // O_NONBLOCK, so that opening does not wait for a carrier; all waits use poll.
        let flags = (OFlags::NOCTTY | OFlags::NONBLOCK).bits();
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(flags.cast_signed())
            .open(path)
            .map_err(|error| format!("cannot open {name}: {}", advice(&error)))?;
        let mut settings = tcgetattr(&file)
            .map_err(|_| format!("{name} is not a serial device; expected one such as /dev/ttyACM0"))?;
        ioctl_tiocexcl(&file).map_err(|error| format!("{name} cannot be opened exclusively: {error}"))?;
        settings.make_raw();
        settings.control_modes |= ControlModes::CLOCAL | ControlModes::CREAD;
        settings.control_modes -= ControlModes::CSTOPB | ControlModes::CRTSCTS;
        settings
            .set_speed(baud)
            .map_err(|_| format!("{name} does not support {baud} baud; choose another with --baud"))?;
        let set = tcsetattr(&file, OptionalActions::Now, &settings);
        set.map_err(|error| format!("{name} cannot be set to raw mode at {baud} baud: {error}"))?;
        // Discards data from before this session.
        tcflush(&file, QueueSelector::IOFlush).map_err(|error| format!("{name}: {error}"))?;
        Ok(Self { file })
    }
}

fn advice(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "no such device; is the board plugged in? ls /dev/ttyACM* /dev/ttyUSB*".to_owned(),
        ErrorKind::PermissionDenied => {
            "no permission; add yourself to its group (often: sudo usermod -aG dialout $USER) and log in again"
                .to_owned()
        }
        ErrorKind::ResourceBusy => "another program has it open; close that first".to_owned(),
        _ => error.to_string(),
    }
}

impl Port for SerialLine {
    fn send(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            match self.file.write(bytes) {
                Ok(count) => bytes = bytes.get(count..).unwrap_or_default(),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    if !ready(&self.file, PollFlags::OUT, SEND)? {
                        let text = format!("the line accepted no data for {} s", SEND.as_secs());
                        return Err(io::Error::new(ErrorKind::TimedOut, text));
                    }
                }
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn receive(&mut self, buffer: &mut [u8], limit: Duration) -> io::Result<usize> {
        receive(&mut self.file, buffer, limit, "the serial device is gone; was it unplugged?")
    }
}
