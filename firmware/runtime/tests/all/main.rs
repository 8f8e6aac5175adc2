//! The kernels of the runtime by their properties, in one binary.
#![allow(clippy::disallowed_methods, reason = "what stands in a test is emitted nowhere")]

mod adaptation;
mod attitude;
mod common;
mod control;
mod dac;
mod dac_exact;
mod dynamics;
mod geometry;
mod grid;
mod learning;
mod owing;
mod plays;
mod preisach;
mod rate;
mod real;
mod recorder;
mod setpoint;
mod snapshot;
mod supervisor;
mod trig;
mod trigger;
mod velocity;
mod wave;
