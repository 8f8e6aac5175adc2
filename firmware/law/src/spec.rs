//! Interfaces: of a spec to every law, and of a law to the supervised tick.

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

/// Constants of a spec that both laws need, and the types of parts whose size depends on the spec.
pub trait Spec: Copy + Debug + PartialEq + 'static {
    /// `f32` or `f64`.
    type Real: Real + Debug;
    /// The law in use: [`TaskSpace`](crate::platform::TaskSpace) or [`LegSpace`](crate::legs::LegSpace).
    type Law: ControlLaw<Self>;
    /// Hysteresis model of a leg.
    type Table;
    /// Memory of a leg's drive.
    type Memory: LegMemory<Self::Real, Self::Table>;

    /// Hysteresis model of each leg.
    fn tables(&self) -> &[Self::Table; LEGS];
    /// Converter codes in volts and in cells of the tables.
    fn dac(&self) -> &Dac<Self::Real>;
    /// Constants of the supervisor.
    fn supervision(&self) -> &Supervision<Self::Real>;
    /// Lowest and highest valid word of each gauge.
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
    /// Ranges of the settings, each for a number of words.
    fn permitted(&self) -> &[(PermittedRange<Self::Real>, usize)];
    /// Bounds of the numbers of a state.
    fn sizes(&self) -> Sizes;
    /// The legs at reset.
    fn reset(&self) -> Reset<Self>;
    /// Whether the tables are those of the legs. Otherwise the law never runs: the machine has the open drive only.
    fn is_identified(&self) -> bool;
}

/// A spec with constants from the compiler, so that all sizes are known. [`controller!`](crate::controller) implements
/// it.
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

/// Output of a tick. Every number is finite. The state has all other results.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TickOutput<P: Spec> {
    /// Voltage of each leg for the next interval, V: exactly that of [`TickOutput::dac_code`].
    pub voltage: [P::Real; LEGS],
    /// Converter code of each leg.
    pub dac_code: [i32; LEGS],
    /// Bits of [`crate::status`].
    pub status: u32,
}

/// Settings, unchecked, as the compiler writes them; they may change while running. [`Config`](crate::Config) holds
/// checked settings.
pub trait Settings<P: Spec>: Copy + Debug + PartialEq {
    /// First word of the code limits.
    const CODES: usize;
    /// Voltage limits and slew limit in converter codes.
    fn code_limits(&self) -> CodeLimits;
    /// From words in the order of the controller's `CONFIG_NAMES`, each within its range.
    ///
    /// # Errors
    /// The first word that is inconsistent with the others.
    fn read(p: P, words: &[u64]) -> Result<Self, ConfigError>;
    /// Writes the words in the order of the controller's `CONFIG_NAMES`.
    fn save(&self, words: &mut Writer<'_>);
}

/// Input of a tick.
pub trait Input<P: Spec>: Copy + Debug + PartialEq {
    /// From words in the order of the controller's `INPUT_NAMES`; missing words are zero.
    fn read(p: P, words: &[u64]) -> Self;
    /// From the words of a command and a target's readings. A target without a wrench sensor gives NaN for the wrench.
    fn measured(p: P, command: &[u64], gauge: &[P::Real; 6], wrench: &[P::Real; 6]) -> Self;
    /// As words in the order of the controller's `INPUT_NAMES`.
    fn save(&self, words: &mut Writer<'_>);
    /// The gauges' words.
    fn gauges(&self) -> &[P::Real; 6];
    /// The same, mutable.
    fn gauges_mut(&mut self) -> &mut [P::Real; 6];
}

/// A law that a supervisor can start, run and suspend.
///
/// Every method takes, as far as it needs them and in this order: the constants, the settings, the state or the
/// machine, and the input of the tick.
pub trait ControlLaw<P: Spec<Law = Self>>: Sized {
    /// Settings, which may change while running.
    type Settings: Settings<P>;
    /// State from tick to tick.
    type State: Copy + Debug + Snapshot;
    /// Input of a tick.
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
    /// Word of each gauge (rows) per displacement of each leg (columns) near these words, per m. For a host that
    /// simulates gauges.
    #[must_use]
    fn words_per_leg(p: P, _words: &[P::Real; 6]) -> [[P::Real; 6]; 6] {
        *p.readings_per_leg()
    }
    /// Expected reading of a gauge by the codes sent over the last interval, and the set-point of the axis or leg of
    /// that number.
    fn expected_reading(p: P, state: &Self::State, channel: usize) -> (P::Real, P::Real);
    /// Measured position of the axis or leg of that number, m or rad, and its present correction, if any. `reading` is
    /// that of its gauge.
    fn reached(state: &Self::State, channel: usize, reading: P::Real) -> (P::Real, Option<P::Real>);

