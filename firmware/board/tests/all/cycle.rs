//! The tick against the controller called by hand, on converters that take every code, faults included.

#![allow(clippy::unwrap_used)]

use std::cell::RefCell;
use std::rc::Rc;

use controller::hysteresis::{Memory, TABLES};
use controller::limits::DAC;
use controller::sensing;
use controller::supervised::{
    AMPLIFIER, CONVERTER, Cause, INTEGRITY, LINK_LOST, MISSED_TICK, Machine, MachineInput, MachineOutput, Phase,
    Request, STALLED, STOP, machine_at_reset, supervise,
};
use controller::supervision::READINGS_PER_LEG;
use controller::{Command, CommandKind, Config, INPUT_WORDS, Real, Target, TickInput};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen_board::{Board, COMMAND_WORDS, Exchange, GAUGE_BITS, TargetStatus};
use specgen_hal::{Amplifiers, Fault, Gauges};

/// What a board did to its amplifiers, in order.
#[derive(Debug, Clone, Copy, PartialEq)]
enum AmplifierAction {
    Start,
    Enable(bool),
    Write([i32; 6]),
}

/// What the converters answer next, and what was sent to them.
#[derive(Default)]
struct Bench {
    codes: [i32; 6],
    gauge_fault: Option<Fault>,
    write_fault: Option<Fault>,
    start_fault: Option<Fault>,
    done: Vec<AmplifierAction>,
    /// Legs that the codes move and the gauges see; none stand where they are.
    legs: Option<[Memory; 6]>,
}

/// Ticks that arming takes, the wiring check of six legs included, and some more.
const ARMED: u32 = 4500;
/// Codes of gauges in the middle of their range.
const MIDDLE: i32 = 1 << 17;

/// Where the codes of the amplifiers bring the gauges.
fn follow(legs: &mut [Memory; 6], codes: &[i32; 6]) -> [i32; 6] {
    for ((leg, table), code) in legs.iter_mut().zip(&TABLES).zip(codes) {
        leg.apply(table, DAC.drive(*code));
    }
    READINGS_PER_LEG.map(|row| {
        let moved: Real = row.iter().zip(&*legs).map(|(part, leg)| part * leg.displacement()).sum();
        MIDDLE + (2.0 * moved / sensing::CONVERTER.per_code).round() as i32
    })
}

#[derive(Clone, Default)]
struct Parts(Rc<RefCell<Bench>>);

impl Gauges for Parts {
    /// One bit more than the reference's gauges.
    const BITS: u32 = 18;

    fn read(&mut self) -> Result<[i32; 6], Fault> {
        let bench = self.0.borrow();
        bench.gauge_fault.map_or(Ok(bench.codes), Err)
    }
}

impl Amplifiers for Parts {
    const BITS: u32 = 16;

    fn start(&mut self) -> Result<(), Fault> {
        let mut bench = self.0.borrow_mut();
        bench.done.push(AmplifierAction::Start);
        bench.start_fault.map_or(Ok(()), Err)
    }

    fn write(&mut self, codes: &[i32; 6]) -> Result<(), Fault> {
        let mut bench = self.0.borrow_mut();
        bench.done.push(AmplifierAction::Write(*codes));
        if let Some(mut legs) = bench.legs.take() {
            bench.codes = follow(&mut legs, codes);
            bench.legs = Some(legs);
        }
        bench.write_fault.map_or(Ok(()), Err)
    }

    fn enable(&mut self, on: bool) -> Result<(), Fault> {
        self.0.borrow_mut().done.push(AmplifierAction::Enable(on));
        Ok(())
    }
}

/// For the rest of the test, as on a board.
fn at_reset() -> &'static mut Machine {
    Box::leak(Box::new(machine_at_reset()))
}

fn started(intact: bool) -> (Parts, Board<'static, Parts, Parts>, Exchange) {
    let parts = Parts::default();
    parts.0.borrow_mut().codes = [MIDDLE; 6];
    let mut board = Board::new(parts.clone(), parts.clone(), at_reset(), intact);
    let mut exchange = Exchange::new();
    board.start(&mut exchange.report);
    exchange.silence.heard();
    parts.0.borrow_mut().done.clear();
    (parts, board, exchange)
}

