//! The controller of the platform in task space: P, F and P/F.

pub mod crate_root;
pub mod task_space;
