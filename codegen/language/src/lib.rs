//! The language of a spec, and everything that is known of a spec before any computation.
//!
//! ```text
//! TOML → spec (tables, keys, units, places) → model (SI, checked)
//!          └─ diagnostic: findings, each with its place
//! ```
//! [`model`] declares each section of a spec once, keys and fields together. Parsing, checks, JSON Schema and the reference of keys in
//! [`spec`] follow from these declarations; `keys/declare.rs` has their form. The pages of the findings are in `findings/`.
//!
//! The one crate that reads TOML. What every later crate needs is here, too: [`files`], [`output`], [`interrupt`] and [`lock`] to read
//! and write files, [`outcome`], [`ui`] and [`table`] for the results of commands, [`editor`] for what editors ask, [`shell`] for lines of a shell in messages.

pub mod arrays;
pub mod diagnostic;
pub mod editor;
pub mod files;
pub mod interrupt;
mod keys;
mod lines;
pub mod lock;
pub mod model;
mod named;
pub mod outcome;
pub mod output;
pub mod quantity;
pub mod shell;
mod source;
pub mod spec;
pub mod table;
pub mod ui;

pub use source::SpecSource;
