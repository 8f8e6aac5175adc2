//! Many runs of a compiled controller against simulated machines and images.

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
