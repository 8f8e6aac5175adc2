//! The supervisor in the emitted controller: every cause in every phase, random sequences against a state machine of its own
//! text, the same bits on the emulated MCU, any input bits at all, and no jump when the law begins.

mod begin;
pub mod bench;
mod bits;
mod commissioning;
mod cross_talk;
mod document;
mod drive;
mod fuzz;
mod lost;
#[path = "../../../firmware/runtime/tests/all/supervisor/oracle.rs"]
mod oracle;
mod oscillation;
mod refusals;
mod samples;
mod sequences;
mod stops;
mod table;
mod unidentified;
mod wiring;
