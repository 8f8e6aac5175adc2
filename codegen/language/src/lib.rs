//! What a spec says, and what the compiler knows of it before it computes anything.
//!
//! ```text
//! TOML → spec (tables, keys, units, places) → model (SI, checked)
//!          └─ diagnostic: findings, each with its place
//! ```
//! The one crate that reads TOML. [`interrupt`] and [`lock`] are here because everything that writes needs them.

pub mod diagnostic;
pub mod interrupt;
mod keys;
pub mod lock;
pub mod model;
pub mod quantity;
mod source;
pub mod spec;

pub use source::SpecSource;
