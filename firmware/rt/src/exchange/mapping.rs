//! A file of plain atomic words in memory, and the futex calls on them.

use core::marker::PhantomData;
use core::ptr::NonNull;
use core::sync::atomic::AtomicU32;
use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use crate::clock::SECOND;

/// A shared mapping of one `T`, which is made of atomic integers alone: any bytes are a `T`, and other processes may change them.
pub(super) struct Mapping<T> {
    start: NonNull<T>,
    kind: PhantomData<T>,
}

// SAFETY: `T` is made of atomics; the mapping stays until it is dropped.
unsafe impl<T: Sync> Send for Mapping<T> {}
// SAFETY: as above.
unsafe impl<T: Sync> Sync for Mapping<T> {}

impl<T> Mapping<T> {
    /// A new file of zeros, for this user alone.
    pub(super) fn create(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(true).mode(0o600).open(path)?;
        file.set_len(size_of::<T>() as u64)?;
        Self::of(&file)
    }

    /// A file that is there; `InvalidData` if it is too short.
    pub(super) fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).open(path)?;
        if file.metadata()?.len() != size_of::<T>() as u64 {
            return Err(io::Error::from(io::ErrorKind::InvalidData));
        }
        Self::of(&file)
    }

    fn of(file: &File) -> io::Result<Self> {
        // SAFETY: a new mapping, wherever the kernel likes; the file is at least as long.
        let start = unsafe {
            libc::mmap(
                core::ptr::null_mut(),
                size_of::<T>(),
                libc::PROT_READ | libc::PROT_WRITE,
                libc::MAP_SHARED | libc::MAP_POPULATE,
                file.as_raw_fd(),
                0,
            )
        };
        match NonNull::new(start.cast::<T>()) {
            Some(start) if start.as_ptr().cast() != libc::MAP_FAILED => Ok(Self { start, kind: PhantomData }),
            _ => Err(io::Error::last_os_error()),
        }
    }

    pub(super) fn words(&self) -> &T {
        // SAFETY: mapped until this is dropped, aligned to a page, and any bytes are a `T`.
        unsafe { self.start.as_ref() }
    }
}

impl<T> Drop for Mapping<T> {
    fn drop(&mut self) {
        // SAFETY: mapped in `of` with this length, and unmapped once.
        unsafe { libc::munmap(self.start.as_ptr().cast(), size_of::<T>()) };
    }
}

/// Wakes whoever sleeps on `bell`, in any process.
pub(super) fn wake(bell: &AtomicU32) {
    // SAFETY: the address is that of a live word; the other arguments are plain numbers.
    unsafe { libc::syscall(libc::SYS_futex, bell.as_ptr(), libc::FUTEX_WAKE, i32::MAX) };
}

/// Sleeps until [`wake`], at most `patience` (ns); not at all if `bell` is no more `seen`. May end early.
pub(super) fn sleep(bell: &AtomicU32, seen: u32, patience: u64) {
    let time =
        libc::timespec { tv_sec: (patience / SECOND) as libc::time_t, tv_nsec: (patience % SECOND) as libc::c_long };
    // SAFETY: the address is that of a live word, the time that of a live local.
    unsafe { libc::syscall(libc::SYS_futex, bell.as_ptr(), libc::FUTEX_WAIT, seen, &raw const time) };
}
