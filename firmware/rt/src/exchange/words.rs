//! The shared words, and how they are written, read and waited for.
//!
//! All memory ordering is in this file, which takes its atomics from the module above. `tests/loom` replaces them by
//! those of a model checker, which tries every order that processor and compiler may choose.

use super::atomic::{AtomicU32, AtomicU64, Ordering, fence};
use super::{CHANNELS, LOOK, TRIES, clock, hint, mapping};

/// Data from the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Actuation {
    /// A number that differs between runs of a controller.
    pub session: u64,
    /// Tick of the session whose interval begins, from 0.
    pub tick: u64,
    /// Amplifiers on.
    pub enable: bool,
    /// Converter codes.
    pub codes: [i32; CHANNELS],
}

/// Data from the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sensing {
    /// Session that it follows.
    pub session: u64,
    /// Tick of the session at whose beginning it is read.
    pub tick: u64,
    /// Converter codes of the gauges.
    pub codes: [i32; CHANNELS],
    /// Force and torque on the platform as bits of f64, N and N m; 0 without a sensor.
    pub wrench: [u64; CHANNELS],
}

/// Words of the file, in order.
#[derive(Default)]
#[repr(C)]
pub(super) struct SharedWords {
    pub(super) magic: AtomicU64,
    pub(super) version: AtomicU64,
    /// First half of the SHA-256 of the spec.
    pub(super) digest: [AtomicU64; 2],
    /// Process of the machine's side; 0 after a normal end.
    pub(super) server: AtomicU64,
    /// Session and tick that the controller waits for.
    wanted: [AtomicU64; 2],
    actuation_count: AtomicU64,
    actuation: [AtomicU64; 3 + CHANNELS],
    sensing_count: AtomicU64,
    sensing: [AtomicU64; 2 + 2 * CHANNELS],
    /// Bells on which the machine's side and the controller sleep.
    bells: [Bell; 2],
}

/// A counter that the other side increments, and whether somebody sleeps on it.
#[derive(Default)]
#[repr(C)]
struct Bell {
    count: AtomicU32,
    sleepers: AtomicU32,
}

impl SharedWords {
    /// For the machine: the latest actuation and the requested sensing (session, tick), once the counter of either
    /// differs from `seen`; none after `timeout` (ns). It polls for `look` (ns) before it sleeps.
    pub(super) fn wait(&self, seen: &mut u32, look: u64, timeout: u64) -> Option<(Actuation, [u64; 2])> {
        *seen = wait_for(&self.bells[0], *seen, look, timeout)?;
        // Read the request first. An actuation read before it could be older than the tick that the controller
        // completed just before the request, and the machine would run that tick with old codes.
        let wanted = [&self.wanted[0], &self.wanted[1]].map(|word| word.load(Ordering::Acquire));
        let mut block = [0; 3 + CHANNELS];
        read_block(&self.actuation_count, &self.actuation, &mut block)?;
        let [session, tick, enable, codes @ ..] = block;
        Some((Actuation { session, tick, enable: enable == 1, codes: codes.map(|code| code as i32) }, wanted))
    }

    /// For the machine: publishes a reading.
    pub(super) fn publish(&self, sensing: &Sensing) {
        let mut block = [0; 2 + 2 * CHANNELS];
        (block[0], block[1]) = (sensing.session, sensing.tick);
        for k in 0..CHANNELS {
            block[2 + k] = u64::from(sensing.codes[k] as u32);
            block[2 + CHANNELS + k] = sensing.wrench[k];
        }
        write_block(&self.sensing_count, &self.sensing, &block);
        ring(&self.bells[1]);
    }

    /// For the controller: the reading at the beginning of `tick`; none if the machine does not publish it within
    /// `timeout` (ns).
    pub(super) fn sense(&self, session: u64, tick: u64, timeout: u64) -> Option<Sensing> {
        let deadline = clock::now().saturating_add(timeout);
        let mut asked = false;
        loop {
            let bell = self.bells[1].count.load(Ordering::Acquire);
            let mut block = [0; 2 + 2 * CHANNELS];
            if read_block(&self.sensing_count, &self.sensing, &mut block).is_some()
                && block[0] == session
                && block[1] == tick
            {
                let at = |first: usize| core::array::from_fn(|k| block[first + k]);
                let codes: [u64; CHANNELS] = at(2);
                return Some(Sensing {
                    session,
                    tick,
                    codes: codes.map(|code| code as u32 as i32),
                    wrench: at(2 + CHANNELS),
                });
            }
            if !asked {
                // A reader that sees this tick also sees the actuation before it.
                self.wanted[1].store(tick, Ordering::Release);
                self.wanted[0].store(session, Ordering::Release);
                ring(&self.bells[0]);
                asked = true;
            }
            let left = deadline.saturating_sub(clock::now());
            if left == 0 {
                return None;
            }
            let _ = wait_for(&self.bells[1], bell, LOOK, left);
        }
    }

    /// For the controller: publishes codes for the interval that begins with `tick`.
    pub(super) fn actuate(&self, session: u64, tick: u64, enable: bool, codes: &[i32; CHANNELS]) {
        let mut block = [0; 3 + CHANNELS];
        (block[0], block[1], block[2]) = (session, tick, u64::from(enable));
        for (word, code) in block[3..].iter_mut().zip(codes) {
            *word = u64::from(*code as u32);
        }
        write_block(&self.actuation_count, &self.actuation, &block);
        ring(&self.bells[0]);
    }
}

/// Writes a block that has only one writer: the counter is odd meanwhile.
fn write_block<const N: usize>(count: &AtomicU64, words: &[AtomicU64; N], block: &[u64; N]) {
    let before = count.load(Ordering::Relaxed);
    count.store(before.wrapping_add(1), Ordering::Relaxed);
    fence(Ordering::Release);
    for (word, value) in words.iter().zip(block) {
        word.store(*value, Ordering::Relaxed);
    }
    count.store(before.wrapping_add(2), Ordering::Release);
}

/// A consistent block; none if the other side is stuck in the middle of a write.
fn read_block<const N: usize>(count: &AtomicU64, words: &[AtomicU64; N], block: &mut [u64; N]) -> Option<()> {
    for _ in 0..TRIES {
        let before = count.load(Ordering::Acquire);
        if before & 1 == 0 {
            for (value, word) in block.iter_mut().zip(words) {
                *value = word.load(Ordering::Relaxed);
            }
            fence(Ordering::Acquire);
            if count.load(Ordering::Relaxed) == before {
                return Some(());
            }
        }
        hint::spin_loop();
    }
    None
}

fn ring(bell: &Bell) {
    // Sequentially consistent with the sleeper: either it sees the new count, or it is seen here.
    bell.count.fetch_add(1, Ordering::SeqCst);
    if bell.sleepers.load(Ordering::SeqCst) > 0 {
        mapping::wake(&bell.count);
    }
}

/// The bell's count once it differs from `seen`; none after `timeout` (ns). Sleeps after `look` (ns).
fn wait_for(bell: &Bell, seen: u32, look: u64, timeout: u64) -> Option<u32> {
    let start = clock::now();
    loop {
        let count = bell.count.load(Ordering::Acquire);
        if count != seen {
            return Some(count);
        }
        let waited = clock::now().saturating_sub(start);
        if waited >= timeout {
            return None;
        }
        if waited < look {
            hint::spin_loop();
        } else {
            bell.sleepers.fetch_add(1, Ordering::SeqCst);
            mapping::sleep(&bell.count, seen, timeout - waited);
            bell.sleepers.fetch_sub(1, Ordering::SeqCst);
        }
    }
}
