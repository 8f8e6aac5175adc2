//! Phases, requests, causes and event bits of the supervisor, with their words. The words are part of every link and record.

/// Bit of an event word: a tick began too late, or one was left out.
pub const MISSED_TICK: u32 = 1;
/// Bit of an event word: nothing was heard over the link for longer than the target permits.
pub const LINK_LOST: u32 = 2;
/// Bit of an event word: tables or settings are not those that were built.
pub const INTEGRITY: u32 = 4;
/// Bit of an event word: a converter did not answer, or wrongly.
pub const CONVERTER: u32 = 8;
/// Bit of an event word: emergency stop.
pub const STOP: u32 = 16;

/// What the machine is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Amplifiers off, codes at rest.
    Disarmed,
    /// Amplifiers on, codes held, the law put where the machine is.
    Arming,
    /// The control law at work.
    Running,
    /// Codes held, the law suspended.
    Holding,
    /// Codes on their way to rest.
    RampingDown,
    /// As disarmed, for a cause that is to be acknowledged.
    Faulted,
}

impl Phase {
    /// 0 disarmed, 1 arming, 2 running, 3 holding, 4 ramping down, 5 faulted.
    #[inline]
    #[must_use]
    pub const fn word(self) -> u64 {
        match self {
            Self::Disarmed => 0,
            Self::Arming => 1,
            Self::Running => 2,
            Self::Holding => 3,
            Self::RampingDown => 4,
            Self::Faulted => 5,
        }
    }

    /// Whether the amplifiers are to be on.
    #[inline]
    #[must_use]
    pub const fn is_powered(self) -> bool {
        !matches!(self, Self::Disarmed | Self::Faulted)
    }

    /// In words for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Disarmed => "disarmed",
            Self::Arming => "arming",
            Self::Running => "running",
            Self::Holding => "holding",
            Self::RampingDown => "ramping down",
            Self::Faulted => "faulted",
        }
    }

    /// The inverse of [`Phase::word`]; none for any other number.
    #[must_use]
    pub const fn from_word(word: u64) -> Option<Self> {
        Some(match word {
            0 => Self::Disarmed,
            1 => Self::Arming,
            2 => Self::Running,
            3 => Self::Holding,
            4 => Self::RampingDown,
            5 => Self::Faulted,
            _ => return None,
        })
    }
}

/// What the user wants of the supervisor. It holds for as long as it is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// Nothing: the machine stays in its phase.
    None,
    /// Amplifiers on. Taken when it begins to be given, not while it stays: a machine never arms itself again.
    Arm,
    /// The control law at work.
    Run,
    /// Codes held.
    Hold,
    /// Codes to rest, then amplifiers off.
    RampDown,
    /// The cause of a fault was seen. Taken when it begins to be given.
    Acknowledge,
}

impl Request {
    /// 0 none, 1 arm, 2 run, 3 hold, 4 ramp down, 5 acknowledge.
    #[inline]
    #[must_use]
    pub const fn word(self) -> u64 {
        match self {
            Self::None => 0,
            Self::Arm => 1,
            Self::Run => 2,
            Self::Hold => 3,
            Self::RampDown => 4,
            Self::Acknowledge => 5,
        }
    }

    /// The inverse of [`Request::word`]. Any other number is a hold: what cannot be understood must not move anything.
    #[inline]
    #[must_use]
    pub const fn from_word(word: u64) -> Self {
        match word {
            0 => Self::None,
            1 => Self::Arm,
            2 => Self::Run,
            4 => Self::RampDown,
            5 => Self::Acknowledge,
            _ => Self::Hold,
        }
    }
}

/// Why a phase was forced upon the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Cause {
    /// Nothing was.
    None,
    /// A gauge's word is no number.
    GaugeNotFinite,
    /// A gauge is beyond its range.
    GaugeRange,
    /// A gauge gives the same word over and over while the legs move.
    GaugeStuck,
    /// A leg is not where its model says, by its gauges.
    GaugeDisagreement,
    /// The platform or a leg is too far from its set-point.
    TrackingError,
    /// A leg stayed at a limit of its voltage or table.
    VoltageSaturation,
    /// A leg stayed at the limit of its slew rate.
    SlewSaturation,
    /// [`MISSED_TICK`].
    MissedTick,
    /// [`LINK_LOST`].
    LinkLost,
    /// [`INTEGRITY`].
    Integrity,
    /// [`CONVERTER`].
    Converter,
    /// [`STOP`].
    EmergencyStop,
    /// [`LINK_LOST`] for so long that nobody is waited for any more.
    HostGone,
    /// [`CONVERTER`] for so long.
    ConverterSilent,
}

impl Cause {
    /// All but [`Cause::None`], in the order of their words.
    pub const ALL: [Self; 14] = [
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
        Self::ConverterSilent,
    ];

