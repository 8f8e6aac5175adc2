//! The paper's figures and tables compared with ours: parts of a separate page.

pub mod convergence;
pub mod legs;
pub mod linear;
pub mod machining;
pub mod motion;
pub mod region;
