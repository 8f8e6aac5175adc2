//! The supervisor: which phase the machine is in, and why.

mod kinds;

pub use kinds::{CONVERTER, Cause, INTEGRITY, LINK_LOST, MISSED_TICK, Phase, Request, STOP};

use crate::digest::Digest;
use crate::real::Real;

/// State of the supervisor.
#[derive(Debug, Clone, Copy)]
pub struct Supervisor<T> {
    /// What the machine is doing.
    pub phase: Phase,
    /// Why, if it was forced upon it.
    pub cause: Cause,
    /// The request of the last tick.
    pub request: Request,
    /// Displacement of each leg that the gauges last showed, m.
    pub measured: [T; 6],
}

impl<T: Real> Default for Supervisor<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Supervisor<T> {
    /// Reset: disarmed.
    #[must_use]
    pub const fn new() -> Self {
        Self { phase: Phase::Disarmed, cause: Cause::None, request: Request::None, measured: [T::ZERO; 6] }
    }

    /// Adds the state to a digest.
    pub fn digest(&self, digest: &mut Digest) {
        digest.word(self.phase.word() | self.cause.word() << 8 | self.request.word() << 16);
        for value in &self.measured {
            digest.real(*value);
        }
    }
}
