//! What every law has to know of a spec, and what the supervised tick has to know of a law.

mod config;
mod machine;

use core::fmt::Debug;

use specgen_runtime::snapshot::{Sizes, Writer};
use specgen_runtime::supervisor::{Fallback, Phase, Supervision};
use specgen_runtime::{CodeLimits, Dac, Legs, PermittedRange, Real, Snapshot};

use crate::memory::LegMemory;
use crate::words::WordArray;

pub use config::{Config, ConfigError};
pub use machine::Machine;

/// Number of legs.
pub const LEGS: usize = 6;

/// Constants of a spec that both laws ask for, and the types of what has a size of its own.
pub trait Spec: Copy + Debug + PartialEq + 'static {
    /// `f32` or `f64`.
    type Real: Real + Debug;
    /// The law that it runs: [`TaskSpace`](crate::platform::TaskSpace) or [`LegSpace`](crate::legs::LegSpace).
    type Law: ControlLaw<Self>;
    /// Hysteresis model of a leg.
    type Table;
    /// What a leg remembers of its drive.
    type Memory: LegMemory<Self::Real, Self::Table>;

    /// Hysteresis model of each leg.
    fn tables(&self) -> &[Self::Table; LEGS];
    /// Converter codes in volts and in cells of the tables.
    fn dac(&self) -> &Dac<Self::Real>;
    /// What the supervisor takes for a fault.
    fn supervision(&self) -> &Supervision<Self::Real>;
    /// Lowest and highest word of each gauge that is believed.
    fn raw_limits(&self) -> &[[Self::Real; 2]; 6];
    /// Reading of each gauge (rows) per displacement of each leg (columns) at rest.
    fn readings_per_leg(&self) -> &[[Self::Real; LEGS]; 6];
    /// Leg kinematics.
    fn geometry(&self) -> &Legs<'_, Self::Real>;
    /// J⁻¹ of the legs at rest: pose coordinates (rows) per leg displacement (columns).
    fn inverse_jacobian(&self) -> &[[Self::Real; LEGS]; 6];
    /// Corrections of the forward kinematics.
    fn corrections(&self) -> usize;
    /// Largest |x|, |y|, |z| (m) and |θx|, |θy|, |θz| (rad) accepted.
    fn pose_bound(&self) -> &[Self::Real; 6];
    /// Ranges of the settings, each for so many words.
    fn permitted(&self) -> &[(PermittedRange<Self::Real>, usize)];
    /// How large the numbers of a state may be.
    fn sizes(&self) -> Sizes;
    /// The legs at reset.
    fn reset(&self) -> Reset<Self>;
}

/// A spec whose constants a compiler wrote, so that all sizes are known. [`controller!`](crate::controller) implements it.
pub trait ConstSpec: Spec {
    /// The constants.
    const CONSTANTS: Self;
    /// The spec's settings.
    const DEFAULTS: SettingsOf<Self>;
    /// Words of the settings.
    type ConfigWords: WordArray;
    /// Words of a command.
    type CommandWords: WordArray;
    /// Words of a tick's input.
    type InputWords: WordArray;
    /// Words of a supervised tick's input.
    type MachineInputWords: WordArray;
    /// Words of a machine.
    type MachineWords: WordArray;
}

/// The legs at reset: at rest.
#[derive(Debug, Clone, Copy)]
pub struct Reset<P: Spec> {
    /// Reversal memory of each leg.
    pub memory: [P::Memory; LEGS],
    /// Displacement that the model gives each leg, m.
    pub displacement: [P::Real; LEGS],
    /// Converter code of every leg.
    pub code: i32,
}

/// What a tick yields. Every number is finite. What else there is to know stands in the state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickOutput<P: Spec> {
    /// Voltage of each leg for the coming interval, V: exactly that of [`TickOutput::dac_code`].
    pub voltage: [P::Real; LEGS],
    /// Converter code of each leg.
    pub dac_code: [i32; LEGS],
    /// Bits of [`crate::status`].
    pub status: u32,
}

