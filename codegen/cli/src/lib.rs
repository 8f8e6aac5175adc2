//! The `specgen` command, and re-exports of the crates that it consists of.
//!
//! ```text
//! spec (TOML) → model (SI, checked) → tables (identified) → ir (every constant) → emitted crate (text) → built image
//! ```
//! Data flows one way, and a crate depends only on crates listed before it in ARCHITECTURE.md.

pub mod cli;

pub use specgen_compiler::{
    assumed, compile, emit, findings, ir, lint, lower, precision, reach, requirements, rest, settings, stability,
    workspace,
};
pub use specgen_identify::{self as identify, everett, waveform};
pub use specgen_language::{diagnostic, files, interrupt, lock, model, outcome, shell, spec, ui};
pub use specgen_operate::{self as operate, doctor, pil, plant_server};
pub use specgen_report::{self as report, plot};
pub use specgen_run_time as run_time;
pub use specgen_studies::{lead, learning, machine, paper, reproduce, robust, tuning, verify};
pub use specgen_toolchain::{self as target, budget};
