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
        /// Present phase.
        pub phase: Phase = Phase::Disarmed, choice;
        /// Cause of the phase, if it was forced.
        pub cause: Cause = Cause::None, choice;
        /// The request of the last tick.
        pub request: Request = Request::None, choice;
        /// Armed since the law last ran: the law starts from scratch.
        pub fresh: bool = true, set;
        /// A new request to arm that could not be followed yet.
        pub wants_arming: bool = false, set;
        /// Whether conditions are being counted.
        pub busy: bool = false, set;
        /// Gauge and limit conditions of the last tick: bits of causes, and of channels.
        pub seen: u32 = 0, tally;
        /// Conditions of the present tick: bits of causes (bit 31 for an amplifier fault), from bit 16 on the gauges or
        /// legs concerned, from bit 22 on the gauges whose words were replaced.
        pub conditions: u32 = 0, tally;
        /// Ticks without a condition while arming; ticks of a ramp.
        pub ticks: u32 = 0, tally;
        /// How long conditions have lasted.
        pub debounce: Debounce = Debounce::new(), part;
        /// Compares the gauges with the codes sent.
        pub watch: Watch<T> = Watch::new(), part;
        /// Previous samples of the gauges.
        pub sift: Sift<T> = Sift::new(), part;
        /// The wiring check.
        pub check: Check<T> = Check::new(), part;
        /// Oscillation detection and the fallback stage.
        pub oscillation: Oscillation<T> = Oscillation::new(), part;
        /// Approach to the requested set-point, if the law has no generator.
        pub approach: Approach<T> = Approach::new(), part;
    }
}

impl<T: Real> Supervisor<T> {
    /// Whether the gauges' words can be used unchanged; otherwise [`Supervisor::sift`] them. Before
    /// [`Supervisor::decide`].
    #[inline]
    pub fn accepts(&mut self, supervision: &Supervision<T>, words: &[T; 6]) -> bool {
        !self.phase.is_powered() || self.sift.accepts(supervision, words)
    }

    /// Replaces words that jumped. `faults`: gauges that the law rejects, bit by bit.
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

    /// Sets the phase of the next interval; returns whether the law starts running with it.
    ///
    /// `events` are the target's events since the last tick; `at_rest` returns whether every code is at rest (not
    /// called while running).
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

    /// Every transition except running on.
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
            Phase::Driving => {
                // The law starts from a hold.
                let goes_on = matches!(self.request, Request::Drive | Request::None);
                self.goes_on(supervision, goes_on, lasted);
            }
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
        // A request held from before does not count. One that came too early waits as long as it is given.
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
            // A machine whose wiring was not checked must not hold.
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
        let goes_on = self.request != Request::Hold;
        if self.goes_on(supervision, goes_on, lasted) && self.request == Request::Acknowledge && begun {
            self.recover();
        }
    }

    /// Ramps down or holds for a request or a cause; false if so. `goes_on`: the request is not to hold.
    fn goes_on(&mut self, supervision: &Supervision<T>, goes_on: bool, lasted: u32) -> bool {
        let ramp = lasted & supervision.ramps_down();
        if ramp != 0 {
            self.enter(Phase::RampingDown, Cause::of_lowest(ramp));
        } else if self.request == Request::RampDown {
            self.enter(Phase::RampingDown, Cause::of_lowest(lasted));
        } else if lasted != 0 || !goes_on {
            self.enter(Phase::Holding, Cause::of_lowest(lasted));
        } else {
            return true;
        }
        false
    }

    /// The user has acknowledged the oscillation: the full law is active again.
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
            // After a cause, only a new request shows that the user knows of it.
            Request::Run if present == 0 && (begun || self.cause == Cause::None) => {
                self.enter(Phase::Running, Cause::None);
                return true;
            }
            Request::Drive if present == 0 && (begun || self.cause == Cause::None) => {
                // The law starts again where the legs then are.
                self.fresh = true;
                self.enter(Phase::Driving, Cause::None);
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
            // The fallback lasts until the user acknowledges it, or arms again.
            Phase::Running if self.oscillation.stage != Fallback::None => self.cause = Cause::Oscillation,
            Phase::Running | Phase::Driving | Phase::Holding | Phase::RampingDown => self.oscillation.forgive(),
            Phase::Disarmed | Phase::Arming | Phase::Faulted => self.oscillation = Oscillation::new(),
        }
        // A suspicion belongs to the phase in which it arose. Ramp and hold keep it.
        if !matches!(phase, Phase::Holding | Phase::RampingDown) {
            self.watch.forgive();
            self.debounce = Debounce::new();
            self.busy = false;
        }
    }

    /// Whether a pulse is under way, or being evaluated.
    #[inline]
    #[must_use]
    pub fn is_checking(&self, supervision: &Supervision<T>) -> bool {
        self.phase == Phase::Arming && self.ticks >= supervision.arm_ticks && supervision.wiring.is_some()
    }

    /// Word of the wiring check's finding if that is why the machine does not run, or of the fallback stage.
    #[inline]
    #[must_use]
    pub fn finding(&self) -> u32 {
        match (self.cause, self.oscillation.stage) {
            (Cause::Wiring, _) => self.check.finding,
            (_, Fallback::None) => 0,
            (_, stage) => Finding::Fallback(stage).word(),
        }
    }

    /// Continues the wiring check, if one is under way, with valid readings (m). `expected`: readings per leg
    /// displacement.
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

    /// Target code of a leg while the law does not run: rest, or rest plus its pulse.
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

    /// Code steps of every leg towards its target in this tick, while the law does not run; never above `max_step`.
    #[inline]
    pub fn step_to_rest(&mut self, supervision: &Supervision<T>, max_step: i32) -> i32 {
        match self.phase {
            Phase::Holding | Phase::Running | Phase::Driving => 0,
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

    /// Takes a tick's results: invalid gauges (bits), legs held back by a limit (bits).
    #[inline]
    pub fn see(&mut self, faults: u32, limited: u32, words: &[T; 6], moved: &[i32; 6], max_step: i32) {
        self.seen = if faults | limited == 0 { 0 } else { seen(faults, limited, words, moved, max_step) };
    }

    /// The measured pose came near the end of the workspace. After [`Supervisor::see`].
    #[cold]
    pub fn see_end_of_workspace(&mut self) {
        self.seen |= Cause::Workspace.bit();
    }

    /// Takes a sample of the channel whose turn it was.
    #[inline]
    pub fn look(&mut self, supervision: &Supervision<T>, channel: usize, sample: &Sample<T>) {
        self.watch.look(supervision, channel, sample);
    }

    /// Takes error and set-point (m or rad, finite) of that channel while the law runs, and the external correction, if
    /// any.
    #[inline]
    pub fn follow(&mut self, supervision: &Supervision<T>, channel: usize, error: T, target: T, given: Option<T>) {
        let limited = self.seen & Cause::VoltageSaturation.bit() != 0;
        let motion = Motion { error, target, given, limited };
        if self.oscillation.look(&supervision.steadiness, channel, &motion) {
            self.suspect(supervision);
        }
    }

    /// An oscillation is being counted.
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