/// What may change while running, unchecked: as the compiler writes it. [`Config`](crate::Config) holds what was checked.
pub trait Settings<P: Spec>: Copy + Debug + PartialEq {
    /// First word of the code limits.
    const CODES: usize;
    /// Voltage limits and slew limit in converter codes.
    fn code_limits(&self) -> CodeLimits;
    /// From words in the order of the controller's `CONFIG_NAMES`, each within its range.
    ///
    /// # Errors
    /// The first word that does not go with the others.
    fn read(p: P, words: &[u64]) -> Result<Self, ConfigError>;
    /// Writes the words in the order of the controller's `CONFIG_NAMES`.
    fn save(&self, words: &mut Writer<'_>);
}

/// What a tick reads.
pub trait Input<P: Spec>: Copy + Debug + PartialEq {
    /// From words in the order of the controller's `INPUT_NAMES`; zero beyond their end.
    fn read(p: P, words: &[u64]) -> Self;
    /// Of the words of a command, and of readings as a target has them. One that measures no wrench gives NaN for it.
    fn measured(p: P, command: &[u64], gauge: &[P::Real; 6], wrench: &[P::Real; 6]) -> Self;
    /// As words in the order of the controller's `INPUT_NAMES`.
    fn save(&self, words: &mut Writer<'_>);
    /// The gauges' words.
    fn gauges(&self) -> &[P::Real; 6];
    /// The same, to be replaced.
    fn gauges_mut(&mut self) -> &mut [P::Real; 6];
}

/// A law that a supervisor can begin, run and suspend.
///
/// Every method takes the constants, the settings, the state or the machine, and the input of the tick, as far as it needs them, in this
/// order.
pub trait ControlLaw<P: Spec<Law = Self>>: Sized {
    /// What may change while running.
    type Settings: Settings<P>;
    /// What is remembered from tick to tick.
    type State: Copy + Debug + Snapshot;
    /// What a tick reads.
    type Input: Input<P>;

    /// The state at reset.
    fn at_reset(reset: &Reset<P>) -> Self::State;
    /// Codes held at the outputs.
    fn codes(state: &Self::State) -> [i32; LEGS];
    /// Code and memory of each leg.
    fn drives(state: &mut Self::State) -> impl Iterator<Item = (&mut i32, &mut P::Memory)>;
    /// Readings of the gauges, m, from their words.
    #[inline]
    fn readings(_p: P, words: &[P::Real; 6]) -> [P::Real; 6] {
        *words
    }
    /// Word of each gauge (rows) per displacement of each leg (columns) near these words, per m: for a host that stands in for gauges.
    #[must_use]
    fn words_per_leg(p: P, _words: &[P::Real; 6]) -> [[P::Real; 6]; 6] {
        *p.readings_per_leg()
    }
    /// What a gauge ought to read by the codes sent over the interval that has ended, and the set-point of the axis or leg of that number.
    fn expected_reading(p: P, state: &Self::State, channel: usize) -> (P::Real, P::Real);
    /// Where the axis or leg of that number is, m or rad, and the correction at work on it, if it has one. `reading` is that of its gauge.
    fn reached(state: &Self::State, channel: usize, reading: P::Real) -> (P::Real, Option<P::Real>);

    /// A tick of the law, or of what it has fallen back to; its status.
    fn advance(p: P, config: &Config<P>, state: &mut Self::State, fallback: Fallback, input: &Self::Input) -> u32;
    /// Puts the law where the machine is. No leg moves in the first tick.
    fn enter_running(p: P, config: &Config<P>, machine: &mut Machine<P>, input: &Self::Input);
    /// A tick of the law under its supervisor; its status.
    #[inline]
    fn run(p: P, config: &Config<P>, machine: &mut Machine<P>, input: &Self::Input) -> u32 {
        let Machine { state, supervisor } = machine;
        Self::advance(p, config, state, supervisor.oscillation.stage, input)
    }
    /// Brings a motion that was under way to rest where the law is to be suspended: the status; none where nothing moves.
    #[inline]
    fn decelerate(_p: P, _config: &Config<P>, _machine: &mut Machine<P>, _input: &Self::Input) -> Option<u32> {
        None
    }
    /// What is still measured while codes are held or on their way to rest, the law suspended. Returns the gauges that are not believed,
    /// bit by bit.
    fn hold(p: P, config: &Config<P>, machine: &mut Machine<P>, input: &Self::Input) -> u32;
    /// Output lines over the coming interval, as bits of the status. They are low unless the law runs.
    #[inline]
    fn fire_triggers(
        _config: &Config<P>,
        _state: &mut Self::State,
        _phase: Phase,
        _input: &Self::Input,
        _status: u32,
    ) -> u32 {
        0
    }
    /// h_d for the end of a tick, and h at its beginning, m and rad, where passes of a motion are learned from them.
    #[must_use]
    fn shown(_state: &Self::State) -> Option<[[P::Real; 6]; 2]> {
        None
    }
    /// A tick's output as words in the order of the controller's `OUTPUT_NAMES`, and what of the state that it left is shown.
    fn write_output(p: P, output: &TickOutput<P>, state: &Self::State, words: &mut [u64]);
}

/// Settings of a spec's law.
pub type SettingsOf<P> = <<P as Spec>::Law as ControlLaw<P>>::Settings;
/// State of a spec's law.
pub type StateOf<P> = <<P as Spec>::Law as ControlLaw<P>>::State;
/// What a tick of a spec's law reads.
pub type InputOf<P> = <<P as Spec>::Law as ControlLaw<P>>::Input;
