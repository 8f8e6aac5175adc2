//! Comparison with the paper: its printed values, reasons for differences, and its two studies without a trajectory: the stability
//! region of Fig. 29 and the genetic algorithm of Table 3.

pub mod convergence;
pub mod printed;
pub mod region;
pub mod remark;
