//! The state machine.

use super::approach::Approach;
use super::debounce::Debounce;
use super::kinds::{
    AMPLIFIER, AMPLIFIER_CONDITION, Cause, EVENTS, FIRST_CHANNEL, FIRST_EVENT, HOLDS, Phase, RAMPS_DOWN, Request,
    SWITCHES_OFF,
};
use super::oscillation::{Fallback, Motion, Oscillation};
use super::sift::{Activity, Sift};
use super::supervision::Supervision;
use super::watch::{Sample, Watch};
use super::wiring::{Check, Finding, Response};
use crate::dac::CodeLimits;
use crate::real::Real;

crate::state! { |words|
    /// State of the supervisor. Disarmed at reset, nothing seen.
    pub struct Supervisor<T>[T: Real] {
        /// What the machine is doing.
        pub phase: Phase = Phase::Disarmed, choice;
        /// Why, if it was forced upon it.
        pub cause: Cause = Cause::None, choice;
        /// The request of the last tick.
        pub request: Request = Request::None, choice;
        /// Armed since it last ran: the law begins anew.
        pub fresh: bool = true, set;
        /// A request to arm that began to be given and could not be followed yet.
        pub wants_arming: bool = false, set;
        /// Some conditions are being counted.
        pub busy: bool = false, set;
        /// What the last tick showed of gauges and limits: bits of causes, and of channels.
        pub seen: u32 = 0, tally;
        /// Conditions of the present tick: bits of causes (bit 31 for a fault of an amplifier), from bit 16 on the gauges or legs that
        /// they are about, from bit 22 on the gauges whose words were replaced.
        pub conditions: u32 = 0, tally;
        /// Ticks without a condition while arming; ticks of a ramp.
        pub ticks: u32 = 0, tally;
        /// How long conditions have lasted.
        pub debounce: Debounce = Debounce::new(), part;
        /// What the gauges show against what was sent.
        pub watch: Watch<T> = Watch::new(), part;
        /// Samples of the gauges before this one.
        pub sift: Sift<T> = Sift::new(), part;
        /// Whether gauges and legs are wired as the spec says.
        pub check: Check<T> = Check::new(), part;
        /// Whether the error goes on oscillating, and what the law has fallen back to.
        pub oscillation: Oscillation<T> = Oscillation::new(), part;
        /// Way to the set-point that is asked for, where the law has no generator.
        pub approach: Approach<T> = Approach::new(), part;
    }
}

impl<T: Real> Supervisor<T> {
    /// Whether the gauges' words may be used as they are; where not, [`Supervisor::sift`] them. Before [`Supervisor::decide`].
    #[inline]
    pub fn accepts(&mut self, supervision: &Supervision<T>, words: &[T; 6]) -> bool {
        !self.phase.is_powered() || self.sift.accepts(supervision, words)
    }

    /// Replaces words that leapt. `faults`: which words the law does not believe, bit by bit.
    pub fn sift(&mut self, supervision: &Supervision<T>, words: &mut [T; 6], faults: impl Fn(&[T; 6]) -> u32) {
        let activity = if self.phase == Phase::Arming && !self.is_checking(supervision) {
            Activity::Standing
        } else if self.phase == Phase::Running && self.oscillation.is_suspected() {
            Activity::Oscillating
        } else {
            Activity::Moving
        };
        self.watch.lasted |= self.sift.sift(supervision, words, faults, activity);
    }

    /// Brings the machine into the phase of the coming interval; returns whether it begins to run with it.
    ///
    /// `events` are what the target noticed since the last tick, `at_rest` whether every code is at rest (not asked while
    /// running).
    #[inline]
    pub fn decide(&mut self, supervision: &Supervision<T>, request: Request, events: u32, at_rest: bool) -> bool {
        let begun = request != self.request;
        self.request = request;
        let amplifier = (events & AMPLIFIER) << (AMPLIFIER_CONDITION - AMPLIFIER.trailing_zeros());
        let present = (self.seen & CAUSES) | self.watch.present | (events & EVENTS) << FIRST_EVENT | amplifier;
        self.conditions = self.seen
            | present
            | self.watch.suspected() << FIRST_CHANNEL
            | self.sift.conditions()
            | self.oscillation.conditions;
        let lasted = self.debounce.count(supervision, present, &mut self.busy) | self.watch.lasted;
        self.watch.lasted = 0;
        let goes_on = !matches!(request, Request::Hold | Request::RampDown | Request::Acknowledge);
        if self.phase == Phase::Running && lasted == 0 && goes_on {
            return false;
        }
        self.change(supervision, begun, present, lasted, at_rest)
    }

