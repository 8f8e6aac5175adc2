//! The law of a platform in task space: (7) over the hysteresis feed-forward.

mod config;
mod constants;
mod notch;
pub mod passes;
pub mod sensing;
pub mod stages;
mod state;
pub mod step;
mod supervised;
pub mod tick;
pub mod triggers;
pub mod waves;

pub use config::{Environment, Settings};
pub use constants::{Platform, TaskSpace};
pub use state::{LegState, State};
pub use step::actuate;
pub use tick::TickInput;
