//! Data between the real-time thread and the service: by value, through rings that never block.

use core::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};

use controller::snapshot::MACHINE_STATE_WORDS;
use controller::snapshot::recorder::{self, Recorder};
use controller::supervised::{MachineInput, Request};
use controller::waves::Wave;
use controller::{Config, PLACE_WORDS, Real};
use rtrb::{Consumer, Producer, RingBuffer};
use specgen_board::EdgeCommand;
use specgen_link::{EdgeStatus, Health};
use specgen_runtime::pass;

use crate::words::Command;

/// Rows between the threads: 0.8 s at 10 kHz.
const ROWS: usize = 8192;
/// Commands between the threads; the loop takes one a tick.
const COMMANDS: usize = 64;
/// States between the threads, one for [`SNAPSHOT_EVERY`] rows and one for every change of the settings.
const SNAPSHOTS: usize = 16;
/// Rows per block of a run's record.
pub const SNAPSHOT_EVERY: u32 = 2048;

/// A recorder with its memory, for the life of the program. The owner of the box uses it.
pub type Tape = Box<Recorder<'static>>;

/// A player of passes with its memory, as a [`Tape`].
pub type Player = Box<pass::Player<'static, Real>>;

/// One tick, as it is handed over.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Number of the tick; skipped ones are left out.
    pub tick: u64,
    /// Ticks that were run before it.
    pub count: u64,
    pub input: MachineInput,
    pub output: recorder::Row,
    /// Pose and set-point after the tick.
    pub place: [u64; PLACE_WORDS],
    /// Digest of the machine after the tick; 0 if the run is not recorded.
    pub digest: u64,
    /// Ticks before it that were late.
    pub late: u64,
    /// Commands executed before it.
    pub commands: u32,
    /// A block of the record begins with it: its [`Snapshot`] was handed over before.
    pub opens: bool,
    /// Whether the set-point is a wave's.
    pub waving: bool,
    /// Status of the input line.
    pub edge: EdgeStatus,
    /// Rows that the recorder of the loop holds, if it has one.
    pub recorded: Option<u64>,
    /// Whether that recorder has seen its trigger.
    pub triggered: bool,
}

/// The machine before a tick.
pub struct Snapshot {
    /// Ticks that were run before it.
    pub count: u64,
    pub digest: u64,
    pub state: [u64; MACHINE_STATE_WORDS],
}

/// Command words of the host in control, and request to the supervisor, from the next tick on.
#[derive(Debug, Clone, Copy)]
pub struct OperatorRequest {
    /// None if only the request changes.
    pub command: Option<Command>,
    pub request: Request,
}

/// A command for the loop, executed between two ticks.
// The ring has room for the largest variant anyway: a box would have to be released by the real-time thread.
#[allow(clippy::large_enum_variant)]
#[derive(Debug)]
pub enum LoopCommand {
    Request(OperatorRequest),
    Configure(Config),
    /// Starts a wave, if none is under way.
    Wave(Wave),
    StopWave,
    /// A command that waits for the rising edge of the input line, in place of any other.
    Await(EdgeCommand, Option<Wave>),
    /// Cancels the waiting command.
    StopWaiting,
    /// Starts the pass that this player was prepared for, if no wave is under way.
    Pass(Player),
    /// Ends the pass in progress.
    AbortPass,
    Tape(Tape),
    /// Restarts the recorder of the loop.
    Record(recorder::Settings),
    Trigger,
    /// Stops the recorder and hands it back.
    StopRecorder,
}

#[derive(Debug, Default)]
pub struct Shared {
    pub stop: AtomicBool,
    pub ended: AtomicBool,
    /// Last sign of life of the service, ns of [`specgen_rt::clock::now`].
    pub service_alive: AtomicU64,
    /// Changes with every request over a link whose silence matters; 0 without one.
    pub link: AtomicU64,
    /// Ticks whose rows were lost.
    pub lost_rows: AtomicU64,
    /// Failed readings and outputs of the device.
    pub device_faults: AtomicU64,
    /// Ticks with a gauge fault.
    pub gauge_faults: AtomicU32,
    /// Duration of a tick, from waking up to its end, ns.
    pub tick: LastAndLongest,
    /// Time from the readings to the outputs, ns.
    pub output: LastAndLongest,
    /// Delay of waking up, ns; none if time waits for the loop.
    pub delay: LastAndLongest,
    /// Ticks that ended after the planned time of the next one.
    pub overruns: AtomicU32,
}

impl Shared {
    /// Times at which a tick was planned, woken, read, written and done, and the period, ns. If time waits for the
    /// loop, nothing is late.
    pub fn record_tick(&self, [planned, woken, read, written, done]: [u64; 5], period: u64, elastic: bool) {
        self.tick.add(done.saturating_sub(woken));
        self.output.add(written.saturating_sub(read));
        if !elastic {
            self.delay.add(woken.saturating_sub(planned));
            if done > planned + period {
                self.overruns.fetch_add(1, Ordering::Relaxed);
            }
        }
    }

