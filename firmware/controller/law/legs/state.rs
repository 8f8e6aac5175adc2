//! What the controller remembers from tick to tick. No NaN or infinity is ever stored here.

use crate::hysteresis::{GRID, LED, Memory};
use crate::supervision::{code_at_rest, memory_at_rest};
use crate::{LEGS, Real, TickInput, limits};
use specgen_runtime::snapshot::{Invalid, LARGEST_PLACE, Reader, Snapshot, Writer};
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
        Self { legs: LegState::all_at_rest(), demand: [0.0; LEGS], ticks_in_run: 0 }
    }

    /// Fingerprint of everything that later ticks depend on, for comparing two machines bit for bit.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        for leg in &self.legs {
            leg.memory.digest(&mut digest);
            leg.estimate.digest(&mut digest);
            digest.word(leg.code as u32 as u64);
            if LED {
                digest.real(leg.lead);
            }
        }
        for demand in &self.demand {
            digest.real(*demand);
        }
        digest.word(self.ticks_in_run as u64);
        digest.finish()
    }
}

impl Snapshot for LegState {
    const WORDS: usize = <Memory as Snapshot>::WORDS + <Estimate<Real> as Snapshot>::WORDS + 1 + LED as usize;
    fn save(&self, words: &mut Writer<'_>) {
        self.memory.save(words);
        words.word(self.code as u32 as u64);
        self.estimate.save(words);
        if LED {
            words.real(self.lead);
        }
    }

    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), Invalid> {
        self.memory.restore(words)?;
        if self.memory.highest() > GRID as Real {
            return Err(words.refused());
        }
        self.code = words.count_to(limits::CODES[1])?;
        if self.code < limits::CODES[0] {
            return Err(words.refused());
        }
        self.estimate.restore(words)?;
        if LED {
            self.lead = words.real(LARGEST_PLACE)?;
        }
        Ok(())
    }
}

impl Snapshot for State {
    const WORDS: usize = LEGS * <LegState as Snapshot>::WORDS + LEGS + 1;
    fn save(&self, words: &mut Writer<'_>) {
        for leg in &self.legs {
            leg.save(words);
        }
        words.reals(&self.demand);
        words.word(self.ticks_in_run as u64);
    }

    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), Invalid> {
        for leg in &mut self.legs {
            leg.restore(words)?;
        }
        words.reals(&mut self.demand, LARGEST_PLACE)?;
        self.ticks_in_run = words.counter()?;
        Ok(())
    }
}

impl TickInput {
    /// As words in the order of `INPUT_NAMES`.
    pub(crate) fn save(&self, words: &mut Writer<'_>) {
        words.reals(&self.setpoint);
        words.reals(&self.displacement);
    }
}
