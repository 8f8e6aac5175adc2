//! The recorder of a board: the division of its memory, and its settings from power-up on.

use controller::snapshot::recorder::{Activity, Recorder, Settings, Trigger};
use controller::snapshot::{RECORD_LAYOUT, digest, save_piece};
use controller::supervised::{Machine, machine_at_reset};
use controller::{CONFIG_WORDS, Config};
use specgen_link::{RecorderAction, RecorderStatus};

/// Most blocks. A new block replaces the oldest, so more blocks keep more rows from before the trigger.
const BLOCKS: usize = 8;
/// Least ratio of a block's size to its preamble: settings and snapshot must not fill the memory.
const PREAMBLES: usize = 4;
/// Every n-th row ends with a digest, which costs as much as three rows. A replay compares codes, status and phase of
/// every tick anyway.
const DIGEST_EVERY: u32 = 16;

/// A recorder in this memory that waits for a fault; half of the memory is for rows after it. None if not even two
/// blocks fit, for example with a controller of very long memory on a small part.
#[must_use]
pub(crate) fn recorder(memory: &'static mut [u64]) -> Option<Recorder<'static>> {
    let most = memory.len() / (PREAMBLES * RECORD_LAYOUT.preamble());
    let blocks = most.clamp(2, BLOCKS);
    let mut recorder = Recorder::new(memory, blocks, RECORD_LAYOUT).ok()?.owing();
    recorder.start(settings((recorder.capacity() / 2) as u32));
    Some(recorder)
}

/// A fault triggers; `after` rows follow.
const fn settings(after: u32) -> Settings {
    Settings {
        streaming: false,
        trigger: Trigger { fault: true, phase_change: false },
        after: if after > 0 { after } else { 1 },
        decimation: 1,
        digest_every: DIGEST_EVERY,
    }
}

/// Carries out an action and returns the status.
pub(crate) fn act(recorder: &mut Recorder<'static>, action: RecorderAction) -> RecorderStatus {
    match action {
        RecorderAction::Look => {}
        RecorderAction::Arm { after } => recorder.start(settings(after)),
        RecorderAction::Trigger => recorder.trigger(),
        RecorderAction::Stop => recorder.stop(),
    }
    RecorderStatus {
        running: !is_stopped(recorder),
        triggered: matches!(recorder.activity(), Activity::Triggered(_) | Activity::Complete),
        ticks: u32::try_from(recorder.rows()).unwrap_or(u32::MAX),
        capacity: u32::try_from(recorder.capacity()).unwrap_or(u32::MAX),
    }
}

/// Whether its content can no longer change.
pub(crate) fn is_stopped(recorder: &Recorder<'static>) -> bool {
    matches!(recorder.activity(), Activity::Stopped | Activity::Complete) && !recorder.owes()
}

/// Copy of a machine and its settings after a tick: source of the recorder's pending data while ticks go on.
#[derive(Debug)]
pub struct MachineSnapshot {
    config: Config,
    machine: Machine,
}

impl Default for MachineSnapshot {
    fn default() -> Self {
        Self::new()
    }
}

impl MachineSnapshot {
    /// Nothing in it yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { config: Config::new(), machine: machine_at_reset() }
    }

    /// A copy of this machine, with the settings of the spec.
    #[must_use]
    pub fn of(machine: &Machine) -> Self {
        Self { config: Config::new(), machine: *machine }
    }

    /// Takes a copy: the longest time for which a tick is held off.
    pub fn keep(&mut self, config: &Config, machine: &Machine) {
        self.config = *config;
        self.machine = *machine;
    }

    /// Digest of the copied machine.
    pub(crate) fn digest(&self) -> u64 {
        digest(&self.machine)
    }

    /// Words of a block's preamble, settings and state, from the `first`-th on.
    #[inline(never)]
    pub(crate) fn words(&self, first: usize, words: &mut [u64; PIECE]) -> usize {
        let left = PREAMBLE.saturating_sub(first);
        if first < CONFIG_WORDS {
            let config = self.config.to_words();
            let from = config.get(first..).unwrap_or_default();
            for (slot, word) in words.iter_mut().zip(from) {
                *slot = *word;
            }
            return if from.len() < PIECE { from.len() } else { PIECE };
        }
        save_piece(&self.machine, first - CONFIG_WORDS, words);
        if left < PIECE { left } else { PIECE }
    }
}

/// Words of a block's preamble after its header, and of a piece that is written with the tick held off.
pub(crate) const PREAMBLE: usize = RECORD_LAYOUT.config + RECORD_LAYOUT.state;
pub(crate) const PIECE: usize = 32;