    /// A tick of the law, or of its fallback; returns the status.
    fn advance(p: P, config: &Config<P>, state: &mut Self::State, fallback: Fallback, input: &Self::Input) -> u32;
    /// Sets the law's state to the machine's position. No leg moves in the first tick.
    fn enter_running(p: P, config: &Config<P>, machine: &mut Machine<P>, input: &Self::Input);
    /// A tick of the law under its supervisor; returns the status.
    #[inline]
    fn run(p: P, config: &Config<P>, machine: &mut Machine<P>, input: &Self::Input) -> u32 {
        let Machine { state, supervisor } = machine;
        Self::advance(p, config, state, supervisor.oscillation.stage, input)
    }
    /// Stops a motion under way when the law is to be suspended. Returns the status; none if nothing moves.
    #[inline]
    fn decelerate(_p: P, _config: &Config<P>, _machine: &mut Machine<P>, _input: &Self::Input) -> Option<u32> {
        None
    }
    /// Voltages that the input commands in an open drive, V.
    ///
    /// # Errors
    /// There are none, or one is not finite: the status of a tick in which the legs are held.
    #[inline]
    fn voltages(_input: &Self::Input) -> Result<&[P::Real; LEGS], u32> {
        Err(0)
    }
    /// Whether an open drive may begin: no motion is under way, and the pose is not near the end of the workspace.
    #[inline]
    fn may_drive(_p: P, _state: &Self::State) -> bool {
        true
    }
    /// Measured pose, m and rad.
    #[inline]
    fn pose(_state: &Self::State) -> [P::Real; 6] {
        [P::Real::ZERO; 6]
    }
    /// Whether the platform may leave its workspace before an open drive ends. `before`: the pose a tick ago.
    #[inline]
    fn is_near_end(_p: P, _state: &Self::State, _before: &[P::Real; 6]) -> bool {
        false
    }
    /// Measures while codes are held, driven or ramp to rest and the law is suspended. Returns the invalid gauges, bit by bit.
    fn hold(p: P, config: &Config<P>, machine: &mut Machine<P>, input: &Self::Input) -> u32;
    /// Output lines over the next interval, as bits of the status. They are low unless the law runs.
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
    /// h_d for the end of a tick, and h at its beginning, m and rad, if passes of a motion are learned from them.
    #[must_use]
    fn shown(_state: &Self::State) -> Option<[[P::Real; 6]; 2]> {
        None
    }
    /// Words of a tick's output and of the state after it, in the order of the controller's `OUTPUT_NAMES`.
    fn write_output(p: P, output: &TickOutput<P>, state: &Self::State, words: &mut [u64]);
}

/// Settings of a spec's law.
pub type SettingsOf<P> = <<P as Spec>::Law as ControlLaw<P>>::Settings;
/// State of a spec's law.
pub type StateOf<P> = <<P as Spec>::Law as ControlLaw<P>>::State;
/// Input of a tick of a spec's law.
pub type InputOf<P> = <<P as Spec>::Law as ControlLaw<P>>::Input;