/// The same with legs that move.
fn moving() -> (Parts, Board<'static, Parts, Parts>, Exchange) {
    let (parts, board, exchange) = started(true);
    parts.0.borrow_mut().legs = Some([Memory::new(); 6]);
    (parts, board, exchange)
}

/// The controller by hand, from typed inputs instead of words.
struct ByHand {
    config: Config,
    machine: Machine,
}

impl ByHand {
    fn new() -> Self {
        Self { config: Config::new(), machine: machine_at_reset() }
    }

    fn tick(
        &mut self,
        command: &[u64; COMMAND_WORDS],
        gauge: [Real; 6],
        request: Request,
        events: u32,
    ) -> MachineOutput {
        let vector = |start: usize| core::array::from_fn(|k| Real::from_bits(command[start + k]));
        let command = Command {
            kind: CommandKind::from_word(command[0]),
            selector: command[1] as u32,
            sequence: command[2] as u32,
            target: Target { pose: vector(3), rate: vector(9), acceleration: vector(15) },
        };
        let tick = TickInput { command, correction: [], gauge, wrench: [Real::NAN; 6] };
        supervise(&self.config, &mut self.machine, &MachineInput { tick, request, events })
    }
}

const REQUESTS: [Request; 6] =
    [Request::None, Request::Arm, Request::Run, Request::Hold, Request::RampDown, Request::Acknowledge];

/// Random commands, requests, codes and faults: what goes out is what the controller says, and the line is switched off
/// before and on after the codes.
#[test]
fn a_board_does_what_the_controller_says_whatever_happens() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let (parts, mut board, mut exchange) = started(true);
    let mut by_hand = ByHand::new();
    let mut carried = 0;
    let (mut faults, mut enabled) = (0, 0);
    for tick in 0..20_000_u64 {
        let mut chance = |one_in: u32| random.next_u32() % one_in == 0;
        let (gauge_fails, write_fails, stop, amplifier) = (chance(50), chance(50), chance(200), chance(200));
        let missed = if chance(40) { 1 + random.next_u32() % 3 } else { 0 };
        let missed = if random.next_u32() % 1000 == 0 { 100 + random.next_u32() % 2 } else { missed };
        if random.next_u32() % 20 == 0 {
            exchange.command.request = REQUESTS[random.next_u32() as usize % 6];
            exchange.command.command[0] = u64::from(random.next_u32() % 5);
            exchange.command.command[2] = tick;
        }
        exchange.silence.heard();
        {
            let mut bench = parts.0.borrow_mut();
            for code in &mut bench.codes {
                *code = ((1 << 17) + (random.next_u32() % 2000) as i32 - 1000).clamp(0, (1 << 18) - 1);
            }
            bench.gauge_fault = gauge_fails.then_some(Fault::Blank);
            bench.write_fault = write_fails.then_some(Fault::ReadBack);
        }
        let (orders, codes) = (exchange.command, parts.0.borrow().codes);
        let restarted = board.tick(&mut exchange, TargetStatus { missed, stop, amplifier });

        let mut events = carried;
        for (happened, event) in [
            (gauge_fails, CONVERTER),
            (missed > 0, MISSED_TICK),
            (missed > 100, STALLED),
            (stop, STOP),
            (amplifier, AMPLIFIER),
        ] {
            events |= if happened { event } else { 0 };
        }
        let gauge = if gauge_fails { [Real::NAN; 6] } else { codes.map(|code| sensing::CONVERTER.reading(code >> 1)) };
        let held = by_hand.machine.state.legs.each_ref().map(|leg| leg.code);
        // What the supervisor is asked for with converters that were just started is nothing.
        let request = if restarted { Request::None } else { orders.request };
        let output = by_hand.tick(&orders.command, gauge, request, if restarted { events & !carried } else { events });
        let mut expected =
            if restarted { vec![AmplifierAction::Enable(false), AmplifierAction::Start] } else { Vec::new() };
        if restarted && held != [0; 6] {
            expected.push(AmplifierAction::Write(held));
        }
        if output.amplifier_on {
            expected.extend([AmplifierAction::Write(output.tick.dac_code), AmplifierAction::Enable(true)]);
            enabled += 1;
        } else {
            expected.extend([AmplifierAction::Enable(false), AmplifierAction::Write(output.tick.dac_code)]);
        }
        assert_eq!(std::mem::take(&mut parts.0.borrow_mut().done), expected, "tick {tick}");
        assert_eq!(board.machine().digest(), by_hand.machine.digest(), "tick {tick}");
        assert_eq!(exchange.report.phase, output.phase);
        assert_eq!(exchange.report.cause, output.cause);
        carried = if write_fails { CONVERTER } else { 0 };
        faults += u32::from(gauge_fails) + u32::from(write_fails);
        assert_eq!(exchange.report.health.converter_faults, faults);
    }
    assert_eq!(exchange.report.health.faults, Fault::Blank.bit() | Fault::ReadBack.bit());
    assert!(enabled > 0, "the amplifiers were never on: this tested nothing");
}

