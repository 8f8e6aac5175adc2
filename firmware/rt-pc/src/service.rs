//! The thread beside the loop, without a deadline: writes the record, hears operators, carries the plan on.

mod socket;

use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;

use controller::OUTPUT_WORDS;
use controller::supervised::{Cause, Phase};
use rtrb::{Consumer, Producer};
use specgen_rt::account::Verdict;
use specgen_rt::clock;

use crate::control::{Row, Shared, Wish};
use crate::operator::{Operator, Said};
use crate::record::Recorder;
pub use socket::Socket;

/// Between two rounds: the ring holds many times what comes in it.
const ROUND: Duration = Duration::from_millis(2);

/// What the service works with.
pub struct Service<'a> {
    /// What the loop did.
    pub rows: Consumer<Row>,
    /// What it is to do.
    pub wishes: Producer<Wish>,
    /// Flags and counters.
    pub shared: &'a Shared,
    /// Who asks.
    pub operator: Operator,
    /// Where ticks are written, if anywhere.
    pub recorder: Option<(PathBuf, Recorder)>,
    /// Where lines come from, if anywhere.
    pub socket: Option<Socket>,
    /// Set by a signal, taken back here.
    pub signal: Arc<AtomicBool>,
    /// Signals that came.
    pub signals: u32,
    /// Ask to ramp down at this time, ns.
    pub until: Option<u64>,
}

/// What is known at the end.
#[derive(Debug)]
pub struct Outcome {
    /// What the supervisor said last.
    pub last: Option<Said>,
    /// Causes of faults seen, in order.
    pub faults: Vec<(u64, Cause)>,
    /// The record's rows, or why it is not whole.
    pub record: Option<(PathBuf, io::Result<u64>)>,
    /// Late ticks among the rows.
    pub late_rows: u64,
    /// Rows seen.
    pub rows: u64,
    /// Why the plan was given up.
    pub complaint: Option<String>,
}

impl Service<'_> {
    /// Works until the loop has ended and every row is written.
    pub fn run(mut self) -> Outcome {
        let mut outcome =
            Outcome { last: None, faults: Vec::new(), record: None, late_rows: 0, rows: 0, complaint: None };
        loop {
            // Asked before the rows are drained: none can come after it.
            let ended = self.shared.ended.load(Ordering::Acquire);
            let now = clock::now();
            self.shared.service_alive.store(now, Ordering::Relaxed);
            self.drain(&mut outcome);
            if ended {
                break;
            }
            if let Some(said) = &outcome.last {
                self.operator.hear(said, now);
            }
            if let Some(socket) = &mut self.socket {
                socket.serve(&mut self.operator, outcome.last.as_ref(), now);
            }
            self.signals += u32::from(self.signal.swap(false, Ordering::Relaxed));
            if self.signals > 0 || self.until.is_some_and(|until| now >= until) {
                self.operator.go_down(now);
            }
            if self.operator.is_over() || self.signals > 1 {
                self.shared.stop.store(true, Ordering::Relaxed);
            }
            if let Some(wish) = self.operator.wish()
                && self.wishes.push(wish).is_err()
            {
                self.operator.repeat();
            }
            std::thread::sleep(ROUND);
        }
        if let Some((path, recorder)) = self.recorder.take() {
            outcome.record = Some((path, recorder.finish()));
        }
        outcome.complaint = self.operator.complaint.take();
        outcome
    }

    fn drain(&mut self, outcome: &mut Outcome) {
        while let Ok(row) = self.rows.pop() {
            outcome.rows += 1;
            if row.verdict != Verdict::OnTime {
                outcome.late_rows += 1;
            }
            let said = said(&row);
            let was = outcome.last.map(|last| last.phase);
            if said.phase == Phase::Faulted && was != Some(Phase::Faulted) {
                outcome.faults.push((said.tick, said.cause));
            }
            outcome.last = Some(said);
            if let Some((path, mut recorder)) = self.recorder.take() {
                match recorder.add(&row) {
                    Ok(()) => self.recorder = Some((path, recorder)),
                    // The machine goes on; the record ends here, which the summary says.
                    Err(error) => outcome.record = Some((path, Err(error))),
                }
            }
        }
    }
}

/// The supervisor's part of a row.
fn said(row: &Row) -> Said {
    let word = row.output[OUTPUT_WORDS];
    Said {
        phase: Phase::from_word(word & 0xff).unwrap_or(Phase::Faulted),
        cause: Cause::from_word(word >> 8 & 0xff).unwrap_or(Cause::None),
        on: word >> 16 & 1 == 1,
        // The status is the control law's last word.
        status: row.output[OUTPUT_WORDS - 1] as u32,
        tick: row.tick,
    }
}
