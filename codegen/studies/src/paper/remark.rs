//! Reasons why a value differs from the paper's.

use serde::{Serialize, Serializer};

/// A ratio within this of 1 needs no explanation.
pub const AGREES: f64 = 0.10;

specgen_language::named! {
    /// A reason.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Remark {
        /// Within [`AGREES`].
        Agrees => "agrees",
        /// Bias of Table 1.
        Bias => "bias",
        /// EWMA and PCC of Table 2.
        UpperBound => "upper-bound",
        /// Tables 5 and 7.
        Tracking => "tracking",
        /// Tables 6 and 8.
        Angles => "angles",
        /// Table 5, z, PCC, 0.1 Hz.
        Suspect => "suspect",
        /// Table 9, translation.
        WorkParts => "work-parts",
        /// Table 9, angles.
        BelowResolution => "below-resolution",
        /// (AII.18).
        Ewma => "ewma-limit",
        /// No known reason.
        Unexplained => "unexplained",
    }
}

impl Remark {
    /// `reason`, unless the values agree.
    pub fn of(paper: f64, ours: f64, reason: Self) -> Self {
        if (ours / paper - 1.0).abs() <= AGREES { Self::Agrees } else { reason }
    }

    /// The reason as text.
    pub fn text(self) -> &'static str {
        match self {
            Self::Agrees => "Within 10 % of the paper.",
            Self::Bias => {
                "The paper prints δ (headed \"bias α\") without defining its zero; ours is relative to the gauge zeroed \
                 at 0 V after a saturating sweep, for one of five stacks. Only the slope determines λ."
            }
            Self::UpperBound => {
                "The paper's EWMA and PCC rows do not follow from its description: a faithful simulation with the printed \
                 weights, on a plant that matches its Invhys row and its slopes, gives values 8 to 17 times lower, and for a \
                 static plant no spectrum of disturbances gives the paper's ratios. They are upper bounds and a ranking \
                 (Invhys > EWMA > PCC), which our results preserve."
            }
            Self::Tracking => {
                "The machine is our own: geometry, gauge layout, stiffness and the order of the gains are not printed (gains \
                 appear twice, at 1e-6 without units), so gains follow the compiler's rule, and the feed-forward includes \
                 inertia and gravity. The printed paths have jumps; we follow the corrected ones. The paper's values are upper \
                 bounds."
            }
            Self::Angles => {
                "Printed as \"n rad\", interpreted as µrad: π/72 rad would need ±4.4 mm from legs of 60 µm, so rotations are \
                 mrad and their errors µrad. Machine and gains are our own, as for the translations."
            }
            Self::Suspect => {
                "The printed 100.149 does not fit its row (531.8 and 631.13 at 1 and 10 Hz) and its column; a digit is probably \
                 missing. Machine and gains are our own as well."
            }
            Self::WorkParts => {
                "Stiffness of the work parts and position of the tip are not printed; they are assumed (glass 3 MN/m, aluminium \
                 1.2 MN/m, tip 40 mm above the platform); gains and machine are our own, and x(t) is missing in print."
            }
            Self::BelowResolution => {
                "The printed angles, 1.6 to 28 nrad, are at or below the resolution of the paper's own gauges: 2.2 nm at ±80 mm \
                 is 20 nrad. Ours are true angles: with P/F the effect of gauge noise, with P also the rotation by the part's \
                 torque."
            }
            Self::Ewma => {
                "(AII.18) prints 0 < λ < 2 for every weight, which holds only for ω = 1; correct is 0 < λω < 2, and the emitted \
                 controller settles up to this limit."
            }
            Self::Unexplained => "Differs by more than 10 %; the known errors of the paper do not explain it.",
        }
    }
}

impl Serialize for Remark {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reason_is_given_only_where_values_differ() {
        assert_eq!(Remark::of(100.0, 109.0, Remark::Tracking), Remark::Agrees);
        assert_eq!(Remark::of(100.0, 91.0, Remark::Tracking), Remark::Agrees);
        assert_eq!(Remark::of(100.0, 111.0, Remark::Tracking), Remark::Tracking);
        assert_eq!(Remark::of(100.0, f64::NAN, Remark::Tracking), Remark::Tracking);
    }
}
