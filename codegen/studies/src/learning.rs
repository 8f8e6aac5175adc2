//! Iterative learning of a motion that repeats: between passes the correction that a tick adds to its request is changed by what the
//! gauges showed of the error.
//!
//! ```text
//! c ← Q (c + L e)        e = h_d − h over a pass;  L = V T⁻¹ V⁻¹;  |Q| = 1/(1 + (f/f_c)⁸), without phase
//! ```
//! T is the closed loop from a correction to the gauges, of the compiler's model in modal coordinates. Per frequency the error of a pass is
//! that of the one before times Q (I − T_real L), so learning converges where its spectral radius is below 1: f_c is the highest
//! frequency at which that holds, with room, for every machine within the intervals of `[robust]`. All of it works between passes; in a
//! tick a table is played.

mod convergence;
mod excitation;
mod gain;
mod heard;
mod matrix;
mod motion;
mod passes;
mod plan;
mod refusal;
mod response;
mod seen;
mod table;
mod update;

pub use convergence::{Convergence, LARGEST_RADIUS, Learnable};
pub use excitation::{Excitation, PASSES};
pub use heard::ModeMeasurement;
pub use motion::Motion;
pub use passes::{
    Ending, LearnError, Learner, LearningResult, Pass, RepeatableMachine, course, held, learn, translation_nm,
};
pub use plan::Plan;
pub use refusal::{NOWHERE, takes_correction};
pub use response::{Bin, Response};
pub use seen::PassObservation;
pub use table::{Table, TableError, knots};
pub use update::Update;
