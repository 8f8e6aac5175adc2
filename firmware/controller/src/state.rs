// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! What the controller remembers from tick to tick. No NaN or infinity is ever stored here.

use crate::config::Environment;
use crate::hysteresis::{GRID, Memory};
use crate::supervision::{code_at_rest, displacement_at_rest, memory_at_rest};
use crate::{LEGS, Real, limits};
use specgen_runtime::setpoint::Generator;
use specgen_runtime::snapshot::{LARGEST, LARGEST_PLACE, Sizes, Snapshot};
use specgen_runtime::{ControlMode, Digest, Estimate, Integral, Interaction, NotchState, Rate, Transfer};

/// State of one leg.
#[derive(Debug, Clone, Copy)]
pub struct LegState {
    /// Reversal memory of the drive that was really applied.
    pub memory: Memory,
    /// q̂ = ρ̂X: displacement really requested by the code held, in the model of the mode it was asked in, m.
    pub requested: Real,
    /// Part of the last request that a limit withheld, m; zero for a leg that was free.
    pub excess: Real,
    /// Converter code now held at the output.
    pub code: i32,
}

impl LegState {
    /// At reset.
    pub(crate) const fn at_rest(leg: usize) -> Self {
        Self { memory: memory_at_rest(leg), requested: displacement_at_rest(leg), excess: 0.0, code: code_at_rest() }
    }
}

/// State of the controller.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct State {
    /// h: pose from rest, from the last gauge readings that were believed, m and rad.
    pub pose: [Real; 6],
    /// ḣ: its filtered derivative.
    pub rate: Rate<Real>,
    /// Where set-points come from; its target is h_d at the end of the interval now running.
    pub generator: Generator<Real>,
    /// N(h_d − h), the pose error behind the notch, m and rad.
    pub error: [Real; 6],
    /// Notch on the pose error.
    pub error_notch: NotchState<Real>,
    /// Notch on the innovation.
    pub innovation_notch: NotchState<Real>,
    /// k_I ∫e.
    pub integral: Integral<Real>,
    /// δ̂ and φ̂ of each mode.
    pub estimates: [Estimate<Real>; 6],
    /// K⁻¹F in modal coordinates: what the feedback takes the platform to deflect by, over the interval now running.
    pub deflection: [Real; 6],
    /// Δl(h_d) of the interval now running, m.
    pub demand: [Real; LEGS],
    /// p: deflection of each leg under the known load of the interval now running, m.
    pub load: [Real; LEGS],
    /// Interaction wrench last believed, N and N m.
    pub wrench: [Real; 6],
    /// What is left of the last change of mode.
    pub transfer: Transfer<Real>,
    /// Some leg was held back by a limit in the last tick.
    pub limited: bool,
    /// Mode of the last tick; none before the first.
    pub mode: Option<ControlMode>,
    /// Where the last tick took the interaction force from.
    pub interaction: Interaction,
    /// Its model of the environment.
    pub environment: Environment,
    /// Legs 0 to 5. They stand last, for they are large: what comes before them is within reach of one instruction of a Cortex-M.
    pub legs: [LegState; LEGS],
}

impl Default for State {
    fn default() -> Self {
        Self::new()
    }
}

impl State {
    /// Reset: at rest, as `memory_at_rest` of `supervision.rs` says, no correction.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            legs: [
                LegState::at_rest(0),
                LegState::at_rest(1),
                LegState::at_rest(2),
                LegState::at_rest(3),
                LegState::at_rest(4),
                LegState::at_rest(5),
            ],
            pose: [0.0; 6],
            rate: Rate::new(),
            generator: Generator::new(),
            error: [0.0; 6],
            error_notch: NotchState::new(),
            innovation_notch: NotchState::new(),
            integral: Integral::new(),
            estimates: [Estimate::new(); 6],
            deflection: [0.0; 6],
            demand: [0.0; LEGS],
            load: [0.0; LEGS],
            limited: false,
            wrench: [0.0; 6],
            transfer: Transfer::new(),
            mode: None,
            interaction: Interaction::Neglected,
            environment: Environment { stiffness: [0.0; 6], rest: [0.0; 6] },
        }
    }

    /// Fingerprint of everything that later ticks depend on, for comparing two machines bit for bit.
    #[must_use]
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::new();
        Snapshot::digest(self, &mut digest);
        digest.finish()
    }
}

specgen_runtime::state! {
    impl[] LegState, Memory::WORDS + 3, |words| { memory, requested, excess, code } {
        words.part(memory)?;
        words.check(|| memory.highest() <= GRID as Real)?;
        words.ticks(code, limits::CODES[1])?;
        words.check(|| *code >= limits::CODES[0])?;
        words.number(requested, LARGEST_PLACE)?;
        words.number(excess, words.sizes().request)?;
    }
}

specgen_runtime::state! {
    impl[] State,
    LEGS * LegState::WORDS
        + 6 * Estimate::<Real>::WORDS
        + 8 * 6
        + Rate::<Real>::WORDS
        + Generator::<Real>::WORDS
        + 2 * NotchState::<Real>::WORDS
        + Integral::<Real>::WORDS
        + Transfer::<Real>::WORDS
        + 3,
    |words| {
        pose, rate, generator, error, error_notch, innovation_notch, integral, estimates, deflection, demand, load, limited,
        wrench, transfer, mode, interaction, environment, legs
    } {
        for leg in legs {
            words.part(leg)?;
        }
        for estimate in estimates {
            words.part(estimate)?;
        }
        let Sizes { request, stiffness: largest_stiffness, .. } = words.sizes();
        words.numbers(pose, LARGEST_PLACE)?;
        words.numbers(error, LARGEST_PLACE)?;
        words.numbers(deflection, request)?;
        words.numbers(demand, LARGEST_PLACE)?;
        words.numbers(load, request)?;
        words.numbers(wrench, LARGEST)?;
        let Environment { stiffness, rest } = environment;
        words.numbers(stiffness, largest_stiffness)?;
        words.numbers(rest, LARGEST_PLACE)?;
        words.part(rate)?;
        words.part(generator)?;
        words.part(error_notch)?;
        words.part(innovation_notch)?;
        words.part(integral)?;
        words.part(transfer)?;
        words.set(limited)?;
        words.choice(mode)?;
        words.choice(interaction)?;
    }
}
