//! State of a law and of its supervisor.

use specgen_runtime::supervisor::Supervisor;
use specgen_runtime::{Digest, Snapshot as _};

use super::{Spec, StateOf};

specgen_runtime::state! { |words|
    /// The whole state from tick to tick. It never contains a NaN or infinity. Reset: disarmed, and the law at reset.
    pub struct Machine<P>[P: Spec](state: StateOf<P>) {
        /// State of the control law.
        pub state: StateOf<P> = state, part;
        /// State of the supervisor.
        pub supervisor: Supervisor<P::Real> = Supervisor::new(), part;
    }
}

impl<P: Spec> Machine<P> {
    /// Fingerprint of the whole state.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        let mut state = Digest::new();
        self.state.digest(&mut state);
        digest.word(state.finish());
        self.supervisor.digest(&mut digest);
        digest.finish()
    }
}
