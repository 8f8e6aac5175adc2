//! Waiting for a file descriptor, with a limit.

use std::io::{self, ErrorKind, Read};
use std::os::fd::AsFd;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;

/// Whether there is something to read (`IN`) or room to write (`OUT`) within `limit`. A signal ends the wait early.
pub(crate) fn ready(file: &impl AsFd, flags: PollFlags, limit: Duration) -> io::Result<bool> {
    let mut files = [PollFd::new(file, flags)];
    let limit = Timespec::try_from(limit).map_err(io::Error::other)?;
    match poll(&mut files, Some(&limit)) {
        Ok(count) => Ok(count > 0),
        Err(Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

/// Reads what arrives within `limit`; 0 bytes if nothing does. `gone` says what it means that the other end is closed.
pub(crate) fn receive(
    file: &mut (impl AsFd + Read),
    buffer: &mut [u8],
    limit: Duration,
    gone: &str,
) -> io::Result<usize> {
    if !ready(file, PollFlags::IN, limit)? {
        return Ok(0);
    }
    match file.read(buffer) {
        Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(0),
        // EIO: the other end of a terminal is closed.
        Err(error) if error.raw_os_error() != Some(Errno::IO.raw_os_error()) => Err(error),
        Ok(0) | Err(_) => Err(io::Error::new(ErrorKind::UnexpectedEof, gone)),
        Ok(count) => Ok(count),
    }
}
