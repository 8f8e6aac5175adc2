#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Control kernels that every emitted controller uses.
//!
//! Nothing here depends on a spec: sizes are const parameters and numbers come in as arguments. What depends on
//! the spec (geometry, tables, limits, the order of the stages) is emitted into the `controller` crate.
//!
//! | module | what | source |
//! |---|---|---|
//! | [`everett`] | Everett function on a grid: look-up and inverse along one branch | section 3 |
//! | [`memory`] | reversal memory: forward Preisach model, its inverse, bounded storage | section 3, operator Γ and Γ⁻¹ |
//! | [`adaptation`] | run-to-run EWMA and PCC | (AII.3), (AII.5), (AII.6) |
//! | [`dac`] | converter codes with voltage and slew limits | section 4, amplifiers |
//! | [`dynamics`] | motion of the platform to leg forces and displacements | (4), (AI.1)–(AI.17) |
//! | [`trig`] | sine and cosine by the same operations everywhere | |
//! | [`digest`] | fingerprint of the state for comparing two machines | |
//! | [`real`] | the scalar type, `f32` or `f64` | |
//!
//! Rules kept here: no panic path, no allocation, no `unsafe`, loops with a fixed bound, no `min`/`max`/`clamp`/`mul_add`
//! (their results on ±0 and NaN, or their assertions, depend on the compiler), sums in written order.

pub mod adaptation;
pub mod dac;
pub mod digest;
pub mod dynamics;
pub mod everett;
pub mod memory;
pub mod real;
pub mod trig;

pub use adaptation::{Estimate, Law};
pub use dac::{CodeLimits, Dac};
pub use digest::Digest;
pub use dynamics::{Load, Motion, Platform};
pub use everett::Everett;
pub use memory::ReversalMemory;
pub use real::Real;
