// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! What the controller remembers from tick to tick. No NaN or infinity is ever stored here.

use crate::config::Environment;
use crate::hysteresis::{GRID, Memory};
use crate::supervision::{code_at_rest, displacement_at_rest, memory_at_rest};
use crate::{LEGS, Real, TickInput, limits};
use specgen_runtime::setpoint::{CommandKind, Generator};
use specgen_runtime::snapshot::{Invalid, LARGEST, LARGEST_PLACE, Reader, Snapshot, Writer};
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
    /// Some leg was held back by a limit in the last tick.
    pub limited: bool,
    /// Interaction wrench last believed, N and N m.
    pub wrench: [Real; 6],
    /// What is left of the last change of mode.
    pub transfer: Transfer<Real>,
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
            legs: LegState::all_at_rest(),
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
        for leg in &self.legs {
            leg.memory.digest(&mut digest);
            digest.real(leg.requested);
            digest.real(leg.excess);
            digest.word(leg.code as u32 as u64);
        }
        for estimate in &self.estimates {
            estimate.digest(&mut digest);
        }
        let Environment { stiffness, rest } = &self.environment;
        let vectors =
            [&self.pose, &self.error, &self.deflection, &self.demand, &self.load, &self.wrench, stiffness, rest];
        for vector in vectors {
            for value in vector {
                digest.real(*value);
            }
        }
        self.rate.digest(&mut digest);
        self.generator.digest(&mut digest);
        self.error_notch.digest(&mut digest);
        self.innovation_notch.digest(&mut digest);
        self.integral.digest(&mut digest);
        self.transfer.digest(&mut digest);
        digest.word(self.limited as u64);
        digest.word(match self.mode {
            None => 0,
            Some(mode) => 1 + mode.word(),
        });
        digest.word(self.interaction.word());
        digest.finish()
    }
}

impl Snapshot for LegState {
    const WORDS: usize = <Memory as Snapshot>::WORDS + 3;
    fn save(&self, words: &mut Writer<'_>) {
        self.memory.save(words);
        words.word(self.code as u32 as u64);
        words.reals(&[self.requested, self.excess]);
    }

    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), Invalid> {
        self.memory.restore(words)?;
        if self.memory.highest() > GRID as Real {
            return Err(words.refused());
        }
        self.code = words.count_to(limits::CODES[1])?;
        if self.code < limits::CODES[0] {
            return Err(words.refused());
        }
        self.requested = words.real(LARGEST_PLACE)?;
        self.excess = words.real(words.sizes().request)?;
        Ok(())
    }
}

impl Snapshot for State {
    const WORDS: usize = LEGS * <LegState as Snapshot>::WORDS
        + 6 * <Estimate<Real> as Snapshot>::WORDS
        + 8 * 6
        + <Rate<Real> as Snapshot>::WORDS
        + <Generator<Real> as Snapshot>::WORDS
        + 2 * <NotchState<Real> as Snapshot>::WORDS
        + <Integral<Real> as Snapshot>::WORDS
        + <Transfer<Real> as Snapshot>::WORDS
        + 3;
    fn save(&self, words: &mut Writer<'_>) {
        for leg in &self.legs {
            leg.save(words);
        }
        for estimate in &self.estimates {
            estimate.save(words);
        }
        for vector in [
            &self.pose,
            &self.error,
            &self.deflection,
            &self.demand,
            &self.load,
            &self.wrench,
            &self.environment.stiffness,
            &self.environment.rest,
        ] {
            words.reals(vector);
        }
        self.rate.save(words);
        self.generator.save(words);
        self.error_notch.save(words);
        self.innovation_notch.save(words);
        self.integral.save(words);
        self.transfer.save(words);
        words.flag(self.limited);
        words.word(match self.mode {
            None => 0,
            Some(mode) => 1 + mode.word(),
        });
        words.word(self.interaction.word());
    }

    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), Invalid> {
        for leg in &mut self.legs {
            leg.restore(words)?;
        }
        for estimate in &mut self.estimates {
            estimate.restore(words)?;
        }
        words.reals(&mut self.pose, LARGEST_PLACE)?;
        words.reals(&mut self.error, LARGEST_PLACE)?;
        words.reals(&mut self.deflection, words.sizes().request)?;
        words.reals(&mut self.demand, LARGEST_PLACE)?;
        words.reals(&mut self.load, words.sizes().request)?;
        words.reals(&mut self.wrench, LARGEST)?;
        words.reals(&mut self.environment.stiffness, words.sizes().stiffness)?;
        words.reals(&mut self.environment.rest, LARGEST_PLACE)?;
        self.rate.restore(words)?;
        self.generator.restore(words)?;
        self.error_notch.restore(words)?;
        self.innovation_notch.restore(words)?;
        self.integral.restore(words)?;
        self.transfer.restore(words)?;
        self.limited = words.flag()?;
        self.mode = match words.word(u64::MAX)? {
            0 => None,
            word => match ControlMode::from_word(word - 1) {
                Some(mode) => Some(mode),
                None => return Err(words.refused()),
            },
        };
        let Some(interaction) = Interaction::from_word(words.word(u64::MAX)?) else {
            return Err(words.refused());
        };
        self.interaction = interaction;
        Ok(())
    }
}

impl TickInput {
    /// As words in the order of `INPUT_NAMES`.
    pub(crate) fn save(&self, words: &mut Writer<'_>) {
        words.word(match self.command.kind {
            CommandKind::Hold => 0,
            CommandKind::Stream => 1,
            CommandKind::Move => 2,
            CommandKind::Trajectory => 3,
            CommandKind::Unknown => 4,
        });
        words.word(self.command.selector as u64);
        words.word(self.command.sequence as u64);
        words.reals(&self.command.target.pose);
        words.reals(&self.command.target.rate);
        words.reals(&self.command.target.acceleration);
        words.reals(&self.gauge);
        words.reals(&self.wrench);
    }
}
