//! The controller of six legs with their own gauges: hysteresis feed-forward alone.

pub mod gauges;
