// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! What the controller remembers from tick to tick. No NaN or infinity is ever stored here.

use crate::config::Environment;
use crate::defaults::LINES;
use crate::hysteresis::Memory;
use crate::supervision::{code_at_rest, displacement_at_rest, memory_at_rest};
use crate::task_space::{CORRECTED, DAMPED};
use crate::{LEGS, Real};
use specgen_runtime::setpoint::Generator;
use specgen_runtime::snapshot::Snapshot;
use specgen_runtime::supervisor::Fallback;
use specgen_runtime::trigger::Triggers;
use specgen_runtime::{
    ControlMode, Correction, Damping, Digest, Estimate, Integral, Interaction, LastLine, NotchState, Rate, Transfer,
};

specgen_runtime::state! { |words|
    /// State of one leg.
    pub struct LegState(leg: usize) {
        /// Reversal memory of the drive that was really applied.
        pub memory: Memory = memory_at_rest(leg), part;
        /// Where on its table the leg was found last.
        pub last: LastLine<Real> = LastLine::new(), derived;
        /// Converter code now held at the output.
        pub code: i32 = code_at_rest(), ticks(words.sizes().codes[1]) if *code >= words.sizes().codes[0];
        /// q̂ = ρ̂X: displacement really requested by the code held, in the model of the mode it was asked in, m.
        pub requested: Real = displacement_at_rest(leg), number(words.sizes().leg);
        /// Part of the last request that a limit withheld, m; zero for a leg that was free.
        pub excess: Real = 0.0, number(words.sizes().request);
    }
}

specgen_runtime::state! { |words|
    /// State of the controller. Reset: at rest, as `memory_at_rest` of `supervision.rs` says, no correction.
    #[repr(C)]
    pub struct State {
        /// h: pose from rest, from the last gauge readings that were believed, m and rad.
        pub pose: [Real; 6] = [0.0; 6], axes(words.sizes().pose);
        /// ḣ: its filtered derivative.
        pub rate: Rate<Real> = Rate::new(), part;
        /// Where set-points come from; its target is h_d at the end of the interval now running.
        pub generator: Generator<Real> = Generator::new(), part;
        /// N(h_d − h), the pose error behind the notch, m and rad.
        pub error: [Real; 6] = [0.0; 6], numbers(words.sizes().error);
        /// Notch on the pose error.
        pub error_notch: NotchState<Real> = NotchState::new(), part;
        /// Notch on the innovation.
        pub innovation_notch: NotchState<Real> = NotchState::new(), part;
        /// What is asked for against the modes.
        pub damping: Damping<Real, DAMPED> = Damping::new(), part;
        /// What was learned or prepared for the motion.
        pub correction: Correction<Real, CORRECTED> = Correction::new(), part;
        /// k_I ∫e.
        pub integral: Integral<Real> = Integral::new(), part;
        /// δ̂ and φ̂ of each mode.
        pub estimates: [Estimate<Real>; 6] = [Estimate::new(); 6], parts;
        /// K⁻¹F in modal coordinates: what the feedback takes the platform to deflect by, over the interval now running.
        pub deflection: [Real; 6] = [0.0; 6], numbers(words.sizes().request);
        /// Δl(h_d) of the interval now running, m.
        pub demand: [Real; LEGS] = [0.0; LEGS], numbers(words.sizes().leg);
        /// p: deflection of each leg under the known load of the interval now running, m.
        pub load: [Real; LEGS] = [0.0; LEGS], numbers(words.sizes().request);
        /// Interaction wrench last believed, N and N m.
        pub wrench: [Real; 6] = [0.0; 6], axes(words.sizes().wrench);
        /// What is left of the last change of mode.
        pub transfer: Transfer<Real> = Transfer::new(), part;
        /// Some leg was held back by a limit in the last tick.
        pub limited: bool = false, set;
        /// How much of the law the last tick had.
        pub fallback: Fallback = Fallback::None, choice;
        /// Mode of the last tick; none before the first.
        pub mode: Option<ControlMode> = None, choice;
        /// Where the last tick took the interaction force from.
        pub interaction: Interaction = Interaction::Neglected, choice;
        /// Its model of the environment.
        pub environment: Environment = Environment::new(), part;
        /// Output lines.
        pub triggers: Triggers<Real, LINES> = Triggers::new(), part;
        /// Legs 0 to 5. They stand last, for they are large: what comes before them is within reach of one instruction of a Cortex-M.
        pub legs: [LegState; LEGS] =
            [LegState::new(0), LegState::new(1), LegState::new(2), LegState::new(3), LegState::new(4), LegState::new(5)], parts;
    }
}

impl State {
    /// Fingerprint of everything that later ticks depend on, for comparing two machines bit for bit.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        Snapshot::digest(self, &mut digest);
        digest.finish()
    }
}
