//! What a tick reads and yields, and both as 64-bit words: the bits of a number (an `f32` zero-extended) or an integer. Every target
//! reads and writes these, so that two of them can be compared bit for bit.

use crate::defaults::LINES;
use crate::limits::DAC;
use crate::task_space::{CORRECTED, MODES_TO_LEGS};
use crate::words::{names, numbers, six};
use crate::{LEGS, Real, State};
use specgen_runtime::Real as _;
use specgen_runtime::linear::{each, transform};
use specgen_runtime::setpoint::{Command, CommandKind, Target};
use specgen_runtime::snapshot::Writer;

/// Bits 0 to 5 of the status: leg held back by table, voltage or slew limit.
pub const LEG_LIMITED: u32 = 0x3f;

/// Bits 8 to 13: gauge not finite or out of range. The pose, the integral and the estimates were held.
pub const GAUGE_FAULT: u32 = 0x3f00;

/// Bit 16: set-point not finite, out of the workspace or a jump; the last one was held.
pub const SETPOINT_FAULT: u32 = 0x1_0000;

/// Bit 17: the stream of set-points is stale; brought to rest.
pub const SETPOINT_STALE: u32 = 0x2_0000;

/// Bit 18: bias, move or trajectory under way.
pub const GENERATOR_BUSY: u32 = 0x4_0000;

/// Bit 19: measured wrench not finite or out of range; the last one believed was kept.
pub const WRENCH_FAULT: u32 = 0x8_0000;

/// Bit 20: correction not a number, or larger or faster than it may be; followed as far as the limits let it.
pub const CORRECTION_LIMITED: u32 = 0x10_0000;

/// Bits 6, 7, 14 and 15: output line 0, 1, 2, 3 is high over the coming interval. Under the supervisor alone.
pub const TRIGGER_HIGH: u32 = 0xc0c0;

/// Bit 21: some output line has missed a pulse since its settings were given. Under the supervisor alone.
pub const TRIGGER_MISSED: u32 = 0x20_0000;

/// Bits 24 to 29: the rate-dependent inverse of the leg was not safe to use; the static one stood in for it. Never set by models
/// with one inverse.
pub const STATIC_INVERSE: u32 = 0x3f00_0000;

/// Words of a tick's input.
pub const INPUT_WORDS: usize = COMMAND_WORDS + 12;

/// Words of a command: they stand before those that are measured.
pub const COMMAND_WORDS: usize = 21 + CORRECTED;

/// Words of a tick's output.
pub const OUTPUT_WORDS: usize = if LINES == 0 { 55 } else { 56 };

/// Words of where a platform is, see [`place_words`].
pub const PLACE_WORDS: usize = 24;

/// Names of the input words. `command` is 0 hold, 1 stream, 2 move, 3 trajectory; `correction` stands there if `control.correction` asks
/// for it.
pub const INPUT_NAMES: [&str; INPUT_WORDS] = {
    let mut names = [""; INPUT_WORDS];
    let mut k = 0;
    while k < INPUT_WORDS {
        names[k] = EVERY_NAME[if k < 21 || INPUT_WORDS == EVERY_NAME.len() { k } else { k + 6 }];
        k += 1;
    }
    names
};

/// Those of a controller that has them all.
const EVERY_NAME: [&str; 39] = names![
    "command", "selector", "sequence";
    "setpoint", "setpoint_rate", "setpoint_acceleration", "correction", "gauge", "wrench";
];

/// Names of the output words. `missed` stands there if the spec has a `trigger`: the pulses that each line has missed since its settings were
/// given, 15 bits a line, the first lowest.
pub const OUTPUT_NAMES: [&str; OUTPUT_WORDS] = {
    let every = names![;
        "voltage", "requested", "demand", "level", "drift", "dac_code", "pose", "target", "load";
        "status", "missed"
    ];
    let mut names = [""; OUTPUT_WORDS];
    let mut k = 0;
    while k < OUTPUT_WORDS {
        names[k] = every[k];
        k += 1;
    }
    names
};

/// What a tick reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickInput {
    /// What the platform is to do.
    pub command: Command<Real>,
    /// c, what was learned or prepared for the motion, added to the request: m and rad.
    pub correction: [Real; CORRECTED],
    /// Reading of each gauge: V if the spec gives a calibration, else m from rest.
    pub gauge: [Real; 6],
    /// Measured force (N) and torque (N m) of the work piece ON the platform, about P_C, base axes.
    pub wrench: [Real; 6],
}

