//! Privileges and resources of a real-time thread, with instructions for each that is missing.
#![allow(unsafe_code)] // Calls of the C library; each says why it is sound.

use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::PathBuf;

/// Bytes of stack that are touched before the loop starts.
pub const STACK: usize = 512 * 1024;

/// A privilege that the system denied.
#[derive(Debug)]
pub struct MissingPrivilege {
    /// What was asked for.
    pub what: String,
    /// The system's answer.
    pub cause: io::Error,
    /// How to get it.
    pub fix: &'static str,
}

impl fmt::Display for MissingPrivilege {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}; {}", self.what, self.cause, self.fix)
    }
}

impl std::error::Error for MissingPrivilege {}

/// How to grant real-time priority to a user, or to a program.
pub const FIX_PRIORITY: &str = "put `@realtime - rtprio 95` into /etc/security/limits.d/realtime.conf and join group \
     `realtime` (log in again), or `sudo setcap cap_sys_nice,cap_ipc_lock+ep` on this program";
/// How to permit locked memory.
pub const FIX_MEMORY: &str = "put `@realtime - memlock unlimited` into /etc/security/limits.d/realtime.conf and join group \
     `realtime` (log in again), or `sudo setcap cap_sys_nice,cap_ipc_lock+ep` on this program";

/// Puts the calling thread under `SCHED_FIFO` at `priority` (1 to 99).
///
/// # Errors
/// If the privilege is missing, or the priority is invalid.
pub fn set_fifo(priority: u8) -> Result<(), MissingPrivilege> {
    // SAFETY: an all-zero sched_param is valid (some C libraries have more fields); the call reads it.
    let answer = unsafe {
        let mut parameters: libc::sched_param = core::mem::zeroed();
        parameters.sched_priority = libc::c_int::from(priority);
        // Child threads, if there are any, get normal scheduling.
        libc::sched_setscheduler(0, libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, &raw const parameters)
    };
    refused(answer, || format!("SCHED_FIFO at priority {priority}"), FIX_PRIORITY)
}

/// Keeps every page of this process in memory, including later ones.
///
/// # Errors
/// Without the right to.
pub fn lock_memory() -> Result<(), MissingPrivilege> {
    // SAFETY: takes no pointers.
    let answer = unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) };
    refused(answer, || "locking memory (mlockall)".to_owned(), FIX_MEMORY)
}

/// Lets the system page memory out again.
pub fn unlock_memory() {
    // SAFETY: takes no pointers.
    unsafe { libc::munlockall() };
}

/// Keeps the calling thread on one processor.
///
/// # Errors
/// If the processor does not exist, or is not available to this process.
pub fn pin(processor: usize) -> Result<(), MissingPrivilege> {
    let fix = "choose one that `taskset -p $$` allows; `nproc --all` counts them from 0";
    if processor >= libc::CPU_SETSIZE as usize {
        let cause = io::Error::from(io::ErrorKind::InvalidInput);
        return Err(MissingPrivilege { what: format!("processor {processor}"), cause, fix });
    }
    // SAFETY: an all-zero set is the empty one; `processor` is within it; the call reads it.
    let answer = unsafe {
        let mut set: libc::cpu_set_t = core::mem::zeroed();
        libc::CPU_SET(processor, &mut set);
        libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set)
    };
    refused(answer, || format!("processor {processor}"), fix)
}

/// Processors available to this process, in ascending order.
#[must_use]
pub fn processors() -> Vec<usize> {
    // SAFETY: an all-zero set is the empty one; the call writes it, the query stays within it.
    unsafe {
        let mut set: libc::cpu_set_t = core::mem::zeroed();
        if libc::sched_getaffinity(0, size_of::<libc::cpu_set_t>(), &raw mut set) != 0 {
            return Vec::new();
        }
        (0..libc::CPU_SETSIZE as usize).filter(|k| libc::CPU_ISSET(*k, &set)).collect()
    }
}

/// Soft and hard limit of a resource (`libc::RLIMIT_…`); none if the system does not return them. `u64::MAX` means no
/// limit.
#[must_use]
pub fn limit(resource: Resource) -> Option<[u64; 2]> {
    let name = match resource {
        Resource::Priority => libc::RLIMIT_RTPRIO,
        Resource::LockedMemory => libc::RLIMIT_MEMLOCK,
    };
    // SAFETY: an all-zero rlimit is valid; the call writes it.
    unsafe {
        let mut limits: libc::rlimit = core::mem::zeroed();
        (libc::getrlimit(name, &raw mut limits) == 0).then_some([limits.rlim_cur, limits.rlim_max])
    }
}

/// What [`limit`] is asked about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Resource {
    /// Highest `SCHED_FIFO` priority.
    Priority,
    /// Bytes that may be locked.
    LockedMemory,
}

/// Touches [`STACK`] bytes of the calling thread's stack, to avoid page faults later.
#[inline(never)]
pub fn touch_stack() {
    let mut pages = [0_u8; STACK];
    // `black_box` keeps the compiler from removing the writes.
    for page in std::hint::black_box(&mut pages).chunks_mut(4096) {
        page[0] = 1;
    }
    std::hint::black_box(&pages);
}

/// Keeps processors out of deep sleep while it exists.
#[derive(Debug)]
pub struct AwakeProcessors {
    _file: File,
}

impl AwakeProcessors {
    /// Requests a wake-up latency of 0 µs by `/dev/cpu_dma_latency`.
    ///
    /// # Errors
    /// If the device does not exist or is not writable.
    pub fn request() -> Result<Self, MissingPrivilege> {
        let path = PathBuf::from("/dev/cpu_dma_latency");
        let ask = || {
            let mut file = OpenOptions::new().write(true).open(&path)?;
            file.write_all(&0_i32.to_ne_bytes())?;
            Ok(Self { _file: file })
        };
        ask().map_err(|cause| MissingPrivilege {
            what: format!("keeping processors awake ({})", path.display()),
            cause,
            fix: "let group `realtime` write it by a udev rule: KERNEL==\"cpu_dma_latency\", GROUP=\"realtime\", MODE=\"0660\"",
        })
    }
}

fn refused(answer: libc::c_int, what: impl FnOnce() -> String, fix: &'static str) -> Result<(), MissingPrivilege> {
    if answer == 0 {
        return Ok(());
    }
    let cause = io::Error::last_os_error();
    Err(MissingPrivilege { what: what(), cause, fix })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_processor_that_is_not_there_is_refused_with_a_mend() {
        for missing in [100_000, libc::CPU_SETSIZE as usize - 1] {
            if processors().contains(&missing) {
                continue;
            }
            let error = pin(missing).unwrap_err().to_string();
            assert!(error.starts_with(&format!("processor {missing}: ")) && error.contains("taskset"), "{error}");
        }
        std::thread::spawn(|| {
            let first = processors()[0];
            pin(first).unwrap();
            assert_eq!(processors(), [first]);
        })
        .join()
        .unwrap();
    }

    #[test]
    fn a_priority_beyond_the_highest_is_refused_whatever_the_rights() {
        let error = std::thread::spawn(|| set_fifo(120).unwrap_err().to_string()).join().unwrap();
        assert!(error.starts_with("SCHED_FIFO at priority 120: ") && error.contains("limits.d"), "{error}");
        touch_stack();
        assert!(limit(Resource::Priority).is_some() && limit(Resource::LockedMemory).is_some());
    }
}
