//! Phases, requests, causes and event bits of the supervisor, with their words. The words are part of every link and record.

use crate::choice::choice;

/// Bit of an event word: a tick began too late or was skipped.
pub const MISSED_TICK: u32 = 1;
/// Bit of an event word: no message over the link for longer than the target permits.
pub const LINK_LOST: u32 = 2;
/// Bit of an event word: tables or settings in memory have changed.
pub const INTEGRITY: u32 = 4;
/// Bit of an event word: a converter did not respond, or responded wrongly.
pub const CONVERTER: u32 = 8;
/// Bit of an event word: emergency stop.
pub const STOP: u32 = 16;
/// Bit of an event word: an amplifier reports a fault.
pub const AMPLIFIER: u32 = 64;
/// Bit of an event word: more ticks in a row were missed than the spec permits, `supervisor.missed_in_a_row`.
pub const STALLED: u32 = 1 << (Cause::Stalled.word() - FIRST_EVENT);
/// Bits of an event word that map to causes by [`FIRST_EVENT`]. [`AMPLIFIER`] is a cause as well; the other bits are
/// for records.
pub const EVENTS: u32 = MISSED_TICK | LINK_LOST | INTEGRITY | CONVERTER | STOP | STALLED;
/// Bit k of an event word maps to the cause with number k plus this.
pub const FIRST_EVENT: u64 = Cause::MissedTick.word();
/// First bit in conditions for the gauges or legs concerned.
pub(super) const FIRST_CHANNEL: u32 = 16;
/// Bit of [`Cause::Oscillation`] in conditions: bits 16 to 27 are for gauges and legs, 29 and 30 for the fallback
/// stage.
pub(super) const OSCILLATION_CONDITION: u32 = 28;
/// Bit of [`Cause::AmplifierFault`] in conditions.
pub(super) const AMPLIFIER_CONDITION: u32 = 31;
/// Bit of [`Cause::Workspace`] in conditions: no other cause has number 0.
const WORKSPACE_CONDITION: u32 = 0;

choice! {
    /// Phase of the machine.
    pub enum Phase {
        /// Amplifiers off, codes at rest.
        Disarmed = 0 => "disarmed",
        /// Amplifiers on, codes at rest, then a pulse of each leg: the wiring check.
        Arming = 1 => "arming",
        /// The control law is active.
        Running = 2 => "running",
        /// Codes held, the law suspended.
        Holding = 3 => "holding",
        /// Codes ramp to rest.
        RampingDown = 4 => "ramping down",
        /// As disarmed, with a cause that must be acknowledged.
        Faulted = 5 => "faulted",
        /// Open drive: the host commands the voltage of each leg, the law is suspended.
        Driving = 6 => "driving",
    }
}

impl Phase {
    /// Whether the amplifiers are on in this phase.
    #[inline]
    #[must_use]
    pub const fn is_powered(self) -> bool {
        !matches!(self, Self::Disarmed | Self::Faulted)
    }

    /// Whether the host's commands move the machine in this phase.
    #[inline]
    #[must_use]
    pub const fn is_commanded(self) -> bool {
        matches!(self, Self::Running | Self::Driving)
    }
}

choice! {
    /// A request to the supervisor. It applies to every tick in which it is given. An unknown word means hold: nothing
    /// may move because of it.
    pub enum Request or Hold {
        /// No request: the machine stays in its phase.
        None = 0,
        /// Amplifiers on. Edge-triggered: a machine never arms itself again.
        Arm = 1,
        /// Run the control law.
        Run = 2,
        /// Codes held.
        Hold = 3,
        /// Codes to rest, then amplifiers off.
        RampDown = 4,
        /// Acknowledges a fault. Edge-triggered.
        Acknowledge = 5,
        /// Open drive, from a hold: the law is suspended, and the host commands voltages.
        Drive = 6,
    }
}

choice! {
    /// Cause of a forced change of phase. [`Cause::None`] has an empty name.
    #[derive(PartialOrd, Ord)]
    pub enum Cause {
        /// Nothing was.
        None = 0 => "",
        /// A gauge's word is not finite.
        GaugeNotFinite = 1 => "gauge not finite",
        /// A gauge is beyond its range.
        GaugeRange = 2 => "gauge out of range",
        /// A gauge repeats the same word while the legs move.
        GaugeStuck = 3 => "gauge stuck",
        /// A gauge disagrees with the model of its leg.
        GaugeDisagreement = 4 => "gauges disagree",
        /// The platform or a leg is too far from its set-point.
        TrackingError = 5 => "tracking error",
        /// A leg stayed at a limit of its voltage or table.
        VoltageSaturation = 6 => "voltage saturation",
        /// A leg stayed at the limit of its slew rate.
        SlewSaturation = 7 => "slew saturation",
        /// [`MISSED_TICK`].
        MissedTick = 8 => "missed tick",
        /// [`LINK_LOST`].
        LinkLost = 9 => "link lost",
        /// [`INTEGRITY`].
        Integrity = 10 => "integrity",
        /// [`CONVERTER`].
        Converter = 11 => "converter",
        /// [`STOP`].
        EmergencyStop = 12 => "emergency stop",
        /// [`LINK_LOST`] for so long that the host is considered gone.
        HostGone = 13 => "host gone",
        /// Gauges or legs are not wired as in the spec: found by the wiring check while arming.
        Wiring = 14 => "wiring",
        /// [`STALLED`].
        Stalled = 15 => "stalled",
        /// The error keeps oscillating. While running, it is the cause of the law's fallback.
        Oscillation = 16 => "oscillation",
        /// [`AMPLIFIER`]. The spec sets the reaction: [`Reaction`].
        AmplifierFault = 17 => "amplifier fault",
        /// The measured pose came near the end of the workspace in an open drive.
        Workspace = 18 => "end of the workspace",
        /// [`Request::Run`] is given, but no leg is identified: the machine has the open drive only. Not a condition.
        NotIdentified = 19 => "legs not identified",
    }
}

