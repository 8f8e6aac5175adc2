//! Tunes gains and weights by simulating the loop with the emitted controller.
//!
//! ```text
//! spec → space (what may change) → relay test → start ─┐
//!                genetic | cma: ask ─→ feasible (margins) ─→ evaluate (simulation) ─→ tell
//!                                      └ archive: history, best, front ─→ write (spec)
//! ```
//! Settings are words of the controller's `Config`: nothing is built per candidate. A candidate that violates a margin is rejected
//! before simulation; one that reaches a limit of voltage or stroke is rejected during simulation. Neither is scored.

pub mod evaluate;
pub mod feasible;
pub mod front;
pub mod genetic;
pub mod relay;
pub mod search;
pub mod setting;
pub mod space;
pub mod write;

pub use evaluate::{Case, Conditions, Evaluation, Score, TickErrors, TrajectoryChoice};
pub use search::{Candidate, Optimiser, Search, SearchOptions};
pub use setting::Setting;
pub use space::{Space, TunedNumbers};
