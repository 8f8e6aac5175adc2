// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! Six legs at reset.

use crate::supervision::ALIKE_AT_REST;
use crate::{LEGS, LegState};

impl LegState {
    /// The six legs at reset.
    pub(crate) const fn all_at_rest() -> [Self; LEGS] {
        if ALIKE_AT_REST {
            [Self::at_rest(0); LEGS]
        } else {
            [Self::at_rest(0), Self::at_rest(1), Self::at_rest(2), Self::at_rest(3), Self::at_rest(4), Self::at_rest(5)]
        }
    }
}
