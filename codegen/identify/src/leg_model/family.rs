//! Families of leg models: their parts and their price.

use serde::Serialize;

use super::READ_OUT;
use specgen_language::model::LegModelKind as Kind;

/// Time constants of the creep, s: a decade apart.
pub(crate) const TIMES: [f64; 5] = [100.0, 10.0, 1.0, 0.1, 0.01];
/// Plays of a leg with plays in the controller, `specgen_runtime::plays::PLAYS`.
pub const WIDENED_PLAYS: usize = 24;

/// A family of models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Family {
    /// Its parts.
    pub kind: Kind,
    /// Whether creep is after them.
    pub creep: bool,
    /// Whether its plays widen with the rate.
    pub widens: bool,
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
        let each = |kind| [false, true].map(|creep| Self { kind, creep, widens: false });
        let widened = Self { kind: Kind::Plays, creep: true, widens: true };
        Kind::FITTED.into_iter().flat_map(each).chain([widened]).collect()
    }

    /// Its name in a report.
    #[must_use]
    pub fn name(self) -> String {
        let (creep, rate) = (if self.creep { ", creep" } else { "" }, if self.widens { ", rate" } else { "" });
        format!("{}{creep}{rate}", self.kind.word())
    }

    /// Instructions of one leg's inverse on a Cortex-M7 in f64, about: the table, and what is around it.
    #[must_use]
    pub fn instructions(self) -> usize {
        let around = if self.is_table() { 0 } else { 75 };
        (if self.widens { 385 } else { 100 }) + around + if self.creep { 9 * TIMES.len() } else { 0 }
    }

    /// Bytes of constants for one leg in f64.
    #[must_use]
    pub fn bytes(self, grid: usize) -> usize {
        let around = if self.is_table() { 0 } else { 8 * (2 * READ_OUT + 9) };
        let still = if self.widens { 8 * (2 * WIDENED_PLAYS + 6) } else { 4 * (grid + 1) * (grid + 2) };
        still + around + if self.creep { 24 * TIMES.len() } else { 0 }
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
        !self.has_state() && !self.widens
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
