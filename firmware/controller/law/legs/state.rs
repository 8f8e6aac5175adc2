//! What the controller remembers from tick to tick. No NaN or infinity is ever stored here.

use crate::hysteresis::{LED, Memory};
use crate::supervision::{code_at_rest, memory_at_rest};
use crate::{LEGS, Real};
use specgen_runtime::snapshot::Snapshot;
use specgen_runtime::{Digest, Estimate};

specgen_runtime::state! { |words|
    /// State of one leg.
    pub struct LegState(leg: usize) {
        /// Reversal memory; its displacement is q̂ = ρ̂X, what was really requested, m.
        pub memory: Memory = memory_at_rest(leg), part;
        /// Converter code now held at the output.
        pub code: i32 = code_at_rest(), ticks(words.sizes().codes[1]) if *code >= words.sizes().codes[0];
        /// δ̂ and φ̂, m.
        pub estimate: Estimate<Real> = Estimate::new(), part;
        /// What the leg is asked for beyond the demand, so that it arrives in time, m; none without `hysteresis.dead_time`.
        pub lead: [Real; LED as usize] = [0.0; LED as usize], numbers(words.sizes().leg);
    }
}

specgen_runtime::state! { |words|
    /// State of the controller. Reset: at rest, as `memory_at_rest` of `supervision.rs` says, no correction.
    pub struct State {
        /// Legs 0 to 5.
        pub legs: [LegState; LEGS] =
            [LegState::new(0), LegState::new(1), LegState::new(2), LegState::new(3), LegState::new(4), LegState::new(5)], parts;
        /// T: leg displacements demanded by the last accepted set-point, m.
        pub demand: [Real; LEGS] = [0.0; LEGS], numbers(words.sizes().leg);
        /// Ticks since the last run ended.
        pub ticks_in_run: u32 = 0, tally;
    }
}

impl State {
    /// Fingerprint of everything that later ticks depend on, for comparing two machines bit for bit.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        Snapshot::digest(self, &mut digest);
        digest.finish()
    }
}
