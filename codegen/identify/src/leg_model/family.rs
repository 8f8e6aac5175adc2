//! Families of leg models: their parts and their price.

use serde::Serialize;

use super::READ_OUT;
use specgen_language::model::LegModelKind as Kind;

/// Time constants of the creep, s: a decade apart.
pub(crate) const TIMES: [f64; 5] = [100.0, 10.0, 1.0, 0.1, 0.01];

/// A family of models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Family {
    /// Its parts.
    pub kind: Kind,
    /// Whether creep is after them.
    pub creep: bool,
}

impl Serialize for Family {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.name())
    }
}

impl Family {
    /// Every family, the simplest first.
    #[must_use]
    pub fn all() -> Vec<Self> {
        Kind::FITTED.into_iter().flat_map(|kind| [false, true].map(|creep| Self { kind, creep })).collect()
    }

    /// Its name in a report.
    #[must_use]
    pub fn name(self) -> String {
        format!("{}{}", self.kind.word(), if self.creep { ", creep" } else { "" })
    }

    /// Instructions of one leg's inverse on a Cortex-M7 in f64, about: the table, and what is around it.
    #[must_use]
    pub fn instructions(self) -> usize {
        let around = if self.is_table() { 0 } else { 75 };
        100 + around + if self.creep { 9 * TIMES.len() } else { 0 }
    }

    /// Bytes of constants for one leg in f64.
    #[must_use]
    pub fn bytes(self, grid: usize) -> usize {
        let around = if self.is_table() { 0 } else { 8 * (2 * READ_OUT + 9) };
        4 * (grid + 1) * (grid + 2) + around + if self.creep { 24 * TIMES.len() } else { 0 }
    }

    pub(super) fn is_table(self) -> bool {
        self.kind == Kind::Preisach && !self.creep
    }

    pub(super) fn creeps(self) -> bool {
        self.creep
    }

    pub(super) fn has_plays(self) -> bool {
        self.kind != Kind::BoucWen
    }

    pub(super) fn is_cubic(self) -> bool {
        self.kind == Kind::GeneralizedPlays
    }

    /// Whether each branch has a free offset in the fit, so that creep of another kind between the curves does not distort
    /// the model. A Bouc-Wen leg has a known creep, and its read-out needs the offset.
    pub(super) fn floats(self) -> bool {
        !self.has_state()
    }

    pub(super) fn has_state(self) -> bool {
        matches!(self.kind, Kind::BoucWen | Kind::Hybrid)
    }

    /// Powers of the read-out above the first.
    pub(super) fn powers(self) -> usize {
        match self.kind {
            Kind::Plays => READ_OUT - 1,
            Kind::BoucWen | Kind::Hybrid => 2,
            _ => 0,
        }
    }
}
