//! What the controller remembers from tick to tick. No NaN or infinity is ever stored here.

use crate::hysteresis::{GRID, LED, Memory};
use crate::supervision::{code_at_rest, memory_at_rest};
use crate::{LEGS, Real, limits};
use specgen_runtime::snapshot::{LARGEST_PLACE, Snapshot};
use specgen_runtime::{Digest, Estimate};

/// State of one leg.
#[derive(Debug, Clone, Copy)]
pub struct LegState {
    /// Reversal memory; its displacement is q̂ = ρ̂X, what was really requested, m.
    pub memory: Memory,
    /// δ̂ and φ̂, m.
    pub estimate: Estimate<Real>,
    /// Converter code now held at the output.
    pub code: i32,
    /// What the leg is asked for beyond the demand, so that it arrives in time, m; zero without `hysteresis.dead_time`.
    pub lead: Real,
}

impl LegState {
    /// At reset.
    pub(crate) const fn at_rest(leg: usize) -> Self {
        Self { memory: memory_at_rest(leg), estimate: Estimate::new(), code: code_at_rest(), lead: 0.0 }
    }
}

/// State of the controller.
#[derive(Debug, Clone, Copy)]
pub struct State {
    /// Legs 0 to 5.
    pub legs: [LegState; LEGS],
    /// T: leg displacements demanded by the last accepted set-point, m.
    pub demand: [Real; LEGS],
    /// Ticks since the last run ended.
    pub ticks_in_run: u32,
}

impl Default for State {
    fn default() -> Self {
        Self::new()
    }
}

impl State {
    /// Reset: at rest, as `memory_at_rest` of `supervision.rs` says, no correction.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            legs: [
                LegState::at_rest(0),
                LegState::at_rest(1),
                LegState::at_rest(2),
                LegState::at_rest(3),
                LegState::at_rest(4),
                LegState::at_rest(5),
            ],
            demand: [0.0; LEGS],
            ticks_in_run: 0,
        }
    }

    /// Fingerprint of everything that later ticks depend on, for comparing two machines bit for bit.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        Snapshot::digest(self, &mut digest);
        digest.finish()
    }
}

specgen_runtime::state! {
    impl[] LegState, Memory::WORDS + Estimate::<Real>::WORDS + 1 + LED as usize,
    |words| { memory, estimate, code, lead } {
        words.part(memory)?;
        words.check(|| memory.highest() <= GRID as Real)?;
        words.ticks(code, limits::CODES[1])?;
        words.check(|| *code >= limits::CODES[0])?;
        words.part(estimate)?;
        if LED {
            words.number(lead, LARGEST_PLACE)?;
        }
    }
}

specgen_runtime::state! {
    impl[] State, LEGS * LegState::WORDS + LEGS + 1, |words| { legs, demand, ticks_in_run } {
        for leg in legs {
            words.part(leg)?;
        }
        words.numbers(demand, LARGEST_PLACE)?;
        words.tally(ticks_in_run)?;
    }
}
