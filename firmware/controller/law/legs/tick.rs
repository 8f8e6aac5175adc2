//! What a tick reads and yields, and both as 64-bit words: the bits of a number (an `f32` zero-extended) or an integer. Every target
//! reads and writes these, so that two of them can be compared bit for bit.

use crate::words::{names, six};
use crate::{LEGS, Real, State};
use specgen_runtime::Real as _;
use specgen_runtime::snapshot::Writer;

/// Bits 0 to 5 of the status: leg held back by table, voltage or slew limit.
pub const LEG_LIMITED: u32 = 0x3f;

/// Bits 8 to 13: gauge not finite or out of range; the leg's estimates were held.
pub const GAUGE_FAULT: u32 = 0x3f00;

/// Bit 16: set-point not finite or out of bounds; the last accepted one was held.
pub const SETPOINT_FAULT: u32 = 0x1_0000;

/// Bits 24 to 29: the rate-dependent inverse of the leg was not safe to use; the static one stood in for it. Never set by models
/// with one inverse.
pub const STATIC_INVERSE: u32 = 0x3f00_0000;

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
pub struct TickInput {
    /// Set-point for the end of the coming interval: pose from rest (m, rad) or leg displacements (m), as
    /// [`crate::Config::setpoint`] says.
    pub setpoint: [Real; 6],
    /// Gauge reading Y of each leg, m, zero at rest.
    pub displacement: [Real; LEGS],
}

/// What a tick yields. Every number is finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickOutput {
    /// Voltage of each leg for the coming interval, V: exactly that of [`TickOutput::dac_code`].
    pub voltage: [Real; LEGS],
    /// q̂ = ρ̂X: displacement really requested of each leg, after all limits, m.
    pub requested: [Real; LEGS],
    /// T: displacement demanded of each leg, m.
    pub demand: [Real; LEGS],
    /// δ̂ of each leg, m.
    pub level: [Real; LEGS],
    /// φ̂ of each leg, m.
    pub drift: [Real; LEGS],
    /// Converter code of each leg.
    pub dac_code: [i32; LEGS],
    /// [`LEG_LIMITED`], [`GAUGE_FAULT`], [`SETPOINT_FAULT`].
    pub status: u32,
}

impl TickInput {
    /// From words in the order of [`INPUT_NAMES`].
    #[must_use]
    pub fn from_words(words: &[u64; INPUT_WORDS]) -> Self {
        Self { setpoint: six(words, 0), displacement: six(words, COMMAND_WORDS) }
    }

    /// Of the words of a command, and of readings as a target has them. No wrench is asked for.
    #[must_use]
    pub fn measured(words: &[u64; COMMAND_WORDS], gauge: &[Real; 6], _wrench: &[Real; 6]) -> Self {
        Self { setpoint: six(words, 0), displacement: *gauge }
    }

    /// As words in the order of [`INPUT_NAMES`].
    pub(crate) fn save(&self, words: &mut Writer<'_>) {
        words.reals(&self.setpoint);
        words.reals(&self.displacement);
    }
}

/// Words in the order of [`OUTPUT_NAMES`], of a tick; nothing of the state is needed.
#[must_use]
pub fn output_words(output: &TickOutput, _state: &State) -> [u64; OUTPUT_WORDS] {
    let mut words = [0; OUTPUT_WORDS];
    for index in 0..LEGS {
        words[index] = output.voltage[index].to_word();
        words[LEGS + index] = output.requested[index].to_word();
        words[2 * LEGS + index] = output.demand[index].to_word();
        words[3 * LEGS + index] = output.level[index].to_word();
        words[4 * LEGS + index] = output.drift[index].to_word();
        words[5 * LEGS + index] = output.dac_code[index] as u32 as u64;
    }
    words[6 * LEGS] = output.status as u64;
    words
}

/// Where a platform is: nothing of it is known.
#[must_use]
pub fn place_words(_state: &State) -> [u64; PLACE_WORDS] {
    []
}
