//! Random sequences of requests, events and samples against a state machine of its own text, with a machine that does nothing
//! but move its codes.

use std::collections::BTreeSet;

use specgen_runtime::supervisor::{Cause, Phase, Reaction, Request, Sample, Supervision, Supervisor, toward};

use super::oracle::*;
use crate::common::Random;

const REST: i32 = 7;
const MAX_STEP: i32 = 100;
/// Codes that the machine has.
const HIGHEST: i32 = 600;
const GAUGE_RANGE: [f64; 2] = [-2e-6, 48e-6];

fn platform_bounds() -> Bounds {
    Bounds::platform([50e-6, 50e-6, 60e-6, 0.3e-3, 0.3e-3, 0.4e-3], GAUGE_RANGE)
}

fn plan(bounds: &Bounds) -> Supervision<f64> {
    let second = bounds.ticks_per_second as u32;
    let [gauge, voltage, slew] =
        [bounds.gauge_ticks, bounds.voltage_ticks, bounds.slew_ticks].map(|ticks| ticks as u32);
    let samples = bounds.samples as u32;
    Supervision {
        arm_ticks: bounds.arm_ticks,
        rest: REST,
        ramp_step: 40,
        ramp_every: 2,
        timeout: [4 * gauge, 4 * gauge, voltage, slew, second + 1, 4 * gauge, bounds.gone_ticks as u32],
        weight: [4, 4, 1, 1, second, 4, 1],
        stuck_motion: STUCK_MOTION,
        stuck_samples: samples,
        disagreement: DISAGREEMENT,
        disagreement_samples: samples,
        tracking: bounds.tracking,
        tracking_samples: samples,
        leap: [1.0; 6],
        repeats: 0,
        steadiness: super::SUPERVISION.steadiness,
        amplifier_fault: match bounds.amplifier {
            Act::Off => Reaction::Off,
            Act::Ramp => Reaction::RampDown,
            Act::Hold => Reaction::Hold,
        },
        wiring: None,
    }
}

/// What comes from outside in a tick.
struct Tick {
    request: u64,
    events: u64,
    words: [f64; 6],
    expected: [f64; 6],
    errors: [f64; 6],
    /// Legs that a limit holds back, and by how many codes each would move where the law runs.
    limited: u32,
    moved: [i32; 6],
    /// Whether the pose is near the end of the workspace.
    strays: bool,
}

/// What can be wrong with one gauge, axis or leg.
#[derive(Clone, Copy)]
enum Wrong {
    NotFinite,
    Range,
    Stuck,
    Disagreement,
    Astray,
    Voltage,
    Slew,
    Stray,
}

/// A supervisor on a machine of six codes.
struct Bench {
    supervisor: Supervisor<f64>,
    plan: Supervision<f64>,
    codes: [i32; 6],
}

impl Bench {
    fn new(bounds: &Bounds) -> Self {
        Self { supervisor: Supervisor::new(), plan: plan(bounds), codes: [REST; 6] }
    }

