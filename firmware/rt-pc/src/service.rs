//! The thread beside the loop, without a deadline: writes the record, serves the link, continues the plan.

mod clients;
mod handler;
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
use crate::handover::{LoopCommand, Outer, Row, Shared};
use crate::operator::SupervisorReport;
use crate::record;
pub use link::{Link, Traffic};

/// Pause between two rounds, unless a host sends something: the ring holds many times the rows of a round.
const ROUND: Timespec = Timespec { tv_sec: 0, tv_nsec: 2_000_000 };

pub struct Service<'a> {
    pub rings: Outer,
    pub shared: &'a Shared,
    pub console: Console,
    /// Destination of the ticks, if any.
    pub record: Option<(PathBuf, record::Writer)>,
    /// Source of frames, if any.
    pub link: Option<Link>,
    /// Set by a signal, cleared here.
    pub signal: Arc<AtomicBool>,
    pub signals: u32,
    /// Time at which to request a ramp-down, ns.
    pub until: Option<u64>,
}

/// Results at the end.
#[derive(Debug, Default)]
pub struct Outcome {
    pub last: Option<SupervisorReport>,
    /// Reports of faults, of holds with a cause, and of fallbacks, in order.
    pub incidents: Vec<SupervisorReport>,
    /// The record's rows, or the reason why it is incomplete.
    pub record: Option<(PathBuf, io::Result<u64>)>,
    /// The last file of the recorder, and its ticks or the error.
    pub capture: Option<(PathBuf, io::Result<u64>)>,
    /// Statistics of the link, if there was one.
    pub link: Option<Traffic>,
    pub rows: u64,
    /// Reason why the plan failed.
    pub failure: Option<String>,
}

impl Service<'_> {
    /// Works until the loop has ended and every row is written.
    pub fn run(mut self) -> Outcome {
        let mut outcome = Outcome::default();
        loop {
            // Read before the rows are drained: no row can come after it.
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

    /// Serves the hosts, and sets whose silence the loop watches.
    fn serve(&mut self, now: u64) {
        if let Some(link) = &mut self.link {
            self.console.health = self.shared.health();
            link.serve(&mut self.console, now);
        }
        let number = self.console.operator.heartbeat();
        self.shared.link.store(number, Ordering::Relaxed);
    }

    /// Sends queued commands, as far as there is room.
    fn send(&mut self) {
        self.console.take_pending();
        let (commands, mut number) = self.console.outgoing();
        while self.rings.commands.slots() > 0 {
            let Some(order) = commands.pop_front() else { break };
            if let (LoopCommand::Configure(config), Some((_, writer))) = (&order, &mut self.record) {
                writer.configured(number, config);
            }
            number = number.wrapping_add(1);
            // There is room, and nothing else sends commands.
            let _ = self.rings.commands.push(order);
        }
    }

    /// Waits until a host sends something, or for a round.
    fn wait(&self) {
        let all: Vec<BorrowedFd<'_>> = self.link.iter().flat_map(Link::descriptors).collect();
        let mut files: Vec<PollFd<'_>> = all.iter().map(|file| PollFd::new(file, PollFlags::IN)).collect();
        // A signal ends it early; in any case a next round follows.
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
                outcome.incidents.push(said);
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
                            .give_up(format!("{}: the record is incomplete: {error}", path.display()), now);
                        outcome.record = Some((path, Err(error)));
                    }
                }
            } else if row.opens {
                // Of a record that ended: its states must not block the ring.
                let _ = self.rings.snapshots.pop();
            }
        }
        // After the rows, which have older information on the recorder.
        while let Ok((tape, taken)) = self.rings.tapes.pop() {
            if let Some(order) = self.console.capture.receive(tape, taken) {
                self.console.queue(order);
            }
        }
        while let Ok(player) = self.rings.players.pop() {
            self.console.receive_player(player);
        }
    }
}

