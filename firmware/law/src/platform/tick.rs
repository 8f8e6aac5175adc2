//! Input and output of a tick, also as 64-bit words: the bits of a number (an `f32` zero-extended) or an integer. Every
//! target reads and writes these words, so that two targets can be compared bit for bit.

use specgen_runtime::linear::{each, transform};
use specgen_runtime::setpoint::{Command, CommandKind, Target};
use specgen_runtime::snapshot::Writer;
use specgen_runtime::trigger::OutputLines as _;
use specgen_runtime::{Real as _, RequestCorrection};

use super::constants::Platform;
use super::state::State;
use crate::spec::{ConstSpec, Input, LEGS, TickOutput};
use crate::words::{fill, names, six};

/// Words of a command without a correction.
const MOTION_WORDS: usize = 21;

/// Words of a command: the first of an input, before the measured ones.
#[must_use]
pub const fn command_words(corrected: usize) -> usize {
    MOTION_WORDS + corrected
}

/// Words of a tick's output: one more if the platform has output lines.
#[must_use]
pub const fn output_words_with(lines: usize) -> usize {
    if lines == 0 { STATUS + 1 } else { STATUS + 2 }
}

/// Index of the status among the words of an output.
const STATUS: usize = 9 * LEGS;

/// Words of pose and set-point, see [`place_words`].
pub const PLACE_WORDS: usize = 24;
/// The first of the voltages among them.
pub(super) const VOLTAGES: usize = 18;

/// Names of the input words. `command` is 0 hold, 1 stream, 2 move, 3 trajectory; 4 open drive, with the voltages of the
/// legs in `setpoint`. `correction` is present if
/// `control.correction` is set.
#[must_use]
pub const fn input_names<const N: usize>() -> [&'static str; N] {
    let mut names = [""; N];
    let mut k = 0;
    while k < N {
        names[k] = EVERY_NAME[if k < MOTION_WORDS || N == EVERY_NAME.len() { k } else { k + 6 }];
        k += 1;
    }
    names
}

/// Names of a controller with all of them.
const EVERY_NAME: [&str; 39] = names![
    "command", "selector", "sequence";
    "setpoint", "setpoint_rate", "setpoint_acceleration", "correction", "gauge", "wrench";
];

/// Names of the output words. `missed` is present if the spec has a `trigger`: the pulses that each line has missed
/// since its settings were written, 15 bits a line, the first lowest.
#[must_use]
pub const fn output_names<const N: usize>() -> [&'static str; N] {
    let every = names![;
        "voltage", "requested", "demand", "level", "drift", "dac_code", "pose", "target", "load";
        "status", "missed"
    ];
    let mut names = [""; N];
    let mut k = 0;
    while k < N {
        names[k] = every[k];
        k += 1;
    }
    names
}

/// Requested correction of a platform.
type Offsets<P> = <<P as Platform>::Correction as RequestCorrection<<P as crate::Spec>::Real>>::Offsets;

/// Input of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickInput<P: Platform> {
    /// Command to the platform.
    pub command: Command<P::Real>,
    /// c, the correction that was learned or prepared for the motion, added to the request: m and rad.
    pub correction: Offsets<P>,
    /// Reading of each gauge: V if the spec has a calibration, else m from rest.
    pub gauge: [P::Real; 6],
    /// Measured force (N) and torque (N m) of the work piece ON the platform, about P_C, base axes.
    pub wrench: [P::Real; 6],
}

impl<P: Platform> Input<P> for TickInput<P> {
    fn read(p: P, words: &[u64]) -> Self {
        let correction = wanted(p, words);
        let end = MOTION_WORDS + correction.as_ref().len();
        Self { command: command(words), correction, gauge: six(words, end), wrench: six(words, end + 6) }
    }

    fn measured(p: P, words: &[u64], gauge: &[P::Real; 6], wrench: &[P::Real; 6]) -> Self {
        Self { command: command(words), correction: wanted(p, words), gauge: *gauge, wrench: *wrench }
    }

    fn save(&self, words: &mut Writer<'_>) {
        words.word(self.command.kind.word());
        words.word(self.command.selector as u64);
        words.word(self.command.sequence as u64);
        words.reals(&self.command.target.pose);
        words.reals(&self.command.target.rate);
        words.reals(&self.command.target.acceleration);
        words.reals(self.correction.as_ref());
        words.reals(&self.gauge);
        words.reals(&self.wrench);
    }

    #[inline]
    fn gauges(&self) -> &[P::Real; 6] {
        &self.gauge
    }

    #[inline]
    fn gauges_mut(&mut self) -> &mut [P::Real; 6] {
        &mut self.gauge
    }
}

impl<P: Platform + ConstSpec> TickInput<P> {
    /// From words in the order of the controller's `INPUT_NAMES`.
    #[must_use]
    pub fn from_words(words: &P::InputWords) -> Self {
        Self::read(P::CONSTANTS, words.as_ref())
    }
}

/// The correction of a command's words.
fn wanted<P: Platform>(p: P, words: &[u64]) -> Offsets<P> {
    let mut wanted = P::Correction::nothing(p.correction());
    fill(wanted.as_mut(), words, MOTION_WORDS);
    wanted
}

/// The command of a tick's first words.
fn command<T: specgen_runtime::Real>(words: &[u64]) -> Command<T> {
    let [kind, selector, sequence] = *words.first_chunk().unwrap_or(&[0; 3]);
    Command {
        kind: CommandKind::from_word(kind),
        selector: saturated(selector),
        sequence: saturated(sequence),
        target: Target { pose: six(words, 3), rate: six(words, 9), acceleration: six(words, 15) },
    }
}

/// Writes the words of a tick's output and of the state after it, in the order of [`output_names`]. `level` and `drift`
/// are δ̂ and φ̂ as displacements of the legs.
pub fn write_output<P: Platform>(p: P, output: &TickOutput<P>, state: &State<P>, all: &mut [u64]) {
    let Some((words, last)) = all.split_first_chunk_mut::<{ STATUS + 1 }>() else { return };
    let target = state.generator.target();
    let level = transform(p.modes_to_legs(), &each(|mode| state.estimates[mode].level));
    let drift = transform(p.modes_to_legs(), &each(|mode| state.estimates[mode].drift));
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
    words[STATUS] = output.status as u64;
    if let Some(missed) = last.first_mut() {
        *missed = state.triggers.missed();
    }
}

/// Measured pose and set-point, both from rest and with the bias, then the set-point in the user's coordinates, m and
/// rad; then the voltage of each leg, V. Six words each.
#[must_use]
pub fn place_words<P: Platform>(p: P, state: &State<P>) -> [u64; PLACE_WORDS] {
    let mut words = [0; PLACE_WORDS];
    let (target, place) = (state.generator.target(), state.generator.place());
    for axis in 0..6 {
        words[axis] = state.pose[axis].to_word();
        words[6 + axis] = target.pose[axis].to_word();
        words[12 + axis] = place[axis].to_word();
    }
    for (leg, state) in state.legs.iter().enumerate() {
        words[VOLTAGES + leg] = p.dac().voltage(state.code).to_word();
    }
    words
}

/// A counter from its word.
fn saturated(word: u64) -> u32 {
    if word > u32::MAX as u64 { u32::MAX } else { word as u32 }
}
