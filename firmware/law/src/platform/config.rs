//! What may change while running. Its defaults are the spec's; another tuning is another `Config`, never another build.

use specgen_runtime::snapshot::{Field, LARGEST_PLACE, Reader, Snapshot as _, Writer};
use specgen_runtime::trigger::Line;
use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction, Permitted, Real};

use super::constants::Platform;
use super::parts::OutputLines;
use crate::spec::{Compiled, ConfigError};
use crate::words::{WordArray as _, six, word};

/// First word of the weights, of the code limits, of the gains and of the output lines.
const CONFIG_WEIGHTS: usize = 2;
const CONFIG_CODES: usize = 4;
const CONFIG_GAINS: usize = 7;
const CONFIG_LINES: usize = CONFIG_GAINS + 48;

/// Place of the end of a line among its words.
const LINE_STOP: usize = 4;

/// What the output lines of a platform show.
type LineSettings<P> = <<P as Platform>::Lines as OutputLines<<P as crate::Spec>::Real>>::Settings;

specgen_runtime::state! { |words|
    /// K_e (h − h_e): a linear model of what the platform presses on.
    #[derive(PartialEq)]
    pub struct Environment<T>[T: Real] {
        /// K_e, N/m and N m/rad, x y z θx θy θz.
        pub stiffness: [T; 6] = [T::ZERO; 6], numbers(words.sizes().stiffness);
        /// h_e: pose from rest at which it is unloaded, m and rad.
        pub rest: [T; 6] = [T::ZERO; 6], numbers(LARGEST_PLACE);
    }
}

/// Settings, unchecked: the spec's as the compiler writes them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings<P: Platform> {
    /// From `control.mode` and `adaptation.mode`.
    pub mode: ControlMode,
    /// From `control.interaction`.
    pub interaction: Interaction,
    /// From `adaptation`.
    pub level_weight: P::Real,
    /// From `adaptation`.
    pub drift_weight: P::Real,
    /// From `actuator` and `dac`.
    pub code_limits: CodeLimits,
    /// Of P/F; from `gains` or the start rule.
    pub gains: Gains<P::Real>,
    /// Of P; from `gains` or the start rule.
    pub position_gains: Gains<P::Real>,
    /// From `environment`.
    pub environment: Environment<P::Real>,
    /// Whether any k_v is other than zero: of `gains`, of `position_gains`.
    pub damps: [bool; 2],
    /// From `trigger`.
    pub triggers: LineSettings<P>,
}

/// Checked settings. Every value it holds keeps the tick within its promises.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config<P: Platform>(Settings<P>);

impl<P: Platform + Compiled> Default for Config<P> {
    fn default() -> Self {
        Self::new()
    }
}

impl<P: Platform> Config<P> {
    /// P, F or P/F with its run-to-run law; from `control.mode` and `adaptation.mode`.
    #[inline]
    #[must_use]
    pub const fn mode(&self) -> ControlMode {
        self.0.mode
    }

    /// Where the interaction force of (7) comes from; from `control.interaction`.
    #[inline]
    #[must_use]
    pub const fn interaction(&self) -> Interaction {
        self.0.interaction
    }

    /// ω (EWMA) or ω1 (PCC) per tick, within [0, 1]; from `adaptation`.
    #[inline]
    #[must_use]
    pub const fn level_weight(&self) -> P::Real {
        self.0.level_weight
    }

    /// ω2 (PCC) per tick, within [0, 1]; from `adaptation`.
    #[inline]
    #[must_use]
    pub const fn drift_weight(&self) -> P::Real {
        self.0.drift_weight
    }

    /// Voltage limits and slew limit in converter codes.
    #[inline]
    #[must_use]
    pub const fn code_limits(&self) -> CodeLimits {
        self.0.code_limits
    }

    /// Gains of (7) in the present mode: those of P where it works alone.
    #[inline]
    #[must_use]
    pub const fn active_gains(&self) -> &Gains<P::Real> {
        match self.0.mode {
            ControlMode::P => &self.0.position_gains,
            _ => &self.0.gains,
        }
    }

