//! The recorder of a board: how its memory is cut, and what it does from power-up on.

use controller::snapshot::recorder::{Activity, Recorder, Settings, Trigger};
use controller::snapshot::{RECORD_LAYOUT, digest, save_piece};
use controller::supervised::{Machine, machine_at_reset};
use controller::{CONFIG_WORDS, Config};
use specgen_link::{RecorderAction, RecorderStatus};

/// Most blocks. The oldest is given up when a new one begins, so many of them keep more of what was before the trigger.
const BLOCKS: usize = 8;
/// A block has so many times the words that it begins with, or more: settings and snapshot are not to fill the memory.
const PREAMBLES: usize = 4;
/// One row in so many ends with a digest, which costs as much as three rows do. Codes, status and phase of every tick are compared
/// all the same.
const DIGEST_EVERY: u32 = 16;

/// A recorder in this memory that waits for a fault, and then keeps as much after it as before. None if not even two blocks fit,
/// which a controller of very long memory may do to a small part.
#[must_use]
pub(crate) fn recorder(memory: &'static mut [u64]) -> Option<Recorder<'static>> {
    let most = memory.len() / (PREAMBLES * RECORD_LAYOUT.preamble());
    let blocks = most.clamp(2, BLOCKS);
    let mut recorder = Recorder::new(memory, blocks, RECORD_LAYOUT).ok()?.owing();
    recorder.start(settings((recorder.capacity() / 2) as u32));
    Some(recorder)
}

/// A fault triggers; `after` rows follow it.
const fn settings(after: u32) -> Settings {
    Settings {
        streaming: false,
        trigger: Trigger { fault: true, phase_change: false },
        after: if after > 0 { after } else { 1 },
        decimation: 1,
        digest_every: DIGEST_EVERY,
    }
}

/// Does what is asked and says how it stands.
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

/// Whether what it holds stays as it is.
pub(crate) fn is_stopped(recorder: &Recorder<'static>) -> bool {
    matches!(recorder.activity(), Activity::Stopped | Activity::Complete) && !recorder.owes()
}

/// A machine and its settings as they were after a tick: what the recorder owes is written from it, while ticks go on.
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

    /// Of this machine, under the settings of the spec.
    #[must_use]
    pub fn of(machine: &Machine) -> Self {
        Self { config: Config::new(), machine: *machine }
    }

    /// Takes a copy: what holds a tick off longest.
    pub fn keep(&mut self, config: &Config, machine: &Machine) {
        self.config = *config;
        self.machine = *machine;
    }

    /// Digest of the machine as it was.
    pub(crate) fn digest(&self) -> u64 {
        digest(&self.machine)
    }

    /// Words of what a block begins with, settings and state, from the `first`-th on.
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

/// Words of what a block begins with besides its header, and of a piece that is written while the tick is held off.
pub(crate) const PREAMBLE: usize = RECORD_LAYOUT.config + RECORD_LAYOUT.state;
pub(crate) const PIECE: usize = 32;