/// The comparison above is able to fail: another shift of the codes is another machine.
#[test]
fn a_code_taken_with_another_shift_is_seen() {
    let (parts, mut board, mut exchange) = started(true);
    let mut by_hand = ByHand::new();
    let mut differs = false;
    for k in 0..50 {
        parts.0.borrow_mut().codes = [(1 << 17) + 100 * k; 6];
        exchange.command.request = if k == 0 { Request::Arm } else { Request::Run };
        exchange.silence.heard();
        let orders = exchange.command;
        board.tick(&mut exchange, TargetStatus::default());
        let codes = parts.0.borrow().codes;
        by_hand.tick(&orders.command, codes.map(|code| sensing::CONVERTER.reading((code + 2) >> 1)), orders.request, 0);
        differs |= board.machine().digest() != by_hand.machine.digest();
    }
    assert!(differs);
}

#[test]
fn a_link_without_a_frame_or_that_fell_silent_is_an_event() {
    let parts = Parts::default();
    let mut board = Board::new(parts.clone(), parts, at_reset(), true);
    let mut exchange = Exchange::new();
    board.start(&mut exchange.report);
    board.tick(&mut exchange, TargetStatus::default());
    assert_eq!(exchange.report.health.events & LINK_LOST, LINK_LOST);
    exchange.silence.heard();
    exchange.report.health.events = 0;
    // 0.1 s at the reference's 100 µs.
    for _ in 0..1000 {
        board.tick(&mut exchange, TargetStatus::default());
    }
    assert_eq!(exchange.report.health.events & LINK_LOST, 0);
    board.tick(&mut exchange, TargetStatus::default());
    assert_eq!(exchange.report.health.events & LINK_LOST, LINK_LOST);
}

#[test]
fn a_damaged_flash_is_an_event_of_every_tick() {
    let (_, mut board, mut exchange) = started(false);
    for _ in 0..3 {
        exchange.report.health.events = 0;
        board.tick(&mut exchange, TargetStatus::default());
        assert_eq!(exchange.report.health.events & INTEGRITY, INTEGRITY);
    }
    let (_, mut whole, mut exchange) = started(true);
    whole.tick(&mut exchange, TargetStatus::default());
    assert_eq!(exchange.report.health.events & INTEGRITY, 0);
}

#[test]
fn converters_that_did_not_start_never_get_power_until_a_new_acknowledgement_starts_them() {
    let parts = Parts::default();
    parts.0.borrow_mut().start_fault = Some(Fault::ReadBack);
    let mut board = Board::new(parts.clone(), parts.clone(), at_reset(), true);
    let mut exchange = Exchange::new();
    board.start(&mut exchange.report);
    assert_eq!(exchange.report.health.faults, Fault::ReadBack.bit());
    for request in [Request::Arm, Request::Run, Request::Acknowledge, Request::Acknowledge, Request::Run, Request::Run]
    {
        exchange.silence.heard();
        exchange.report.health.events = 0;
        exchange.command.request = request;
        board.tick(&mut exchange, TargetStatus::default());
        assert_eq!(exchange.report.health.events & CONVERTER, CONVERTER);
    }
    let starts = |parts: &Parts| parts.0.borrow().done.iter().filter(|&&done| done == AmplifierAction::Start).count();
    assert!(!parts.0.borrow().done.contains(&AmplifierAction::Enable(true)));
    // Once at power-up, once for the one acknowledgement that was given twice, if the supervisor had the amplifiers off.
    let before = starts(&parts);
    assert!(before <= 2, "{before}");

    parts.0.borrow_mut().start_fault = None;
    for request in [Request::RampDown, Request::None, Request::Acknowledge, Request::None] {
        for _ in 0..20_000 {
            exchange.silence.heard();
            exchange.command.request = request;
            board.tick(&mut exchange, TargetStatus::default());
        }
    }
    assert_eq!(starts(&parts), before + 1);
    exchange.report.health.events = 0;
    board.tick(&mut exchange, TargetStatus::default());
    assert_eq!(exchange.report.health.events & CONVERTER, 0);
}

