//! What a measurable part of the tick is.

use crate::spec::{ConfigOf, InputOf, Spec, StateOf};

/// A part of the tick. `run` gets a copy of the state and leaves its result there.
#[derive(Debug, Clone, Copy)]
pub struct Stage<P: Spec> {
    /// Name, at most 16 bytes of ASCII.
    pub name: &'static str,
    /// How often a tick runs it: once, or once for each leg with the number of the leg.
    pub calls: usize,
    /// The part itself.
    pub run: extern "C" fn(&ConfigOf<P>, &mut StateOf<P>, &InputOf<P>, usize),
}
