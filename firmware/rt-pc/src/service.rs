//! The thread beside the loop, without a deadline: writes the record, serves the link, carries the plan on.

mod clients;
mod desk;
mod link;
mod listener;

use core::sync::atomic::{AtomicBool, Ordering};
use std::io;
use std::os::fd::BorrowedFd;
use std::path::PathBuf;
use std::sync::Arc;

use controller::supervised::{Cause, Finding, Phase};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use specgen_rt::clock;

use crate::console::Console;
use crate::handover::{Order, Outer, Row, Shared};
use crate::operator::Said;
use crate::record;
pub use link::{Link, Traffic};

/// Between two rounds, unless a host sends something: the ring holds many times what comes in it.
const ROUND: Timespec = Timespec { tv_sec: 0, tv_nsec: 2_000_000 };

pub struct Service<'a> {
    pub rings: Outer,
    pub shared: &'a Shared,
    pub console: Console,
    /// Where ticks are written, if anywhere.
    pub record: Option<(PathBuf, record::Writer)>,
    /// Where frames come from, if anywhere.
    pub link: Option<Link>,
    /// Set by a signal, taken back here.
    pub signal: Arc<AtomicBool>,
    pub signals: u32,
    /// Ask to ramp down at this time, ns.
    pub until: Option<u64>,
}

/// Something that the supervisor did for a cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Incident {
    pub tick: u64,
    /// Phase that it led to.
    pub phase: Phase,
    pub cause: Cause,
    /// What the wiring check found, if that is the cause.
    pub finding: Finding,
}

/// What is known at the end.
#[derive(Debug, Default)]
pub struct Outcome {
    pub last: Option<Said>,
    /// Faults, holds for a cause, and what the law fell back to, in order.
    pub incidents: Vec<Incident>,
    /// The record's rows, or why it is not whole.
    pub record: Option<(PathBuf, io::Result<u64>)>,
    /// The last file of the recorder, and its ticks or why it could not be written.
    pub capture: Option<(PathBuf, io::Result<u64>)>,
    /// What came over the link, if there was one.
    pub link: Option<Traffic>,
    pub rows: u64,
    /// Why the plan was given up.
    pub failure: Option<String>,
}

impl Service<'_> {
    /// Works until the loop has ended and every row is written.
    pub fn run(mut self) -> Outcome {
        let mut outcome = Outcome::default();
        loop {
            // Asked before the rows are drained: none can come after it.
            let ended = self.shared.ended.load(Ordering::Acquire);
            let now = clock::now();
            self.shared.service_alive.store(now, Ordering::Relaxed);
            self.drain(&mut outcome, now);
            if ended {
                break;
            }
            if let Some(said) = self.console.said {
                self.console.operator.update(&said, now);
            }
            self.serve(now);
            self.console.passes.work();
            self.signals += u32::from(self.signal.swap(false, Ordering::Relaxed));
            if self.signals > 0 || self.until.is_some_and(|until| now >= until) {
                self.console.operator.ramp_down(now);
            }
            if self.console.operator.is_over() || self.signals > 1 {
                self.shared.stop.store(true, Ordering::Relaxed);
            }
            self.send();
            self.wait();
        }
        if let Some((path, writer)) = self.record.take() {
            outcome.record = Some((path, writer.finish()));
        }
        outcome.last = self.console.said;
        outcome.failure = self.console.operator.failure.take();
        outcome.capture = self.console.capture.written.take();
        outcome.link = self.link.map(|link| link.traffic());
        outcome
    }

    /// Serves the hosts, and says whose silence the loop is to watch.
    fn serve(&mut self, now: u64) {
        if let Some(link) = &mut self.link {
            self.console.health = self.shared.health();
            link.serve(&mut self.console, now);
        }
        let number = self.console.operator.link_number();
        self.shared.link.store(number, Ordering::Relaxed);
    }

    /// Sends what was asked for, as far as there is room.
    fn send(&mut self) {
        self.console.wish();
        let (orders, mut number) = self.console.outgoing();
        while self.rings.orders.slots() > 0
            && let Some(order) = orders.pop_front()
        {
            if let (Order::Configure(config), Some((_, writer))) = (&order, &mut self.record) {
                writer.configured(number, config);
            }
            number = number.wrapping_add(1);
            // There is room, and nothing else puts orders there.
            let _ = self.rings.orders.push(order);
        }
    }

    /// Until a host sends something, or for a round.
    fn wait(&self) {
        let all: Vec<BorrowedFd<'_>> = self.link.iter().flat_map(Link::descriptors).collect();
        let mut files: Vec<PollFd<'_>> = all.iter().map(|file| PollFd::new(file, PollFlags::IN)).collect();
        // A signal ends it early, and whatever else it says there is a next round.
        let _ = poll(&mut files, Some(&ROUND));
    }

    fn drain(&mut self, outcome: &mut Outcome, now: u64) {
        while let Ok(row) = self.rings.rows.pop() {
            outcome.rows += 1;
            let said = said(&row);
            let before = self.console.said.map_or((Phase::Disarmed, Cause::None), |said| (said.phase, said.cause));
            let finding = self.console.said.map_or(Finding::None, |said| said.finding);
            let fell_back = matches!(said.finding, Finding::Fallback(_)) && said.finding != finding;
            let faulted = said.phase == Phase::Faulted && before.0 != Phase::Faulted;
            let held = said.phase == Phase::Holding && said.cause != Cause::None && (said.phase, said.cause) != before;
            if faulted || held || fell_back {
                outcome.incidents.push(Incident {
                    tick: said.tick,
                    phase: said.phase,
                    cause: said.cause,
                    finding: said.finding,
                });
            }
            self.console.update(&row, said, now);
            if let Some(link) = &mut self.link {
                link.show(&row);
            }
            if let Some((path, mut writer)) = self.record.take() {
                match writer.add(&row, &mut self.rings.snapshots) {
                    Ok(()) => self.record = Some((path, writer)),
                    Err(error) => {
                        self.console
                            .operator
                            .give_up(format!("{}: the record is not whole: {error}", path.display()), now);
                        outcome.record = Some((path, Err(error)));
                    }
                }
            } else if row.opens {
                // Of a record that ended: its states must not block the ring.
                let _ = self.rings.snapshots.pop();
            }
        }
        // After the rows: what they say of the recorder is older.
        while let Ok((tape, taken)) = self.rings.tapes.pop() {
            if let Some(order) = self.console.capture.receive(tape, taken) {
                self.console.order(order);
            }
        }
        while let Ok(player) = self.rings.players.pop() {
            self.console.receive_player(player);
        }
    }
}

/// The supervisor's part of a row.
fn said(row: &Row) -> Said {
    let word = u64::from(row.output.supervisor);
    Said {
        phase: Phase::from_word(word & 0xff).unwrap_or(Phase::Faulted),
        cause: Cause::from_word(word >> 8 & 0xff).unwrap_or(Cause::None),
        finding: Finding::of_word(row.output.supervisor >> 17),
        on: word >> 16 & 1 == 1,
        status: row.output.status,
        tick: row.tick,
        orders: row.orders,
        waving: row.waving,
        late: row.late,
    }
}
