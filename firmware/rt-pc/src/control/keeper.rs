//! Results of every tick: a row for the service, and a recorder of the loop.
//!
//! Both are filled after the outputs are written. If a block of a record must begin, its state is taken then, for the
//! next tick, so that no work lies between reading the gauges and driving the amplifiers.

use core::sync::atomic::Ordering;

use controller::Config;
use controller::snapshot::recorder::{Activity, Settings};
use controller::snapshot::{MACHINE_STATE_WORDS, record_before};
use controller::supervised::Machine;

use crate::handover::{Outlets, Row, SNAPSHOT_EVERY, Shared, Snapshot, Tape};

/// The loop's recorder, and its outgoing rings.
pub struct Keeper<'a> {
    outlets: Outlets,
    tape: Option<Tape>,
    taken: u32,
    shared: &'a Shared,
    /// The next row begins a block of the run's record, and its state was handed over.
    opens: bool,
    /// It should begin a block, but there was no room for the state: the row is lost.
    lost: bool,
    /// Rows of the block so far.
    since: u32,
}

impl<'a> Keeper<'a> {
    /// The state of `machine` at power-up begins the record.
    pub fn new(
        outlets: Outlets,
        tape: Option<Tape>,
        shared: &'a Shared,
        (machine, config): (&Machine, &Config),
    ) -> Self {
        let mut keeper = Self { outlets, tape, taken: 0, shared, opens: false, lost: false, since: SNAPSHOT_EVERY };
        keeper.prepare(machine, config, 0, false);
        keeper
    }

    /// Whether rows need the digest of the machine.
    pub fn wants_digest(&self) -> bool {
        self.outlets.snapshots.is_some() || self.tape.is_some()
    }

    pub fn count_command(&mut self) {
        self.taken = self.taken.wrapping_add(1);
    }

    /// Takes a recorder. The loop never has two.
    pub fn take(&mut self, mut tape: Tape, count: u64) {
        tape.begin(count);
        if let Some(other) = self.tape.replace(tape) {
            if let Err(rtrb::PushError::Full(other)) = self.outlets.tapes.push((other, self.taken)) {
                // Not reached: there is one tape. A release here would be in the real-time thread.
                core::mem::forget(other);
            }
        }
    }

    pub fn record(&mut self, settings: Settings, count: u64) {
        if let Some(tape) = &mut self.tape {
            tape.start(settings);
            tape.begin(count);
        }
    }

    pub fn trigger(&mut self) {
        if let Some(tape) = &mut self.tape {
            tape.trigger();
        }
    }

    pub fn stop(&mut self) {
        if let Some(tape) = &mut self.tape {
            tape.stop();
        }
    }

    /// Stores a tick; a recorder with a complete record is handed over.
    pub fn keep(&mut self, mut row: Row) {
        if let Some(tape) = &mut self.tape {
            tape.push(&row.input.to_words(), &row.output, || row.digest);
            row.recorded = Some(tape.rows());
            row.triggered = matches!(tape.activity(), Activity::Triggered(_) | Activity::Complete);
        }
        (row.opens, row.commands) = (self.opens, self.taken);
        self.since += 1;
        if self.lost || self.outlets.rows.push(row).is_err() {
            self.shared.lost_rows.fetch_add(1, Ordering::Relaxed);
            // After a gap the record continues with a state.
            self.since = SNAPSHOT_EVERY;
        }
    }

    /// Before tick number `count`, under `config`; `changed`: these settings are new.
    pub fn prepare(&mut self, machine: &Machine, config: &Config, count: u64, changed: bool) {
        self.give_back();
        if let Some(tape) = &mut self.tape {
            if changed {
                tape.settings_changed();
            }
            record_before(config, machine, tape);
        }
        (self.opens, self.lost) = (false, false);
        if let Some(snapshots) = &mut self.outlets.snapshots {
            if changed || self.since >= SNAPSHOT_EVERY {
                // With room for both, the row is certain to follow.
                if self.outlets.rows.slots() > 0 && snapshots.slots() > 0 {
                    let mut snapshot = Snapshot { count, digest: machine.digest(), state: [0; MACHINE_STATE_WORDS] };
                    machine.save(&mut snapshot.state);
                    self.opens = snapshots.push(snapshot).is_ok();
                    self.since = 0;
                }
                self.lost = !self.opens;
            }
        }
    }

    fn give_back(&mut self) {
        if let Some(tape) = self.tape.take_if(|tape| matches!(tape.activity(), Activity::Complete | Activity::Stopped))
        {
            if let Err(rtrb::PushError::Full((tape, _))) = self.outlets.tapes.push((tape, self.taken)) {
                // With the next tick.
                self.tape = Some(tape);
            }
        }
    }

