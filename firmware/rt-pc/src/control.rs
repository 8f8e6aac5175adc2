//! The real-time thread: in each tick it reads the inputs, computes, writes the outputs, and hands the tick's row to other
//! threads. It does not allocate, lock or use files.
//!
//! No control decision is made here. A missed tick, an invalid gauge or a lost host is an event bit; the supervisor
//! decides the reaction.

mod keeper;
mod setpoints;

use core::sync::atomic::Ordering;

use controller::sensing;
use controller::snapshot::recorder;
use controller::supervised::{
    AMPLIFIER, CONVERTER, INTEGRITY, LINK_LOST, MISSED_TICK, MachineOutput, Phase, STALLED, STOP, machine_at_reset,
    measured_input, supervise,
};
use controller::supervision::STALL_TICKS;
use controller::{Config, LEGS, Real, place_words, triggers};
use specgen_rt::account::{Account, Stamps};
use specgen_rt::clock::{self, Usage};
use specgen_rt::{allocation, scheduling};
use specgen_runtime::pending::EDGE;
use specgen_runtime::supervisor::OF_GAUGES;

use crate::devices::Device;
use crate::handover::{Inner, LoopCommand, Row, Shared, Tape};
use keeper::Keeper;
use setpoints::Setpoints;

/// From the start of the loop to its first tick, ns.
const START_DELAY: u64 = 20_000_000;
/// The computer was suspended if the clock that counts suspension gains more than this on the monotonic clock, ns.
const SUSPENSION: u64 = 1_000_000;
/// Time without a heartbeat of the service thread after which the operator's link is lost, ns. Its period is a few ms.
const SERVICE_TIMEOUT: u64 = 2_000_000_000;

/// Timing of the loop.
#[derive(Debug, Clone, Copy)]
pub struct Timing {
    /// Control period, ns.
    pub period: u64,
    /// Outputs later than this after the planned time are late, ns.
    pub limit: u64,
    /// Ticks without a request after which a link is lost.
    pub silence: u64,
    /// For simulated machines, whose time can wait: after a late tick none is skipped, and the next one starts as soon
    /// as possible.
    pub elastic: bool,
}

/// The loop with its data.
pub struct Loop<'a, D> {
    pub device: &'a mut D,
    pub config: Config,
    /// Event bits that hold for the whole run, such as a failed integrity check.
    pub standing_events: u32,
    pub rings: Inner,
    pub tape: Option<Tape>,
    pub shared: &'a Shared,
    pub timing: Timing,
}

