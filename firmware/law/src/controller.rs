//! The names of an emitted controller, for targets.

/// Gives an emitted controller its public names: types and sizes of this spec, and functions that call the law with its
/// constants. Invoke it at the root of the crate, beside the modules with the constants. `platform` or `legs` selects
/// the law; the macro implements its trait with the constants. `open_drive`: no leg is identified.
///
/// The functions that run a tick are not generic, so that each is compiled once, in the controller.
#[macro_export]
macro_rules! controller {
    (platform $(, $only:ident)?) => {
        /// Words of a command: the first of an input, before the measured ones.
        pub const COMMAND_WORDS: usize = $crate::platform::tick::command_words(task_space::CORRECTED);
        /// Words of a tick's input.
        pub const INPUT_WORDS: usize = COMMAND_WORDS + 12;
        /// Words of a tick's output.
        pub const OUTPUT_WORDS: usize = $crate::platform::tick::output_words_with(defaults::LINES);
        /// Names of the input words, see `input_names` of the law.
        pub const INPUT_NAMES: [&str; INPUT_WORDS] = $crate::platform::tick::input_names();
        /// Names of the output words, see `output_names` of the law.
        pub const OUTPUT_NAMES: [&str; OUTPUT_WORDS] = $crate::platform::tick::output_names();
        /// Model of the environment that the platform presses on.
        pub type Environment = $crate::platform::Environment<Real>;

        pub use $crate::specgen_runtime::setpoint::{Command, CommandKind, Target};
        pub use $crate::specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction, Law};
        pub use $crate::status::{
            CORRECTION_LIMITED, GAUGE_FAULT, GENERATOR_BUSY, LEG_LIMITED, SETPOINT_FAULT, SETPOINT_STALE,
            STATIC_INVERSE, TRIGGER_HIGH, TRIGGER_MISSED, WRENCH_FAULT,
        };

        /// Six gauges that measure the platform: constants of the law's `platform::sensing`.
        pub mod sensing {
            pub use super::gauges::{CALIBRATION, CONVERTER, GAUGES, RATE, RAW_LIMITS};
        }

        impl $crate::platform::Platform for Constants {
            type Damping = $crate::specgen_runtime::Damping<Real, { task_space::DAMPED }>;
            type Correction = $crate::specgen_runtime::Correction<Real, { task_space::CORRECTED }>;
            type Lines = $crate::specgen_runtime::trigger::Triggers<Real, { defaults::LINES }>;
            type Frames = setpoint::UserFrames;
            type Calibration = gauges::Meaning;

            $crate::controller! { @accessors
                period -> Real = task_space::PERIOD;
                compliance -> Real = task_space::COMPLIANCE;
                wrench_to_legs -> &[[Real; 6]; LEGS] = &task_space::WRENCH_TO_LEGS;
                legs_to_wrench -> &[[Real; LEGS]; 6] = &task_space::LEGS_TO_WRENCH;
                force_to_modes -> &[[Real; 6]; 6] = &task_space::FORCE_TO_MODES;
                legs_to_modes -> &[[Real; LEGS]; 6] = &task_space::LEGS_TO_MODES;
                modes_to_legs -> &[[Real; 6]; LEGS] = &task_space::MODES_TO_LEGS;
                body -> &$crate::specgen_runtime::Platform<Real> = &body::PLATFORM;
                affine_load -> Option<&$crate::specgen_runtime::Affine<Real>> =
                    const { task_space::AFFINE_LOAD.as_ref() };
                cross_talk -> Option<&[[Real; 6]; LEGS]> = const { task_space::CROSS_TALK.as_ref() };
                rest_force -> &[Real; LEGS] = &task_space::REST_FORCE;
                wrench_limit -> &[Real; 6] = &task_space::WRENCH_LIMIT;
                lead -> Real = task_space::LEAD;
                own_leads -> &[Real] = &task_space::OWN_LEADS;
                transfer_keep -> Real = task_space::TRANSFER_KEEP;
                transfer_negligible -> Real = task_space::TRANSFER_NEGLIGIBLE;
                cells_per_metre -> Real = task_space::CELLS_PER_METRE;
                metres_per_cell -> Real = task_space::METRES_PER_CELL;
                notch -> Option<&$crate::specgen_runtime::Notch<Real>> = const { task_space::NOTCH.as_ref() };
                damping -> &[$crate::specgen_runtime::Resonator<Real>; task_space::DAMPED] = &task_space::DAMPING;
                hands_over -> bool = task_space::HANDS_OVER;
                correction -> &[$crate::specgen_runtime::CorrectionLimit<Real>; task_space::CORRECTED] = &task_space::CORRECTION;
                lines -> &[$crate::specgen_runtime::trigger::Line<Real>; defaults::LINES] = &defaults::TRIGGERS;
                setpoints -> &$crate::specgen_runtime::setpoint::Setpoints<Real, setpoint::UserFrames> = &setpoint::SETPOINTS;
                gauges -> &$crate::specgen_runtime::Gauges<'_, Real> = &gauges::GAUGES;
                calibration -> Option<&gauges::Meaning> = const { gauges::CALIBRATION.as_ref() };
                rate_filter -> &$crate::specgen_runtime::RateFilter<Real> = &gauges::RATE;
            }
        }

        $crate::controller!(@both platform TaskSpace, super::task_space::CORRECTED != 0, [super::defaults::LINES, super::defaults::INPUT] $($only)?);
    };
    (legs) => {
        pub use $crate::legs::tick::{COMMAND_WORDS, INPUT_NAMES, INPUT_WORDS, OUTPUT_NAMES, OUTPUT_WORDS};
        pub use $crate::specgen_runtime::{CodeLimits, Law, SetpointKind};
        pub use $crate::status::{GAUGE_FAULT, LEG_LIMITED, SETPOINT_FAULT, STATIC_INVERSE};

        /// Readings of the legs' own gauges.
        pub mod sensing {
            pub use super::gauges::{CONVERTER, LEG_SETPOINT, RAW_LIMITS};
        }

        impl $crate::legs::SixLegs for Constants {
            type Lead = $crate::legs::Lead<Real, { hysteresis::LED as usize }>;
            type Change = $crate::legs::Change<Real, { hysteresis::BENT as usize }>;

            $crate::controller! { @accessors
                lead -> Real = hysteresis::LEAD;
                lag -> Real = hysteresis::LAG;
                bend -> Real = hysteresis::BEND;
                gain_growth -> Real = hysteresis::GAIN_GROWTH;
                lead_limit -> Real = hysteresis::LEAD_LIMIT;
                leg_setpoint -> &[Real; 2] = &gauges::LEG_SETPOINT;
                leg_gain -> Real = defaults::LEG_GAIN;
                period_seconds -> f64 = PERIOD_SECONDS;
                approach_keep -> Real = supervision::APPROACH_KEEP;
                approach_negligible -> Real = supervision::APPROACH_NEGLIGIBLE;
            }
        }

        $crate::controller!(@both legs LegSpace, false, [0, false]);
    };
    (@both $law:ident $kind:ident, $corrects:expr, [$lines:expr, $input:expr] $($only:ident)?) => {
        pub use defaults::LEG_GAIN;
        pub use identity::{
            ASSUMED, Constants, DESCRIPTION, LEGS, PERIOD_SECONDS, Real, SCALAR_BITS, SPEC_DIGEST, SPEC_NAME, SPECGEN_VERSION,
        };
        pub use $crate::ConfigError;
        pub use $crate::$law::tick::PLACE_WORDS;

        /// Settings, which may change while running.
        pub type Config = $crate::Config<Constants>;
        /// State of the controller from tick to tick.
        pub type State = $crate::$law::State<Constants>;
        /// State of one leg.
        pub type LegState = $crate::$law::LegState<Constants>;
        /// Input of a tick.
        pub type TickInput = $crate::$law::TickInput<Constants>;
        /// Output of a tick.
        pub type TickOutput = $crate::TickOutput<Constants>;

        /// Words of the settings.
        pub const CONFIG_WORDS: usize = permitted::WORDS;
        /// Names of the settings.
        pub const CONFIG_NAMES: [&str; CONFIG_WORDS] = permitted::NAMES;

        impl $crate::Spec for Constants {
            type Real = Real;
            type Law = $crate::$law::$kind;
            type Table = hysteresis::Table;
            type Memory = hysteresis::Memory;

            $crate::controller! { @accessors
                tables -> &[hysteresis::Table; LEGS] = &hysteresis::TABLES;
                dac -> &$crate::specgen_runtime::Dac<Real> = &limits::DAC;
                supervision -> &$crate::specgen_runtime::supervisor::Supervision<Real> = &supervision::SUPERVISION;
                raw_limits -> &[[Real; 2]; 6] = &gauges::RAW_LIMITS;
                readings_per_leg -> &[[Real; LEGS]; 6] = &supervision::READINGS_PER_LEG;
                geometry -> &$crate::specgen_runtime::Legs<'_, Real> = &geometry::GEOMETRY;
                inverse_jacobian -> &[[Real; LEGS]; 6] = &geometry::INVERSE_JACOBIAN;
                corrections -> usize = geometry::CORRECTIONS;
                pose_bound -> &[Real; 6] = &geometry::POSE_BOUND;
                permitted -> &[($crate::specgen_runtime::PermittedRange<Real>, usize)] = &permitted::SETTINGS;
                sizes -> $crate::specgen_runtime::snapshot::Sizes = permitted::STATE;
                reset -> $crate::Reset<Self> = supervision::at_rest();
                is_identified -> bool = supervised::IDENTIFIED;
            }
        }

        impl $crate::ConstSpec for Constants {
            const CONSTANTS: Self = Self;
            const DEFAULTS: $crate::$law::Settings<Self> = defaults::DEFAULTS;
            type ConfigWords = [u64; CONFIG_WORDS];
            type CommandWords = [u64; COMMAND_WORDS];
            type InputWords = [u64; INPUT_WORDS];
            type MachineInputWords = [u64; supervised::MACHINE_INPUT_WORDS];
            type MachineWords = [u64; snapshot::MACHINE_STATE_WORDS];
        }

        /// The state at reset.
        #[must_use]
        pub const fn state_at_reset() -> State {
            State::new(&supervision::at_rest())
        }

        /// One control tick. See `step` of the law for the timing.
        pub fn step(config: &Config, state: &mut State, input: &TickInput) -> TickOutput {
            $crate::supervise::step(Constants, config, state, input)
        }

        /// Words in the order of [`OUTPUT_NAMES`], from a tick's output and the state after it.
        #[must_use]
        pub fn output_words(output: &TickOutput, state: &State) -> [u64; OUTPUT_WORDS] {
            let mut words = [0; OUTPUT_WORDS];
            $crate::$law::tick::write_output(Constants, output, state, &mut words);
            words
        }

        /// Word of each gauge (rows) per displacement of each leg (columns) near these words, per m.
        #[must_use]
        pub fn words_per_leg(gauges: &[Real; 6]) -> [[Real; 6]; 6] {
            <<Constants as $crate::Spec>::Law as $crate::ControlLaw<Constants>>::words_per_leg(Constants, gauges)
        }

        /// Pose and set-point, see `place_words` of the law.
        #[must_use]
        pub fn place_words(state: &State) -> [u64; PLACE_WORDS] {
            $crate::$law::tick::place_words(Constants, state)
        }

        /// The control law under its supervisor: every target calls this.
        pub mod supervised {
            use super::{COMMAND_WORDS, Config, Constants, INPUT_NAMES, INPUT_WORDS, OUTPUT_NAMES, OUTPUT_WORDS, Real};

            pub use $crate::specgen_runtime::supervisor::{
                AMPLIFIER, CONVERTER, Cause, Fallback, Finding, INTEGRITY, LINK_LOST, MISSED_TICK, Phase, Request,
                SAMPLE_REPEATED, SAMPLE_REPLACED, STALLED, STOP,
            };

            /// State of the supervisor in this controller's arithmetic.
            pub type Supervisor = $crate::specgen_runtime::supervisor::Supervisor<Real>;
            /// The whole state from tick to tick.
            pub type Machine = $crate::Machine<Constants>;
            /// Input of a supervised tick.
            pub type MachineInput = $crate::MachineInput<Constants>;
            /// Output of a supervised tick.
            pub type MachineOutput = $crate::MachineOutput<Constants>;

            /// Whether the legs are identified. Otherwise there is only the open drive, and `run` is refused.
            pub const IDENTIFIED: bool = $crate::controller!(@identified $($only)?);
            /// Words of a supervised tick's input.
            pub const MACHINE_INPUT_WORDS: usize = INPUT_WORDS + 2;
            /// Words of a supervised tick's output.
            pub const MACHINE_OUTPUT_WORDS: usize = OUTPUT_WORDS + 2;
            /// Names of the input words. `request` is 0 none, 1 arm, 2 run, 3 hold, 4 ramp down, 5 acknowledge, 6 open
            /// drive.
            /// `events` is a set of bits.
            pub const MACHINE_INPUT_NAMES: [&str; MACHINE_INPUT_WORDS] =
                $crate::followed_by(&INPUT_NAMES, ["request", "events"]);
            /// Names of the output words. `supervisor` is phase | cause << 8 | amplifier on << 16 | finding of the
            /// wiring check or fallback stage of the law << 17. `conditions` has bit 1 << cause for each cause that is
            /// present, debounced or not; from bit 16 on the gauges or legs concerned; from bit 22 on the gauges whose
            /// words were replaced by predictions. Bit 28 is cause 16, bits 29 and 30 are the fallback stage, bit 31 is
            /// cause 17, bit 0 is cause 18, see [`Fallback`].
            pub const MACHINE_OUTPUT_NAMES: [&str; MACHINE_OUTPUT_WORDS] =
                $crate::followed_by(&OUTPUT_NAMES, ["supervisor", "conditions"]);

            /// The machine at reset: disarmed.
            #[must_use]
            pub const fn machine_at_reset() -> Machine {
                Machine::new(super::state_at_reset())
            }

            /// The input of a tick, from the command and the measured values. A target without a wrench sensor gives
            /// NaN for the wrench.
            #[must_use]
            pub fn measured_input(
                command: &[u64; COMMAND_WORDS],
                gauge: &[Real; 6],
                wrench: &[Real; 6],
                request: Request,
                events: u32,
            ) -> MachineInput {
                MachineInput::measured(command, gauge, wrench, request, events)
            }

            /// Words in the order of [`MACHINE_OUTPUT_NAMES`], from a tick's output and the machine after it.
            #[must_use]
            pub fn machine_output_words(output: &MachineOutput, machine: &Machine) -> [u64; MACHINE_OUTPUT_WORDS] {
                let mut words = [0; MACHINE_OUTPUT_WORDS];
                $crate::write_machine_output(Constants, output, machine, &mut words);
                words
            }

            /// One supervised tick.
            ///
            /// Events and the request act in this tick. Readings act in the next one, after the law has seen them.
            pub fn supervise(config: &Config, machine: &mut Machine, input: &MachineInput) -> MachineOutput {
                $crate::supervise::supervise(Constants, config, machine, input)
            }
        }

        /// The machine as 64-bit words and back, and the supervised tick with a recorder.
        ///
        /// A record of [`supervise_recorded`](snapshot::supervise_recorded) replays bit for bit from any block:
        /// `specgen replay`.
        pub mod snapshot {
            use super::supervised::{MACHINE_INPUT_WORDS, Machine, MachineInput, MachineOutput, supervise};
            use super::{CONFIG_WORDS, Config};
            use $crate::specgen_runtime::record::Layout;
            use $crate::specgen_runtime::recorder::Recorder;
            use $crate::specgen_runtime::snapshot::Field;

            pub use $crate::specgen_runtime::recorder;
            pub use $crate::specgen_runtime::snapshot::InvalidState;

            /// Words of a [`Machine`].
            pub const MACHINE_STATE_WORDS: usize = Machine::WORDS;
            /// Words of this controller's records.
            pub const RECORD_LAYOUT: Layout =
                Layout { config: CONFIG_WORDS, input: MACHINE_INPUT_WORDS, state: MACHINE_STATE_WORDS };

            /// [`supervise`] with a recorder.
            pub fn supervise_recorded(
                config: &Config,
                machine: &mut Machine,
                input: &MachineInput,
                recorder: &mut Recorder<'_>,
            ) -> MachineOutput {
                record_before(config, machine, recorder);
                let output = supervise(config, machine, input);
                record_after(machine, input, &output, recorder);
                output
            }

            /// The recorder's part before a tick with these settings.
            #[inline]
            pub fn record_before(config: &Config, machine: &Machine, recorder: &mut Recorder<'_>) {
                if recorder.opens() {
                    open_block(config, machine, recorder);
                }
            }

            #[inline(never)]
            fn open_block(config: &Config, machine: &Machine, recorder: &mut Recorder<'_>) {
                recorder.open_with(&config.to_words(), || digest(machine), |words| machine.save_into(words));
            }

            /// [`Machine::digest`], compiled here.
            #[must_use]
            pub fn digest(machine: &Machine) -> u64 {
                machine.digest()
            }

            /// [`Machine::save_piece`], compiled here.
            pub fn save_piece(machine: &Machine, first: usize, words: &mut [u64]) {
                machine.save_piece(first, words);
            }

            /// The recorder's part after the tick. Compiled here, for speed, and with its own stack frame, which is
            /// released before the law needs the stack.
            #[inline(never)]
            pub fn record_after(
                machine: &Machine,
                input: &MachineInput,
                output: &MachineOutput,
                recorder: &mut Recorder<'_>,
            ) {
                $crate::snapshot::record_after(machine, input, output, recorder);
            }
        }

        /// Whether tables and settings in memory are as the compiler wrote them.
        pub mod integrity {
            use super::Config;
            use super::checked::add_tables;
            use core::hint::black_box;

            pub use super::checked::{CRC, IDENTITY, SETTINGS};

            /// The spec's settings in memory, which [`intact`] checks: the settings at start. Invalid words give
            /// `Config::new()`; [`intact`] is then false.
            #[must_use]
            pub fn config() -> Config {
                Config::from_words(black_box(&SETTINGS)).unwrap_or_default()
            }

            /// CRC-32 of identity, tables, trajectories and settings as they are in memory now.
            #[must_use]
            pub fn computed() -> u32 {
                $crate::integrity::computed(&IDENTITY, add_tables, &SETTINGS)
            }

            /// Whether nothing has changed since the compiler wrote it. A target checks this once, before it switches
            /// the amplifiers on.
            #[must_use]
            pub fn intact() -> bool {
                computed() == black_box(CRC)
            }
        }

        /// A wave in place of the host's set-points.
        pub mod waves {
            pub use $crate::$law::waves::{drive_limits, limits, may_begin, may_drive, rest, write};

            /// The wave generator of this controller.
            pub type Wave = $crate::specgen_runtime::wave::Wave<super::Real>;
        }

        /// A pass of a repeated motion.
        pub mod passes {
            use super::{COMMAND_WORDS, Constants, Real, State};
            use $crate::ControlLaw as _;

            pub use $crate::platform::passes::{begin, write};

            /// Whether this controller takes a correction, which passes need.
            pub const POSSIBLE: bool = $corrects;

            /// Whether a pass may begin with the next tick, see `may_begin` of the law.
            #[must_use]
            pub fn may_begin(status: u32, words: &[u64]) -> bool {
                POSSIBLE && $crate::platform::passes::may_begin(status, words)
            }

            /// Result of a tick: h_d for its end, and h at its beginning, m and rad.
            #[must_use]
            pub fn shown(state: &State) -> Option<[[Real; 6]; 2]> {
                <Constants as $crate::Spec>::Law::shown(state)
            }

            /// Writes a correction of zero.
            pub fn end(words: &mut [u64; COMMAND_WORDS]) {
                $crate::platform::passes::end::<Real>(words);
            }
        }

        /// Digital lines.
        pub mod triggers {
            pub use $crate::specgen_runtime::trigger::{Direction, HIGH, Kind, Line, MISSED, MOST, lines};

            /// Output lines of this controller.
            pub const LINES: usize = $lines;
            /// Whether it has an input line.
            pub const INPUT: bool = $input;
        }

        /// Parts of the tick as separate functions, to measure their cost. The tick does not use them.
        #[cfg(feature = "stages")]
        pub mod stages {
            use super::{Config, Constants, State, TickInput};

            pub use $crate::$law::stages::STAGE_COUNT;

            /// A part of the tick.
            pub type Stage = $crate::Stage<Constants>;

            /// All stages, in the order of the tick. A static, so that they are compiled here and share code with the
            /// tick.
            pub static STAGES: [Stage; STAGE_COUNT] = $crate::$law::stages::stages();

            /// Prepares a copy of the state for the stages; not measured.
            pub fn prepare(config: &Config, state: &mut State, input: &TickInput) {
                $crate::$law::stages::prepare(Constants, config, state, input);
            }
        }
    };
    (@identified) => {
        true
    };
    (@identified open_drive) => {
        false
    };
    (@accessors $($name:ident -> $type:ty = $value:expr;)+) => {
        $(
            #[inline(always)]
            fn $name(&self) -> $type {
                $value
            }
        )+
    };
}
