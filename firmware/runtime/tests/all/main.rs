//! The kernels of the runtime by their properties, in one binary.

mod adaptation;
mod attitude;
mod common;
mod control;
mod dac;
mod preisach;
mod rate;
mod setpoint;
mod supervisor;
mod trig;
mod velocity;
mod wave;