/// What a tick yields. Every number is finite. What else there is to know stands in the [`State`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickOutput {
    /// Voltage of each leg for the coming interval, V: exactly that of [`TickOutput::dac_code`].
    pub voltage: [Real; LEGS],
    /// Converter code of each leg.
    pub dac_code: [i32; LEGS],
    /// [`LEG_LIMITED`], [`GAUGE_FAULT`], [`SETPOINT_FAULT`], [`SETPOINT_STALE`], [`GENERATOR_BUSY`], [`WRENCH_FAULT`],
    /// [`CORRECTION_LIMITED`], [`TRIGGER_HIGH`], [`TRIGGER_MISSED`].
    pub status: u32,
}

impl TickInput {
    /// From words in the order of [`INPUT_NAMES`].
    #[must_use]
    pub fn from_words(words: &[u64; INPUT_WORDS]) -> Self {
        let (gauge, wrench) = (six(words, COMMAND_WORDS), six(words, COMMAND_WORDS + 6));
        Self { command: command(words), correction: numbers(words, 21), gauge, wrench }
    }

    /// Of the words of a command, and of readings as a target has them. One that measures no wrench gives NaN for it.
    #[must_use]
    pub fn measured(words: &[u64; COMMAND_WORDS], gauge: &[Real; 6], wrench: &[Real; 6]) -> Self {
        Self { command: command(words), correction: numbers(words, 21), gauge: *gauge, wrench: *wrench }
    }

    /// As words in the order of [`INPUT_NAMES`].
    pub(crate) fn save(&self, words: &mut Writer<'_>) {
        words.word(self.command.kind.word());
        words.word(self.command.selector as u64);
        words.word(self.command.sequence as u64);
        words.reals(&self.command.target.pose);
        words.reals(&self.command.target.rate);
        words.reals(&self.command.target.acceleration);
        words.reals(&self.correction);
        words.reals(&self.gauge);
        words.reals(&self.wrench);
    }
}

/// The command of a tick's first words.
fn command(words: &[u64]) -> Command<Real> {
    let [kind, selector, sequence] = *words.first_chunk().unwrap_or(&[0; 3]);
    Command {
        kind: CommandKind::from_word(kind),
        selector: saturated(selector),
        sequence: saturated(sequence),
        target: Target { pose: six(words, 3), rate: six(words, 9), acceleration: six(words, 15) },
    }
}

/// Words in the order of [`OUTPUT_NAMES`], of a tick and of the state that it left. `level` and `drift` are δ̂ and φ̂ as
/// displacements of the legs.
#[must_use]
pub fn output_words(output: &TickOutput, state: &State) -> [u64; OUTPUT_WORDS] {
    let mut words = [0; OUTPUT_WORDS];
    let target = state.generator.target();
    let level = transform(&MODES_TO_LEGS, &each(|mode| state.estimates[mode].level));
    let drift = transform(&MODES_TO_LEGS, &each(|mode| state.estimates[mode].drift));
    for (index, leg) in state.legs.iter().enumerate() {
        words[index] = output.voltage[index].to_word();
        words[LEGS + index] = leg.requested.to_word();
        words[2 * LEGS + index] = state.demand[index].to_word();
        words[3 * LEGS + index] = level[index].to_word();
        words[4 * LEGS + index] = drift[index].to_word();
        words[5 * LEGS + index] = output.dac_code[index] as u32 as u64;
        words[6 * LEGS + index] = state.pose[index].to_word();
        words[7 * LEGS + index] = target.pose[index].to_word();
        words[8 * LEGS + index] = state.load[index].to_word();
    }
    words[9 * LEGS] = output.status as u64;
    if let Some(missed) = words.get_mut(9 * LEGS + 1) {
        *missed = state.triggers.missed();
    }
    words
}

/// Where the platform is: the pose measured and the set-point, both from rest and with the bias, then the set-point in the
/// user's coordinates, m and rad; then the voltage of each leg, V. Six words each.
#[must_use]
pub fn place_words(state: &State) -> [u64; PLACE_WORDS] {
    let mut words = [0; PLACE_WORDS];
    let (target, place) = (state.generator.target(), state.generator.place());
    for axis in 0..6 {
        words[axis] = state.pose[axis].to_word();
        words[6 + axis] = target.pose[axis].to_word();
        words[12 + axis] = place[axis].to_word();
    }
    for (leg, state) in state.legs.iter().enumerate() {
        words[18 + leg] = DAC.voltage(state.code).to_word();
    }
    words
}

/// A counter from its word.
fn saturated(word: u64) -> u32 {
    if word > u32::MAX as u64 { u32::MAX } else { word as u32 }
}