/// The supervisor's part of a row.
fn said(row: &Row) -> SupervisorReport {
    let word = u64::from(row.output.supervisor);
    SupervisorReport {
        phase: Phase::from_word(word & 0xff).unwrap_or(Phase::Faulted),
        cause: Cause::from_word(word >> 8 & 0xff).unwrap_or(Cause::None),
        finding: Finding::of_word(row.output.supervisor >> 17),
        on: word >> 16 & 1 == 1,
        status: row.output.status,
        tick: row.tick,
        commands: row.commands,
        waving: row.waving,
        late: row.late,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::row;
    use crate::capture::Capture;
    use crate::handover::{Inner, SNAPSHOT_EVERY, Snapshot, rings};
    use crate::operator::{Arbiter, Timeout};
    use controller::Config;
    use controller::snapshot::MACHINE_STATE_WORDS;
    use controller::supervised::Request;
    use specgen_rt::clock::SECOND;
    use std::time::Duration;

    const HOLDING: u32 = Phase::Holding.word() as u32;
    const FAULTED: u32 = Phase::Faulted.word() as u32;

    fn service<'a>(
        shared: &'a Shared,
        record: Option<&str>,
        until: Option<u64>,
    ) -> (Service<'a>, Inner, Option<PathBuf>) {
        let (inner, rings) = rings(record.is_some());
        let operator = Arbiter::new(true, Timeout { silence: SECOND, idle: SECOND });
        let console = Console::new(operator, Capture::new(None).unwrap().0, Config::new());
        let path = record.map(|name| std::env::temp_dir().join(format!("rt-pc-{name}-{}", std::process::id())));
        let record = path.clone().map(|path| {
            let writer = record::Writer::create(&path, &Config::new()).unwrap();
            (path, writer)
        });
        let signal = Arc::new(AtomicBool::new(false));
        (Service { rings, shared, console, record, link: None, signal, signals: 0, until }, inner, path)
    }

    fn word(phase: u32, cause: Cause, on: bool, finding: u32) -> u32 {
        phase | (cause.word() as u32) << 8 | u32::from(on) << 16 | finding << 17
    }

    #[test]
    fn a_word_says_phase_cause_finding_and_whether_the_amplifiers_are_on() {
        let mut row = row(9);
        for (phase, cause, on) in [(Phase::Holding, Cause::AmplifierFault, true), (Phase::Faulted, Cause::None, false)]
        {
            for finding in [0, 5] {
                row.output.supervisor = word(phase.word() as u32, cause, on, finding);
                (row.commands, row.waving, row.late, row.output.status) = (4, on, 3, 77);
                let found = said(&row);
                assert_eq!((found.phase, found.cause, found.on), (phase, cause, on));
                assert_eq!(found.finding, Finding::of_word(finding));
                assert_eq!((found.tick, found.commands, found.waving, found.late, found.status), (9, 4, on, 3, 77));
            }
        }
        row.output.supervisor = 0xff;
        assert_eq!(said(&row).phase, Phase::Faulted, "what cannot be understood");
    }

    #[test]
    fn faults_holds_for_a_cause_and_fall_backs_are_incidents_once() {
        let shared = Shared::default();
        let (mut service, mut inner, _) = service(&shared, None, None);
        let fallback = (0..1 << 15).find(|word| matches!(Finding::of_word(*word), Finding::Fallback(_))).unwrap();
        let running = Phase::Running.word() as u32;
        let words = [
            word(HOLDING, Cause::None, true, 0),
            word(HOLDING, Cause::LinkLost, true, 0),
            word(HOLDING, Cause::LinkLost, true, 0),
            word(HOLDING, Cause::TrackingError, true, 0),
            word(running, Cause::None, true, 0),
            word(running, Cause::Oscillation, true, fallback),
            word(running, Cause::Oscillation, true, fallback),
            word(FAULTED, Cause::Converter, false, 0),
            word(FAULTED, Cause::Converter, false, 0),
            word(Phase::Disarmed.word() as u32, Cause::None, false, 0),
            word(HOLDING, Cause::None, true, 0),
        ];
        for (tick, supervisor) in (0..).zip(words) {
            let mut row = row(tick);
            row.output.supervisor = supervisor;
            inner.outlets.rows.push(row).unwrap();
        }
        let mut outcome = Outcome::default();
        service.drain(&mut outcome, 3);
        let found: Vec<_> = outcome.incidents.iter().map(|one| (one.tick, one.phase, one.cause)).collect();
        assert_eq!(
            found,
            [
                (1, Phase::Holding, Cause::LinkLost),
                (3, Phase::Holding, Cause::TrackingError),
                (5, Phase::Running, Cause::Oscillation),
                (7, Phase::Faulted, Cause::Converter),
            ]
        );
        assert_eq!(outcome.rows, words.len() as u64);
        assert_eq!(service.console.ticked, Some(3));
    }

    #[test]
    fn the_loop_learns_whose_silence_matters_and_a_round_takes_its_time() {
        let shared = Shared::default();
        let (mut service, _inner, _) = service(&shared, None, None);
        service.serve(0);
        assert_eq!(shared.link.load(Ordering::Relaxed), 0);
        service.console.operator.take_for_host(crate::operator::HostId(1), 0).unwrap();
        service.serve(0);
        let number = shared.link.load(Ordering::Relaxed);
        assert!(number > 0 && number == service.console.operator.heartbeat());
        let start = clock::now();
        service.wait();
        assert!(clock::now() - start >= ROUND.tv_nsec as u64 / 2);
    }

    #[test]
    fn orders_go_out_in_their_order_as_far_as_there_is_room() {
        let shared = Shared::default();
        let (mut service, mut inner, _) = service(&shared, None, None);
        let room = service.rings.commands.slots();
        for _ in 0..room - 1 {
            service.console.queue(LoopCommand::Trigger);
        }
        service.console.configure(Config::new());
        service.console.operator.ramp_down(0);
        service.send();
        // The wish came last, and finds no room.
        assert_eq!((inner.commands.slots(), service.console.outgoing().0.len()), (room, 1));
        assert!(matches!(inner.commands.pop(), Ok(LoopCommand::Trigger)));
        service.send();
        let commands: Vec<_> = std::iter::from_fn(|| inner.commands.pop().ok()).collect();
        assert!(
            matches!(commands[room - 2..], [LoopCommand::Configure(_), LoopCommand::Request(wish)] if wish.request == Request::RampDown)
        );
        assert!(service.console.outgoing().0.is_empty());
    }

    #[test]
    fn a_record_has_the_settings_of_its_rows_and_ends_where_a_state_is_missing() {
        let shared = Shared::default();
        let (mut service, mut inner, path) = service(&shared, Some("settings"), None);
        let path = path.unwrap();
        let mut words = Config::new().to_words();
        let gain = controller::CONFIG_NAMES.iter().position(|name| *name == "kp[0]").unwrap();
        words[gain] = crate::words::word(0.0);
        service.console.operator.take_pending();
        service.console.configure(Config::from_words(&words).unwrap());
        service.send();
        let state = [0; MACHINE_STATE_WORDS];
        let mut outcome = Outcome::default();
        // The order was taken before the second of three blocks.
        for (block, commands) in [(0, 0), (1, 1), (2, 1)] {
            let count = block * u64::from(SNAPSHOT_EVERY);
            inner.outlets.snapshots.as_mut().unwrap().push(Snapshot { count, digest: 1, state }).unwrap();
            for tick in count..count + u64::from(SNAPSHOT_EVERY) {
                let mut row = row(tick);
                (row.opens, row.commands) = (tick == count, commands);
                inner.outlets.rows.push(row).unwrap();
            }
            service.drain(&mut outcome, 0);
        }
        assert!(outcome.record.is_none() && service.record.is_some());
        let (_, writer) = service.record.take().unwrap();
        assert_eq!(writer.finish().unwrap(), 3 * u64::from(SNAPSHOT_EVERY));
        let bytes = std::fs::read(&path).unwrap();
        let (old, new) = (Config::new().to_words(), words);
        let of = |words: [u64; controller::CONFIG_WORDS]| words.map(u64::to_le_bytes).concat();
        let count = |part: Vec<u8>| bytes.windows(part.len()).filter(|window| *window == part).count();
        assert_eq!((count(of(old)), count(of(new))), (1, 2));

        let writer = record::Writer::create(&path, &Config::new()).unwrap();
        service.record = Some((path.clone(), writer));
        inner.outlets.snapshots.as_mut().unwrap().push(Snapshot { count: 8, digest: 1, state }).unwrap();
        for count in [9, 10] {
            let mut row = row(count);
            row.opens = true;
            inner.outlets.rows.push(row).unwrap();
        }
        inner.outlets.snapshots.as_mut().unwrap().push(Snapshot { count: 10, digest: 1, state }).unwrap();
        service.drain(&mut outcome, 0);
        assert!(matches!(&outcome.record, Some((found, Err(_))) if *found == path));
        assert!(service.record.is_none() && service.console.operator.failure.is_some());
        assert_eq!(service.rings.snapshots.slots(), 0, "what comes behind it blocks nothing");
        std::fs::remove_file(&path).unwrap();
    }

    /// Runs it beside a machine that ramps down, or stays on for ever; what the outcome says, and how long it took, ns.
    fn served(until: Option<u64>, signals: &'static [u64], goes_down: bool) -> (Outcome, u64, bool) {
        let shared: &'static Shared = Box::leak(Box::default());
        let (service, mut inner, _) = service(shared, None, until);
        let signal = Arc::clone(&service.signal);
        let start = clock::now();
        let machine = std::thread::spawn(move || {
            let (mut asked, mut tick) = (Request::None, 0);
            while !shared.stop.load(Ordering::Relaxed) && clock::now() < start + 5 * SECOND {
                while let Ok(order) = inner.commands.pop() {
                    if let LoopCommand::Request(wish) = order {
                        asked = wish.request;
                    }
                }
                if signals.contains(&tick) {
                    signal.store(true, Ordering::Relaxed);
                }
                let mut row = row(tick);
                let down = goes_down && asked == Request::RampDown;
                row.output.supervisor = if down { 0 } else { word(HOLDING, Cause::None, true, 0) };
                inner.outlets.rows.push(row).unwrap();
                tick += 1;
                std::thread::sleep(Duration::from_millis(2));
            }
            shared.ended.store(true, Ordering::Release);
            asked == Request::RampDown
        });
        let outcome = service.run();
        let took = clock::now() - start;
        let ramped = machine.join().unwrap();
        assert!(shared.stop.load(Ordering::Relaxed) && outcome.rows > 0);
        assert!(clock::now() - shared.service_alive.load(Ordering::Relaxed) < SECOND);
        (outcome, took, ramped)
    }

    #[test]
    fn a_time_or_a_signal_ramps_down_and_a_second_signal_ends_at_once() {
        let (outcome, took, ramped) = served(Some(clock::now() + SECOND / 10), &[], true);
        assert!(ramped && (SECOND / 10..4 * SECOND).contains(&took), "{took}");
        assert_eq!((outcome.last.unwrap().phase, outcome.failure), (Phase::Disarmed, None));
        let (outcome, took, ramped) = served(None, &[10], true);
        assert!(ramped && (20_000_000..4 * SECOND).contains(&took), "{took}");
        assert_eq!(outcome.last.unwrap().phase, Phase::Disarmed);
        let (outcome, took, ramped) = served(None, &[10, 60], false);
        assert!(ramped && (120_000_000..4 * SECOND).contains(&took), "{took}");
        assert_eq!(outcome.last.unwrap().phase, Phase::Holding);
    }
}
