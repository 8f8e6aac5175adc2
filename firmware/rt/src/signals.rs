//! Signals that must not end the process.
#![allow(unsafe_code)] // A call of the C library; it says why it is sound.

/// From now on a file that would exceed the limit (`ulimit -f`) is an error of the write (`EFBIG`), as with a full
/// disk, and does not end the process. Child processes inherit this.
pub fn ignore_file_size() {
    // SAFETY: no handler is set that could run; the number is that of a signal.
    unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
}
