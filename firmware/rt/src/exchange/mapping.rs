//! A file of plain atomic words in memory, and the futex calls on them.

use core::marker::PhantomData;
use core::ptr::NonNull;
use core::sync::atomic::AtomicU32;
use std::fs::{File, OpenOptions, Permissions};
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::Path;

use crate::clock::SECOND;

/// A shared mapping of one `T`, which is made of atomic integers alone: any bytes are a `T`, and other processes may change them.
pub(super) struct Mapping<T> {
    start: NonNull<T>,
    kind: PhantomData<T>,
}

/// Read and written by its owner.
const MODE: u32 = 0o600;

/// Why a file is not mapped.
#[derive(Debug)]
pub(super) enum Unfit {
    /// Somebody else can change it, or what it leads to.
    NotOwn(String),
    /// It has another size than a `T`.
    Size,
    /// The system's answer.
    File(io::Error),
}

impl Unfit {
    fn of(error: io::Error, path: &Path) -> Self {
        match std::fs::read_link(path) {
            Ok(target) => Self::NotOwn(format!("it is a symbolic link to {}", target.display())),
            Err(_) => Self::File(error),
        }
    }
}

impl From<io::Error> for Unfit {
    fn from(error: io::Error) -> Self {
        Self::File(error)
    }
}

// SAFETY: `T` is made of atomics; the mapping stays until it is dropped.
unsafe impl<T: Sync> Send for Mapping<T> {}
// SAFETY: as above.
unsafe impl<T: Sync> Sync for Mapping<T> {}

impl<T> Mapping<T> {
    /// A new file of zeros, for this user alone; `AlreadyExists` if anything has that name.
    pub(super) fn create(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).create_new(true).mode(MODE).open(path)?;
        // Less what the umask takes, which this gives back.
        file.set_permissions(Permissions::from_mode(MODE))?;
        file.set_len(size_of::<T>() as u64)?;
        Self::of(&file)
    }

    /// A file that is there. It has to be as [`Mapping::create`] makes it: whoever else may write it may make it shorter too, and
    /// then reading the mapping ends the process.
    pub(super) fn open(path: &Path) -> Result<Self, Unfit> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK)
            .open(path)
            .map_err(|error| Unfit::of(error, path))?;
        let found = file.metadata()?;
        // SAFETY: has no arguments and touches no memory.
        let user = unsafe { libc::geteuid() };
        if !found.is_file() {
            return Err(Unfit::NotOwn("it is no regular file".to_owned()));
        }
        if found.uid() != user {
            return Err(Unfit::NotOwn(format!("it belongs to user {}, and this is user {user}", found.uid())));
        }
        if found.mode() & 0o777 != MODE {
            let mode = found.mode() & 0o777;
            return Err(Unfit::NotOwn(format!("its mode is {mode:03o}, expected {MODE:03o}")));
        }
        if found.len() != size_of::<T>() as u64 {
            return Err(Unfit::Size);
        }
        Ok(Self::of(&file)?)
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

/// Sleeps until [`wake`], at most `timeout` (ns); not at all if `bell` is no more `seen`. May end early.
pub(super) fn sleep(bell: &AtomicU32, seen: u32, timeout: u64) {
    let time =
        libc::timespec { tv_sec: (timeout / SECOND) as libc::time_t, tv_nsec: (timeout % SECOND) as libc::c_long };
    // SAFETY: the address is that of a live word, the time that of a live local.
    unsafe { libc::syscall(libc::SYS_futex, bell.as_ptr(), libc::FUTEX_WAIT, seen, &raw const time) };
}
