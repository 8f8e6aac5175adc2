//! What several modules share.

pub mod exact;
pub mod gauges;
pub mod help;
pub mod specs;