#[test]
fn the_command_stands_before_the_gauges() {
    assert_eq!(controller::INPUT_NAMES[COMMAND_WORDS], "gauge[0]");
    assert_eq!(controller::INPUT_NAMES[COMMAND_WORDS + 5], "gauge[5]");
    assert_eq!(COMMAND_WORDS + 12, INPUT_WORDS);
    assert_eq!(GAUGE_BITS, 17);
    assert_eq!(specgen_board::PERIOD_NANOSECONDS, 100_000);
}

/// Whatever else took the amplifiers off: an acknowledgement starts converters that failed, and one is enough.
#[test]
fn a_converter_that_failed_names_the_cause_and_one_acknowledgement_is_enough_once_it_answers() {
    for stop in [false, true] {
        let (parts, mut board, mut exchange) = moving();
        let mut run = |exchange: &mut Exchange, request: Request, ticks: u32, stop: bool| {
            exchange.command.request = request;
            for _ in 0..ticks {
                exchange.silence.heard();
                board.tick(exchange, TargetStatus { stop, ..TargetStatus::default() });
            }
        };
        run(&mut exchange, Request::Arm, ARMED, false);
        assert_eq!(exchange.report.phase, Phase::Holding);
        parts.0.borrow_mut().gauge_fault = Some(Fault::NotEnded);
        run(&mut exchange, Request::Arm, 99, false);
        assert_eq!((exchange.report.phase, exchange.report.cause), (Phase::Holding, Cause::None));
        run(&mut exchange, Request::Arm, 1, stop);
        let cause = if stop { Cause::EmergencyStop } else { Cause::Converter };
        assert_eq!(exchange.report.cause, cause, "not the gauge, which nobody read");
        run(&mut exchange, Request::None, 100, false);
        assert_eq!(exchange.report.phase, Phase::Faulted);
        parts.0.borrow_mut().done.clear();
        run(&mut exchange, Request::Acknowledge, 100, false);
        assert_eq!(exchange.report.phase, Phase::Faulted, "it still does not answer");
        run(&mut exchange, Request::None, 1, false);
        // The pose is that of the last tick in which they were read.
        let report = &exchange.report;
        assert!(report.measured.is_some_and(|measured| measured + 100 < report.tick), "{report:?}");
        parts.0.borrow_mut().gauge_fault = None;
        run(&mut exchange, Request::Acknowledge, 2, false);
        assert_eq!(exchange.report.phase, Phase::Disarmed);
        assert_eq!(parts.0.borrow().done.iter().filter(|&&done| done == AmplifierAction::Start).count(), 2);
        assert!(exchange.report.health.gauge_faults > 100);
    }
}

/// A debugger that held the core while the watchdog stood still: `supervisor.missed_in_a_row` is 100.
#[test]
fn a_machine_that_stood_still_ramps_down_and_its_record_says_so() {
    for (missed, phase, cause) in [
        (0, Phase::Holding, Cause::None),
        (100, Phase::Holding, Cause::None),
        (101, Phase::Faulted, Cause::Stalled),
        (9_999, Phase::Faulted, Cause::Stalled),
        (u32::MAX, Phase::Faulted, Cause::Stalled),
    ] {
        let (parts, mut board, mut exchange) = moving();
        let mut tick = |exchange: &mut Exchange, missed| {
            exchange.silence.heard();
            board.tick(exchange, TargetStatus { missed, ..TargetStatus::default() });
        };
        exchange.command.request = Request::Arm;
        (0..ARMED).for_each(|_| tick(&mut exchange, 0));
        assert!(exchange.report.amplifier_on);
        exchange.report.health.events = 0;
        tick(&mut exchange, missed);
        let seen = if missed > 100 { MISSED_TICK | STALLED } else { missed.min(1) };
        assert_eq!(exchange.report.health.events, seen, "{missed}");
        (0..20_000).for_each(|_| tick(&mut exchange, 0));
        assert_eq!((exchange.report.phase, exchange.report.cause), (phase, cause), "{missed}");
        assert_eq!(
            parts.0.borrow().done.last() == Some(&AmplifierAction::Enable(true)),
            cause == Cause::None,
            "{missed}"
        );
    }
}

