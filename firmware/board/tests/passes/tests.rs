//! A board whose controller takes a correction and has an input line, in one binary.

// Under the name that the tests of every board use.
extern crate specgen_board_passes as specgen_board;

#[path = "../../../../tests/tests/board_support/mod.rs"]
mod board_support;
mod correction;
mod edge;
#[path = "../all/record.rs"]
mod record;
#[path = "../all/samples.rs"]
mod samples;

use controller::supervised::Machine;
use specgen_board::{Exchange, LinkHandler, RequestContext, Stopwatch};
use specgen_link::{Device, Reply, Request};

/// Asks without the link, whoever has the session, and looks at the answer.
fn ask<R>(
    exchange: &mut Exchange,
    machine: &mut Machine,
    request: Request<'_>,
    look: impl FnOnce(Reply<'_>) -> R,
) -> R {
    let mut with = |action: &mut dyn FnMut(&mut Exchange, &mut Machine)| action(exchange, machine);
    look(RequestContext { handler: &mut LinkHandler::new(Stopwatch::NONE), with: &mut with }.execute(&request))
}
