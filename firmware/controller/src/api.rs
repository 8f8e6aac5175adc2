// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! What the crate shows at its root.

pub use crate::config::{CONFIG_NAMES, CONFIG_WORDS, Config, ConfigError, Environment};
pub use crate::defaults::LEG_GAIN;
pub use crate::description::DESCRIPTION;
pub use crate::identity::{ASSUMED, LEGS, PERIOD_SECONDS, Real, SCALAR_BITS, SPEC_DIGEST, SPEC_NAME, SPECGEN_VERSION};
pub use crate::state::{LegState, State};
pub use crate::step::{actuate, step};
pub use crate::tick::{
    COMMAND_WORDS, CORRECTION_LIMITED, GAUGE_FAULT, GENERATOR_BUSY, INPUT_NAMES, INPUT_WORDS, LEG_LIMITED,
    OUTPUT_NAMES, OUTPUT_WORDS, PLACE_WORDS, SETPOINT_FAULT, SETPOINT_STALE, STATIC_INVERSE, TRIGGER_HIGH,
    TRIGGER_MISSED, TickInput, TickOutput, WRENCH_FAULT, output_words, place_words,
};
pub use specgen_runtime::setpoint::{Command, CommandKind, Target};
pub use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction, Law};
