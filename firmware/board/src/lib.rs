//! The common part of all boards: one control tick on real converters, its schedule, and the link commands.
//!
//! ```text
//! timer ─► Schedule ─missed─► Board::tick: Gauges ─codes─► supervise ─codes─► Amplifiers
//!                               ▲ commands, wave │ report, record
//!                               │                ▼
//! link  ◄─► Endpoint ◄─► requests ◄─► LinkHandler ◄─► Exchange
//! ```
//! The timer's interrupt owns [`Board`], the background owns the link. [`Exchange`] connects them; its lock is held
//! only for copies. The supervisor makes every decision about control: a board collects faults and reports them as
//! events.
//!
//! Nothing here allocates, panics or loops without a bound.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod catch_up;
mod cycle;
mod download;
mod exchange;
mod gather;
mod handler;
mod health;
mod learn;
mod recording;
mod report;
mod requests;
mod samples;
mod schedule;
mod source;
#[cfg(feature = "lockstep")]
mod stepper;
mod words;

pub use catch_up::catch_up;
pub use controller::COMMAND_WORDS;
pub use cycle::{Board, TargetStatus};
pub use exchange::{Access, Exchange, TickCommand};
pub use gather::gather;
pub use handler::{LinkHandler, RequestContext};
pub use health::{BACKGROUND_SILENCE, Health, RAMPED_DOWN};
pub use learn::learn;
pub use recording::MachineSnapshot;
pub use report::{Probes, Report, Stopwatch};
pub use requests::{Backend, Command, execute, pass_status, wave_refusal};
pub use samples::{SampleMemory, sample};
pub use schedule::{DueTick, Schedule};
pub use source::{EdgeCommand, Source};
pub use words::{GAUGE_BITS, PERIOD_NANOSECONDS};
