//! The platform as a plant: six hysteretic legs under a rigid body, measured by six gauges, pressing on a work piece.
//!
//! ```text
//! voltages ─► amplifier (lag, current) ─► stack (plays, creep, asymmetry) ─► d_i ┐ ×6
//!                                                  axial stiffness and damping ──┴─► rigid platform ◄─ work part
//!                                                       gauges ◄─ pose ─────────────────┘      └─► force sensor
//! ```
//! It shares no model with the controller. The dynamics follow from the motion of the bodies, leg lengths and gauge
//! readings from the geometry. The legs are play operators (Prandtl-Ishlinskii) with creep and a quadratic asymmetry.
//! The asymmetry breaks congruency, so that no Everett table can represent these legs. SI units; angles are those of
//! R = Rz Ry Rx.

#![allow(clippy::needless_range_loop, reason = "matrices are indexed as in their formulae")]

mod contact;
mod frames;
mod gauge;
mod geometry;
mod imperfections;
mod inertia;
mod linear;
mod long_step;
mod parameters;
mod plant;
pub mod rig;
pub mod scenario;
mod sensor;
mod specimen;
mod structure;
pub mod study;
pub mod table;

pub use contact::{Contact, WorkPart, Wrench};
pub use frames::UserFrames;
pub use gauge::{GaugeSignal, Probe};
pub use geometry::{Geometry, angles, rate_matrix, rotation};
pub use imperfections::{Cable, Imperfections, Mains, ModePlace, StructuralMode};
pub use inertia::Masses;
pub use linear::{Matrix3, Matrix6, Six, Three, exponential};
pub use parameters::{Joints, PlatformParameters, REFERENCE_PLATFORM};
pub use plant::PlatformPlant;
pub use rig::PlatformRig;
pub use scenario::PlatformScenario;
pub use sensor::ForceSensor;
pub use specimen::Specimen;
pub use structure::{Structure, StructureParameters};

/// The larger of two errors. Unlike `f64::max` it keeps a NaN, so that a test with a bound fails.
#[cfg(test)]
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || a >= b { a } else { b }
}
