//! What several modules share.

pub mod gauges;
pub mod specs;
