//! What the spec fixes about the supervisor.

use super::kinds::{Cause, RAMPS_DOWN, Reaction, SWITCHES_OFF};
use super::oscillation::Steadiness;
use super::wiring::Wiring;

/// Causes that are timed tick by tick, in the order of [`Supervision::timeout`]. Those of the watch are counted in samples there; all
/// others act at once.
pub const TIMED: [Cause; TIMERS] = [
    Cause::GaugeNotFinite,
    Cause::GaugeRange,
    Cause::VoltageSaturation,
    Cause::SlewSaturation,
    Cause::MissedTick,
    Cause::Converter,
    Cause::HostGone,
];
/// How many these are.
pub const TIMERS: usize = 7;

crate::constants::constants! {
    ($) supervision_fields;
    /// Constants of the supervisor; from `supervisor`. Six gauges are looked at in turn, so what they show is counted in samples, one
    /// in six ticks.
    pub struct Supervision<T> {
        /// Ticks without any condition that arming takes, ≥ 1.
        pub arm_ticks: u32,
        /// Code at rest.
        pub rest: i32,
        /// Codes by which a ramp moves, ≥ 1, every so many ticks, ≥ 1.
        pub ramp_step: i32,
        /// See [`Supervision::ramp_step`].
        pub ramp_every: u32,
        /// For each of [`TIMED`], the count at which the condition is a cause, ≥ 1.
        pub timeout: [u32; TIMERS],
        /// For each of them, what a tick with the condition counts; one without it takes 1 off.
        pub weight: [u32; TIMERS],
        /// Motion along a gauge that the codes sent must have caused before an unchanged word means that the gauge is stuck, m.
        pub stuck_motion: T,
        /// Samples after that, ≥ 1.
        pub stuck_samples: u32,
        /// Largest |reading − expected| of a gauge, m.
        pub disagreement: T,
        /// Samples for which it must be beyond, ≥ 1.
        pub disagreement_samples: u32,
        /// Largest |set-point − measured| of each axis (m, rad), or of each leg (m).
        pub tracking: [T; 6],
        /// Samples for which it must be beyond, ≥ 1.
        pub tracking_samples: u32,
        /// Largest |word − prediction| of each gauge, in the unit of its words; beyond it the word is replaced.
        pub leap: [T; 6],
        /// Count of repeated samples, [`WRONG`](super::WRONG) each, at which they are a fault; 0 where they say nothing.
        pub repeats: u32,
        /// What a sustained oscillation is told by.
        pub steadiness: Steadiness<T>,
        /// What a fault of an amplifier leads to.
        pub amplifier_fault: Reaction,
        /// The wiring check that arming ends with; none where the spec switches it off.
        pub wiring: Option<Wiring<T>>,
    }
}

impl<T> Supervision<T> {
    /// Causes that take the amplifiers off at once, where they are on or not (`powered`). A disarmed machine minds no amplifier: it refuses to arm.
    pub(super) fn switches_off(&self, powered: bool) -> u32 {
        SWITCHES_OFF | if powered { self.where_it_is(Reaction::Off) } else { 0 }
    }

    /// Causes that bring the codes to rest, then take the amplifiers off.
    pub(super) fn ramps_down(&self) -> u32 {
        RAMPS_DOWN | self.where_it_is(Reaction::RampDown)
    }

    fn where_it_is(&self, reaction: Reaction) -> u32 {
        if self.amplifier_fault == reaction { Cause::AmplifierFault.bit() } else { 0 }
    }
}
