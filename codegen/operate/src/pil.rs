//! Processor in the loop: the program of a microcontroller controls a simulated machine. The host library gets the same inputs,
//! and the outputs are compared bit for bit in every tick.
//!
//! ```text
//! scenario ─► Lockstep ─┬─ host library ────────────────────────────────┐
//!    ▲                  └─ link ─► image in QEMU (pipes), board (serial) ┴─ equal? ─► voltages ─┐
//!    └──────────────────────────────────────── plant ◄──────────────────────────────────────────┘
//! ```

mod difference;
mod lockstep;
mod pipes;
mod plan;
mod report;
mod run;
mod serial;
mod session;
pub(crate) mod wait;

pub use difference::Difference;
pub use lockstep::{Cost, Lockstep, Stop};
pub use pipes::Pipes;
pub use plan::{Options, Run};
pub use report::Report;
pub use run::run;
pub use serial::{BAUD, SerialLine};
pub use session::{OpenError, OpenSession, open};
