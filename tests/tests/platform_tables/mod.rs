//! The paper's Tables 5 to 9, limits of stability and behaviour in the large, from the emitted controller on simulated
//! machines out of tolerance. `cargo test --release -p specgen-tests platform_tables -- --nocapture` prints every
//! figure.

mod behaviour;
pub mod bench;
mod classes;
mod damping;
mod lead;
mod learning;
mod limits;
mod non_repeating;
mod oracle;
mod prepared;
mod response;
mod rest;
mod steps;
mod structure;
mod tables;
