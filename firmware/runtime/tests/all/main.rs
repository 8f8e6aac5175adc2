//! The kernels of the runtime by their properties, in one binary.
#![allow(clippy::disallowed_methods, reason = "what stands in a test is emitted nowhere")]

mod adaptation;
mod attitude;
mod common;
mod control;
mod dac;
mod dac_exact;
mod preisach;
mod rate;
mod setpoint;
mod supervisor;
mod trig;
mod velocity;
mod wave;
