//! The figures of the feasibility studies with the oracles in the loop, and the rig that runs them, in one binary.
#![allow(clippy::unwrap_used)] // Helpers of tests, where a panic is a failed test.

mod legs;
mod platform;
mod rig;
