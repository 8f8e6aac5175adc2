//! Ranges of parameters, and findings about values outside.

use std::fmt;

/// One end of a range.
#[derive(Clone, Copy)]
pub(crate) enum Bound {
    Above(f64),
    AtLeast(f64),
    AtMost(f64),
    Below(f64),
}

impl Bound {
    fn holds(self, value: f64) -> bool {
        match self {
            Self::Above(bound) => value > bound,
            Self::AtLeast(bound) => value >= bound,
            Self::AtMost(bound) => value <= bound,
            Self::Below(bound) => value < bound,
        }
    }

    /// Finding about a `value` that violates a bound. A NaN violates every bound.
    pub(crate) fn and(self, other: Self, field: &str, value: f64) -> Option<String> {
        let good = self.holds(value) && other.holds(value);
        (!good).then(|| format!("`{field}` is {value}; expected a number {self} and {other}"))
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Above(bound) => write!(f, "> {bound}"),
            Self::AtLeast(bound) => write!(f, ">= {bound}"),
            Self::AtMost(bound) => write!(f, "<= {bound}"),
            Self::Below(bound) => write!(f, "< {bound}"),
        }
    }
}
