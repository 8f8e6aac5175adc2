//! What the crate shows at its root.

pub use crate::config::{CONFIG_NAMES, CONFIG_WORDS, Config, ConfigError};
pub use crate::defaults::LEG_GAIN;
pub use crate::description::DESCRIPTION;
pub use crate::identity::{ASSUMED, LEGS, PERIOD_SECONDS, Real, SCALAR_BITS, SPEC_DIGEST, SPEC_NAME, SPECGEN_VERSION};
pub use crate::state::{LegState, State};
pub use crate::step::{actuate, step};
pub use crate::tick::{
    COMMAND_WORDS, GAUGE_FAULT, INPUT_NAMES, INPUT_WORDS, LEG_LIMITED, OUTPUT_NAMES, OUTPUT_WORDS, PLACE_WORDS,
    SETPOINT_FAULT, STATIC_INVERSE, TickInput, TickOutput, output_words, place_words,
};
pub use specgen_runtime::{CodeLimits, Law, SetpointKind};
