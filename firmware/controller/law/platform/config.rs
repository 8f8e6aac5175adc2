//! What may change while running. Its defaults are the spec's; another tuning is another `Config`, never another build.

use crate::defaults::{
    DRIFT_WEIGHT, ENVIRONMENT_REST, ENVIRONMENT_STIFFNESS, GAINS, INTERACTION, LEVEL_WEIGHT, LINES, MAX_STEP, MODE,
    POSITION_GAINS, TRIGGERS,
};
use crate::words::six;
use crate::{Real, limits, permitted};
use specgen_runtime::snapshot::{Field, LARGEST_PLACE, Reader, Snapshot, Writer};
use specgen_runtime::trigger::Line;
use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction, Permitted, Real as _};

/// Words of the settings.
pub const CONFIG_WORDS: usize = permitted::WORDS;

/// Names of the settings. `mode` is 0 P; 1, 2, 3 F with Invhys, EWMA, PCC; 4, 5, 6 P/F with the same. `interaction` is 0
/// neglected, 1 modelled, 2 measured. `kp`, `ki`, `kv` are the gains of P/F, `position_…` those of P.
pub const CONFIG_NAMES: [&str; CONFIG_WORDS] = permitted::NAMES;

/// First word of the weights, of the code limits, of the gains and of the output lines in [`CONFIG_NAMES`].
const CONFIG_WEIGHTS: usize = 2;
const CONFIG_CODES: usize = 4;
const CONFIG_GAINS: usize = 7;
const CONFIG_LINES: usize = CONFIG_GAINS + 48;

/// Words of a line, and the place of its end among them.
const LINE_WORDS: usize = Line::<Real>::WORDS;
const LINE_STOP: usize = 4;

/// A value that a [`Config`] cannot hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigError {
    /// The word of [`CONFIG_NAMES`] that is out of range.
    pub word: usize,
}

specgen_runtime::state! { |words|
    /// K_e (h − h_e): a linear model of what the platform presses on.
    #[derive(PartialEq)]
    pub struct Environment {
        /// K_e, N/m and N m/rad, x y z θx θy θz.
        pub stiffness: [Real; 6] = [0.0; 6], numbers(words.sizes().stiffness);
        /// h_e: pose from rest at which it is unloaded, m and rad.
        pub rest: [Real; 6] = [0.0; 6], numbers(LARGEST_PLACE);
    }
}

/// Checked settings. Every value it holds keeps the tick within its promises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    mode: ControlMode,
    interaction: Interaction,
    level_weight: Real,
    drift_weight: Real,
    code_limits: CodeLimits,
    gains: Gains<Real>,
    position_gains: Gains<Real>,
    environment: Environment,
    damps: [bool; 2],
    triggers: [Line<Real>; LINES],
}

impl Default for Config {
    fn default() -> Self {
        Self::new()
    }
}

