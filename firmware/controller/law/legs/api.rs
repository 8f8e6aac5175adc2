//! What the crate shows at its root.

pub use crate::config::{Config, ConfigError, SetpointKind};
pub use crate::defaults::LEG_GAIN;
pub use crate::identity::{LEGS, PERIOD_SECONDS, Real, SCALAR_BITS, SPEC_DIGEST, SPEC_NAME, SPECGEN_VERSION};
pub use crate::names::DESCRIPTION;
pub use crate::state::{LegState, State};
pub use crate::step::{GAUGE_FAULT, LEG_LIMITED, SETPOINT_FAULT, STATIC_INVERSE, TickInput, TickOutput, actuate, step};
pub use crate::words::{
    COMMAND_WORDS, CONFIG_NAMES, CONFIG_WORDS, INPUT_NAMES, INPUT_WORDS, OUTPUT_NAMES, OUTPUT_WORDS, output_words,
};
pub use specgen_runtime::{CodeLimits, Law};
