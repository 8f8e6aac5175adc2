//! The figures of the feasibility studies with the oracles in the loop, and the rig that runs them, in one binary.

mod legs;
mod platform;
mod rig;