impl<D: Device> Loop<'_, D> {
    /// Runs until [`Shared::stop`], and switches the amplifiers off. `account` collects the timing of the run.
    pub fn run(mut self, account: &mut Account) {
        scheduling::touch_stack();
        let mut machine = machine_at_reset();
        let mut setpoints = Setpoints::new();
        let Inner { outlets, mut commands, mut players } = self.rings;
        let mut keeper = Keeper::new(outlets, self.tape.take(), self.shared, (&machine, &self.config));
        let mut phase = Phase::Disarmed;
        let mut enabled = false;
        // In the last tick.
        let mut output_failed = false;
        let mut link = Link { number: 0, last_request: 0, silence: self.timing.silence };
        let mut count = 0;
        let Timing { period, elastic, .. } = self.timing;
        let mut planned = clock::now() + START_DELAY;
        let mut tick = 0;
        // Time for which the computer was suspended since boot.
        let mut slept = clock::since_boot().wrapping_sub(clock::now());
        allocation::enter();
        while !self.shared.stop.load(Ordering::Relaxed) {
            clock::sleep_until(planned);
            let woken = clock::now();
            let slept_now = clock::since_boot().wrapping_sub(woken);
            let suspended = slept_now.wrapping_sub(slept) > SUSPENSION && slept_now > slept;
            slept = slept_now;
            let skipped = if elastic { 0 } else { account.arrive(planned, woken, suspended) };
            planned += skipped * period;
            tick += skipped;

            let mut events = self.standing_events;
            if skipped > 0 {
                events |= MISSED_TICK;
            }
            // While the PC is suspended, the monotonic clock stops, and no tick counts as skipped.
            if skipped > u64::from(STALL_TICKS) || (suspended && !elastic) {
                events |= STALLED;
            }
            let silence = woken.saturating_sub(self.shared.service_alive.load(Ordering::Relaxed));
            if silence > SERVICE_TIMEOUT || link.is_lost(self.shared.link.load(Ordering::Relaxed), tick) {
                events |= LINK_LOST;
            }

            self.device.tick(tick);
            let read = self.device.read();
            let mut input_failed = read.is_err();
            // Toggles the heartbeat line, and reads the emergency stop and the amplifiers' fault contact.
            let contacts = self.device.beat();
            input_failed |= contacts.is_err();
            let contacts = contacts.unwrap_or_default();
            if contacts.stop {
                events |= STOP;
            }
            if contacts.fault {
                events |= AMPLIFIER;
            }
            let mut rising_edge = false;
            if triggers::INPUT {
                let line = self.device.input();
                input_failed |= line.is_err();
                rising_edge = setpoints.sense(line);
            }
            let usage = Usage::of_this_thread();
            let sensed = clock::now();

            if input_failed || output_failed {
                events |= CONVERTER;
            }
            let command = setpoints.next(phase);
            let (gauge, wrench) = match read {
                Ok(codes) => (
                    codes.map(|code| sensing::CONVERTER.reading(code)),
                    self.device.wrench().map(|value| value as Real),
                ),
                // The supervisor treats NaN as an invalid reading.
                Err(_) => ([Real::NAN; LEGS], [Real::NAN; LEGS]),
            };
            // The supervisor ignores the edge; it is an event so that records contain it.
            let events = if rising_edge { events | EDGE } else { events };
            let input = measured_input(&command, &gauge, &wrench, setpoints.request(), events);
            let output = supervise(&self.config, &mut machine, &input);
            let computed = clock::now();

            let mut driven = Ok(());
            if enabled && !output.amplifier_on {
                // Repeated in every tick until it succeeds.
                driven = self.device.enable(false);
                enabled = driven.is_err();
            }
            driven = driven.and(self.device.write(&output.tick.dac_code));
            if triggers::LINES != 0 {
                driven = driven.and(self.device.set(triggers::lines(output.tick.status)));
            }
            if output.amplifier_on && !enabled && driven.is_ok() {
                // Only after the codes are written. Even if this fails, the amplifiers may be on.
                driven = self.device.enable(true);
                enabled = true;
            }
            output_failed = driven.is_err();
            let written = clock::now();
            if input_failed || output_failed {
                self.shared.device_faults.fetch_add(1, Ordering::Relaxed);
            }

            if machine.supervisor.conditions & OF_GAUGES != 0 {
                self.shared.gauge_faults.fetch_add(1, Ordering::Relaxed);
            }
            phase = output.phase;
            setpoints.keep(&machine.state, output.tick.status);
            let digest = if keeper.wants_digest() { machine.digest() } else { 0 };
            keeper.keep(Row {
                tick,
                count,
                input,
                output: row_of(&output),
                place: place_words(&machine.state),
                digest,
                late: account.late().iter().sum(),
                commands: 0,
                opens: false,
                waving: setpoints.waving(),
                edge: setpoints.edge(),
                recorded: None,
                triggered: false,
            });
            if triggers::INPUT {
                setpoints.begin_awaited(tick, phase, output.tick.status, &self.config);
            }
            count += 1;
            let mut configured = false;
            if let Ok(command) = commands.pop() {
                keeper.count_command();
                match command {
                    LoopCommand::Request(wish) => setpoints.accept(wish),
                    LoopCommand::Configure(config) => (self.config, configured) = (config, true),
                    LoopCommand::Wave(wave) => setpoints.start(wave),
                    LoopCommand::StopWave => setpoints.stop(),
                    LoopCommand::Await(awaited, wave) => setpoints.wait_for_edge(awaited, wave),
                    LoopCommand::StopWaiting => setpoints.stop_waiting(),
                    LoopCommand::Pass(player) => setpoints.pass(player),
                    LoopCommand::AbortPass => setpoints.abort_pass(),
                    LoopCommand::Tape(tape) => keeper.take(tape, count),
                    LoopCommand::Record(settings) => keeper.record(settings, count),
                    LoopCommand::Trigger => keeper.trigger(),
                    LoopCommand::StopRecorder => keeper.stop(),
                }
            }
            keeper.prepare(&machine, &self.config, count, configured);
            // If the ring is full, the player is returned after a later tick.
            if let Some(Err(rtrb::PushError::Full(player))) = setpoints.take_player().map(|player| players.push(player))
            {
                setpoints.put_player(player);
            }
            let usage = Usage::of_this_thread().since(usage);
            let done = clock::now();
            self.shared.record_tick([planned, woken, sensed, written, done], period, elastic);
            account.tick(&Stamps { planned, woken, read: sensed, computed, written, done }, &usage, suspended);
            planned += period;
            if elastic && planned < done {
                planned = done;
            }
            tick += 1;
        }
        // A second attempt, because a bus that failed once may work now. A failure cannot be reported any more.
        let _ = self.device.enable(false).or_else(|_| self.device.enable(false));
        keeper.finish();
        allocation::leave();
        self.shared.ended.store(true, Ordering::Release);
    }
}

