//! What the loop leaves behind of every tick: a row for the service, and a recorder of its own.
//!
//! Both are filled after the outputs are written, and where a block of a record is to begin, its state is taken then, for the
//! tick to come: nothing of it lies between reading the gauges and driving the amplifiers.

use core::sync::atomic::Ordering;

use controller::Config;
use controller::snapshot::recorder::{Activity, Settings};
use controller::snapshot::{MACHINE_STATE_WORDS, record_before};
use controller::supervised::Machine;

use crate::handover::{Outlets, Row, SNAPSHOT_EVERY, Shared, Snapshot, Tape};

/// The loop's recorder, and its ends of the rings that lead out.
pub struct Keeper<'a> {
    outlets: Outlets,
    tape: Option<Tape>,
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

    pub fn ordered(&mut self) {
        self.taken = self.taken.wrapping_add(1);
    }

    /// Takes a recorder. The loop never has two.
    pub fn take(&mut self, mut tape: Tape, count: u64) {
        tape.begin(count);
        if let Some(other) = self.tape.replace(tape)
            && let Err(rtrb::PushError::Full(other)) = self.outlets.tapes.push((other, self.taken))
        {
            // Not reached: there is one tape. Released here it would be by the real-time thread.
            core::mem::forget(other);
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

    /// Keeps a tick; a recorder that has what it was to record is handed over.
    pub fn keep(&mut self, mut row: Row) {
        if let Some(tape) = &mut self.tape {
            tape.push(&row.input.to_words(), &row.output, || row.digest);
            row.recorded = Some(tape.rows());
            row.triggered = matches!(tape.activity(), Activity::Triggered(_) | Activity::Complete);
        }
        (row.opens, row.orders) = (self.opens, self.taken);
        self.since += 1;
        if self.lost || self.outlets.rows.push(row).is_err() {
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
            record_before(config, machine, tape);
        }
        (self.opens, self.lost) = (false, false);
        if let Some(snapshots) = &mut self.outlets.snapshots
            && (changed || self.since >= SNAPSHOT_EVERY)
        {
            // With room for both the row cannot fail to follow.
            if self.outlets.rows.slots() > 0 && snapshots.slots() > 0 {
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
            && let Err(rtrb::PushError::Full((tape, _))) = self.outlets.tapes.push((tape, self.taken))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Writer;
    use controller::PLACE_WORDS;
    use controller::snapshot::recorder;
    use controller::supervised::{MACHINE_INPUT_WORDS, MachineInput};
    use rtrb::RingBuffer;
    use specgen_link::EdgeStatus;

    fn row(count: u64, digest: u64) -> Row {
        let output = recorder::Row { codes: [0; 6], status: 0, supervisor: 0 };
        let place = [0; PLACE_WORDS];
        let input = MachineInput::from_words(&[count; MACHINE_INPUT_WORDS]);
        let (opens, waving, triggered) = (false, false, false);
        Row {
            tick: count,
            count,
            input,
            output,
            place,
            digest,
            late: 0,
            orders: 0,
            opens,
            waving,
            edge: EdgeStatus::NONE,
            recorded: None,
            triggered,
        }
    }

    #[test]
    fn rows_that_find_no_room_are_counted_and_the_record_goes_on_behind_them_with_a_state() {
        let (machine, config, shared) = (Machine::new(), Config::new(), Shared::default());
        let (rows, mut taken) = RingBuffer::new(4);
        let (snapshots, mut states) = RingBuffer::new(2);
        let (tapes, _tapes) = RingBuffer::new(1);
        let outlets = Outlets { rows, snapshots: Some(snapshots), tapes };
        let mut keeper = Keeper::new(outlets, None, &shared, (&machine, &config));
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
        let word = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        let mut at = 16 + word(8).checked_shr(32).unwrap() as usize + 8;
        let mut blocks = Vec::new();
        while at < bytes.len() {
            // Rows, first tick, why it begins.
            blocks.push([word(at + 16), word(at + 24), word(at + 32) & 0xffff_ffff]);
            at += (word(at + 8) as usize + 1) * 8;
        }
        assert_eq!(blocks, [[4, 0, 0], [3, 11, 0]]);
    }
}
