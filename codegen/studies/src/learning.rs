//! Iterative learning control of a repeated motion: after each pass, the correction that a tick adds to its request is updated from the
//! error that the gauges measured.
//!
//! ```text
//! c ← Q (c + L e)        e = h_d − h over a pass;  L = V T⁻¹ V⁻¹;  |Q| = 1/(1 + (f/f_c)⁸), without phase
//! ```
//! T is the closed loop from a correction to the gauges, by the compiler's model in modal coordinates. At each frequency, the error of a pass is
//! that of the pass before times Q (I − T_real L), so learning converges where its spectral radius is below 1. f_c is the highest
//! frequency at which this holds, with a margin, for every machine within the intervals of `[robust]`. All computation happens between
//! passes; a tick only plays a table.

mod coherence;
mod convergence;
mod excitation;
mod gain;
mod learner;
mod legs;
mod machine;
mod modes;
mod motion;
mod observation;
mod passes;
mod plan;
mod refusal;
mod response;
pub(crate) mod structure;
mod table;
mod update;

pub use convergence::{Convergence, LARGEST_RADIUS, Learnable};
pub use excitation::{Excitation, PASSES, SweepSpectra};
pub use learner::Learner;
pub use legs::HystereticLegs;
pub use machine::{LearnError, RepeatableMachine, error_by_tick, pass_timing};
pub use modes::ModeMeasurement;
pub use motion::Motion;
pub use observation::PassObservation;
pub use passes::{Ending, LearningResult, Pass, learn, measured_translation_nm};
pub use plan::Plan;
pub use refusal::{NOWHERE, larger_limit, largest_correction, takes_correction};
pub use response::{Bin, Response};
pub use structure::{Location, StructuralMode, Structure};
pub use table::{Table, TableError, knots};
pub use update::Update;
