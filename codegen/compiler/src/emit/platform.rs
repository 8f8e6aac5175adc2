//! The controller of the platform in task space: P, F and P/F.

pub mod gauges;
pub mod task_space;