    /// Hands the recorder over in any state: the loop ends.
    pub fn finish(mut self) {
        self.stop();
        self.give_back();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Writer;
    use controller::supervised::machine_at_reset;
    use controller::supervised::{MACHINE_INPUT_WORDS, MachineInput};
    use rtrb::RingBuffer;

    fn row(count: u64, digest: u64) -> Row {
        let input = MachineInput::from_words(&[count; MACHINE_INPUT_WORDS]);
        Row { digest, input, ..crate::bench::row(count) }
    }

    #[test]
    fn rows_that_find_no_room_are_counted_and_the_record_goes_on_behind_them_with_a_state() {
        let (machine, config, shared) = (machine_at_reset(), Config::new(), Shared::default());
        let (mut keeper, (mut taken, mut states, _tapes)) = keeper([4, 2], true, &shared);
        let path = std::env::temp_dir().join(format!("rt-pc-gap-{}.rec", std::process::id()));
        let mut writer = Writer::create(&path, &config).unwrap();
        for count in 0..14 {
            if count == 10 {
                while let Ok(row) = taken.pop() {
                    writer.add(&row, &mut states).unwrap();
                }
            }
            keeper.keep(row(count, machine.digest()));
            keeper.prepare(&machine, &config, count + 1, false);
        }
        // Of number 10 it was known before it that there was no room.
        assert_eq!(shared.lost_rows.load(Ordering::Relaxed), 7);
        while let Ok(row) = taken.pop() {
            writer.add(&row, &mut states).unwrap();
        }
        assert_eq!(writer.finish().unwrap(), 7);
        let bytes = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        // Rows, first tick, why it begins.
        let blocks = crate::bench::blocks(&bytes).into_iter().map(|block| [block[2], block[3], block[4] & 0xffff_ffff]);
        assert_eq!(blocks.collect::<Vec<_>>(), [[4, 0, 0], [3, 11, 0]]);
    }

    type Ends = (rtrb::Consumer<Row>, rtrb::Consumer<Snapshot>, rtrb::Consumer<(Tape, u32)>);

    /// A keeper with rings of this room, and their other ends.
    fn keeper([room, states]: [usize; 2], records: bool, shared: &Shared) -> (Keeper<'_>, Ends) {
        let (rows, rows_out) = RingBuffer::new(room);
        let (snapshots, snapshots_out) = RingBuffer::new(states);
        let (tapes, tapes_out) = RingBuffer::new(1);
        let outlets = Outlets { rows, snapshots: records.then_some(snapshots), tapes };
        let keeper = Keeper::new(outlets, None, shared, (&machine_at_reset(), &Config::new()));
        (keeper, (rows_out, snapshots_out, tapes_out))
    }

    #[test]
    fn a_block_begins_with_a_state_after_so_many_rows_and_with_other_settings() {
        let (machine, config, shared) = (machine_at_reset(), Config::new(), Shared::default());
        let (mut keeper, (mut rows, mut snapshots, _)) = keeper([8; 2], true, &shared);
        assert!(keeper.wants_digest());
        let mut opened = Vec::new();
        let last = 2 * u64::from(SNAPSHOT_EVERY) + 50;
        for count in 0..last {
            keeper.keep(row(count, 1));
            keeper.count_command();
            keeper.prepare(&machine, &config, count + 1, count == 99);
            let row = rows.pop().unwrap();
            assert_eq!(u64::from(row.commands), count);
            assert_eq!((row.recorded, row.triggered), (None, false));
            if row.opens {
                let snapshot = snapshots.pop().unwrap();
                assert_eq!((snapshot.count, snapshot.digest), (row.count, machine.digest()));
                opened.push(row.count);
            }
        }
        let every = u64::from(SNAPSHOT_EVERY);
        assert_eq!(opened, [0, 100, 100 + every]);
        assert_eq!(shared.lost_rows.load(Ordering::Relaxed), 0);
    }

    #[test]
    fn a_run_that_is_not_recorded_hands_rows_alone() {
        let (machine, config, shared) = (machine_at_reset(), Config::new(), Shared::default());
        let (mut keeper, (mut rows, mut snapshots, mut tapes)) = keeper([4; 2], false, &shared);
        assert!(!keeper.wants_digest());
        keeper.trigger();
        keeper.stop();
        for count in 0..6 {
            keeper.keep(row(count, 0));
            keeper.prepare(&machine, &config, count + 1, true);
        }
        assert_eq!(shared.lost_rows.load(Ordering::Relaxed), 2);
        assert!(rows.pop().is_ok_and(|row| !row.opens) && snapshots.pop().is_err() && tapes.pop().is_err());
        let (_, tape) = crate::capture::Capture::new(None).unwrap();
        keeper.take(tape, 6);
        assert!(keeper.wants_digest());
        keeper.prepare(&machine, &config, 6, false);
        keeper.keep(row(6, 5));
        assert!(tapes.pop().is_err(), "it records");
        keeper.trigger();
        keeper.stop();
        keeper.prepare(&machine, &config, 7, false);
        assert!(!keeper.wants_digest());
        assert!(tapes.pop().is_ok_and(|(tape, taken)| tape.rows() == 1 && taken == 0));
    }

    #[test]
    fn a_recorder_that_finds_no_room_is_kept_and_given_back_at_the_end() {
        let (machine, config, shared) = (machine_at_reset(), Config::new(), Shared::default());
        let (mut keeper, (_rows, _snapshots, mut tapes)) = keeper([4; 2], true, &shared);
        for expected in [false, true] {
            let (_, tape) = crate::capture::Capture::new(None).unwrap();
            keeper.take(tape, 0);
            keeper.stop();
            keeper.prepare(&machine, &config, 1, false);
            assert_eq!(keeper.tape.is_some(), expected);
        }
        assert!(tapes.pop().is_ok());
        keeper.finish();
        assert!(tapes.pop().is_ok_and(|(tape, _)| tape.activity() == Activity::Stopped));
    }
}
