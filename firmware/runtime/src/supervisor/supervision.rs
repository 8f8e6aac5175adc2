//! Constants of the supervisor, from the spec.

use super::kinds::{Cause, RAMPS_DOWN, Reaction, SWITCHES_OFF};
use super::oscillation::Steadiness;
use super::wiring::Wiring;

/// Causes that are debounced tick by tick, in the order of [`Supervision::timeout`]. Those of the watch are counted in
/// samples; all others act at once.
pub const TIMED: [Cause; TIMERS] = [
    Cause::GaugeNotFinite,
    Cause::GaugeRange,
    Cause::VoltageSaturation,
    Cause::SlewSaturation,
    Cause::MissedTick,
    Cause::Converter,
    Cause::HostGone,
];
/// Number of these causes.
pub const TIMERS: usize = 7;

crate::constants::constants! {
    ($) supervision_fields;
    /// Constants of the supervisor; from `supervisor`. Six gauges are checked in turn, so their conditions are counted in
    /// samples, one in six ticks.
    pub struct Supervision<T> {
        /// Ticks without any condition that arming requires, ≥ 1.
        pub arm_ticks: u32,
        /// Code at rest.
        pub rest: i32,
        /// Codes per step of a ramp, ≥ 1, and ticks per step, ≥ 1.
        pub ramp_step: i32,
        /// See [`Supervision::ramp_step`].
        pub ramp_every: u32,
        /// For each of [`TIMED`], the count at which the condition is a cause, ≥ 1.
        pub timeout: [u32; TIMERS],
        /// For each of them, the increment of a tick with the condition; a tick without it decrements by 1.
        pub weight: [u32; TIMERS],
        /// Motion along a gauge, by the codes sent, after which an unchanged word means that the gauge is stuck, m.
        pub stuck_motion: T,
        /// Samples after that, ≥ 1.
        pub stuck_samples: u32,
        /// Largest |reading − expected| of a gauge, m.
        pub disagreement: T,
        /// Samples for which that must last, ≥ 1.
        pub disagreement_samples: u32,
        /// Largest |set-point − measured| of each axis (m, rad), or of each leg (m).
        pub tracking: [T; 6],
        /// Samples for which that must last, ≥ 1.
        pub tracking_samples: u32,
        /// Largest |word − prediction| of each gauge, in the unit of its words; beyond it the word is replaced.
        pub leap: [T; 6],
        /// Count of repeated samples, [`WRONG`](super::WRONG) each, that is a fault; 0 if they are not checked.
        pub repeats: u32,
        /// Limits of the oscillation detection.
        pub steadiness: Steadiness<T>,
        /// Reaction to an amplifier fault.
        pub amplifier_fault: Reaction,
        /// The wiring check at the end of arming; none if the spec switches it off.
        pub wiring: Option<Wiring<T>>,
    }
}

impl<T> Supervision<T> {
    /// Causes that switch the amplifiers off at once. `powered`: whether they are on. A disarmed machine ignores its
    /// amplifiers: it refuses to arm.
    pub(super) fn switches_off(&self, powered: bool) -> u32 {
        SWITCHES_OFF | if powered { self.where_it_is(Reaction::Off) } else { 0 }
    }

    /// Causes that ramp the codes to rest and then switch the amplifiers off.
    pub(super) fn ramps_down(&self) -> u32 {
        RAMPS_DOWN | self.where_it_is(Reaction::RampDown)
    }

    fn where_it_is(&self, reaction: Reaction) -> u32 {
        if self.amplifier_fault == reaction { Cause::AmplifierFault.bit() } else { 0 }
    }
}