    /// Gains of P/F; from `gains`.
    #[inline]
    #[must_use]
    pub const fn gains(&self) -> &Gains<P::Real> {
        &self.0.gains
    }

    /// Gains of P alone; from `gains.position`.
    #[inline]
    #[must_use]
    pub const fn position_gains(&self) -> &Gains<P::Real> {
        &self.0.position_gains
    }

    /// Whether any k_v of the present mode is other than zero.
    #[inline]
    #[must_use]
    pub const fn damps(&self) -> bool {
        match self.0.mode {
            ControlMode::P => self.0.damps[1],
            ControlMode::F(_) => false,
            ControlMode::PF(_) => self.0.damps[0],
        }
    }

    /// K_e and h_e.
    #[inline]
    #[must_use]
    pub const fn environment(&self) -> &Environment<P::Real> {
        &self.0.environment
    }

    /// What the output lines show; from `trigger`.
    #[inline]
    #[must_use]
    pub const fn triggers(&self) -> &LineSettings<P> {
        &self.0.triggers
    }

    /// From words in the order of the controller's `CONFIG_NAMES`.
    ///
    /// # Errors
    /// The first word that is out of range.
    pub fn read(p: P, words: &[u64]) -> Result<Self, ConfigError> {
        Self::check(p, words)?;
        let Some(mode) = ControlMode::from_word(word(words, 0)) else {
            return Err(ConfigError { word: 0 });
        };
        let Some(interaction) = Interaction::from_word(word(words, 1)) else {
            return Err(ConfigError { word: 1 });
        };
        let set = |first: usize| Gains {
            proportional: six(words, first),
            integral: six(words, first + 6),
            derivative: six(words, first + 12),
        };
        let (gains, position_gains) = (set(CONFIG_GAINS), set(CONFIG_GAINS + 18));
        Ok(Self(Settings {
            mode,
            interaction,
            level_weight: P::Real::from_word(word(words, CONFIG_WEIGHTS)),
            drift_weight: P::Real::from_word(word(words, CONFIG_WEIGHTS + 1)),
            code_limits: CodeLimits {
                max_step: word(words, CONFIG_CODES) as i32,
                min: word(words, CONFIG_CODES + 1) as i32,
                max: word(words, CONFIG_CODES + 2) as i32,
            },
            damps: [damps(&gains), damps(&position_gains)],
            gains,
            position_gains,
            environment: Environment { stiffness: six(words, CONFIG_GAINS + 36), rest: six(words, CONFIG_GAINS + 42) },
            triggers: lines(p, words)?,
        }))
    }

    /// Writes the words in the order of the controller's `CONFIG_NAMES`.
    pub fn save(&self, words: &mut Writer<'_>) {
        words.word(self.0.mode.word());
        words.word(self.0.interaction.word());
        words.real(self.0.level_weight);
        words.real(self.0.drift_weight);
        let CodeLimits { max_step, min, max } = self.0.code_limits;
        for code in [max_step, min, max] {
            words.word(code as u32 as u64);
        }
        for gains in [&self.0.gains, &self.0.position_gains] {
            words.reals(&gains.proportional);
            words.reals(&gains.integral);
            words.reals(&gains.derivative);
        }
        words.reals(&self.0.environment.stiffness);
        words.reals(&self.0.environment.rest);
        for line in self.0.triggers.as_ref() {
            line.save(words);
        }
    }

    /// Every word is within its range, or the first that is not.
    #[inline(never)]
    fn check(p: P, words: &[u64]) -> Result<(), ConfigError> {
        for (word, value) in words.iter().enumerate() {
            match Permitted::of(p.permitted(), word) {
                Some(permitted) if permitted.takes(*value) => {}
                _ => return Err(ConfigError { word }),
            }
        }
        if word(words, CONFIG_CODES + 2) < word(words, CONFIG_CODES + 1) {
            return Err(ConfigError { word: CONFIG_CODES + 2 });
        }
        for (index, line) in lines(p, words)?.as_ref().iter().enumerate() {
            if line.stop < line.start {
                return Err(ConfigError { word: CONFIG_LINES + index * Line::<P::Real>::WORDS + LINE_STOP });
            }
        }
        Ok(())
    }
}