/// Whether the host at the other end of a link is still there.
struct Link {
    /// Number of the last request; 0 if no host is in control, whose silence would matter.
    number: u64,
    /// Tick of that request.
    last_request: u64,
    /// Ticks of silence that are tolerated.
    silence: u64,
}

impl Link {
    /// Whether the host is silent for too long at this `tick`, if the last request has this `number`. Skipped ticks count
    /// as silence, too.
    fn is_lost(&mut self, number: u64, tick: u64) -> bool {
        if number != self.number {
            (self.number, self.last_request) = (number, tick);
        }
        number != 0 && tick - self.last_request > self.silence
    }
}

/// The outputs of a tick as a recorder stores them.
fn row_of(output: &MachineOutput) -> recorder::Row {
    recorder::Row { codes: output.tick.dac_code, status: output.tick.status, supervisor: output.supervisor_word() }
}

/// The event bit of an integrity check: tables or settings in memory are damaged unless they are `intact`.
pub fn integrity_event(intact: bool) -> u32 {
    if intact { 0 } else { INTEGRITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::{Bench, Call, FAST, is_on, phase, run};
    use crate::capture::Capture;
    use controller::PLACE_WORDS;
    use controller::supervised::{Cause, Request};
    use controller::waves::{self, Wave};
    use specgen_rt::clock::SECOND;
    use specgen_runtime::wave::{AxisWave, Settings, Shape};

    /// Ticks of the machine after the test has done something to it.
    const AFTER: u64 = 20;
    const AT: u64 = 10;

    /// A machine that runs, and in tick [`AT`] of that something that happens to it; the first row that shows it.
    fn incident(mut act: impl FnMut(&mut Bench, u64) + Send + 'static) -> (Bench, usize) {
        let (bench, account) = run(FAST, move |bench| {
            let Some(since) = bench.arm_and_run() else { return };
            if let Some(since) = since.checked_sub(AT) {
                act(bench, since);
                if since == AFTER {
                    bench.stop();
                }
            }
        });
        assert!(account.balances() && account.skipped().iter().sum::<u64>() == 0);
        let running = bench.rows.iter().position(|row| phase(row) == Phase::Running).expect("it runs");
        let first = running + AT as usize;
        assert!(bench.rows[..first].iter().all(|row| row.input.events == 0));
        (bench, first)
    }

    fn cause(row: &Row) -> Cause {
        Cause::from_word(u64::from(row.output.supervisor >> 8 & 0xff)).unwrap()
    }

    fn calls(bench: &Bench, wanted: Call) -> Vec<u64> {
        bench.calls.iter().filter(|(_, call)| *call == wanted).map(|(tick, _)| *tick).collect()
    }

    #[test]
    fn every_tick_beats_once_and_gives_out_what_its_row_says() {
        let (bench, _) = incident(|bench, since| {
            if since == 3 {
                bench.ask(Request::RampDown);
            }
        });
        let rows = &bench.rows;
        assert_eq!(bench.beats, (0..rows.len() as u64).collect::<Vec<_>>());
        for (number, row) in (0..).zip(rows) {
            assert_eq!((row.tick, row.count, row.digest), (number, number, 0));
            assert_eq!((row.recorded, row.triggered, row.opens, row.waving), (None, false, false, false));
        }
        let written = bench.calls.iter().filter_map(|(tick, call)| match call {
            Call::Write(codes) => Some((*tick, *codes)),
            Call::Enable(_) => None,
        });
        let written: Vec<_> = written.collect();
        assert_eq!(written, rows.iter().map(|row| (row.tick, row.output.codes)).collect::<Vec<_>>());
        // The line follows the supervisor's word, and rises behind the codes of its tick.
        let rises = rows.iter().find(|row| is_on(row)).unwrap().tick;
        assert_eq!(calls(&bench, Call::Enable(true)), [rises]);
        let place = bench.calls.iter().position(|(_, call)| *call == Call::Enable(true)).unwrap();
        assert!(matches!(bench.calls[place - 1], (tick, Call::Write(_)) if tick == rises));
        assert_eq!(bench.calls.last().unwrap().1, Call::Enable(false), "off at the end");
        assert!(bench.shared.ended.load(Ordering::Acquire));
        // Each wish is one order, which is counted from the next row on.
        let commands: Vec<u32> = rows.iter().map(|row| row.commands).collect();
        assert!(commands[..2] == [0, 0] && commands[2] == 1 && commands.is_sorted() && commands[rows.len() - 1] == 3);
        assert_eq!(phase(rows.last().unwrap()), Phase::Disarmed);
        assert_eq!(bench.sets, if triggers::LINES == 0 { 0 } else { rows.len() });
        assert_eq!(bench.shared.device_faults.load(Ordering::Relaxed), 0);
        assert_eq!(bench.shared.gauge_faults.load(Ordering::Relaxed), 0);
        let place = rows[rows.len() - 20].place;
        assert!(place.iter().any(|word| *word != 0) && place.len() == PLACE_WORDS);
        let health = bench.shared.health();
        assert!(health.tick.is_some() && health.output.is_some() && health.latest.is_none());
    }

    #[test]
    fn a_contact_that_opens_switches_off_in_its_very_tick() {
        for (stop, event, expected) in [(true, STOP, Cause::EmergencyStop), (false, AMPLIFIER, Cause::AmplifierFault)] {
            let (bench, first) = incident(move |bench, _| (bench.contacts.stop, bench.contacts.fault) = (stop, !stop));
            let (before, row) = (&bench.rows[first - 1], &bench.rows[first]);
            assert!(is_on(before) && !is_on(row));
            assert_eq!((phase(row), cause(row)), (Phase::Faulted, expected));
            assert!(bench.rows[first..].iter().all(|row| row.input.events == event));
            // Once, in that tick; and once more at the end of the loop.
            let ended = bench.tick;
            assert_eq!(calls(&bench, Call::Enable(false)), [row.tick, ended]);
            let off = bench.calls.iter().position(|call| *call == (row.tick, Call::Enable(false))).unwrap();
            assert!(matches!(bench.calls[off + 1], (tick, Call::Write(_)) if tick == row.tick), "off before the codes");
        }
    }

    #[test]
    fn a_disable_that_is_refused_is_tried_in_every_tick_until_it_is_done() {
        const REFUSED: u64 = 5;
        let (bench, first) = incident(|bench, since| {
            bench.contacts.stop = true;
            bench.broken.disable = since < REFUSED;
        });
        let start = bench.rows[first].tick;
        let mut tries: Vec<u64> = (start..=start + REFUSED).collect();
        tries.push(bench.tick);
        assert_eq!(calls(&bench, Call::Enable(false)), tries);
        // The tick after a failure says so.
        for (number, row) in (0..).zip(&bench.rows[first..]) {
            let undriven = if (1..=REFUSED).contains(&number) { CONVERTER } else { 0 };
            assert_eq!(row.input.events, STOP | undriven, "{number}");
        }
        assert_eq!(bench.shared.device_faults.load(Ordering::Relaxed), REFUSED);
        let writes = bench.calls.iter().filter(|(_, call)| matches!(call, Call::Write(_))).count();
        assert_eq!(writes, bench.rows.len(), "codes go out all the same");
    }

    #[test]
    fn at_the_end_a_disable_that_is_refused_is_tried_twice() {
        let (bench, _) = incident(|bench, since| bench.broken.disable = since == AFTER);
        assert_eq!(calls(&bench, Call::Enable(false)), [bench.tick; 2]);
    }

    #[test]
    fn gauges_that_are_not_read_are_believed_by_nobody() {
        const FAULTS: u64 = 4;
        let (bench, first) = incident(|bench, since| bench.broken.read = since < FAULTS);
        for (number, row) in (0..).zip(&bench.rows[first..]) {
            let fails = number < FAULTS;
            assert_eq!(row.input.events, if fails { CONVERTER } else { 0 });
            assert_eq!(row.input.tick.gauge.map(Real::is_nan), [fails; LEGS]);
            assert_eq!(row.input.tick.wrench.map(Real::is_nan), [fails; LEGS]);
        }
        assert_eq!(bench.shared.device_faults.load(Ordering::Relaxed), FAULTS);
        assert!(u64::from(bench.shared.gauge_faults.load(Ordering::Relaxed)) >= FAULTS);
    }

    #[test]
    fn lines_that_cannot_be_driven_are_a_fault_of_their_tick() {
        let (bench, first) = incident(|bench, since| bench.broken.beat = since == 0);
        let events: Vec<u32> = bench.rows[first..].iter().map(|row| row.input.events).take(3).collect();
        assert_eq!(events, [CONVERTER, 0, 0]);
        assert_eq!(bench.shared.device_faults.load(Ordering::Relaxed), 1);
        assert_eq!(phase(&bench.rows[first]), Phase::Running, "one alone is no cause");
    }

    #[test]
    fn codes_that_do_not_go_out_are_a_fault_of_the_next_tick() {
        let (bench, first) = incident(|bench, since| bench.broken.write = since == 0);
        let events: Vec<u32> = bench.rows[first..].iter().map(|row| row.input.events).take(3).collect();
        assert_eq!(events, [0, CONVERTER, 0]);
        assert_eq!(bench.shared.device_faults.load(Ordering::Relaxed), 1);
        assert!(bench.calls.iter().all(|(tick, call)| *call != Call::Enable(false) || *tick == bench.tick));
    }

    /// State of the enable line of a machine that arms while something fails for one tick.
    fn armed(break_it: fn(&mut Bench)) -> (Bench, u64) {
        let (bench, _) = run(FAST, move |bench| {
            bench.broken = crate::bench::InjectedFaults::default();
            match bench.tick {
                1 => bench.ask(Request::Arm),
                2 => break_it(bench),
                10 => bench.contacts.stop = true,
                20 => bench.stop(),
                _ => {}
            }
        });
        let on = bench.rows.iter().find(|row| is_on(row)).unwrap().tick;
        assert_eq!(calls(&bench, Call::Enable(false)), [10, 20]);
        (bench, on)
    }

    #[test]
    fn amplifiers_are_enabled_behind_codes_that_went_out_and_disabled_whatever_they_answered() {
        let (bench, on) = armed(|bench| bench.broken.write = true);
        assert_eq!(on, 2);
        assert_eq!(calls(&bench, Call::Enable(true)), [3], "not in the tick whose codes did not go out");
        assert_eq!(bench.rows[3].input.events, CONVERTER);
        let (bench, on) = armed(|bench| bench.broken.enable = true);
        assert_eq!((on, calls(&bench, Call::Enable(true))), (2, vec![2]));
        assert_eq!(bench.rows[3].input.events, CONVERTER);
    }

    #[test]
    fn a_host_that_is_silent_for_longer_than_permitted_is_lost_until_it_asks_again() {
        const SILENCE: u64 = 5;
        let timing = Timing { silence: SILENCE, ..FAST };
        // From tick 10 on a host asks in every third tick, then it is silent, asks once more, and its silence matters no longer.
        let number = |tick: u64| match tick {
            0..10 => 0,
            10..30 => tick / 3,
            30..60 => 100,
            60..80 => 101,
            _ => 0,
        };
        let (bench, _) = run(timing, move |bench| {
            let next = bench.tick + 1;
            bench.shared.link.store(number(next), Ordering::Relaxed);
            if bench.tick == 100 {
                bench.stop();
            }
        });
        for row in &bench.rows {
            let lost = (30 + SILENCE + 1..60).contains(&row.tick) || (60 + SILENCE + 1..80).contains(&row.tick);
            assert_eq!(row.input.events, if lost { LINK_LOST } else { 0 }, "{}", row.tick);
        }
        assert_eq!(bench.rows.len(), 101);
    }

    #[test]
    fn a_service_without_a_sign_of_life_is_a_lost_link() {
        let (bench, _) = run(FAST, |bench| {
            let ago = if bench.tick < 5 { SERVICE_TIMEOUT - SECOND } else { SERVICE_TIMEOUT + 1 };
            bench.shared.service_alive.store(clock::now() - ago, Ordering::Relaxed);
            if bench.tick == 9 {
                bench.stop();
            }
        });
        let events: Vec<u32> = bench.rows.iter().map(|row| row.input.events).collect();
        assert_eq!(events, [[0; 6].as_slice(), &[LINK_LOST; 4]].concat());
    }

    fn spin(time: u64) {
        let start = clock::now();
        while clock::now() < start + time {}
    }

    /// Tries again what a busy computer may be too late for, but not every time.
    fn on_time(test: impl Fn() + std::panic::RefUnwindSafe) {
        if !(0..20).any(|_| std::panic::catch_unwind(&test).is_ok()) {
            test();
        }
    }

    #[test]
    fn time_that_does_not_wait_skips_ticks_and_the_next_one_says_so() {
        on_time(|| {
            const PERIOD: u64 = 100_000;
            let timing = Timing { period: PERIOD, limit: PERIOD / 2, silence: 1 << 40, elastic: false };
            let (bench, account) = run(timing, |bench| match bench.rows.len() {
                50 => spin(30 * PERIOD),
                100 => spin((u64::from(STALL_TICKS) + 50) * PERIOD),
                150 => bench.stop(),
                _ => {}
            });
            let mut gaps = Vec::new();
            for pair in bench.rows.windows(2) {
                let gap = pair[1].tick - pair[0].tick - 1;
                let missed = if gap > 0 { MISSED_TICK } else { 0 };
                let stalled = if gap > u64::from(STALL_TICKS) { STALLED } else { 0 };
                assert_eq!(pair[1].input.events, missed | stalled, "{gap}");
                gaps.push(gap);
            }
            assert!(gaps[50] >= 29 && gaps[100] >= u64::from(STALL_TICKS) + 49, "{gaps:?}");
            // The book and the rows say the same.
            let skipped: u64 = account.skipped().iter().sum();
            assert_eq!(skipped, gaps.iter().sum::<u64>() + bench.rows[0].tick);
            assert!(account.balances() && account.planned() == bench.rows.last().unwrap().tick + 1);
            let late = account.late().iter().sum::<u64>();
            assert!(late >= 2 && bench.rows.last().unwrap().late <= late && bench.rows[0].late == 0);
            let health = bench.shared.health();
            assert!(health.overruns.unwrap() >= 2 && health.latest.is_some());
        });
    }

    #[test]
    fn time_that_waits_skips_none_and_keeps_the_period_behind_a_late_tick() {
        on_time(|| {
            const PERIOD: u64 = 2_000_000;
            let timing = Timing { period: PERIOD, limit: PERIOD, silence: 1 << 40, elastic: true };
            let mut began = Vec::with_capacity(20);
            let (times, taken) = std::sync::mpsc::channel();
            let start = clock::now();
            let (bench, account) = run(timing, move |bench| {
                began.push(clock::now());
                if bench.tick == 5 {
                    spin(10 * PERIOD);
                }
                if bench.tick == 12 {
                    times.send(began.clone()).unwrap();
                    bench.stop();
                }
            });
            let began = taken.recv().unwrap();
            assert!(began[0] >= start + START_DELAY);
            // No tick makes up for a late one, however late that was.
            for pair in began.windows(2) {
                assert!(pair[1] - pair[0] >= PERIOD / 2, "{began:?}");
            }
            assert!(began[6] - began[5] >= 10 * PERIOD, "{began:?}");
            assert!(began[12] - began[6] >= 6 * PERIOD - PERIOD / 2, "{began:?}");
            assert!(began[5] - began[0] >= 5 * PERIOD - PERIOD / 2);
            assert!(bench.rows.iter().all(|row| row.input.events == 0));
            assert_eq!(account.skipped().iter().sum::<u64>(), 0);
        });
    }

    #[test]
    fn a_loop_begins_on_time() {
        on_time(|| {
            const PERIOD: u64 = START_DELAY / 2;
            let timing = Timing { period: PERIOD, limit: PERIOD, silence: 1 << 40, elastic: false };
            let (bench, _) = run(timing, |bench| bench.stop());
            assert_eq!((bench.rows[0].tick, bench.rows[0].input.events), (0, 0));
        });
    }

    #[test]
    fn standing_events_are_in_every_row_and_damaged_tables_are_one() {
        assert_eq!([true, false].map(integrity_event), [0, INTEGRITY]);
        let (inner, outer) = crate::handover::rings(false);
        let mut bench = Bench::new(outer, |bench| {
            if bench.tick == 3 {
                bench.ask(Request::Arm);
            }
            if bench.tick == 9 {
                bench.stop();
            }
        });
        let shared = bench.shared;
        let (config, standing_events) = (Config::new(), integrity_event(false));
        let control =
            Loop { device: &mut bench, config, standing_events, rings: inner, tape: None, shared, timing: FAST };
        control.run(&mut Account::new(1, 1));
        let mut rows = 0;
        while let Ok(row) = bench.outer.rows.pop() {
            assert!(row.input.events == INTEGRITY && !is_on(&row));
            bench.rows.push(row);
            rows += 1;
        }
        assert!(rows > 0);
    }

    #[test]
    fn a_recorder_goes_to_the_loop_and_comes_back_with_its_ticks() {
        let mut tape = Some(Capture::new(None).unwrap().1);
        let (mut bench, _) = run(FAST, move |bench| match bench.tick {
            2 => bench.queue(LoopCommand::Tape(tape.take().unwrap())),
            10 => bench.queue(LoopCommand::Trigger),
            20 => bench.queue(LoopCommand::Record(recorder::Settings {
                streaming: false,
                trigger: recorder::Trigger { fault: true, phase_change: false },
                after: 5,
                decimation: 1,
                digest_every: 1,
            })),
            30 => bench.queue(LoopCommand::StopRecorder),
            40 => bench.stop(),
            _ => {}
        });
        let of = |tick: usize| (bench.rows[tick].recorded, bench.rows[tick].triggered);
        assert_eq!([2, 3, 10, 12].map(of), [(None, false), (Some(1), false), (Some(8), false), (Some(10), true)]);
        assert_eq!([21, 30, 31].map(of), [(Some(1), false), (Some(10), false), (None, false)]);
        assert!(bench.rows[3..31].iter().all(|row| row.digest != 0) && bench.rows[31].digest == 0);
        let (tape, taken) = bench.outer.tapes.pop().unwrap();
        assert_eq!((tape.rows(), taken), (10, 4));
    }

    fn wave() -> Wave {
        let mut settings = Settings::still();
        settings.ramp_ticks = 100;
        settings.ticks = 300;
        settings.axes[2] = AxisWave { offset: 1e-8, shape: Shape::Constant };
        let mut wave = Wave::new(waves::limits(&Config::new()));
        wave.set(&settings).unwrap();
        wave
    }

    #[test]
    fn a_wave_is_followed_while_the_machine_runs_and_ends_with_that() {
        let (bench, _) = run(FAST, |bench| match bench.arm_and_run() {
            Some(10) => bench.queue(LoopCommand::Wave(wave())),
            Some(20) => bench.ask(Request::Hold),
            Some(80) => bench.stop(),
            _ => {}
        });
        let first = bench.rows.iter().position(|row| row.waving).unwrap();
        let waving = bench.rows.iter().filter(|row| row.waving).count();
        // From the tick after the order to the one that holds, which learns of that only behind it.
        assert!(bench.rows[first..first + waving].iter().all(|row| row.waving));
        assert_eq!((waving, phase(&bench.rows[first + waving - 1])), (11, Phase::Holding));
        assert_eq!(phase(bench.rows.last().unwrap()), Phase::Running);
    }
}
