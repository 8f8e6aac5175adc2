//! Link between a controller and a host, the same over a serial line and over the pipes of an emulator.
//!
//! ```text
//! request ─postcard→ message ─┬ header, CRC-32C ─COBS→ frame, 0x00 ─► Endpoint ─► Device (the controller's program)
//! Client ◄─ reply ◄───────────┴──────────────────────────────────◄──────┘
//! ```
//! The host asks, the device answers. One request is under way at a time; the device sends only telemetry by itself.
//! Everything is in fixed memory; nothing allocates, nothing can panic. A damaged frame is counted and dropped as a
//! whole. A repeated request is answered again, not executed again.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]

#[cfg(feature = "std")]
extern crate std;

mod bytes;
#[cfg(feature = "std")]
pub mod client;
mod counters;
mod endpoint;
mod frame;
pub mod lockstep;
mod message;
mod receiver;
pub mod reset_cause;
pub mod samples;
mod silence;

pub use bytes::{Bytes, KNOT, KNOTS, WORDS, put_knots, put_words};
pub use counters::Counters;
pub use endpoint::{Device, Endpoint, telemetry};
pub use frame::{Damage, FRAME, Header, Kind, MESSAGE, VERSION};
pub use message::{
    CostUnit, EdgeStatus, Health, Identity, PassAction, PassStatus, RecorderAction, RecorderStatus, Refusal, Reply,
    Request, Stage, Status, WaveAction,
};
pub use receiver::Receiver;
pub use silence::Silence;
