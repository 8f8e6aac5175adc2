//! What the loop leaves behind of every tick: a row for the service, and a recorder of its own.
//!
//! Both are filled after the outputs are written, and where a block of a record is to begin, its state is taken then, for the
//! tick to come: nothing of it lies between reading the gauges and driving the amplifiers.

use core::sync::atomic::Ordering;

use controller::Config;
use controller::snapshot::MACHINE_STATE_WORDS;
use controller::snapshot::recorder::{Activity, Settings};
use controller::supervised::Machine;
use rtrb::Producer;

use crate::handover::{Row, SNAPSHOT_EVERY, Shared, Snapshot, Tape};

/// The loop's recorder, and its ends of the rings that lead out.
pub struct Keeper<'a> {
    rows: Producer<Row>,
    snapshots: Option<Producer<Snapshot>>,
    tapes: Producer<(Tape, u32)>,
    tape: Option<Tape>,
    /// Orders taken so far.
    taken: u32,
    shared: &'a Shared,
    /// The row to come begins a block of the record of the run, and its state was handed over.
    opens: bool,
    /// It would have to, but there was no room for the state: it is lost.
    lost: bool,
    /// Rows of the block so far.
    since: u32,
}

impl<'a> Keeper<'a> {
    /// With the state of a `machine` at power-up as the beginning of the record.
    pub fn new(
        (rows, snapshots, tapes): (Producer<Row>, Option<Producer<Snapshot>>, Producer<(Tape, u32)>),
        tape: Option<Tape>,
        shared: &'a Shared,
        (machine, config): (&Machine, &Config),
    ) -> Self {
        let mut keeper =
            Self { rows, snapshots, tapes, tape, taken: 0, shared, opens: false, lost: false, since: SNAPSHOT_EVERY };
        keeper.prepare(machine, config, 0, false);
        keeper
    }

    /// Whether rows need the digest of the machine.
    pub fn wants_digest(&self) -> bool {
        self.snapshots.is_some() || self.tape.is_some()
    }

    /// An order was taken.
    pub fn ordered(&mut self) {
        self.taken = self.taken.wrapping_add(1);
    }

    /// Takes a recorder. The loop never has two.
    pub fn take(&mut self, mut tape: Tape, count: u64) {
        tape.begin(count);
        if let Some(other) = self.tape.replace(tape)
            && let Err(rtrb::PushError::Full(other)) = self.tapes.push((other, self.taken))
        {
            // Not reached: there is one tape. Released here it would be by the real-time thread.
            core::mem::forget(other);
        }
    }

    /// Begins the recording anew.
    pub fn record(&mut self, settings: Settings, count: u64) {
        if let Some(tape) = &mut self.tape {
            tape.start(settings);
            tape.begin(count);
        }
    }

    /// Triggers the recorder.
    pub fn trigger(&mut self) {
        if let Some(tape) = &mut self.tape {
            tape.trigger();
        }
    }

    /// Stops the recorder.
    pub fn stop(&mut self) {
        if let Some(tape) = &mut self.tape {
            tape.stop();
        }
    }

    /// Keeps a tick; a recorder that has what it was to record is handed over.
    pub fn keep(&mut self, mut row: Row) {
        if let Some(tape) = &mut self.tape {
            tape.push(&row.input, &row.output, || row.digest);
            row.recorded = Some(tape.rows());
            row.triggered = matches!(tape.activity(), Activity::Triggered(_) | Activity::Complete);
        }
        (row.opens, row.orders) = (self.opens, self.taken);
        self.since += 1;
        if self.lost || self.rows.push(row).is_err() {
            self.shared.lost_rows.fetch_add(1, Ordering::Relaxed);
            // What follows a gap begins with a state.
            self.since = SNAPSHOT_EVERY;
        }
    }

    /// Before tick number `count` of those that are run, under `config`; `changed` says that these settings are new.
    pub fn prepare(&mut self, machine: &Machine, config: &Config, count: u64, changed: bool) {
        self.give_back();
        if let Some(tape) = &mut self.tape {
            if changed {
                tape.settings_changed();
            }
            if tape.opens() {
                tape.open(&config.to_words(), machine.digest(), |words| machine.save_into(words));
            }
        }
        (self.opens, self.lost) = (false, false);
        if let Some(snapshots) = &mut self.snapshots
            && (changed || self.since >= SNAPSHOT_EVERY)
        {
            // With room for both the row cannot fail to follow.
            if self.rows.slots() > 0 && snapshots.slots() > 0 {
                let mut snapshot = Snapshot { count, digest: machine.digest(), state: [0; MACHINE_STATE_WORDS] };
                machine.save(&mut snapshot.state);
                self.opens = snapshots.push(snapshot).is_ok();
                self.since = 0;
            }
            self.lost = !self.opens;
        }
    }

    fn give_back(&mut self) {
        if let Some(tape) = self.tape.take_if(|tape| matches!(tape.activity(), Activity::Complete | Activity::Stopped))
            && let Err(rtrb::PushError::Full((tape, _))) = self.tapes.push((tape, self.taken))
        {
            // With the next tick.
            self.tape = Some(tape);
        }
    }

    /// Hands the recorder over, whatever it has: the loop ends.
    pub fn finish(mut self) {
        self.stop();
        self.give_back();
    }
}