    /// As a message of the link; events are stored for each host separately.
    pub fn health(&self) -> Health {
        let now = |count: &AtomicU32| count.load(Ordering::Relaxed);
        Health {
            events: 0,
            converter_faults: u32::try_from(self.device_faults.load(Ordering::Relaxed)).unwrap_or(u32::MAX),
            // A device reports only that it failed; the stack of a thread has a guard.
            faults: 0,
            gauge_faults: now(&self.gauge_faults),
            overruns: self.delay.get().map(|_| now(&self.overruns)),
            clock: 1_000_000_000,
            tick: self.tick.get(),
            output: self.output.get(),
            latest: self.delay.get().map(|[_, longest]| longest),
            stack: None,
            reset_cause: 0,
        }
    }
}

/// A time of ticks, ns; the real-time thread alone writes it.
#[derive(Debug, Default)]
pub struct LastAndLongest {
    is_known: AtomicBool,
    times: [AtomicU64; 2],
}

impl LastAndLongest {
    pub fn add(&self, time: u64) {
        let [last, longest] = &self.times;
        last.store(time, Ordering::Relaxed);
        longest.fetch_max(time, Ordering::Relaxed);
        self.is_known.store(true, Ordering::Release);
    }

    /// None before the first.
    pub fn get(&self) -> Option<[u64; 2]> {
        let times = || self.times.each_ref().map(|time| time.load(Ordering::Relaxed));
        self.is_known.load(Ordering::Acquire).then(times)
    }
}

/// The loop's outgoing rings.
pub struct Outlets {
    pub rows: Producer<Row>,
    /// States for the record of the run; none if there is no such record.
    pub snapshots: Option<Producer<Snapshot>>,
    /// Recorders with complete records, and the number of commands taken until then.
    pub tapes: Producer<(Tape, u32)>,
}

/// The loop's ends of the rings.
pub struct Inner {
    pub outlets: Outlets,
    pub commands: Consumer<LoopCommand>,
    /// The player, when its pass is over.
    pub players: Producer<Player>,
}

pub struct Outer {
    pub rows: Consumer<Row>,
    pub snapshots: Consumer<Snapshot>,
    pub tapes: Consumer<(Tape, u32)>,
    pub commands: Producer<LoopCommand>,
    pub players: Consumer<Player>,
}

/// Rings, with room for states if the run is recorded.
pub fn rings(records: bool) -> (Inner, Outer) {
    let (rows, rows_out) = RingBuffer::new(ROWS);
    let (snapshots, snapshots_out) = RingBuffer::new(if records { SNAPSHOTS } else { 1 });
    // There is one tape; the second place makes that a matter of no care.
    let (tapes, tapes_out) = RingBuffer::new(2);
    // As of tapes.
    let (players, players_out) = RingBuffer::new(2);
    let (outgoing, commands) = RingBuffer::new(COMMANDS);
    (
        Inner { outlets: Outlets { rows, snapshots: records.then_some(snapshots), tapes }, commands, players },
        Outer { rows: rows_out, snapshots: snapshots_out, tapes: tapes_out, commands: outgoing, players: players_out },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_ticks_are_the_last_and_the_longest_and_none_before_the_first() {
        let shared = Shared::default();
        assert_eq!(shared.health(), Health { overruns: None, clock: 1_000_000_000, ..Health::default() });
        // Planned, woken, read, written, done; the second one ends when the next one is due, the third one later.
        shared.record_tick([100, 103, 110, 130, 150], 100, false);
        shared.record_tick([200, 207, 210, 240, 300], 100, false);
        assert_eq!(shared.health().overruns, Some(0));
        shared.record_tick([300, 301, 310, 320, 401], 100, false);
        shared.device_faults.store(1 << 40, Ordering::Relaxed);
        shared.gauge_faults.store(4, Ordering::Relaxed);
        let health = shared.health();
        assert_eq!((health.tick, health.output), (Some([100, 100]), Some([10, 30])));
        assert_eq!((health.latest, health.overruns), (Some(7), Some(1)));
        assert_eq!((health.converter_faults, health.gauge_faults), (u32::MAX, 4));
        let times = LastAndLongest::default();
        assert_eq!(times.get(), None);
        for (time, expected) in [(5, [5, 5]), (9, [9, 9]), (0, [0, 9])] {
            times.add(time);
            assert_eq!(times.get(), Some(expected));
        }
    }

    #[test]
    fn where_time_waits_nothing_is_late() {
        let shared = Shared::default();
        shared.record_tick([100, 150, 160, 170, 900], 100, true);
        let health = shared.health();
        assert_eq!((health.latest, health.overruns, health.tick), (None, None, Some([750; 2])));
        assert_eq!(shared.overruns.load(Ordering::Relaxed), 0);
    }

    #[test]
    fn only_a_run_that_is_recorded_hands_states_over() {
        for records in [true, false] {
            let (inner, outer) = rings(records);
            assert_eq!(inner.outlets.snapshots.is_some(), records);
            assert!(inner.outlets.rows.slots() >= SNAPSHOT_EVERY as usize && outer.commands.slots() > 0);
        }
    }
}
