//! A file of plain atomic words in memory, and the futex calls on them.
//!
//! Any process that may write the file may truncate it, which removes the memory from all mappings: the system then
//! sends `SIGBUS` on access. The mapping is replaced by zeros of this process, so that the other side appears silent.

use core::ffi::{c_int, c_void};
use core::marker::PhantomData;
use core::ptr::NonNull;
use core::sync::atomic::{AtomicU32, AtomicUsize, Ordering};
use std::fs::{File, OpenOptions, Permissions};
use std::io;
use std::os::fd::AsRawFd;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt, PermissionsExt};
use std::path::Path;

use crate::clock::SECOND;

/// A shared mapping of one `T`, which consists only of atomic integers: any bytes are a valid `T`, and other processes
/// may change them.
pub(super) struct Mapping<T> {
    start: NonNull<T>,
    kind: PhantomData<T>,
}

/// Start and length of every mapping, zeros for free entries: more than a program uses at a time.
static MAPPED: [[AtomicUsize; 2]; 16] = [const { [const { AtomicUsize::new(0) }; 2] }; 16];

/// Read and written by its owner.
const MODE: u32 = 0o600;

/// Reason why a file is not mapped.
#[derive(Debug)]
pub(super) enum MapError {
    /// Another user can change it, or a folder above it.
    NotOwn(String),
    /// Its size differs from that of a `T`.
    Size,
    /// The system's answer.
    File(io::Error),
}

impl MapError {
    fn of(error: io::Error, path: &Path) -> Self {
        match std::fs::read_link(path) {
            Ok(target) => Self::NotOwn(format!("it is a symbolic link to {}", target.display())),
            Err(_) => Self::File(error),
        }
    }
}

impl From<io::Error> for MapError {
    fn from(error: io::Error) -> Self {
        Self::File(error)
    }
}

// SAFETY: `T` is made of atomics; the mapping stays until it is dropped.
unsafe impl<T: Sync> Send for Mapping<T> {}
// SAFETY: as above.
unsafe impl<T: Sync> Sync for Mapping<T> {}

impl<T> Mapping<T> {
    /// A new file of zeros, for this user only; `AlreadyExists` if the name is taken.
    pub(super) fn create(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).create_new(true).mode(MODE).open(path)?;
        // Restores the permissions that the umask removes.
        file.set_permissions(Permissions::from_mode(MODE))?;
        file.set_len(size_of::<T>() as u64)?;
        Self::of(&file)
    }

    /// Opens an existing file. It must be as [`Mapping::create`] makes it: any other user who may write it may truncate
    /// it, and reading the mapping would then end the process.
    pub(super) fn open(path: &Path) -> Result<Self, MapError> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK)
            .open(path)
            .map_err(|error| MapError::of(error, path))?;
        let found = file.metadata()?;
        // SAFETY: has no arguments and touches no memory.
        let user = unsafe { libc::geteuid() };
        if !found.is_file() {
            return Err(MapError::NotOwn("it is no regular file".to_owned()));
        }
        if found.uid() != user {
            return Err(MapError::NotOwn(format!("it belongs to user {}, and this is user {user}", found.uid())));
        }
        if found.mode() & 0o777 != MODE {
            let mode = found.mode() & 0o777;
            return Err(MapError::NotOwn(format!("its mode is {mode:03o}, expected {MODE:03o}")));
        }
        if found.len() != size_of::<T>() as u64 {
            return Err(MapError::Size);
        }
        Ok(Self::of(&file)?)
    }

    fn of(file: &File) -> io::Result<Self> {
        // SAFETY: a new mapping at an address chosen by the kernel; the file is at least as long.
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
            Some(start) if start.as_ptr().cast() != libc::MAP_FAILED => {
                survive(start.as_ptr().expose_provenance(), size_of::<T>());
                Ok(Self { start, kind: PhantomData })
            }
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
        let own = MAPPED.iter().find(|[start, _]| start.load(Ordering::Acquire) == self.start.addr().get());
        if let Some([start, _]) = own {
            start.store(0, Ordering::Release);
        }
        // SAFETY: mapped in `of` with this length, and unmapped once.
        unsafe { libc::munmap(self.start.as_ptr().cast(), size_of::<T>()) };
    }
}

/// Keeps the process alive when the file of this mapping is truncated.
fn survive(start: usize, length: usize) {
    for [place, size] in &MAPPED {
        if place.compare_exchange(0, start, Ordering::AcqRel, Ordering::Relaxed).is_ok() {
            size.store(length, Ordering::Release);
            break;
        }
    }
    // SAFETY: a plain structure of numbers, for which zeros are a value.
    let mut action: libc::sigaction = unsafe { core::mem::zeroed() };
    action.sa_sigaction = taken_away as *const () as usize;
    action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
    // SAFETY: the handler has the type that the flags state, and is async-signal-safe.
    unsafe { libc::sigaction(libc::SIGBUS, &raw const action, core::ptr::null_mut()) };
}

/// Maps zeros in place of a mapping that was truncated. Any other fault ends the process, as without a handler.
extern "C" fn taken_away(_: c_int, info: *mut libc::siginfo_t, _: *mut c_void) {
    // SAFETY: the system passes valid fault information.
    let at = unsafe { (*info).si_addr() }.addr();
    for [start, length] in &MAPPED {
        let (start, length) = (start.load(Ordering::Acquire), length.load(Ordering::Acquire));
        if start != 0 && (start..start + length).contains(&at) {
            let (rights, kind) =
                (libc::PROT_READ | libc::PROT_WRITE, libc::MAP_PRIVATE | libc::MAP_ANONYMOUS | libc::MAP_FIXED);
            let place = core::ptr::with_exposed_provenance_mut(start);
            // SAFETY: replaces a mapping of this length, which stays mapped; any bytes are valid words.
            unsafe { libc::mmap(place, length, rights, kind, -1, 0) };
            return;
        }
    }
    // SAFETY: touches no memory; the fault occurs again, without a handler.
    unsafe { libc::signal(libc::SIGBUS, libc::SIG_DFL) };
}

/// Wakes all sleepers on `bell`, in any process.
pub(super) fn wake(bell: &AtomicU32) {
    // SAFETY: the address is that of a live word; the other arguments are plain numbers.
    unsafe { libc::syscall(libc::SYS_futex, bell.as_ptr(), libc::FUTEX_WAKE, i32::MAX) };
}

/// Sleeps until [`wake`], at most `timeout` (ns); not at all if `bell` differs from `seen`. May end early.
pub(super) fn sleep(bell: &AtomicU32, seen: u32, timeout: u64) {
    let time =
        libc::timespec { tv_sec: (timeout / SECOND) as libc::time_t, tv_nsec: (timeout % SECOND) as libc::c_long };
    // SAFETY: the address is that of a live word, the time that of a live local.
    unsafe { libc::syscall(libc::SYS_futex, bell.as_ptr(), libc::FUTEX_WAIT, seen, &raw const time) };
}
