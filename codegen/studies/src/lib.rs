//! Many runs of a compiled controller against simulated machines and images.
//!
//! | module | what |
//! |---|---|
//! | [`machine`] | the simulated machine of a spec |
//! | [`tuning`] | `evaluate` scores one setting on one machine and is the base of every study; searches; the result as an edit of the spec |
//! | [`factors`], [`robust`] | what varies; corners and draws, parts of a study, quantiles, gate |
//! | [`learning`] | iterative learning: convergence, passes, update, measured response |
//! | [`lead`] | the lead of each trajectory, by the model |
//! | [`paper`], [`reproduce`] | the paper's values and its list of experiments |
//! | [`verdict`] | the first lines of `check`, the main job and the report |
//! | [`verify`] | the same input record on host and microcontroller, compared by bits, counted |

pub mod factors;
pub mod lead;
pub mod learning;
pub mod machine;
pub mod paper;
pub mod reproduce;
pub mod robust;
pub mod tuning;
pub mod verdict;
pub mod verify;