impl<P: Platform + Compiled> Config<P> {
    /// The spec's settings.
    #[must_use]
    pub const fn new() -> Self {
        Self(P::DEFAULTS)
    }

    /// The same in another mode. While running the change is bumpless.
    #[must_use]
    pub const fn with_mode(self, mode: ControlMode) -> Self {
        Self(Settings { mode, ..self.0 })
    }

    /// The same with the interaction force from elsewhere.
    #[must_use]
    pub const fn with_interaction(self, interaction: Interaction) -> Self {
        Self(Settings { interaction, ..self.0 })
    }

    /// The same with other weights per tick.
    ///
    /// # Errors
    /// A weight outside its range in the controller's `permitted::SETTINGS`. That they are stable on the platform is for the
    /// compiler to check, not for this function.
    pub fn with_weights(self, level_weight: P::Real, drift_weight: P::Real) -> Result<Self, ConfigError> {
        Self(Settings { level_weight, drift_weight, ..self.0 }).checked()
    }

    /// The same with other gains for P/F and for P alone.
    ///
    /// # Errors
    /// A gain outside its range in the controller's `permitted::SETTINGS`. That they are stable on the platform is for the compiler
    /// to check, not for this function.
    pub fn with_gains(self, gains: Gains<P::Real>, position_gains: Gains<P::Real>) -> Result<Self, ConfigError> {
        let damps = [damps(&gains), damps(&position_gains)];
        Self(Settings { gains, position_gains, damps, ..self.0 }).checked()
    }

    /// The same with another environment.
    ///
    /// # Errors
    /// A stiffness or a pose outside its range.
    pub fn with_environment(self, environment: Environment<P::Real>) -> Result<Self, ConfigError> {
        Self(Settings { environment, ..self.0 }).checked()
    }

    /// The same with other code limits.
    ///
    /// # Errors
    /// A step below one code or above `actuator.slew_rate`, or limits that leave the spec's voltage limits or are empty.
    pub fn with_code_limits(self, code_limits: CodeLimits) -> Result<Self, ConfigError> {
        Self(Settings { code_limits, ..self.0 }).checked()
    }

    /// The same with other output lines. Each whose settings are other than before begins anew, low.
    ///
    /// # Errors
    /// A number outside its range, or a line that ends before it starts.
    pub fn with_triggers(self, triggers: LineSettings<P>) -> Result<Self, ConfigError> {
        Self(Settings { triggers, ..self.0 }).checked()
    }

    /// From words in the order of the controller's `CONFIG_NAMES`.
    ///
    /// # Errors
    /// The first word that is out of range.
    pub fn from_words(words: &P::ConfigWords) -> Result<Self, ConfigError> {
        Self::read(P::CONSTANTS, words.as_ref())
    }

    /// Words in the order of the controller's `CONFIG_NAMES`.
    #[must_use]
    pub fn to_words(&self) -> P::ConfigWords {
        let mut all = P::ConfigWords::ZERO;
        self.save(&mut Writer::new(all.as_mut()));
        all
    }

    /// These settings, if each is within its range.
    #[inline(never)]
    fn checked(self) -> Result<Self, ConfigError> {
        Self::check(P::CONSTANTS, self.to_words().as_ref())?;
        Ok(self)
    }
}

/// The output lines of the words of settings.
fn lines<P: Platform>(p: P, words: &[u64]) -> Result<LineSettings<P>, ConfigError> {
    let mut lines = *p.lines();
    let mut reader = Reader::new(words.get(CONFIG_LINES..).unwrap_or_default());
    for line in lines.as_mut() {
        line.restore(&mut reader).map_err(|invalid| ConfigError { word: CONFIG_LINES + invalid.word })?;
    }
    Ok(lines)
}

/// Whether any k_v is other than zero.
fn damps<T: Real>(gains: &Gains<T>) -> bool {
    gains.derivative.iter().any(|gain| *gain != T::ZERO)
}
