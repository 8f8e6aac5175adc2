//! The recorder of a board: how its memory is cut, and what it does from power-up on.

use controller::Config;
use controller::snapshot::recorder::{Activity, Recorder, Settings, Trigger};
use controller::snapshot::{RECORD_LAYOUT, record_after, record_before};
use controller::supervised::{Machine, MachineInput, MachineOutput};
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
pub fn recorder(memory: &'static mut [u64]) -> Option<Recorder<'static>> {
    let most = memory.len() / (PREAMBLES * RECORD_LAYOUT.preamble());
    let blocks = most.clamp(2, BLOCKS);
    let mut recorder = Recorder::new(memory, blocks, RECORD_LAYOUT).ok()?;
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
    matches!(recorder.activity(), Activity::Stopped | Activity::Complete)
}

/// What the recorder keeps from before a tick, where a block begins. In a frame of its own, which is done with before the law needs the
/// stack.
#[inline(never)]
pub(crate) fn begin_row(config: &Config, machine: &Machine, recorder: &mut Recorder<'static>) {
    record_before(config, machine, recorder);
}

/// What it keeps from after it.
#[inline(never)]
pub(crate) fn end_row(
    machine: &Machine,
    input: &MachineInput,
    output: &MachineOutput,
    recorder: &mut Recorder<'static>,
) {
    record_after(machine, input, output, recorder);
}