impl Config {
    /// The spec's settings.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            mode: MODE,
            interaction: INTERACTION,
            level_weight: LEVEL_WEIGHT,
            drift_weight: DRIFT_WEIGHT,
            code_limits: CodeLimits { min: limits::CODES[0], max: limits::CODES[1], max_step: MAX_STEP },
            gains: GAINS,
            position_gains: POSITION_GAINS,
            environment: Environment { stiffness: ENVIRONMENT_STIFFNESS, rest: ENVIRONMENT_REST },
            damps: [damps(&GAINS), damps(&POSITION_GAINS)],
            triggers: TRIGGERS,
        }
    }

    /// P, F or P/F with its run-to-run law; from `control.mode` and `adaptation.mode`.
    #[inline]
    #[must_use]
    pub const fn mode(&self) -> ControlMode {
        self.mode
    }

    /// Where the interaction force of (7) comes from; from `control.interaction`.
    #[inline]
    #[must_use]
    pub const fn interaction(&self) -> Interaction {
        self.interaction
    }

    /// ω (EWMA) or ω1 (PCC) per tick, within [0, 1]; from `adaptation`.
    #[inline]
    #[must_use]
    pub const fn level_weight(&self) -> Real {
        self.level_weight
    }

    /// ω2 (PCC) per tick, within [0, 1]; from `adaptation`.
    #[inline]
    #[must_use]
    pub const fn drift_weight(&self) -> Real {
        self.drift_weight
    }

    /// Voltage limits and slew limit in converter codes.
    #[inline]
    #[must_use]
    pub const fn code_limits(&self) -> CodeLimits {
        self.code_limits
    }

    /// Gains of (7) in the present mode: those of P where it works alone.
    #[inline]
    #[must_use]
    pub const fn active_gains(&self) -> &Gains<Real> {
        match self.mode {
            ControlMode::P => &self.position_gains,
            _ => &self.gains,
        }
    }

    /// Gains of P/F; from `gains`.
    #[inline]
    #[must_use]
    pub const fn gains(&self) -> &Gains<Real> {
        &self.gains
    }

    /// Gains of P alone; from `gains.position`.
    #[inline]
    #[must_use]
    pub const fn position_gains(&self) -> &Gains<Real> {
        &self.position_gains
    }

    /// Whether any k_v of the present mode is other than zero.
    #[inline]
    #[must_use]
    pub const fn damps(&self) -> bool {
        match self.mode {
            ControlMode::P => self.damps[1],
            ControlMode::F(_) => false,
            ControlMode::PF(_) => self.damps[0],
        }
    }

    /// K_e and h_e.
    #[inline]
    #[must_use]
    pub const fn environment(&self) -> &Environment {
        &self.environment
    }

    /// What the output lines show; from `trigger`.
    #[inline]
    #[must_use]
    pub const fn triggers(&self) -> &[Line<Real>; LINES] {
        &self.triggers
    }

    /// The same in another mode. While running the change is bumpless.
    #[must_use]
    pub const fn with_mode(self, mode: ControlMode) -> Self {
        Self { mode, ..self }
    }

    /// The same with the interaction force from elsewhere.
    #[must_use]
    pub const fn with_interaction(self, interaction: Interaction) -> Self {
        Self { interaction, ..self }
    }

    /// The same with other weights per tick.
    ///
    /// # Errors
    /// A weight outside its range in [`permitted::SETTINGS`]. That they are stable on the platform is for the
    /// compiler to check, not for this function.
    pub fn with_weights(self, level_weight: Real, drift_weight: Real) -> Result<Self, ConfigError> {
        Self { level_weight, drift_weight, ..self }.checked()
    }

    /// The same with other gains for P/F and for P alone.
    ///
    /// # Errors
    /// A gain outside its range in [`permitted::SETTINGS`]. That they are stable on the platform is for the compiler
    /// to check, not for this function.
    pub fn with_gains(self, gains: Gains<Real>, position_gains: Gains<Real>) -> Result<Self, ConfigError> {
        let damps = [damps(&gains), damps(&position_gains)];
        Self { gains, position_gains, damps, ..self }.checked()
    }

    /// The same with another environment.
    ///
    /// # Errors
    /// A stiffness or a pose outside its range.
    pub fn with_environment(self, environment: Environment) -> Result<Self, ConfigError> {
        Self { environment, ..self }.checked()
    }

    /// The same with other code limits.
    ///
    /// # Errors
    /// A step below one code or above `actuator.slew_rate`, or limits that leave the spec's voltage limits or are empty.
    pub fn with_code_limits(self, code_limits: CodeLimits) -> Result<Self, ConfigError> {
        Self { code_limits, ..self }.checked()
    }

    /// The same with other output lines. Each whose settings are other than before begins anew, low.
    ///
    /// # Errors
    /// A number outside its range, or a line that ends before it starts.
    pub fn with_triggers(self, triggers: [Line<Real>; LINES]) -> Result<Self, ConfigError> {
        Self { triggers, ..self }.checked()
    }

    /// From words in the order of [`CONFIG_NAMES`].
    ///
    /// # Errors
    /// The first word that is out of range.
    pub fn from_words(words: &[u64; CONFIG_WORDS]) -> Result<Self, ConfigError> {
        Self::check(words)?;
        let Some(mode) = ControlMode::from_word(words[0]) else {
            return Err(ConfigError { word: 0 });
        };
        let Some(interaction) = Interaction::from_word(words[1]) else {
            return Err(ConfigError { word: 1 });
        };
        let set = |first: usize| Gains {
            proportional: six(words, first),
            integral: six(words, first + 6),
            derivative: six(words, first + 12),
        };
        let (gains, position_gains) = (set(CONFIG_GAINS), set(CONFIG_GAINS + 18));
        Ok(Self {
            mode,
            interaction,
            level_weight: Real::from_word(words[CONFIG_WEIGHTS]),
            drift_weight: Real::from_word(words[CONFIG_WEIGHTS + 1]),
            code_limits: CodeLimits {
                max_step: words[CONFIG_CODES] as i32,
                min: words[CONFIG_CODES + 1] as i32,
                max: words[CONFIG_CODES + 2] as i32,
            },
            damps: [damps(&gains), damps(&position_gains)],
            gains,
            position_gains,
            environment: Environment { stiffness: six(words, CONFIG_GAINS + 36), rest: six(words, CONFIG_GAINS + 42) },
            triggers: lines(words)?,
        })
    }

    /// Words in the order of [`CONFIG_NAMES`].
    #[must_use]
    pub fn to_words(&self) -> [u64; CONFIG_WORDS] {
        let mut all = [0; CONFIG_WORDS];
        let mut words = Writer::new(&mut all);
        words.word(self.mode.word());
        words.word(self.interaction.word());
        words.real(self.level_weight);
        words.real(self.drift_weight);
        let CodeLimits { max_step, min, max } = self.code_limits;
        for code in [max_step, min, max] {
            words.word(code as u32 as u64);
        }
        for gains in [&self.gains, &self.position_gains] {
            words.reals(&gains.proportional);
            words.reals(&gains.integral);
            words.reals(&gains.derivative);
        }
        words.reals(&self.environment.stiffness);
        words.reals(&self.environment.rest);
        for line in &self.triggers {
            line.save(&mut words);
        }
        all
    }

    /// These settings, if each is within its range.
    #[inline(never)]
    fn checked(self) -> Result<Self, ConfigError> {
        Self::check(&self.to_words())?;
        Ok(self)
    }

    /// Every word is within its range, or the first that is not.
    #[inline(never)]
    fn check(words: &[u64; CONFIG_WORDS]) -> Result<(), ConfigError> {
        for (word, value) in words.iter().enumerate() {
            match Permitted::of(&permitted::SETTINGS, word) {
                Some(permitted) if permitted.takes(*value) => {}
                _ => return Err(ConfigError { word }),
            }
        }
        if words[CONFIG_CODES + 2] < words[CONFIG_CODES + 1] {
            return Err(ConfigError { word: CONFIG_CODES + 2 });
        }
        for (index, line) in lines(words)?.iter().enumerate() {
            if line.stop < line.start {
                return Err(ConfigError { word: CONFIG_LINES + index * LINE_WORDS + LINE_STOP });
            }
        }
        Ok(())
    }
}

/// The output lines of the words of settings.
fn lines(words: &[u64; CONFIG_WORDS]) -> Result<[Line<Real>; LINES], ConfigError> {
    let mut lines = TRIGGERS;
    let mut reader = Reader::new(words.get(CONFIG_LINES..).unwrap_or_default());
    for line in &mut lines {
        line.restore(&mut reader).map_err(|invalid| ConfigError { word: CONFIG_LINES + invalid.word })?;
    }
    Ok(lines)
}

/// Whether any k_v is other than zero.
const fn damps(gains: &Gains<Real>) -> bool {
    let [x, y, z, tilt_x, tilt_y, tilt_z] = gains.derivative;
    x != 0.0 || y != 0.0 || z != 0.0 || tilt_x != 0.0 || tilt_y != 0.0 || tilt_z != 0.0
}
