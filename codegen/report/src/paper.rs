//! The paper's figures and tables beside ours: the parts of a page of their own.

pub mod convergence;
pub mod legs;
pub mod linear;
pub mod machining;
pub mod motion;
pub mod region;
