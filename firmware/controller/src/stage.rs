// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! What a measurable part of the tick is.

use crate::{Config, State, TickInput};

/// A part of the tick. `run` gets a copy of the state and leaves its result there.
#[derive(Debug, Clone, Copy)]
pub struct Stage {
    /// Name, at most 16 bytes of ASCII.
    pub name: &'static str,
    /// How often a tick runs it: once, or once for each leg with the number of the leg.
    pub calls: usize,
    /// The part itself.
    pub run: extern "C" fn(&Config, &mut State, &TickInput, usize),
}
