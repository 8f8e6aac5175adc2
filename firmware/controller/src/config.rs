// Carried over by specgen 0.1.0: the same for every spec. Its constants are in the generated files beside it.

//! What may change while running. Its defaults are the spec's; another tuning is another `Config`, never another build.

use crate::defaults::{
    DRIFT_WEIGHT, ENVIRONMENT_REST, ENVIRONMENT_STIFFNESS, GAINS, INTERACTION, LEVEL_WEIGHT, MAX_STEP, MODE,
    POSITION_GAINS,
};
use crate::words::{CONFIG_CODES, CONFIG_WORDS};
use crate::{Real, limits, permitted};
use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction, Permitted};

/// A value that a [`Config`] cannot hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConfigError {
    /// The word of [`crate::CONFIG_NAMES`] that is out of range.
    pub word: usize,
}

/// K_e (h − h_e): a linear model of what the platform presses on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Environment {
    /// K_e, N/m and N m/rad, x y z θx θy θz.
    pub stiffness: [Real; 6],
    /// h_e: pose from rest at which it is unloaded, m and rad.
    pub rest: [Real; 6],
}

/// Checked settings. Every value it holds keeps the tick within its promises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    pub(crate) mode: ControlMode,
    pub(crate) interaction: Interaction,
    pub(crate) level_weight: Real,
    pub(crate) drift_weight: Real,
    pub(crate) code_limits: CodeLimits,
    pub(crate) gains: Gains<Real>,
    pub(crate) position_gains: Gains<Real>,
    pub(crate) environment: Environment,
    pub(crate) damps: [bool; 2],
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

    /// These settings, if each is within its range.
    #[inline(never)]
    fn checked(self) -> Result<Self, ConfigError> {
        Self::check(&self.to_words())?;
        Ok(self)
    }

    /// Every word is within its range, or the first that is not.
    #[inline(never)]
    pub(crate) fn check(words: &[u64; CONFIG_WORDS]) -> Result<(), ConfigError> {
        for (word, value) in words.iter().enumerate() {
            match Permitted::of(&permitted::SETTINGS, word) {
                Some(permitted) if permitted.takes(*value) => {}
                _ => return Err(ConfigError { word }),
            }
        }
        if words[CONFIG_CODES + 2] < words[CONFIG_CODES + 1] {
            return Err(ConfigError { word: CONFIG_CODES + 2 });
        }
        Ok(())
    }
}

/// Whether any k_v is other than zero.
pub(crate) const fn damps(gains: &Gains<Real>) -> bool {
    let [x, y, z, tilt_x, tilt_y, tilt_z] = gains.derivative;
    x != 0.0 || y != 0.0 || z != 0.0 || tilt_x != 0.0 || tilt_y != 0.0 || tilt_z != 0.0
}
