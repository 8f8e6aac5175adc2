//! Runs compiled controllers on simulated machines and images, and implements the commands that build or write one.
//!
//! | module | content |
//! |---|---|
//! | [`build`], [`firmware`] | the main command; an image for one target: build, size, flash |
//! | [`check`], [`details`] | findings and verdict of a spec; all its properties |
//! | [`export`] | the controller as C library, Python module and FMI unit |
//! | [`begin`] | a new spec from a few answers |
//! | [`controllers`], [`trajectory`], [`runs`] | which controller runs which trajectory, and errors on board |
//! | [`machine`], [`identified`], [`reversal_curves`] | the simulated machine of a spec; with its identified legs; the record of a leg |
//! | [`dynamics`] | M, C, G, J and leg forces at given states |
//! | [`tuning`] | `evaluate` scores a setting on a machine and underlies every study; searches; the result as an edit of the spec |
//! | [`factors`], [`robust`] | uncertain parameters; corners and random machines, shards, quantiles, gate |
//! | [`learning`], [`lessons`] | iterative learning: convergence, passes, update, measured response; the command `learn` |
//! | [`open_response`] | lag, modes and damping of a machine from sweeps of its legs in open drive |
//! | [`lead`] | the lead of each trajectory, by the model |
//! | [`paper`], [`reproduce`] | the paper's printed values and its experiments |
//! | [`verdict`] | the first lines of `check`, the main command and the report |
//! | [`verify`] | the same input record on host and microcontroller, compared bit by bit, with instruction counts |

pub mod begin;
pub mod build;
pub mod check;
pub mod controllers;
pub mod design;
pub mod details;
pub mod dynamics;
pub mod export;
pub mod factors;
pub mod firmware;
pub mod identified;
pub mod lead;
pub mod learning;
pub mod lessons;
pub mod machine;
pub mod open_response;
pub mod paper;
pub mod reproduce;
pub mod reversal_curves;
pub mod robust;
pub mod runs;
pub mod trajectory;
pub mod tuning;
pub mod verdict;
pub mod verify;
