//! The paper's whole list of experiments, ours beside the paper's.
//!
//! ```text
//! embedded (specs in the binary) → compile → emitted controllers → legs, platform (tables) ─→ table → write (md, csv, json)
//!                                                               └→ paper::region, paper::convergence
//! ```

pub mod embedded;
pub mod legs;
pub mod platform;
pub mod table;
pub mod write;
