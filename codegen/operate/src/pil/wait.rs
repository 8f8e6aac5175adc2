//! Waiting for a file descriptor, with a limit.

use std::io;
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
