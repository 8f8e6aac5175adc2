//! The checked model to an emitted controller.
//!
//! ```text
//! model → lint, stability, requirements, demand (findings) → lower → ir (every constant) → emit (text) → workspace (folder)
//! ```

pub mod assumed;
pub mod compile;
pub mod demand;
pub mod emit;
mod figure;
#[cfg(test)]
mod golden;
pub mod lint;
pub mod lower;
pub mod precision;
pub mod reach;
pub mod requirements;
pub mod rest;
pub mod settings;
pub mod stability;
pub mod workspace;

pub use specgen_ir::{self as ir, constants, description};