    /// Everything but running on.
    #[cold]
    #[inline(never)]
    fn change(&mut self, supervision: &Supervision<T>, begun: bool, present: u32, lasted: u32, at_rest: bool) -> bool {
        let off = lasted & supervision.switches_off(self.phase.is_powered());
        if off != 0 && self.phase != Phase::Faulted {
            self.enter(Phase::Faulted, Cause::of_lowest(off));
            return false;
        }
        match self.phase {
            Phase::Disarmed => self.disarmed(begun, present, at_rest),
            Phase::Arming => return self.arming(supervision, present, lasted),
            Phase::Running => self.running(supervision, begun, lasted),
            Phase::Holding => return self.holding(supervision, begun, present, lasted),
            Phase::RampingDown => self.ramping_down(lasted, at_rest),
            Phase::Faulted => {
                if self.request == Request::Acknowledge && begun && present == 0 && at_rest {
                    self.enter(Phase::Disarmed, Cause::None);
                }
            }
        }
        false
    }

    fn disarmed(&mut self, begun: bool, present: u32, at_rest: bool) {
        // A request that stays from before does not count; one that came too early waits as long as it is given.
        self.wants_arming = self.request == Request::Arm && (begun || self.wants_arming);
        if self.wants_arming && present == 0 && at_rest {
            self.wants_arming = false;
            self.fresh = true;
            self.check = Check::new();
            self.enter(Phase::Arming, Cause::None);
        }
    }

    fn arming(&mut self, supervision: &Supervision<T>, present: u32, lasted: u32) -> bool {
        if lasted != 0 {
            self.enter(Phase::RampingDown, Cause::of_lowest(lasted));
        } else if self.request == Request::RampDown
            || self.request == Request::Hold && supervision.wiring.is_some() && !self.check.done
        {
            // A machine whose wiring was not checked cannot hold.
            self.enter(Phase::RampingDown, Cause::None);
        } else if present != 0 {
            self.ticks = 0;
            self.check = Check::new();
        } else if self.check.done && self.check.finding != 0 {
            self.enter(Phase::RampingDown, Cause::Wiring);
        } else {
            self.ticks = self.ticks.saturating_add(1);
            if self.ticks >= supervision.arm_ticks && (self.check.done || supervision.wiring.is_none()) {
                let runs = self.request == Request::Run;
                self.enter(if runs { Phase::Running } else { Phase::Holding }, Cause::None);
                return runs;
            }
        }
        false
    }

    fn running(&mut self, supervision: &Supervision<T>, begun: bool, mut lasted: u32) {
        if lasted & Cause::Oscillation.bit() != 0 && self.oscillation.fall_back() {
            self.cause = Cause::Oscillation;
            lasted &= !Cause::Oscillation.bit();
        }
        let ramp = lasted & supervision.ramps_down();
        if ramp != 0 {
            self.enter(Phase::RampingDown, Cause::of_lowest(ramp));
        } else if self.request == Request::RampDown {
            self.enter(Phase::RampingDown, Cause::of_lowest(lasted));
        } else if lasted != 0 || self.request == Request::Hold {
            self.enter(Phase::Holding, Cause::of_lowest(lasted));
        } else if self.request == Request::Acknowledge && begun {
            self.recover();
        }
    }

    /// The user knows of the oscillation: all of the law is at work again.
    fn recover(&mut self) {
        self.oscillation = Oscillation::new();
        self.cause = Cause::None;
    }

    fn holding(&mut self, supervision: &Supervision<T>, begun: bool, present: u32, lasted: u32) -> bool {
        let ramp = lasted & supervision.ramps_down();
        if ramp != 0 {
            self.enter(Phase::RampingDown, Cause::of_lowest(ramp));
            return false;
        }
        if self.cause == Cause::None {
            self.cause = Cause::of_lowest(lasted);
        }
        match self.request {
            Request::RampDown => self.enter(Phase::RampingDown, self.cause),
            Request::Acknowledge if begun && present == 0 => self.recover(),
            // After a cause, only a request that begins now shows that the user knows of it.
            Request::Run if present == 0 && (begun || self.cause == Cause::None) => {
                self.enter(Phase::Running, Cause::None);
                return true;
            }
            _ => {}
        }
        false
    }

    fn ramping_down(&mut self, lasted: u32, at_rest: bool) {
        if self.cause == Cause::None {
            self.cause = Cause::of_lowest(lasted);
        }
        if at_rest {
            let phase = if self.cause == Cause::None { Phase::Disarmed } else { Phase::Faulted };
            self.enter(phase, self.cause);
        }
    }

    fn enter(&mut self, phase: Phase, cause: Cause) {
        self.phase = phase;
        self.cause = cause;
        self.ticks = 0;
        if phase == Phase::Arming || !phase.is_powered() {
            self.sift = Sift::new();
        }
        match phase {
            // It stays fallen back until the user acknowledges it, or arms anew.
            Phase::Running if self.oscillation.stage != Fallback::None => self.cause = Cause::Oscillation,
            Phase::Running | Phase::Holding | Phase::RampingDown => self.oscillation.forgive(),
            Phase::Disarmed | Phase::Arming | Phase::Faulted => self.oscillation = Oscillation::new(),
        }
        // What was suspected before belongs to the phase before. A ramp and a hold go on with it.
        if !matches!(phase, Phase::Holding | Phase::RampingDown) {
            self.watch.forgive();
            self.debounce = Debounce::new();
            self.busy = false;
        }
    }

