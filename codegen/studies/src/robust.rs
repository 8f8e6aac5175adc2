//! Closed-loop behaviour on machines that deviate from nominal: corners and random machines within declared uncertainties.
//!
//! ```text
//! factors (spec, options, defaults) → plan: nominal, corners, random machines with a seed each → run (emitted controller) → quantiles → gate
//!                                   └ shards, each run anywhere, merged ┘
//! ```
//! Each member of a plan is a separate machine, prepared from scratch, with the spec's own settings.

pub mod deviation;
pub mod gate;
pub mod learning;
pub mod plan;
pub mod quantiles;
pub mod run;
pub mod shard;

pub use crate::factors::{self, Factor, Factors, Origin};
pub use deviation::Deviation;
pub use gate::Gate;
pub use learning::{Learning, LearningFigures};
pub use plan::{Member, Plan};
pub use run::{Figures, Outcome, Study};
pub use shard::Shard;
