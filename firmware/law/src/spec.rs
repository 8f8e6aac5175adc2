//! What every law has to know of a spec, and what the supervised tick has to know of a law.

use core::fmt::Debug;

use specgen_runtime::snapshot::{Sizes, Writer};
use specgen_runtime::supervisor::{Phase, Supervision, Supervisor};
use specgen_runtime::{CodeLimits, Dac, Legs, Permitted, Real, Snapshot};

use crate::memory::LegMemory;
use crate::words::WordArray;

/// Number of legs.
pub const LEGS: usize = 6;

/// Constants of a spec that both laws ask for, and the types of what has a size of its own.
pub trait Spec: Copy + Debug + PartialEq {
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
    fn permitted(&self) -> &[(Permitted<Self::Real>, usize)];
    /// How large the numbers of a state may be.
    fn sizes(&self) -> Sizes;
    /// The legs at reset.
    fn reset(&self) -> Reset<Self>;
}

/// A spec whose constants a compiler wrote, so that all sizes are known. [`controller!`](crate::controller) implements it.
pub trait Compiled: Spec {
    /// The constants.
    const CONSTANTS: Self;
    /// The spec's settings.
    const DEFAULTS: <Self::Law as ControlLaw<Self>>::Settings;
    /// Words of the settings.
    type ConfigWords: WordArray;
    /// Words of a command.
    type CommandWords: WordArray;
    /// Words of a tick's input.
    type InputWords: WordArray;
    /// Words of a tick's output.
    type OutputWords: WordArray;
    /// Words of a supervised tick's input.
    type MachineInputWords: WordArray;
    /// Words of a supervised tick's output.
    type MachineOutputWords: WordArray;
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

/// A law that a supervisor can begin, run and suspend.
///
/// Every method takes the constants, the settings, the state, the supervisor and the input of the tick, as far as it needs them, in this
/// order.
pub trait ControlLaw<P: Spec>: Sized {
    /// What may change while running.
    type Config: Copy + Debug + PartialEq;
    /// The same, unchecked.
    type Settings;
    /// What is remembered from tick to tick.
    type State: Copy + Debug + Snapshot;
    /// What a tick reads.
    type Input: Copy + Debug + PartialEq;
    /// What a tick yields.
    type Output: Copy + Debug + PartialEq;

    /// The state at reset.
    fn at_reset(reset: &Reset<P>) -> Self::State;
    /// Voltage limits and slew limit in converter codes.
    fn code_limits(config: &Self::Config) -> CodeLimits;
    /// Codes held at the outputs.
    fn codes(state: &Self::State) -> [i32; LEGS];
    /// The gauges' words.
    fn readings(input: &Self::Input) -> &[P::Real; 6];
    /// The same, to be replaced.
    fn readings_mut(input: &mut Self::Input) -> &mut [P::Real; 6];
    /// Gauges whose word is not believed: bit k for gauge k.
    fn faults(p: P, readings: &[P::Real; 6]) -> u32;
    /// What a gauge ought to read by the codes sent over the interval that has ended, and the set-point of the axis or leg of that number.
    fn expected_reading(p: P, state: &Self::State, channel: usize) -> (P::Real, P::Real);

    /// Puts the law where the machine is. No leg moves in the first tick.
    fn enter_running(
        p: P,
        config: &Self::Config,
        state: &mut Self::State,
        supervisor: &mut Supervisor<P::Real>,
        input: &Self::Input,
    );
    /// A tick of the law; its status.
    fn run(
        p: P,
        config: &Self::Config,
        state: &mut Self::State,
        supervisor: &mut Supervisor<P::Real>,
        input: &Self::Input,
    ) -> u32;
    /// The channel whose turn it is, after the law has seen the readings. Of it: what is `expected`, and its `target`.
    fn check_tracking(
        p: P,
        state: &Self::State,
        supervisor: &mut Supervisor<P::Real>,
        input: &Self::Input,
        channel: usize,
        expected: [P::Real; 2],
    );
    /// Brings a motion that was under way to rest where the law is to be suspended: the status; none where nothing moves.
    fn decelerate(
        p: P,
        config: &Self::Config,
        state: &mut Self::State,
        supervisor: &mut Supervisor<P::Real>,
        input: &Self::Input,
    ) -> Option<u32>;
    /// Codes held or on their way to rest, the law suspended. Returns the status.
    fn hold(
        p: P,
        config: &Self::Config,
        state: &mut Self::State,
        supervisor: &mut Supervisor<P::Real>,
        input: &Self::Input,
        channel: usize,
        expected: P::Real,
    ) -> u32;
    /// Output lines over the coming interval, as bits of the status. They are low unless the law runs.
    fn fire_triggers(
        p: P,
        config: &Self::Config,
        state: &mut Self::State,
        phase: Phase,
        input: &Self::Input,
        status: u32,
    ) -> u32;
    /// What goes out, of the state that the tick left.
    fn outputs(p: P, state: &Self::State, status: u32) -> Self::Output;

    /// A tick's input from its words; zero where there are none.
    fn read_input(p: P, words: &[u64]) -> Self::Input;
    /// The same of a command's words, and of readings as a target has them. One that measures no wrench gives NaN for it.
    fn measured(p: P, command: &[u64], gauge: &[P::Real; 6], wrench: &[P::Real; 6]) -> Self::Input;
    /// A tick's input as words.
    fn save_input(input: &Self::Input, words: &mut Writer<'_>);
    /// A tick's output as words, and what of the state that it left is shown.
    fn write_output(p: P, output: &Self::Output, state: &Self::State, words: &mut [u64]);
    /// Codes that go out, and the status.
    fn codes_and_status(output: &Self::Output) -> ([i32; LEGS], u32);
}

/// Settings of a spec's law.
pub type ConfigOf<P> = <<P as Spec>::Law as ControlLaw<P>>::Config;
/// State of a spec's law.
pub type StateOf<P> = <<P as Spec>::Law as ControlLaw<P>>::State;
/// What a tick of a spec's law reads.
pub type InputOf<P> = <<P as Spec>::Law as ControlLaw<P>>::Input;
/// What a tick of a spec's law yields.
pub type OutputOf<P> = <<P as Spec>::Law as ControlLaw<P>>::Output;

/// A value that a `Config` cannot hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigError {
    /// The word that is out of range, of those named by the controller's `CONFIG_NAMES`.
    pub word: usize,
}
