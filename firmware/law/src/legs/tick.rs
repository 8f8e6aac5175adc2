//! Input and output of a tick, also as 64-bit words: the bits of a number (an `f32` zero-extended) or an integer. Every
//! target reads and writes these words, so that two targets can be compared bit for bit.

use specgen_runtime::Real as _;
use specgen_runtime::snapshot::Writer;

use super::constants::SixLegs;
use super::state::State;
use crate::spec::{ConstSpec, Input, LEGS, TickOutput};
use crate::words::{names, six};

/// Words of a tick's input.
pub const INPUT_WORDS: usize = 12;

/// Words of a command: the first of an input, before the measured ones.
pub const COMMAND_WORDS: usize = 6;

/// Words of a tick's output.
pub const OUTPUT_WORDS: usize = 37;

/// Words of the platform's pose: none, because six legs do not measure it.
pub const PLACE_WORDS: usize = 0;

/// Names of the input words.
pub const INPUT_NAMES: [&str; INPUT_WORDS] = names![; "setpoint", "displacement";];

/// Names of the output words.
pub const OUTPUT_NAMES: [&str; OUTPUT_WORDS] =
    names![; "voltage", "requested", "demand", "level", "drift", "dac_code"; "status"];

/// Input of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickInput<P: SixLegs> {
    /// Set-point for the end of the next interval: pose from rest (m, rad) or leg displacements (m), as selected by
    /// [`Settings::setpoint`](super::Settings::setpoint).
    pub setpoint: [P::Real; 6],
    /// Gauge reading Y of each leg, m, zero at rest.
    pub displacement: [P::Real; LEGS],
}

impl<P: SixLegs> Input<P> for TickInput<P> {
    fn read(_p: P, words: &[u64]) -> Self {
        Self { setpoint: six(words, 0), displacement: six(words, COMMAND_WORDS) }
    }

    /// A measured wrench is ignored.
    fn measured(_p: P, command: &[u64], gauge: &[P::Real; 6], _wrench: &[P::Real; 6]) -> Self {
        Self { setpoint: six(command, 0), displacement: *gauge }
    }

    fn save(&self, words: &mut Writer<'_>) {
        words.reals(&self.setpoint);
        words.reals(&self.displacement);
    }

    #[inline]
    fn gauges(&self) -> &[P::Real; 6] {
        &self.displacement
    }

    #[inline]
    fn gauges_mut(&mut self) -> &mut [P::Real; 6] {
        &mut self.displacement
    }
}

impl<P: SixLegs + ConstSpec> TickInput<P> {
    /// From words in the order of [`INPUT_NAMES`].
    #[must_use]
    pub fn from_words(words: &P::InputWords) -> Self {
        Self::read(P::CONSTANTS, words.as_ref())
    }
}

/// Writes the words of a tick's output and of the state after it, in the order of [`OUTPUT_NAMES`]. `requested` is the
/// displacement requested of each leg after all limits, `level` and `drift` are δ̂ and φ̂; m.
pub fn write_output<P: SixLegs>(_p: P, output: &TickOutput<P>, state: &State<P>, all: &mut [u64]) {
    let Some(words) = all.first_chunk_mut::<OUTPUT_WORDS>() else { return };
    for (index, leg) in state.legs.iter().enumerate() {
        words[index] = output.voltage[index].to_word();
        words[LEGS + index] = leg.shown().to_word();
        words[2 * LEGS + index] = state.demand[index].to_word();
        words[3 * LEGS + index] = leg.estimate.level.to_word();
        words[4 * LEGS + index] = leg.estimate.drift.to_word();
        words[5 * LEGS + index] = output.dac_code[index] as u32 as u64;
    }
    words[6 * LEGS] = output.status as u64;
}

/// The platform's pose: unknown.
#[must_use]
pub fn place_words<P: SixLegs>(_p: P, _state: &State<P>) -> [u64; PLACE_WORDS] {
    []
}
