//! State of the controller from tick to tick. It never contains a NaN or infinity.

use specgen_runtime::snapshot::Snapshot;
use specgen_runtime::{Digest, Estimate, Real as _};

use super::constants::SixLegs;
use super::lead::{DeadTimeLead as _, LastChange as _};
use crate::memory::LegMemory as _;
use crate::spec::{LEGS, Reset};

specgen_runtime::state! { |words|
    /// State of one leg.
    pub struct LegState<P>[P: SixLegs](reset: &Reset<P>, leg: usize) {
        /// Reversal memory. Its displacement is q̂ = ρ̂X, the displacement requested after all limits, m.
        pub memory: P::Memory = reset.memory[leg], part;
        /// Converter code now held at the output.
        pub code: i32 = reset.code, ticks(words.sizes().codes[1]) if *code >= words.sizes().codes[0];
        /// δ̂ and φ̂, m.
        pub estimate: Estimate<P::Real> = Estimate::new(), part;
        /// Lead on the demand that compensates dead time and resonance, m; none without `hysteresis.dead_time` and
        /// `actuator.resonance_gain`.
        pub lead: P::Lead = P::Lead::REST, part;
        /// Last change of the voltage and last turn, m; none without `actuator.resonance_gain`.
        pub change: P::Change = P::Change::REST, part;
    }
}

specgen_runtime::state! { |words|
    /// State of the controller. Reset: at rest by the spec, no correction.
    pub struct State<P>[P: SixLegs](reset: &Reset<P>) {
        /// Legs 0 to 5.
        pub legs: [LegState<P>; LEGS] = [
            LegState::new(reset, 0), LegState::new(reset, 1), LegState::new(reset, 2),
            LegState::new(reset, 3), LegState::new(reset, 4), LegState::new(reset, 5),
        ], parts;
        /// T: leg displacements demanded by the last accepted set-point, m.
        pub demand: [P::Real; LEGS] = [P::Real::ZERO; LEGS], numbers(words.sizes().leg);
        /// Ticks since the last run ended.
        pub ticks_in_run: u32 = 0, tally;
    }
}

impl<P: SixLegs> LegState<P> {
    /// ρ̂X, m: the displacement that the gauge should show. It does not include the lead, which only compensates
    /// dead time and resonance.
    #[inline]
    #[must_use]
    pub fn shown(&self) -> P::Real {
        match self.lead.asked() {
            Some(lead) => self.memory.displacement() - lead,
            None => self.memory.displacement(),
        }
    }
}

impl<P: SixLegs> State<P> {
    /// Fingerprint of the whole state, for comparing two machines bit for bit.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        Snapshot::digest(self, &mut digest);
        digest.finish()
    }
}
