//! A measurable part of the tick.

use crate::spec::{Config, InputOf, Spec, StateOf};

/// A part of the tick. `run` gets a copy of the state and writes its result there.
#[derive(Debug, Clone, Copy)]
pub struct Stage<P: Spec> {
    /// Name, at most 16 bytes of ASCII.
    pub name: &'static str,
    /// Calls per tick: one, or one for each leg with the leg's number.
    pub calls: usize,
    /// The part itself.
    pub run: extern "C" fn(&Config<P>, &mut StateOf<P>, &InputOf<P>, usize),
}

/// The stages of a law, in the order of the tick: name, calls per tick, and a function of that name.
macro_rules! stages {
    ($kind:ident, |$p:ident, $config:ident, $state:ident, $input:ident, $leg:ident|
     $($(#[$about:meta])* $name:ident, $calls:expr => $run:block)+) => {
        /// Number of stages.
        pub const STAGE_COUNT: usize = [$($calls),+].len();

        /// All stages, in the order of the tick.
        #[must_use]
        pub const fn stages<P: $kind + ConstSpec>() -> [Stage<P>; STAGE_COUNT] {
            [$(Stage { name: stringify!($name), calls: $calls, run: $name::<P> }),+]
        }

        $(
            $(#[$about])*
            extern "C" fn $name<P: $kind + ConstSpec>(
                $config: &Config<P>,
                $state: &mut State<P>,
                $input: &TickInput<P>,
                $leg: usize,
            ) {
                let ($p, _) = (P::CONSTANTS, ($config, $input, $leg));
                $run
            }
        )+
    };
}
pub(crate) use stages;
