//! A host that operates a machine over the link. It turns commands into requests, and keeps the link alive.
//!
//! ```text
//! text ─► Command ─► Operator ─► Session ─ link ─► device (a board at a serial port, a program at a socket)
//!                                    └─ status, every 20 ms: after 0.1 s of silence a device holds
//! ```
//! [`commands`] executes the commands of `specgen operate`, [`panel`] those of a page in the browser. [`pil`] runs the host library
//! and a device in lock-step. [`gcs`] serves the General Command Set: `input` (bytes to commands), `commands`, `stage` (servo,
//! target, limits), `server` (clients, one of which is in control). [`plant_server`] is the simulated machine with converters, and
//! [`doctor`] checks a PC for real-time operation. [`commission`] identifies a machine and its legs in place.

mod command;
pub mod commands;
pub mod commission;
pub mod doctor;
pub mod frame;
pub mod gcs;
pub mod learning;
mod line;
pub mod motion;
pub mod panel;
pub mod pil;
pub mod place;
pub mod plant_server;
pub mod samples;
mod session;
mod socket;
mod wave;

pub use command::{Command, FrameRequest, ModeRequest, WaitCondition};
pub use line::Line;
pub use session::{GAUGES, MAX_AGE, MeasuredPose, POLL_INTERVAL, Session};
pub use socket::SocketLine;
pub use wave::{WaveWords, read_wave, refused_wave};
