//! The paper's experiments, with our results beside the printed ones.
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