    /// A tick beside the oracle, with the order of calls of the emitted controllers; what differs, if anything.
    fn tick(&mut self, oracle: &mut Oracle, tick: &Tick) -> Result<(), String> {
        let Self { supervisor, plan, codes } = self;
        let ran = supervisor.phase == Phase::Running;
        let at_rest = codes.iter().all(|code| *code == REST);
        oracle.decide(tick.request, tick.events, at_rest);
        let begins = supervisor.decide(plan, Request::from_word(tick.request), tick.events as u32, at_rest);
        let found = (supervisor.phase.word() as u8, supervisor.cause.word() as u8, u64::from(supervisor.conditions));
        let expected = (oracle.phase, oracle.cause, oracle.conditions);
        if found != expected {
            return Err(format!("phase, cause, conditions {found:x?} instead of {expected:x?}"));
        }
        let anew = oracle.begins_anew(ran);
        if begins != (!ran && oracle.phase == RUNNING) || (begins && supervisor.fresh) != anew {
            return Err(format!("begins {begins}, anew {anew}"));
        }
        supervisor.fresh &= !begins;
        let channel = supervisor.watch.take_turn();
        let faults = bits(&tick.words, |word| !(GAUGE_RANGE[0]..=GAUGE_RANGE[1]).contains(word));
        let before = *codes;
        let runs = supervisor.phase == Phase::Running;
        let drives = supervisor.phase == Phase::Driving;
        let step = supervisor.step_to_rest(plan, MAX_STEP);
        for (code, moved) in codes.iter_mut().zip(tick.moved) {
            *code = if runs || drives { (*code + moved).clamp(0, HIGHEST) } else { toward(*code, plan.rest, step) };
        }
        if faults == 0 && !matches!(supervisor.phase, Phase::Disarmed | Phase::RampingDown | Phase::Faulted) {
            let sample = Sample {
                word: tick.words[channel],
                reading: if drives { tick.expected[channel] } else { tick.words[channel] },
                expected: tick.expected[channel],
                error: runs.then_some(tick.errors[channel]),
            };
            supervisor.look(plan, channel, &sample);
        }
        let moved: [i32; 6] = std::array::from_fn(|leg| codes[leg] - before[leg]);
        let (limited, moved, most) = if runs || drives { (tick.limited, moved, MAX_STEP) } else { (0, [0; 6], 1) };
        supervisor.see(faults, limited, &tick.words, &moved, most);
        if drives && tick.strays {
            supervisor.see_end_of_workspace();
        }
        oracle.observe(
            &tick.words.map(f64::to_bits),
            &tick.words,
            &tick.expected,
            &tick.errors,
            [&before.map(i64::from), &codes.map(i64::from)],
            u64::from(tick.limited),
            i64::from(MAX_STEP),
        );
        if tick.strays {
            oracle.nears_the_end();
        }
        Ok(())
    }
}

fn bits<T>(values: &[T; 6], holds: impl Fn(&T) -> bool) -> u32 {
    values.iter().enumerate().fold(0, |bits, (index, value)| bits | u32::from(holds(value)) << index)
}

/// A user, a link and a plant at random.
struct World {
    random: Random,
    request: u64,
    events: u64,
    away: u32,
    /// Of the ticks with events, in eighths.
    share: usize,
    wrong: Vec<(usize, Wrong)>,
}

impl World {
    fn below(&mut self, n: usize) -> usize {
        self.random.below(n)
    }

