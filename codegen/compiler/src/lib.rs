//! Compiles the checked model to an emitted controller.
//!
//! ```text
//! model → lint, stability, requirements, demand (findings) → lower → ir (every constant) → emit (text) → workspace (folder)
//! ```
//!
//! | module | what |
//! |---|---|
//! | [`compile`] | the phases in their order: start reading here |
//! | [`stability`] | legs: Jury tests and the sampled leg; platform: modes, notch, start values, closed loop, margins, refusals |
//! | [`reach`], [`demand`] | travel, workspace, bias and paths compared with the strokes; demands of motion compared with the legs |
//! | [`lint`] | values that are each in range but implausible together; each file has pages, messages and rules |
//! | [`findings`] | all codes with their pages |
//! | [`precision`] | rounding errors of the scalar: the runtime's kernels on numbers that record every operation |
//! | [`lower`], [`ir`] | every constant of the controller, computed and rounded; `specgen dump-ir` prints it |
//! | [`constants`] | constants of the IR as structs of the runtime; the emitted text is their `{:?}` |
//! | [`emit`] | IR to text, one emitter for each emitted file, no arithmetic |
//! | [`workspace`] | the output folder, written completely or not at all |
//! | [`requirements`], [`rest`] | converter steps and noise against the requirements of the spec |
//!
//! The test `golden` (`tests/all`) compares every constant, margin and finding of many specs with committed text.

pub mod assumed;
pub mod compile;
pub mod demand;
pub mod emit;
mod figure;
pub mod findings;
pub mod lint;
pub mod lower;
pub mod precision;
pub mod reach;
pub mod requirements;
pub mod rest;
pub mod settings;
pub mod spec_file;
pub mod stability;
pub mod workspace;

pub use specgen_ir::{self as ir, constants, description};
