//! A board on made-up converters, in one binary.

#[path = "../../../../tests/tests/board_support/mod.rs"]
mod board_support;
mod cycle;
mod handler;
mod link;
mod record;
mod samples;
mod schedule;
