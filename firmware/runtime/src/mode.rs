//! Control modes: which parts of the control law are active.
//!
//! # Example
//!
//! ```
//! use specgen_runtime::{ControlMode, Law};
//!
//! let mode = ControlMode::from_word(6);
//! assert_eq!(mode, Some(ControlMode::PF(Law::Pcc)));
//! // Without estimates, P/F has the gains of P.
//! assert!(ControlMode::PF(Law::Invhys).uses_position_gains() && !ControlMode::PF(Law::Pcc).uses_position_gains());
//! assert!(!ControlMode::F(Law::Pcc).feeds_back());
//! ```

use core::fmt;

use crate::adaptation::Law;
use crate::choice::{Choice, choice};

/// Control mode of section 4 of the paper. Its parts: `feeds_back`, `uses_position_gains`, `inverts`, `damps_modes`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ControlMode {
    /// P: position tracking (7) on a linear leg, u = q/ρ̂; no hysteresis model, no adaptation.
    P,
    /// F: hysteresis feed-forward (Fig. 5) on the measured leg displacements; no position feedback.
    F(Law),
    /// P/F: both; the feed-forward is inside the position feedback.
    PF(Law),
}

impl ControlMode {
    /// Name in commands and tables, and number in settings (the *word*), of each mode, in the order of the words.
    pub const WORDS: [(&'static str, u32); 7] =
        [("p", 0), ("f-invhys", 1), ("f-ewma", 2), ("f-pcc", 3), ("pf-invhys", 4), ("pf-ewma", 5), ("pf-pcc", 6)];

    /// Meaning of the words in the documentation of the settings.
    pub const MEANING: &'static str = "0 P; 1, 2, 3 F with Invhys, EWMA, PCC; 4, 5, 6 P/F with the same.";

    /// Whether the position feedback (7) is active.
    #[inline]
    #[must_use]
    pub const fn feeds_back(self) -> bool {
        !matches!(self, Self::F(_))
    }

    /// Whether (7) works without estimates and therefore uses `position_gains` instead of `gains`.
    #[inline]
    #[must_use]
    pub const fn uses_position_gains(self) -> bool {
        matches!(self, Self::P | Self::PF(Law::Invhys))
    }

    /// Whether the legs are driven through the inverse hysteresis model; if not, they are assumed to be linear.
    #[inline]
    #[must_use]
    pub const fn inverts(self) -> bool {
        !matches!(self, Self::P)
    }

    /// Whether active damping, if the controller has it, is on. It is designed for the feedback of P/F.
    #[inline]
    #[must_use]
    pub const fn damps_modes(self) -> bool {
        matches!(self, Self::PF(_))
    }

    /// Every mode, in the order of the words.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..).map_while(Self::from_word)
    }

    /// Run-to-run law; `Invhys` if there is no adaptation.
    #[inline]
    #[must_use]
    pub const fn law(self) -> Law {
        match self {
            Self::P => Law::Invhys,
            Self::F(law) | Self::PF(law) => law,
        }
    }

    /// Number in settings; see [`ControlMode::MEANING`].
    #[inline]
    #[must_use]
    pub const fn word(self) -> u64 {
        match self {
            Self::P => 0,
            Self::F(law) => 1 + law.word(),
            Self::PF(law) => 4 + law.word(),
        }
    }

    /// The mode with this word; none if there is no such mode.
    #[must_use]
    pub const fn from_word(word: u64) -> Option<Self> {
        Some(match word {
            0 => Self::P,
            1 => Self::F(Law::Invhys),
            2 => Self::F(Law::Ewma),
            3 => Self::F(Law::Pcc),
            4 => Self::PF(Law::Invhys),
            5 => Self::PF(Law::Ewma),
            6 => Self::PF(Law::Pcc),
            _ => return None,
        })
    }
}

/// As users write it, such as `P/F pcc`. Inlined, so that no controller links the formatting code.
impl fmt::Display for ControlMode {
    #[inline]
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::P => f.write_str("P"),
            Self::F(law) => write!(f, "F {}", law.name()),
            Self::PF(law) => write!(f, "P/F {}", law.name()),
        }
    }
}

choice! {
    /// Source of the force between platform and work piece in (7).
    pub enum Interaction {
        /// No force, or the feedback compensates it.
        Neglected = 0,
        /// K_e (h_d − h_e) with the stiffness in the settings.
        Modelled = 1,
        /// That of the force/torque sensor.
        Measured = 2,
    }
}

choice! {
    /// Meaning of the six numbers of a leg controller's set-point.
    pub enum SetpointKind {
        /// Pose from rest: m, rad.
        Pose = 0,
        /// Leg displacements, m.
        Leg = 1,
    }
}

/// In a snapshot: the mode of the last tick, or 0 before the first tick.
impl Choice for Option<ControlMode> {
    fn to_word(&self) -> u64 {
        self.map_or(0, |mode| 1 + mode.word())
    }

    fn of_word(word: u64) -> Option<Self> {
        match word.checked_sub(1) {
            None => Some(None),
            Some(mode) => ControlMode::from_word(mode).map(Some),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_read_back_and_others_are_refused() {
        assert_eq!(ControlMode::all().count(), ControlMode::WORDS.len());
        for (place, (mode, (_, word))) in (0..).zip(ControlMode::all().zip(ControlMode::WORDS)) {
            assert_eq!((mode.word(), word), (place, place as u32));
        }
        for word in 0..3 {
            assert_eq!(Interaction::from_word(word).map(Interaction::word), Some(word));
        }
        assert_eq!(Interaction::from_word(u64::MAX), None);
        for word in 0..2 {
            assert_eq!(SetpointKind::from_word(word).map(SetpointKind::word), Some(word));
        }
        assert_eq!(SetpointKind::from_word(2), None);
        for word in 0..3 {
            assert_eq!(Law::from_word(word).map(Law::word), Some(word));
        }
        assert_eq!(Law::from_word(3), None);
    }
}
