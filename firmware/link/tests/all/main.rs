//! The link under damage, message by message, in one binary.

mod damage;
mod messages;
mod panic_free;
mod pieces;
mod samples;
mod support;
