//! The law of six legs with their own gauges: the hysteresis feed-forward of the paper, fed by the leg kinematics.

mod config;
mod constants;
mod lead;
pub mod stages;
mod state;
pub mod step;
mod supervised;
pub mod tick;
pub mod waves;

pub use config::Settings;
pub use constants::{LegSpace, SixLegs};
pub use lead::{Change, DeadTimeLead, LastChange, Lead};
pub use state::{LegState, State};
pub use step::actuate;
pub use tick::TickInput;
