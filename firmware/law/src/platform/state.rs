//! State of the controller from tick to tick. It never contains a NaN or infinity.

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
        /// Reversal memory of the drive that was applied.
        pub memory: P::Memory = reset.memory[leg], part;
        /// Segment of the leg's last solution in its table.
        pub last: LastLine<P::Real> = LastLine::new(), derived;
        /// Converter code now held at the output.
        pub code: i32 = reset.code, ticks(words.sizes().codes[1]) if *code >= words.sizes().codes[0];
        /// q̂ = ρ̂X: displacement requested by the present code, in the model of its mode, m.
        pub requested: P::Real = reset.displacement[leg], number(words.sizes().leg);
        /// Part of the last request that a limit withheld, m; zero for a free leg.
        pub excess: P::Real = P::Real::ZERO, number(words.sizes().request);
    }
}

specgen_runtime::state! { |words|
    /// State of the controller. Reset: at rest by the spec, no correction.
    #[repr(C)]
    pub struct State<P>[P: Platform](reset: &Reset<P>) {
        /// h: pose from rest, from the last valid gauge readings, m and rad.
        pub pose: [P::Real; 6] = [P::Real::ZERO; 6], axes(words.sizes().pose);
        /// ḣ: its filtered derivative.
        pub rate: Rate<P::Real> = Rate::new(), part;
        /// Generator of set-points; its target is h_d at the end of the present interval.
        pub generator: Generator<P::Real> = Generator::new(), part;
        /// N(h_d − h), the pose error after the notch, m and rad.
        pub error: [P::Real; 6] = [P::Real::ZERO; 6], numbers(words.sizes().error);
        /// Notch on the pose error.
        pub error_notch: NotchState<P::Real> = NotchState::new(), part;
        /// Notch on the innovation.
        pub innovation_notch: NotchState<P::Real> = NotchState::new(), part;
        /// State of the active damping.
        pub damping: P::Damping = P::Damping::REST, part;
        /// Correction that was learned or prepared for the motion.
        pub correction: P::Correction = P::Correction::REST, part;
        /// k_I ∫e.
        pub integral: Integral<P::Real> = Integral::new(), part;
        /// δ̂ and φ̂ of each mode.
        pub estimates: [Estimate<P::Real>; 6] = [Estimate::new(); 6], parts;
        /// K⁻¹F in modal coordinates: the deflection that the feedback assumes, over the present interval.
        pub deflection: [P::Real; 6] = [P::Real::ZERO; 6], numbers(words.sizes().request);
        /// Δl(h_d) of the present interval, m.
        pub demand: [P::Real; LEGS] = [P::Real::ZERO; LEGS], numbers(words.sizes().leg);
        /// p: deflection of each leg under the known load of the present interval, m.
        pub load: [P::Real; LEGS] = [P::Real::ZERO; LEGS], numbers(words.sizes().request);
        /// Last valid interaction wrench, N and N m.
        pub wrench: [P::Real; 6] = [P::Real::ZERO; 6], axes(words.sizes().wrench);
        /// Remaining offset of the last change of mode.
        pub transfer: Transfer<P::Real> = Transfer::new(), part;
        /// Whether a limit held a leg back in the last tick.
        pub limited: bool = false, set;
        /// Fallback stage of the last tick.
        pub fallback: Fallback = Fallback::None, choice;
        /// Mode of the last tick; none before the first.
        pub mode: Option<ControlMode> = None, choice;
        /// Source of the interaction force in the last tick.
        pub interaction: Interaction = Interaction::Neglected, choice;
        /// Its model of the environment.
        pub environment: Environment<P::Real> = Environment::new(), part;
        /// Output lines.
        pub triggers: P::Lines = P::Lines::LOW, part;
        /// Legs 0 to 5. Last, because they are large: the fields before them are within reach of one instruction of a
        /// Cortex-M.
        pub legs: [LegState<P>; LEGS] = [
            LegState::new(reset, 0), LegState::new(reset, 1), LegState::new(reset, 2),
            LegState::new(reset, 3), LegState::new(reset, 4), LegState::new(reset, 5),
        ], parts;
    }
}

impl<P: Platform> State<P> {
    /// Fingerprint of the whole state, for comparing two machines bit for bit.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        Snapshot::digest(self, &mut digest);
        digest.finish()
    }
}