    fn choose<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.random.below(of.len())]
    }

    /// What goes wrong from now on.
    fn turn(&mut self) {
        let kinds = [
            Wrong::NotFinite,
            Wrong::Range,
            Wrong::Stuck,
            Wrong::Disagreement,
            Wrong::Astray,
            Wrong::Voltage,
            Wrong::Slew,
            Wrong::Stray,
        ];
        let count = self.choose(&[0, 0, 0, 1, 1, 2, 4]);
        self.wrong = (0..count).map(|_| (self.below(6), self.choose(&kinds))).collect();
        let others = !EVENTS.iter().sum::<u64>() & 0xffff_ffff;
        self.events = self.choose(&[
            0,
            0,
            0,
            0,
            0,
            0,
            1,
            2,
            4,
            8,
            16,
            31,
            STALLED,
            AMPLIFIER,
            AMPLIFIER | 2,
            AMPLIFIER | 8,
            others,
        ]);
        self.away = self.choose(&[2, 4, 12, 24, 72]);
        self.share = self.choose(&[1, 7]);
    }

    fn tick(&mut self, bounds: &Bounds, phase: u8, number: u32, towards: bool) -> Tick {
        if number % 8 == 0 {
            self.request = match (towards, phase) {
                (true, DISARMED) => self.choose(&[ARM, NOTHING]),
                (true, ARMING | HOLDING | RUNNING) => self.choose(&[RUN, RUN, NOTHING, DRIVE]),
                (true, DRIVING) => self.choose(&[DRIVE, DRIVE, NOTHING, RUN]),
                (true, FAULTED) => self.choose(&[ACKNOWLEDGE, NOTHING]),
                _ => self.choose(&[NOTHING, ARM, RUN, HOLD, RAMP_DOWN, ACKNOWLEDGE, DRIVE, 7, u64::MAX]),
            };
        }
        // Each of the readings another word than the last; nothing wrong.
        let words: [f64; 6] = std::array::from_fn(|_| 15e-6 + 1e-9 * self.random.unit());
        let mut tick = Tick {
            request: self.request,
            events: if number < self.away && self.below(8) < self.share { self.events } else { 0 },
            words,
            expected: [15e-6; 6],
            errors: std::array::from_fn(|axis| bounds.tracking[axis] * (2.0 * self.random.unit() - 1.0)),
            limited: 0,
            moved: std::array::from_fn(|_| self.choose(&[0, 1, -1, 99, -99, 100, -100])),
            strays: false,
        };
        for (index, wrong) in self.wrong.clone() {
            // Mostly there, or it would never last.
            if self.below(6) > 0 {
                self.spoil(&mut tick, bounds, number, (index, wrong));
            }
        }
        tick
    }

    fn spoil(&mut self, tick: &mut Tick, bounds: &Bounds, number: u32, (index, wrong): (usize, Wrong)) {
        match wrong {
            Wrong::NotFinite => tick.words[index] = self.choose(&[f64::NAN, f64::INFINITY, f64::NEG_INFINITY]),
            Wrong::Range => {
                // The ends themselves are within, and far from what is expected.
                let [low, high] = GAUGE_RANGE;
                tick.words[index] = self.choose(&[low, high, low - 1e-9, high + 1e-9, 1.0, -1.0]);
                tick.expected[index] = tick.words[index];
            }
            Wrong::Stuck => {
                // At most as far as it may, or further; to either side.
                tick.words[index] = 5e-6;
                tick.expected[index] = self.choose(&[0.0, 0.0, STUCK_MOTION, -1e-9, 40e-9, -40e-9]);
            }
            Wrong::Disagreement => {
                let (reading, expected) =
                    self.choose(&[(0.0, DISAGREEMENT), (DISAGREEMENT, 0.0), (25e-6, 0.0), (0.0, 25e-6)]);
                (tick.words[index], tick.expected[index]) = (reading, expected);
            }
            Wrong::Astray => {
                tick.errors[index] = self.choose(&[1.0, -1.0, 1.001, -1.001, 9.0]) * bounds.tracking[index];
            }
            Wrong::Voltage => {
                tick.limited |= 1 << index;
                tick.moved[index] = self.choose(&[0, 3, -99, 99]);
            }
            Wrong::Slew => {
                tick.limited |= 1 << index;
                tick.moved[index] = if number % 2 == 0 { MAX_STEP } else { -MAX_STEP };
            }
            Wrong::Stray => tick.strays = true,
        }
    }
}

/// Phases and causes that came over random sequences; or the first difference from the oracle.
fn follow(machine: &Bounds, oracle: Bounds, sequences: u32) -> Result<BTreeSet<(u8, u8)>, String> {
    let mut world = World { random: Random(5), request: 0, events: 0, away: 0, share: 0, wrong: Vec::new() };
    let (mut bench, mut oracle) = (Bench::new(machine), Oracle::new(oracle));
    let mut met = BTreeSet::new();
    for sequence in 0..sequences {
        world.turn();
        let towards = world.below(4) > 0;
        for number in 0..world.choose(&[24, 24, 96]) {
            let tick = world.tick(machine, oracle.phase, number, towards);
            bench.tick(&mut oracle, &tick).map_err(|why| format!("sequence {sequence}, tick {number}: {why}"))?;
            met.insert((oracle.phase, oracle.cause));
        }
    }
    Ok(met)
}

