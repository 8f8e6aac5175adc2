//! The paper beside us: what it prints, why ours differs, and its two studies that follow no trajectory: the stability
//! region of Fig. 29 and the genetic algorithm of Table 3.

pub mod convergence;
pub mod printed;
pub mod region;
pub mod remark;
