//! The compiler: one spec file in, one controller crate out.
//!
//! ```text
//! spec (TOML) → model (SI, checked) → tables (identified) → ir (every constant) → emitted crate (text) → built image
//! ```
//! Each phase is a module, and data flows one way. ARCHITECTURE.md has the invariants.

pub mod budget;
pub mod cli;
pub mod compile;
pub mod diagnostic;
pub mod doctor;
pub mod emit;
pub mod everett;
pub mod identify;
pub mod interrupt;
pub mod ir;
pub mod lint;
pub mod lock;
pub mod lower;
pub mod machine;
pub mod model;
pub mod operate;
pub mod paper;
pub mod pil;
pub mod plot;
pub mod precision;
pub mod reach;
pub mod report;
pub mod reproduce;
pub mod requirements;
pub mod robust;
pub mod served;
pub mod settings;
pub mod spec;
pub mod stability;
pub mod target;
pub mod tuning;
pub mod verify;
pub mod waveform;
pub mod workspace;