#[test]
fn phases_causes_and_conditions_of_random_sequences_are_those_of_the_oracle() {
    for bounds in [
        Bounds::legs(),
        platform_bounds(),
        Bounds { amplifier: Act::Ramp, ..Bounds::legs() },
        Bounds { amplifier: Act::Hold, ..Bounds::legs() },
    ] {
        let met = follow(&bounds, bounds.clone(), 6000).unwrap();
        for phase in DISARMED..=DRIVING {
            assert!(met.iter().any(|(found, _)| *found == phase), "phase {phase} never came");
        }
        for cause in (0..=13).chain([15, AMPLIFIER_FAULT, WORKSPACE]) {
            assert!(met.iter().any(|(_, found)| *found == cause), "cause {cause} never came: {met:?}");
        }
        assert!(met.len() > 30, "{met:?}");
    }
}

#[test]
fn an_oracle_of_any_other_time_or_bound_is_told_apart() {
    let bounds = Bounds::legs();
    type Change = (&'static str, fn(&mut Bounds));
    let changes: [Change; 10] = [
        ("arm", |bounds| bounds.arm_ticks += 1),
        ("gauge", |bounds| bounds.gauge_ticks += 1),
        ("voltage", |bounds| bounds.voltage_ticks += 1),
        ("slew", |bounds| bounds.slew_ticks += 1),
        ("samples", |bounds| bounds.samples += 1),
        ("second", |bounds| bounds.ticks_per_second = 3),
        ("host", |bounds| bounds.gone_ticks += 1),
        ("tracking", |bounds| bounds.tracking[4] *= 1.01),
        ("amplifier", |bounds| bounds.amplifier = Act::Ramp),
        ("amplifier held", |bounds| bounds.amplifier = Act::Hold),
    ];
    for (what, change) in changes {
        let mut other = bounds.clone();
        change(&mut other);
        assert!(follow(&bounds, other, 6000).is_err(), "{what}");
    }
}

/// A fault of an amplifier in every phase, with each reaction: phase and cause of the same tick, and the cause kept while it goes on.
#[test]
fn a_fault_of_an_amplifier_does_in_its_tick_what_the_spec_says() {
    use Phase::*;
    let fault = Cause::AmplifierFault;
    for (reaction, running, holding, rising, falling) in [
        (Act::Off, Faulted, Faulted, Faulted, Faulted),
        (Act::Ramp, RampingDown, RampingDown, RampingDown, RampingDown),
        (Act::Hold, Holding, Holding, RampingDown, RampingDown),
    ] {
        let plan = plan(&Bounds { amplifier: reaction, ..Bounds::legs() });
        for (phase, then, cause) in [
            (Disarmed, Disarmed, Cause::None),
            (Arming, rising, fault),
            (Running, running, fault),
            (Holding, holding, fault),
            (Driving, holding, fault),
            (RampingDown, falling, fault),
        ] {
            for events in [64, 64 | 32] {
                let mut supervisor = Supervisor::<f64>::new();
                supervisor.phase = phase;
                assert!(!supervisor.decide(&plan, Request::None, events, false));
                assert_eq!((supervisor.phase, supervisor.cause), (then, cause), "{reaction:?} {phase:?}");
                assert_eq!(supervisor.conditions, 1 << 31, "{reaction:?} {phase:?}");
                // Neither a request to run nor to arm changes that while the fault is there.
                for request in [Request::Arm, Request::Run] {
                    supervisor.decide(&plan, request, events, false);
                    assert_eq!(
                        (supervisor.phase, supervisor.cause),
                        (then, cause),
                        "{reaction:?} {phase:?} {request:?}"
                    );
                }
            }
            let mut supervisor = Supervisor::<f64>::new();
            supervisor.phase = phase;
            supervisor.decide(&plan, Request::None, 32, false);
            assert_eq!(
                (supervisor.cause, supervisor.conditions),
                (Cause::None, 0),
                "an edge of the input line is no fault"
            );
        }
    }
}

/// Every leg by `ramp_step` codes every `ramp_every` ticks, never faster than the slew rate.
#[test]
fn codes_are_held_or_go_to_rest_as_the_phase_says() {
    for (ramp_step, max_step, expected) in [(40, 100, 40), (100, 100, 100), (101, 100, 100), (40, 3, 3)] {
        for ramp_every in [1, 2, 5] {
            let plan = Supervision { ramp_step, ramp_every, ..plan(&Bounds::legs()) };
            let mut supervisor = Supervisor::<f64>::new();
            for phase in [Phase::Running, Phase::Holding, Phase::Driving] {
                supervisor.phase = phase;
                assert_eq!(supervisor.step_to_rest(&plan, max_step), 0, "{phase:?}");
            }
            // While arming the goal is rest, or the pulse of a leg beyond it.
            for phase in [Phase::Disarmed, Phase::Arming, Phase::Faulted] {
                supervisor.phase = phase;
                assert_eq!(supervisor.step_to_rest(&plan, max_step), max_step, "{phase:?}");
            }
            supervisor.phase = Phase::RampingDown;
            for tick in 1..=4 * ramp_every {
                let step = if tick % ramp_every == 0 { expected } else { 0 };
                assert_eq!(supervisor.step_to_rest(&plan, max_step), step, "tick {tick} of {ramp_every}");
            }
        }
    }
}

/// A channel that is none is the first, as is the one after the last.
#[test]
fn channels_beyond_the_last_are_the_first() {
    let plan = plan(&Bounds::legs());
    let mut supervisor = Supervisor::<f64>::new();
    let sample = Sample { word: 1.0, reading: 1.0, expected: 0.0, error: Some(1.0) };
    for channel in [6, 7, usize::MAX] {
        supervisor.watch.forgive();
        supervisor.look(&plan, channel, &sample);
        assert_eq!(supervisor.watch.suspected(), 1, "{channel}");
        assert!(supervisor.watch.channels[0].known && !supervisor.watch.channels[1].known);
    }
    let turns: Vec<usize> = (0..72).map(|_| supervisor.watch.take_turn()).collect();
    assert_eq!(turns[..36], turns[36..]);
    for six in turns.chunks(6) {
        let mut six = six.to_vec();
        six.sort_unstable();
        assert_eq!(six, [0, 1, 2, 3, 4, 5], "every channel once in six ticks");
    }
    supervisor.watch.turn = usize::MAX;
    assert_eq!((supervisor.watch.take_turn(), supervisor.watch.turn), (turns[0], 1));
}

/// Zeros of either sign are equal numbers and different words, and every word of the state is in the digest.
#[test]
fn of_equal_expectations_the_first_is_kept() {
    let plan = plan(&Bounds::legs());
    for (first, second) in [(0.0, -0.0), (-0.0, 0.0)] {
        let mut supervisor = Supervisor::<f64>::new();
        for expected in [first, second] {
            supervisor.look(&plan, 0, &Sample { word: 1.0, reading: 0.0, expected, error: None });
        }
        let kept = supervisor.watch.channels[0].expected;
        assert_eq!(kept.map(f64::to_bits), [first; 2].map(f64::to_bits), "{second:?} after {first:?}");
    }
}

/// However long something lasted, it is forgotten as fast as it was learned.
#[test]
fn a_count_of_samples_stops_where_they_have_lasted() {
    let plan = plan(&Bounds::legs());
    let mut supervisor = Supervisor::<f64>::new();
    let sample = Sample { word: 1.0, reading: 1.0, expected: 0.0, error: Some(1.0) };
    for _ in 0..20 {
        supervisor.look(&plan, 0, &sample);
    }
    let channel = &supervisor.watch.channels[0];
    assert_eq!((channel.disagreed, channel.astray), (plan.disagreement_samples, plan.tracking_samples));
}
