//! Signals that are no reason to end.
#![allow(unsafe_code)] // A call of the C library; it says why it is sound.

/// A file that would grow beyond the limit (`ulimit -f`) is from now on an error of the write (`EFBIG`), as a full disk is, not the
/// end of the process. Programs that this one starts inherit it.
pub fn ignore_file_size() {
    // SAFETY: no handler is set that could run; the number is that of a signal.
    unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
}