impl Cause {
    /// All but [`Cause::None`], in the order of their words.
    pub const ALL: [Self; 19] = [
        Self::GaugeNotFinite,
        Self::GaugeRange,
        Self::GaugeStuck,
        Self::GaugeDisagreement,
        Self::TrackingError,
        Self::VoltageSaturation,
        Self::SlewSaturation,
        Self::MissedTick,
        Self::LinkLost,
        Self::Integrity,
        Self::Converter,
        Self::EmergencyStop,
        Self::HostGone,
        Self::Wiring,
        Self::Stalled,
        Self::Oscillation,
        Self::AmplifierFault,
        Self::Workspace,
        Self::NotIdentified,
    ];

    /// Its bit in conditions: 1 << word; beyond 15, a bit that gauges and legs leave free. None if it is no condition.
    #[inline]
    #[must_use]
    pub const fn bit(self) -> u32 {
        match self {
            Self::Oscillation => 1 << OSCILLATION_CONDITION,
            Self::AmplifierFault => 1 << AMPLIFIER_CONDITION,
            Self::Workspace => 1 << WORKSPACE_CONDITION,
            Self::NotIdentified => 0,
            other => 1 << other.word(),
        }
    }

    /// The cause of the lowest bit; [`Cause::None`] if no bit is set.
    pub(super) const fn of_lowest(bits: u32) -> Self {
        // Numbers decide, and that of the lowest bit is the highest.
        let others = bits & !Self::Workspace.bit();
        let bits = if others != 0 { others } else { bits };
        let word = match bits.trailing_zeros() {
            WORKSPACE_CONDITION => Self::Workspace.word(),
            OSCILLATION_CONDITION => Self::Oscillation.word(),
            AMPLIFIER_CONDITION => Self::AmplifierFault.word(),
            bit => bit as u64,
        };
        match Self::from_word(word) {
            Some(cause) if cause.bit() & bits != 0 => cause,
            _ => Self::None,
        }
    }
}

/// Reaction to an amplifier fault; from `supervisor.amplifier_fault`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reaction {
    /// Amplifiers off in the same tick.
    Off,
    /// Codes ramp to rest, then amplifiers off.
    RampDown,
    /// Codes held.
    Hold,
}

/// Causes that concern a gauge.
pub const OF_GAUGES: u32 =
    Cause::GaugeNotFinite.bit() | Cause::GaugeRange.bit() | Cause::GaugeStuck.bit() | Cause::GaugeDisagreement.bit();
/// Causes that switch the amplifiers off at once, in any phase.
pub const SWITCHES_OFF: u32 = Cause::Integrity.bit() | Cause::EmergencyStop.bit();
/// Causes that ramp the codes to rest and then switch the amplifiers off.
pub const RAMPS_DOWN: u32 = OF_GAUGES
    | Cause::Converter.bit()
    | Cause::HostGone.bit()
    | Cause::Wiring.bit()
    | Cause::Stalled.bit()
    | Cause::Oscillation.bit()
    | Cause::Workspace.bit();
/// Causes that hold the codes.
pub const HOLDS: u32 = Cause::TrackingError.bit()
    | Cause::VoltageSaturation.bit()
    | Cause::SlewSaturation.bit()
    | Cause::MissedTick.bit()
    | Cause::LinkLost.bit();

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_read_back_and_others_are_refused() {
        for word in 0..7 {
            assert_eq!(Phase::from_word(word).map(Phase::word), Some(word));
            assert_eq!(Request::from_word(word).word(), word);
        }
        for word in 0..20 {
            assert_eq!(Cause::from_word(word).map(Cause::word), Some(word));
        }
        for (index, cause) in (1..).zip(Cause::ALL) {
            assert_eq!(cause.word(), index);
            let found = if cause == Cause::NotIdentified { Cause::None } else { cause };
            assert_eq!(Cause::of_lowest(cause.bit()), found);
        }
        for bits in [0, 1 << 16, 1 << 22, 1 << 29, 1 << 30, 0x6fff_0000] {
            assert_eq!(Cause::of_lowest(bits), Cause::None, "gauges, legs, and other bits");
        }
        assert_eq!(Cause::of_lowest(Cause::Workspace.bit() | Cause::LinkLost.bit()), Cause::LinkLost);
        let bits = [Cause::Workspace, Cause::Oscillation, Cause::AmplifierFault].map(Cause::bit);
        assert_eq!(bits, [1, 1 << 28, 1 << 31]);
        assert_eq!((Phase::from_word(7), Cause::from_word(20)), (None, None));
        assert_eq!((Request::from_word(7), Request::from_word(u64::MAX)), (Request::Hold, Request::Hold));
    }

    #[test]
    fn amplifiers_are_on_where_codes_may_stand_above_rest_and_every_kind_has_a_name_of_its_own() {
        let phases: [Phase; 7] = core::array::from_fn(|word| Phase::from_word(word as u64).unwrap_or(Phase::Faulted));
        assert_eq!(phases.map(Phase::is_powered), [false, true, true, true, true, false, true]);
        assert_eq!(phases.map(Phase::is_commanded), [false, false, true, false, false, false, true]);
        let told_apart = |names: &[&str]| {
            let apart = (0..names.len()).all(|a| (0..a).all(|b| names[a] != names[b]));
            apart && names.iter().all(|name| !name.is_empty())
        };
        assert!(told_apart(&phases.map(Phase::name)));
        assert!(told_apart(&Cause::ALL.map(Cause::name)));
        assert_eq!(Cause::None.name(), "");
    }
}
