//! What a tick reads and yields, and both as 64-bit words: the bits of a number (an `f32` zero-extended) or an integer. Every target
//! reads and writes these, so that two of them can be compared bit for bit.

use specgen_runtime::Real as _;
use specgen_runtime::snapshot::Writer;

use super::constants::SixLegs;
use super::state::State;
use crate::spec::{Compiled, LEGS};
use crate::words::{WordArray as _, names, six};

/// Words of a tick's input.
pub const INPUT_WORDS: usize = 12;

/// Words of a command: they stand before those that are measured.
pub const COMMAND_WORDS: usize = 6;

/// Words of a tick's output.
pub const OUTPUT_WORDS: usize = 37;

/// Words of where a platform is: six legs know of none.
pub const PLACE_WORDS: usize = 0;

/// Names of the input words.
pub const INPUT_NAMES: [&str; INPUT_WORDS] = names![; "setpoint", "displacement";];

/// Names of the output words.
pub const OUTPUT_NAMES: [&str; OUTPUT_WORDS] =
    names![; "voltage", "requested", "demand", "level", "drift", "dac_code"; "status"];

/// What a tick reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickInput<P: SixLegs> {
    /// Set-point for the end of the coming interval: pose from rest (m, rad) or leg displacements (m), as
    /// [`Config::setpoint`](super::Config::setpoint) says.
    pub setpoint: [P::Real; 6],
    /// Gauge reading Y of each leg, m, zero at rest.
    pub displacement: [P::Real; LEGS],
}

/// What a tick yields. Every number is finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickOutput<P: SixLegs> {
    /// Voltage of each leg for the coming interval, V: exactly that of [`TickOutput::dac_code`].
    pub voltage: [P::Real; LEGS],
    /// q̂ = ρ̂X: displacement really requested of each leg, after all limits, m.
    pub requested: [P::Real; LEGS],
    /// T: displacement demanded of each leg, m.
    pub demand: [P::Real; LEGS],
    /// δ̂ of each leg, m.
    pub level: [P::Real; LEGS],
    /// φ̂ of each leg, m.
    pub drift: [P::Real; LEGS],
    /// Converter code of each leg.
    pub dac_code: [i32; LEGS],
    /// Bits of [`crate::status`].
    pub status: u32,
}

impl<P: SixLegs> TickInput<P> {
    /// From words in the order of [`INPUT_NAMES`]; zero beyond their end.
    #[must_use]
    pub fn read(words: &[u64]) -> Self {
        Self { setpoint: six(words, 0), displacement: six(words, COMMAND_WORDS) }
    }

    /// Of the words of a command, and of readings as a target has them.
    #[must_use]
    pub fn of_command(words: &[u64], gauge: &[P::Real; 6]) -> Self {
        Self { setpoint: six(words, 0), displacement: *gauge }
    }

    /// As words in the order of [`INPUT_NAMES`].
    pub fn save(&self, words: &mut Writer<'_>) {
        words.reals(&self.setpoint);
        words.reals(&self.displacement);
    }
}

impl<P: SixLegs + Compiled> TickInput<P> {
    /// From words in the order of [`INPUT_NAMES`].
    #[must_use]
    pub fn from_words(words: &P::InputWords) -> Self {
        Self::read(words.as_ref())
    }

    /// See [`TickInput::of_command`]. No wrench is asked for.
    #[must_use]
    pub fn measured(words: &P::CommandWords, gauge: &[P::Real; 6], _wrench: &[P::Real; 6]) -> Self {
        Self::of_command(words.as_ref(), gauge)
    }
}

/// Writes the words of a tick's output in the order of [`OUTPUT_NAMES`]; nothing of the state is needed.
pub fn write_output<P: SixLegs>(output: &TickOutput<P>, all: &mut [u64]) {
    let Some(words) = all.first_chunk_mut::<OUTPUT_WORDS>() else { return };
    for index in 0..LEGS {
        words[index] = output.voltage[index].to_word();
        words[LEGS + index] = output.requested[index].to_word();
        words[2 * LEGS + index] = output.demand[index].to_word();
        words[3 * LEGS + index] = output.level[index].to_word();
        words[4 * LEGS + index] = output.drift[index].to_word();
        words[5 * LEGS + index] = output.dac_code[index] as u32 as u64;
    }
    words[6 * LEGS] = output.status as u64;
}

/// Words in the order of [`OUTPUT_NAMES`], see [`write_output`].
#[must_use]
pub fn output_words<P: SixLegs + Compiled>(output: &TickOutput<P>, _state: &State<P>) -> P::OutputWords {
    let mut words = P::OutputWords::ZERO;
    write_output(output, words.as_mut());
    words
}

/// Where a platform is: nothing of it is known.
#[must_use]
pub fn place_words<P: SixLegs>(_p: P, _state: &State<P>) -> [u64; PLACE_WORDS] {
    []
}
