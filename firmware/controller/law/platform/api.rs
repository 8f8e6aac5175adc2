//! What the crate shows at its root.

pub use crate::config::{Config, ConfigError, Environment};
pub use crate::defaults::LEG_GAIN;
pub use crate::identity::{LEGS, PERIOD_SECONDS, Real, SCALAR_BITS, SPEC_DIGEST, SPEC_NAME, SPECGEN_VERSION};
pub use crate::names::DESCRIPTION;
pub use crate::state::{LegState, State};
pub use crate::step::{
    GAUGE_FAULT, GENERATOR_BUSY, LEG_LIMITED, SETPOINT_FAULT, SETPOINT_STALE, STATIC_INVERSE, TickInput, TickOutput,
    WRENCH_FAULT, actuate, step,
};
pub use crate::words::{
    COMMAND_WORDS, CONFIG_NAMES, CONFIG_WORDS, INPUT_NAMES, INPUT_WORDS, OUTPUT_NAMES, OUTPUT_WORDS, output_words,
};
pub use specgen_runtime::setpoint::{Command, CommandKind, Target};
pub use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction, Law};
