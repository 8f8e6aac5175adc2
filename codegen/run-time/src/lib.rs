//! Runs a compiled spec as a controller without a build: the law of `specgen-law` with constants from the IR.
//!
//! ```text
//! IR ──► constants (numbers rounded as in the emitted text, sizes checked) ──► law ──► host_sim::Controller
//! ```
//! Every output, code, digest and snapshot has the bits of the emitted controller. A tick takes longer, and sizes are data: tables are
//! slices, a reversal memory has the largest permitted size but stores only as many extrema as the spec's, and optional parts can be
//! switched off.
//!
//! Both laws are compiled here in both scalars, and used through [`host_sim::controller::Engine`], so that simulations need not compile
//! them.

mod common;
mod convert;
mod engine;
mod legs;
mod memory;
mod parts;
mod platform;
#[cfg(test)]
mod tests;

use host_sim::controller::{Controller, ControllerError, Engine};
use specgen_ir::constants;
use specgen_ir::scalar::Numbers as _;
use specgen_ir::{Ir, Scalar};
use specgen_runtime::Motion;

use convert::Convert;
pub use memory::ModelLegs;

/// The controller of a compiled spec, with the spec's configuration and the power-up state.
///
/// Its constants, with tables and paths, stay in memory to the end of the process. [`Controller::fork`] shares them.
///
/// # Errors
/// The IR is not one from the compiler.
pub fn controller(ir: &Ir) -> Result<Controller, InvalidIr> {
    let engine = match ir.scalar {
        Scalar::F32 => engine::<f32>(ir)?,
        Scalar::F64 => engine::<f64>(ir)?,
    };
    Ok(Controller::of(engine)?)
}

fn engine<T: common::Number>(ir: &Ir) -> Result<Box<dyn Engine>, InvalidIr> {
    Ok(match &ir.task_space {
        Some(task) => engine::boxed(platform::constants::<T>(ir, task)?)?,
        None => engine::boxed(legs::constants::<T>(ir)?)?,
    })
}

/// The inverse dynamics of a controller at a motion, in its own arithmetic.
#[derive(Debug, Clone, PartialEq)]
pub struct Dynamics {
    /// ∂l/∂h, a row per leg: m/m, m/rad.
    pub jacobian: [[f64; 6]; 6],
    /// M(h).
    pub mass: [[f64; 6]; 6],
    /// C(h, ḣ) ḣ: N, N m.
    pub coriolis: [f64; 6],
    /// G(h): N, N m.
    pub gravity: [f64; 6],
    /// N; positive forces push the platform.
    pub leg_forces: [f64; 6],
    /// Δl from rest, m.
    pub displacements: [f64; 6],
}

/// The inverse dynamics of a compiled spec at a pose from rest (m, rad) with its first and second time derivatives, rounded to the
/// controller's arithmetic.
pub fn dynamics(ir: &Ir, motion: &Motion<f64>) -> Dynamics {
    match ir.scalar {
        Scalar::F32 => dynamics_in::<f32>(ir, motion),
        Scalar::F64 => dynamics_in::<f64>(ir, motion),
    }
}

fn dynamics_in<T: common::Number + Into<f64>>(ir: &Ir, motion: &Motion<f64>) -> Dynamics {
    let convert = &Convert::<T>::new();
    let body = constants::body(convert, &ir.dynamics);
    let [pose, rate, acceleration] = [motion.pose, motion.rate, motion.acceleration].map(|six| convert.vector(&six));
    let motion = Motion { pose, rate, acceleration };
    let six = |numbers: [T; 6]| numbers.map(Into::into);
    Dynamics {
        jacobian: body.jacobian(&pose).map(six),
        mass: body.mass_matrix(&pose).map(six),
        coriolis: six(body.coriolis(&pose, &rate)),
        gravity: six(body.gravity(&pose)),
        leg_forces: six(body.leg_forces(&motion)),
        displacements: six(body.load(&motion, None).displacement),
    }
}

/// An IR that is not one from the compiler.
#[derive(Debug, thiserror::Error)]
pub enum InvalidIr {
    /// A part of it is out of range.
    #[error("the compiled spec cannot be run: {0}")]
    Part(&'static str),
    /// Its description or configuration is invalid.
    #[error(transparent)]
    Controller(#[from] ControllerError),
}
