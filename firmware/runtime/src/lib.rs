#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
//! Control kernels that every emitted controller uses.
//!
//! Nothing here depends on a spec: sizes are const parameters, and numbers are arguments. The emitted `controller`
//! crate contains the spec's geometry, tables and limits.
//!
//! | module | what | source |
//! |---|---|---|
//! | [`everett`] | Everett function on a grid: look-up and inverse along one branch | section 3 |
//! | [`memory`] | reversal memory: forward Preisach model, its inverse, bounded storage | section 3, operator Γ and Γ⁻¹ |
//! | [`dynamic`] | rate-dependent model and inverse: a second weight times the rate of the drive | section 3, (6) |
//! | [`creep`] | rate dependence as creep behind the static model, and its inverse | |
//! | [`bouc_wen`] | a Bouc-Wen state beside the table, a read-out and creep, and their inverse | |
//! | [`plays`] | plays that widen with the rate, in place of the table | |
//! | [`adaptation`] | run-to-run EWMA and PCC | (AII.3), (AII.5), (AII.6) |
//! | [`mode`] | P, F, P/F; where the interaction force comes from | section 4 |
//! | [`feedback`] | position feedback with anti-windup | (7) |
//! | [`correction`] | what was learned or prepared for a motion, added to the request | |
//! | [`motion`] | pose, rate and acceleration | |
//! | [`damping`] | active damping of the platform's modes | |
//! | [`notch`] | modal notch of the feedback | |
//! | [`transfer`] | bumpless change of mode | |
//! | [`setpoint`] | bias, moves, trajectories, streams; user frames | section 4, trajectories |
//! | [`linear`] | six-vectors and constant maps | |
//! | [`dac`] | converter codes with voltage and slew limits | section 4, amplifiers |
//! | [`attitude`] | R = Rz Ry Rx by sine and versine; rates of its angles and angular velocity | (AI.1) |
//! | [`kinematics`] | pose to leg displacements in difference form, and back | (1), (2), (AI.2)–(AI.4) |
//! | [`sensing`] | pose from six gauges that see the platform | section 4 |
//! | [`velocity`] | rate of the measured pose, filtered | (7), k_v |
//! | [`dynamics`] | motion of the platform to leg forces and displacements | (4), (AI.1)–(AI.17) |
//! | [`trig`] | sine and cosine by the same operations everywhere | |
//! | [`crc`] | checksum of tables and settings in memory | |
//! | [`supervisor`] | phases of the machine, causes of faults | |
//! | [`digest`] | fingerprint of the state for comparing two machines | |
//! | [`snapshot`] | a state as words and back, checked | |
//! | [`wave`] | set-points on board: sine, chirp, multisine, reversal curves | |
//! | [`trigger`] | output lines at positions, levels, in motion, at set-points and ticks | |
//! | [`playback`] | a table of corrections, interpolated | |
//! | [`pending`] | what waits for the rising edge of the input line | |
//! | [`pass`] | a motion that repeats: its correction played, its error kept | |
//! | [`recorder`], [`record`] | ticks kept in fixed memory, and the format they leave in | |
//! | [`real`] | the scalar type, `f32` or `f64` | |
//!
//! Rules kept here: no panic path, no allocation, no `unsafe`, loops with a fixed bound, no `min`/`max`/`clamp`/`mul_add`
//! (their results on ±0 and NaN, or their assertions, depend on the compiler), sums in written order.

pub mod adaptation;
pub mod attitude;
pub mod bouc_wen;
mod choice;
mod constants;
pub mod correction;
pub mod crc;
pub mod creep;
pub mod dac;
pub mod damping;
pub mod digest;
pub mod dynamic;
pub mod dynamics;
pub mod everett;
pub mod feedback;
mod field;
pub mod kinematics;
pub mod learning;
pub mod linear;
pub mod memory;
pub mod mode;
pub mod motion;
pub mod notch;
pub mod pass;
pub mod pending;
pub mod permitted;
pub mod playback;
pub mod plays;
pub mod real;
pub mod record;
pub mod recorder;
pub mod sensing;
pub mod setpoint;
pub mod snapshot;
pub mod supervisor;
pub mod transfer;
pub mod trig;
pub mod trigger;
pub mod velocity;
pub mod wave;

pub use adaptation::{Estimate, Law};
pub use attitude::{Attitude, Series};
pub use bouc_wen::{BoucWen, BoucWenEverett, BoucWenMemory, LegModelMemory, WidenedMemory};
pub use correction::{Correction, CorrectionLimit, RequestCorrection};
pub use crc::Crc32;
pub use creep::{Creep, CreepEverett, CreepMemory};
pub use dac::{CodeLimits, Dac};
pub use damping::{Damping, ModalDamping, Resonator};
pub use digest::Digest;
pub use dynamic::{DynamicEverett, DynamicMemory};
pub use dynamics::{Affine, Load, Platform};
pub use everett::{Everett, Grid, LastLine, Nodes};
pub use feedback::{Gains, Integral};
pub use kinematics::Legs;
pub use memory::{DriveMemory, HysteresisMemory, ReversalMemory};
pub use mode::{ControlMode, Interaction, SetpointKind};
pub use motion::Motion;
pub use notch::{Notch, NotchState, Section};
pub use permitted::PermittedRange;
pub use plays::{PlayMemory, Plays};
pub use real::Real;
pub use recorder::Recorder;
pub use sensing::{Calibration, GaugeCalibration, GaugeConverter, Gauges};
pub use snapshot::Snapshot;
pub use transfer::Transfer;
pub use velocity::{Rate, RateFilter};
pub use wave::Wave;
