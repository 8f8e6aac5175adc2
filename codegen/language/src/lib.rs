//! What a spec says, and what the compiler knows of it before it computes anything.
//!
//! ```text
//! TOML → spec (tables, keys, units, places) → model (SI, checked)
//!          └─ diagnostic: findings, each with its place
//! ```
//! [`model`] declares each section of a spec once, keys and fields together. Parsing, checks, JSON Schema and the reference of keys in
//! [`spec`] follow from these declarations; `keys/declare.rs` has their form. The pages of the findings are in `findings/`.
//!
//! The one crate that reads TOML. [`files`], [`interrupt`] and [`lock`] are here because everything that reads or writes needs
//! them, [`shell`] because messages of every crate print lines for one.

pub mod diagnostic;
pub mod files;
pub mod interrupt;
mod keys;
pub mod lock;
pub mod model;
pub mod quantity;
pub mod shell;
mod source;
pub mod spec;

pub use source::SpecSource;