    /// 0 none, 1 gauge not finite, 2 gauge range, 3 gauge stuck, 4 gauge disagreement, 5 tracking error, 6 voltage
    /// saturation, 7 slew saturation, 8 missed tick, 9 link lost, 10 integrity, 11 converter, 12 emergency stop,
    /// 13 host gone, 14 converter silent.
    #[inline]
    #[must_use]
    pub const fn word(self) -> u64 {
        match self {
            Self::None => 0,
            Self::GaugeNotFinite => 1,
            Self::GaugeRange => 2,
            Self::GaugeStuck => 3,
            Self::GaugeDisagreement => 4,
            Self::TrackingError => 5,
            Self::VoltageSaturation => 6,
            Self::SlewSaturation => 7,
            Self::MissedTick => 8,
            Self::LinkLost => 9,
            Self::Integrity => 10,
            Self::Converter => 11,
            Self::EmergencyStop => 12,
            Self::HostGone => 13,
            Self::ConverterSilent => 14,
        }
    }

    /// In words for people; nothing for [`Cause::None`].
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "",
            Self::GaugeNotFinite => "gauge not finite",
            Self::GaugeRange => "gauge out of range",
            Self::GaugeStuck => "gauge stuck",
            Self::GaugeDisagreement => "gauges disagree",
            Self::TrackingError => "tracking error",
            Self::VoltageSaturation => "voltage saturation",
            Self::SlewSaturation => "slew saturation",
            Self::MissedTick => "missed tick",
            Self::LinkLost => "link lost",
            Self::Integrity => "integrity",
            Self::Converter => "converter",
            Self::EmergencyStop => "emergency stop",
            Self::HostGone => "host gone",
            Self::ConverterSilent => "converter silent",
        }
    }

    /// 1 << word: its bit in conditions.
    #[inline]
    #[must_use]
    pub const fn bit(self) -> u32 {
        1 << self.word()
    }

    /// The inverse of [`Cause::word`]; none for any other number.
    #[must_use]
    pub const fn from_word(word: u64) -> Option<Self> {
        Some(match word {
            0 => Self::None,
            1 => Self::GaugeNotFinite,
            2 => Self::GaugeRange,
            3 => Self::GaugeStuck,
            4 => Self::GaugeDisagreement,
            5 => Self::TrackingError,
            6 => Self::VoltageSaturation,
            7 => Self::SlewSaturation,
            8 => Self::MissedTick,
            9 => Self::LinkLost,
            10 => Self::Integrity,
            11 => Self::Converter,
            12 => Self::EmergencyStop,
            13 => Self::HostGone,
            14 => Self::ConverterSilent,
            _ => return None,
        })
    }
}

/// Causes that take the amplifiers off at once, in any phase.
pub const SWITCHES_OFF: u32 = Cause::Integrity.bit() | Cause::EmergencyStop.bit();
/// Causes that bring the codes to rest, then take the amplifiers off.
pub const RAMPS_DOWN: u32 = Cause::GaugeNotFinite.bit()
    | Cause::GaugeRange.bit()
    | Cause::GaugeStuck.bit()
    | Cause::GaugeDisagreement.bit()
    | Cause::HostGone.bit()
    | Cause::ConverterSilent.bit();
/// Causes that hold the codes.
pub const HOLDS: u32 = Cause::TrackingError.bit()
    | Cause::VoltageSaturation.bit()
    | Cause::SlewSaturation.bit()
    | Cause::MissedTick.bit()
    | Cause::LinkLost.bit()
    | Cause::Converter.bit();

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_read_back_and_others_are_refused() {
        for word in 0..6 {
            assert_eq!(Phase::from_word(word).map(Phase::word), Some(word));
            assert_eq!(Request::from_word(word).word(), word);
        }
        for word in 0..15 {
            assert_eq!(Cause::from_word(word).map(Cause::word), Some(word));
        }
        for (index, cause) in (1..).zip(Cause::ALL) {
            assert_eq!(cause.word(), index);
        }
        assert_eq!((Phase::from_word(6), Cause::from_word(15)), (None, None));
        assert_eq!((Request::from_word(6), Request::from_word(u64::MAX)), (Request::Hold, Request::Hold));
    }

    #[test]
    fn amplifiers_are_on_where_codes_may_stand_above_rest_and_every_kind_has_a_name_of_its_own() {
        let phases: [Phase; 6] = core::array::from_fn(|word| Phase::from_word(word as u64).unwrap_or(Phase::Faulted));
        assert_eq!(phases.map(Phase::is_powered), [false, true, true, true, true, false]);
        let told_apart = |names: &[&str]| {
            let apart = (0..names.len()).all(|a| (0..a).all(|b| names[a] != names[b]));
            apart && names.iter().all(|name| !name.is_empty())
        };
        assert!(told_apart(&phases.map(Phase::name)));
        assert!(told_apart(&Cause::ALL.map(Cause::name)));
        assert_eq!(Cause::None.name(), "");
    }
}
