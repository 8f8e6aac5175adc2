//! Monotonic time in nanoseconds, absolute sleeps, and the kernel's counters of a thread.
#![allow(unsafe_code)] // Calls of the C library; each says why it is sound.

use core::mem::MaybeUninit;

/// Nanoseconds in a second.
pub const SECOND: u64 = 1_000_000_000;

/// `CLOCK_MONOTONIC`, ns: never set back, never stepped; it stops while the machine sleeps.
#[must_use]
pub fn now() -> u64 {
    read(libc::CLOCK_MONOTONIC)
}

/// `CLOCK_BOOTTIME`, ns: as [`now`], but it continues while the machine sleeps.
#[must_use]
pub fn since_boot() -> u64 {
    read(libc::CLOCK_BOOTTIME)
}

/// Resolution of [`now`], ns; more than 1 means that there is no high-resolution timer.
#[must_use]
pub fn resolution() -> u64 {
    let mut time = MaybeUninit::<libc::timespec>::zeroed();
    // SAFETY: the call writes one timespec; an all-zero one is valid if it fails.
    let time = unsafe {
        libc::clock_getres(libc::CLOCK_MONOTONIC, time.as_mut_ptr());
        time.assume_init()
    };
    nanoseconds(&time)
}

/// Sleeps until [`now`] is `deadline`, ns; returns at once if that is past. A signal does not end it early.
pub fn sleep_until(deadline: u64) {
    let time =
        libc::timespec { tv_sec: (deadline / SECOND) as libc::time_t, tv_nsec: (deadline % SECOND) as libc::c_long };
    // SAFETY: the call reads one timespec; it has no remainder, as absolute sleeps have none.
    while unsafe {
        libc::clock_nanosleep(libc::CLOCK_MONOTONIC, libc::TIMER_ABSTIME, &raw const time, core::ptr::null_mut())
    } == libc::EINTR
    {}
}

/// The kernel's counters of one thread since its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Usage {
    /// Page faults without disk access.
    pub minor_faults: u64,
    /// Page faults with disk access.
    pub major_faults: u64,
    /// Voluntary context switches: sleeps, and waits for locks and files.
    pub voluntary_switches: u64,
    /// Involuntary context switches.
    pub involuntary_switches: u64,
}

impl Usage {
    /// Counters of the calling thread, now.
    #[must_use]
    pub fn of_this_thread() -> Self {
        let mut usage = MaybeUninit::<libc::rusage>::zeroed();
        // SAFETY: the call writes one rusage; an all-zero one is valid if it fails.
        let usage = unsafe {
            libc::getrusage(libc::RUSAGE_THREAD, usage.as_mut_ptr());
            usage.assume_init()
        };
        let count = |n: libc::c_long| u64::try_from(n).unwrap_or(0);
        Self {
            minor_faults: count(usage.ru_minflt),
            major_faults: count(usage.ru_majflt),
            voluntary_switches: count(usage.ru_nvcsw),
            involuntary_switches: count(usage.ru_nivcsw),
        }
    }

    /// Counts between `earlier` and this.
    #[must_use]
    pub fn since(self, earlier: Self) -> Self {
        Self {
            minor_faults: self.minor_faults.wrapping_sub(earlier.minor_faults),
            major_faults: self.major_faults.wrapping_sub(earlier.major_faults),
            voluntary_switches: self.voluntary_switches.wrapping_sub(earlier.voluntary_switches),
            involuntary_switches: self.involuntary_switches.wrapping_sub(earlier.involuntary_switches),
        }
    }
}

fn read(clock: libc::clockid_t) -> u64 {
    let mut time = MaybeUninit::<libc::timespec>::zeroed();
    // SAFETY: the call writes one timespec; an all-zero one is valid if it fails.
    let time = unsafe {
        libc::clock_gettime(clock, time.as_mut_ptr());
        time.assume_init()
    };
    nanoseconds(&time)
}

fn nanoseconds(time: &libc::timespec) -> u64 {
    (time.tv_sec as u64).wrapping_mul(SECOND).wrapping_add(time.tv_nsec as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_absolute_sleep_ends_no_earlier_than_asked_and_a_past_one_at_once() {
        let start = now();
        sleep_until(start + 2_000_000);
        assert!(now() >= start + 2_000_000);
        let before = Usage::of_this_thread();
        sleep_until(start);
        sleep_until(now() + 1_000_000);
        assert!(Usage::of_this_thread().since(before).voluntary_switches >= 1, "a sleep gives the processor up");
        assert!(resolution() > 0 && since_boot() >= start);
    }
}
