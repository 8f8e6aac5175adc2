//! What the controller remembers from tick to tick. No NaN or infinity is ever stored here.

use specgen_runtime::setpoint::Generator;
use specgen_runtime::snapshot::Snapshot;
use specgen_runtime::supervisor::Fallback;
use specgen_runtime::trigger::OutputLines as _;
use specgen_runtime::{
    ControlMode, Digest, Estimate, Integral, Interaction, LastLine, ModalDamping as _, NotchState, Rate, Real,
    RequestCorrection as _, Transfer,
};

use super::config::Environment;
use super::constants::Platform;
use crate::spec::{LEGS, Reset};

specgen_runtime::state! { |words|
    /// State of one leg.
    pub struct LegState<P>[P: Platform](reset: &Reset<P>, leg: usize) {
        /// Reversal memory of the drive that was really applied.
        pub memory: P::Memory = reset.memory[leg], part;
        /// Where on its table the leg was found last.
        pub last: LastLine<P::Real> = LastLine::new(), derived;
        /// Converter code now held at the output.
        pub code: i32 = reset.code, ticks(words.sizes().codes[1]) if *code >= words.sizes().codes[0];
        /// q̂ = ρ̂X: displacement really requested by the code held, in the model of the mode it was asked in, m.
        pub requested: P::Real = reset.displacement[leg], number(words.sizes().leg);
        /// Part of the last request that a limit withheld, m; zero for a leg that was free.
        pub excess: P::Real = P::Real::ZERO, number(words.sizes().request);
    }
}

specgen_runtime::state! { |words|
    /// State of the controller. Reset: at rest, as the spec says, no correction.
    #[repr(C)]
    pub struct State<P>[P: Platform](reset: &Reset<P>) {
        /// h: pose from rest, from the last gauge readings that were believed, m and rad.
        pub pose: [P::Real; 6] = [P::Real::ZERO; 6], axes(words.sizes().pose);
        /// ḣ: its filtered derivative.
        pub rate: Rate<P::Real> = Rate::new(), part;
        /// Where set-points come from; its target is h_d at the end of the interval now running.
        pub generator: Generator<P::Real> = Generator::new(), part;
        /// N(h_d − h), the pose error behind the notch, m and rad.
        pub error: [P::Real; 6] = [P::Real::ZERO; 6], numbers(words.sizes().error);
        /// Notch on the pose error.
        pub error_notch: NotchState<P::Real> = NotchState::new(), part;
        /// Notch on the innovation.
        pub innovation_notch: NotchState<P::Real> = NotchState::new(), part;
        /// What is asked for against the modes.
        pub damping: P::Damping = P::Damping::REST, part;
        /// What was learned or prepared for the motion.
        pub correction: P::Correction = P::Correction::REST, part;
        /// k_I ∫e.
        pub integral: Integral<P::Real> = Integral::new(), part;
        /// δ̂ and φ̂ of each mode.
        pub estimates: [Estimate<P::Real>; 6] = [Estimate::new(); 6], parts;
        /// K⁻¹F in modal coordinates: what the feedback takes the platform to deflect by, over the interval now running.
        pub deflection: [P::Real; 6] = [P::Real::ZERO; 6], numbers(words.sizes().request);
        /// Δl(h_d) of the interval now running, m.
        pub demand: [P::Real; LEGS] = [P::Real::ZERO; LEGS], numbers(words.sizes().leg);
        /// p: deflection of each leg under the known load of the interval now running, m.
        pub load: [P::Real; LEGS] = [P::Real::ZERO; LEGS], numbers(words.sizes().request);
        /// Interaction wrench last believed, N and N m.
        pub wrench: [P::Real; 6] = [P::Real::ZERO; 6], axes(words.sizes().wrench);
        /// What is left of the last change of mode.
        pub transfer: Transfer<P::Real> = Transfer::new(), part;
        /// Some leg was held back by a limit in the last tick.
        pub limited: bool = false, set;
        /// How much of the law the last tick had.
        pub fallback: Fallback = Fallback::None, choice;
        /// Mode of the last tick; none before the first.
        pub mode: Option<ControlMode> = None, choice;
        /// Where the last tick took the interaction force from.
        pub interaction: Interaction = Interaction::Neglected, choice;
        /// Its model of the environment.
        pub environment: Environment<P::Real> = Environment::new(), part;
        /// Output lines.
        pub triggers: P::Lines = P::Lines::LOW, part;
        /// Legs 0 to 5. They stand last, for they are large: what comes before them is within reach of one instruction of a Cortex-M.
        pub legs: [LegState<P>; LEGS] = [
            LegState::new(reset, 0), LegState::new(reset, 1), LegState::new(reset, 2),
            LegState::new(reset, 3), LegState::new(reset, 4), LegState::new(reset, 5),
        ], parts;
    }
}

impl<P: Platform> State<P> {
    /// Fingerprint of everything that later ticks depend on, for comparing two machines bit for bit.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        Snapshot::digest(self, &mut digest);
        digest.finish()
    }
}
