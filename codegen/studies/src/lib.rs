//! Runs of a compiled controller against simulated machines and images, and the jobs of commands that build or write one.
//!
//! | module | what |
//! |---|---|
//! | [`build`], [`firmware`] | the main job; an image for one target: build, size, flash |
//! | [`check`], [`details`] | findings and verdict of a spec; all that is known of it |
//! | [`export`] | the controller in C and Python, and as a unit of FMI |
//! | [`begin`] | a new spec from some answers |
//! | [`controllers`], [`trajectory`], [`runs`] | what is run, what is followed, and errors on board |
//! | [`machine`], [`reversal_curves`] | the simulated machine of a spec; the record of a leg |
//! | [`dynamics`] | M, C, G, J and leg forces at given states |
//! | [`tuning`] | `evaluate` scores one setting on one machine and is the base of every study; searches; the result as an edit of the spec |
//! | [`factors`], [`robust`] | what varies; corners and draws, parts of a study, quantiles, gate |
//! | [`learning`], [`lessons`] | iterative learning: convergence, passes, update, measured response; the job of `learn` |
//! | [`lead`] | the lead of each trajectory, by the model |
//! | [`paper`], [`reproduce`] | the paper's values and its list of experiments |
//! | [`verdict`] | the first lines of `check`, the main job and the report |
//! | [`verify`] | the same input record on host and microcontroller, compared by bits, counted |

pub mod begin;
pub mod build;
pub mod check;
pub mod controllers;
pub mod details;
pub mod dynamics;
pub mod export;
pub mod factors;
pub mod firmware;
pub mod lead;
pub mod learning;
pub mod lessons;
pub mod machine;
pub mod paper;
pub mod reproduce;
pub mod reversal_curves;
pub mod robust;
pub mod runs;
pub mod trajectory;
pub mod tuning;
pub mod verdict;
pub mod verify;
