//! The General Command Set 2.0, which programs for piezo stages and hexapods speak, over TCP: a bridge on the link.
//!
//! ```text
//! clients ─ TCP ─► Input ─ lines, single bytes ─► commands ─► Stage ─ Session ─ link ─► device
//!                                                              └─ asked at least every 20 ms, whatever clients do
//! ```
//! What is understood, and how it differs, is in `docs/gcs.md`. One client has the orders; every client may look, and stop.

mod axes;
mod code;
mod commands;
mod input;
mod server;
mod stage;
#[cfg(test)]
mod tests;

pub use axes::Axes;
pub use server::Bridge;
pub use stage::Stage;