/// `supervisor.amplifier_fault` of this controller is "off".
#[test]
fn a_fault_of_an_amplifier_switches_off_in_its_tick_and_is_shown_until_it_is_gone() {
    let (parts, mut board, mut exchange) = moving();
    let mut run = |exchange: &mut Exchange, request: Request, ticks: u32, amplifier: bool| {
        exchange.command.request = request;
        exchange.report.health.events = 0;
        for _ in 0..ticks {
            exchange.silence.heard();
            board.tick(exchange, TargetStatus { amplifier, ..TargetStatus::default() });
        }
        let report = &exchange.report;
        (report.phase, report.cause, report.health.events & AMPLIFIER != 0)
    };
    assert_eq!(
        run(&mut exchange, Request::Arm, ARMED, true),
        (Phase::Disarmed, Cause::None, true),
        "it refuses to arm"
    );
    run(&mut exchange, Request::None, 1, false);
    assert_eq!(run(&mut exchange, Request::Arm, ARMED, false), (Phase::Holding, Cause::None, false));
    assert_eq!(parts.0.borrow().done.last(), Some(&AmplifierAction::Enable(true)));
    parts.0.borrow_mut().done.clear();
    assert_eq!(run(&mut exchange, Request::Arm, 1, true), (Phase::Faulted, Cause::AmplifierFault, true));
    assert!(!exchange.report.amplifier_on && parts.0.borrow().done.contains(&AmplifierAction::Enable(false)));
    assert!(!parts.0.borrow().done.contains(&AmplifierAction::Enable(true)));
    run(&mut exchange, Request::None, 20_000, true);
    assert_eq!(run(&mut exchange, Request::Acknowledge, 100, true), (Phase::Faulted, Cause::AmplifierFault, true));
    assert_eq!(run(&mut exchange, Request::None, 1, false), (Phase::Faulted, Cause::AmplifierFault, false));
    assert_eq!(run(&mut exchange, Request::Acknowledge, 2, false), (Phase::Disarmed, Cause::None, false));
}

#[test]
fn without_its_background_a_board_ramps_down_whatever_was_asked_for() {
    let (_, mut board, mut exchange) = moving();
    let mut ticks = |exchange: &mut Exchange, request: Request, count: u32| {
        exchange.command.request = request;
        for _ in 0..count {
            exchange.silence.heard();
            board.tick(exchange, TargetStatus::default());
        }
        exchange.report.phase
    };
    ticks(&mut exchange, Request::Arm, ARMED);
    assert_eq!(ticks(&mut exchange, Request::Hold, 10), Phase::Holding);
    exchange.orphaned = true;
    assert_eq!(ticks(&mut exchange, Request::Run, 10), Phase::Disarmed);
}

/// What a counter of the target shows: each reading of the clock here is a count later than the last.
#[test]
fn times_of_a_tick_are_the_last_and_the_longest_and_overruns_are_counted() {
    use std::sync::atomic::{AtomicU32, Ordering};
    static COUNT: AtomicU32 = AtomicU32::new(u32::MAX - 1);
    let (_, mut board, mut exchange) = started(true);
    board.timed_tick(&mut exchange, TargetStatus::default(), || COUNT.fetch_add(3, Ordering::Relaxed));
    assert_eq!(exchange.report.health.output, [3, 3], "over the end of the counter");
    let report = &mut exchange.report;
    for (late, duration, overruns) in [(0, 100, 0), (1, 99, 0), (1, 100, 1), (40, 20, 1), (0, u32::MAX, 2)] {
        report.record_tick(late, duration, 100);
        assert_eq!((report.health.tick[0], report.health.overruns), (duration, overruns));
    }
    assert_eq!((report.health.tick[1], report.health.latest), (u32::MAX, 40));
}