    /// Whether a leg makes its pulse, or what they showed is judged.
    #[inline]
    #[must_use]
    pub fn is_checking(&self, supervision: &Supervision<T>) -> bool {
        self.phase == Phase::Arming && self.ticks >= supervision.arm_ticks && supervision.wiring.is_some()
    }

    /// Word of what the wiring check found, where that is why the machine does not run; or of what the law has fallen back to.
    #[inline]
    #[must_use]
    pub fn finding(&self) -> u32 {
        match (self.cause, self.oscillation.stage) {
            (Cause::Wiring, _) => self.check.finding,
            (_, Fallback::None) => 0,
            (_, stage) => Finding::Fallback(stage).word(),
        }
    }

    /// Goes on with the wiring check, of readings that are believed (m), where one is under way. `expected`: readings per leg displacement.
    #[inline]
    pub fn check(
        &mut self,
        supervision: &Supervision<T>,
        expected: &Response<T>,
        readings: &[T; 6],
        limits: CodeLimits,
    ) {
        if self.is_checking(supervision) {
            if let Some(wiring) = &supervision.wiring {
                let highest = supervision.rest.saturating_add(wiring.height);
                let refused = if highest < limits.min || highest > limits.max {
                    Finding::NoRoom
                } else if !wiring.can_follow(limits.max_step) {
                    Finding::TooSlow
                } else {
                    Finding::None
                };
                if refused != Finding::None {
                    self.check.done = true;
                    self.check.finding = refused.word();
                }
                self.check.tick(wiring, expected, readings, self.ticks.saturating_sub(supervision.arm_ticks));
            }
        }
    }

    /// Where a leg goes when the law does not run: rest, or its pulse beyond it.
    #[inline]
    #[must_use]
    pub fn goal(&self, supervision: &Supervision<T>, leg: usize) -> i32 {
        match &supervision.wiring {
            Some(wiring) if self.phase == Phase::Arming => {
                supervision.rest.saturating_add(self.check.pulse(wiring, leg))
            }
            _ => supervision.rest,
        }
    }

    /// Codes by which every leg goes towards its goal in this tick, when the law does not run; never above `max_step`.
    #[inline]
    pub fn step_to_rest(&mut self, supervision: &Supervision<T>, max_step: i32) -> i32 {
        match self.phase {
            Phase::Holding | Phase::Running => 0,
            Phase::Disarmed | Phase::Arming | Phase::Faulted => max_step,
            Phase::RampingDown => {
                self.ticks = self.ticks.saturating_add(1);
                if self.ticks < supervision.ramp_every {
                    return 0;
                }
                self.ticks = 0;
                if supervision.ramp_step < max_step { supervision.ramp_step } else { max_step }
            }
        }
    }

    /// Takes what a tick showed: gauges that are not believed (bits), legs that a limit held back (bits).
    #[inline]
    pub fn see(&mut self, faults: u32, limited: u32, words: &[T; 6], moved: &[i32; 6], max_step: i32) {
        self.seen = if faults | limited == 0 { 0 } else { seen(faults, limited, words, moved, max_step) };
    }

    /// Takes a sample of the channel whose turn it was.
    #[inline]
    pub fn look(&mut self, supervision: &Supervision<T>, channel: usize, sample: &Sample<T>) {
        self.watch.look(supervision, channel, sample);
    }

    /// Takes error and set-point (m or rad, finite) of that channel while the law runs, and what is asked for beside the law, if there is such.
    #[inline]
    pub fn follow(&mut self, supervision: &Supervision<T>, channel: usize, error: T, target: T, given: Option<T>) {
        let limited = self.seen & Cause::VoltageSaturation.bit() != 0;
        let motion = Motion { error, target, given, limited };
        if self.oscillation.look(&supervision.steadiness, channel, &motion) {
            self.suspect(supervision);
        }
    }

    /// An oscillation is counted.
    #[cold]
    #[inline(never)]
    fn suspect(&mut self, supervision: &Supervision<T>) {
        self.sift.look_closely();
        if self.oscillation.has_lasted(&supervision.steadiness) {
            self.watch.lasted |= Cause::Oscillation.bit();
        }
    }
}

/// Bits of all causes.
const CAUSES: u32 = SWITCHES_OFF | RAMPS_DOWN | HOLDS;

/// Gauge faults and limits as conditions.
#[cold]
#[inline(never)]
fn seen<T: Real>(faults: u32, limited: u32, words: &[T; 6], moved: &[i32; 6], max_step: i32) -> u32 {
    let mut conditions = (faults | limited) << FIRST_CHANNEL;
    for (index, (word, moved)) in words.iter().zip(moved).enumerate() {
        let bit = 1 << index;
        if faults & bit != 0 {
            conditions |= if word.is_finite() { Cause::GaugeRange.bit() } else { Cause::GaugeNotFinite.bit() };
        }
        if limited & bit != 0 {
            let slewed = *moved >= max_step || *moved <= -max_step;
            conditions |= if slewed { Cause::SlewSaturation.bit() } else { Cause::VoltageSaturation.bit() };
        }
    }
    conditions
}
