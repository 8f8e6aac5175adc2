//! What all boards have in common: one control tick on real converters, when it is due, and what is said over the link.
//!
//! ```text
//! timer ─► Schedule ─missed─► Board::tick: Gauges ─codes─► supervise ─codes─► Amplifiers
//!                                  ▲ orders, wave │ report, record ▼
//! link  ◄─► Endpoint ◄─► Desk ◄── Exchange ────────────────────────┘
//! ```
//! The interrupt of the timer owns [`Board`], the background owns the link; [`Exchange`] lies between them, and is locked
//! for as long as it takes to copy what changed. Every decision about control is the supervisor's: a board collects what
//! went wrong and hands it over as events.
//!
//! Nothing here allocates, panics or loops without a bound.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod catch_up;
mod cycle;
mod desk;
mod download;
mod exchange;
mod gather;
mod health;
mod learn;
mod recording;
mod report;
mod samples;
mod schedule;
mod stepper;
mod words;

pub use catch_up::catch_up;
pub use controller::COMMAND_WORDS;
pub use cycle::{Board, TargetStatus};
pub use desk::{LinkHandler, RequestContext};
pub use exchange::{Access, Exchange, TickCommand};
pub use gather::gather;
pub use health::{BACKGROUND_SILENCE, Health, RAMPED_DOWN};
pub use learn::learn;
pub use recording::MachineSnapshot;
pub use report::{Probes, Report};
pub use samples::SampleMemory;
pub use schedule::{DueTick, Schedule};
pub use stepper::Stopwatch;
pub use words::{GAUGE_BITS, PERIOD_NANOSECONDS};
