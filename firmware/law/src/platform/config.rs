//! The settings of a platform.

use specgen_runtime::snapshot::{Field, LARGEST_PLACE, Reader, Snapshot as _, Writer};
use specgen_runtime::trigger::{Line, OutputLines};
use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction, Real};

use super::constants::Platform;
use crate::spec::{self, ConfigError};
use crate::words::{code_limits, save_code_limits, six, word};

/// First word of the gains and of the output lines.
const GAINS: usize = 7;
const LINES: usize = GAINS + 48;

/// Index of the end of a line among its words.
const LINE_STOP: usize = 4;

/// Settings of a platform's output lines.
type LineSettings<P> = <<P as Platform>::Lines as OutputLines<<P as spec::Spec>::Real>>::Settings;

specgen_runtime::state! { |words|
    /// K_e (h − h_e): a linear model of the environment.
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
    /// P, F or P/F with its run-to-run law; from `control.mode` and `adaptation.mode`.
    pub mode: ControlMode,
    /// Source of the interaction force of (7); from `control.interaction`.
    pub interaction: Interaction,
    /// ω (EWMA) or ω1 (PCC) per tick, within [0, 1]; from `adaptation`.
    pub level_weight: P::Real,
    /// ω2 (PCC) per tick, within [0, 1]; from `adaptation`.
    pub drift_weight: P::Real,
    /// Voltage limits and slew limit in converter codes; from `actuator` and `dac`.
    pub code_limits: CodeLimits,
    /// Gains of P/F with EWMA or PCC; from `gains` or the start rule.
    pub gains: Gains<P::Real>,
    /// Gains of P and of P/F with Invhys; from `position_gains` or the start rule.
    pub position_gains: Gains<P::Real>,
    /// K_e and h_e; from `environment`.
    pub environment: Environment<P::Real>,
    /// Whether any k_v is non-zero: of `gains`, of `position_gains`.
    pub damps: [bool; 2],
    /// Functions of the output lines; from `trigger`.
    pub triggers: LineSettings<P>,
}

impl<P: Platform> Settings<P> {
    /// Gains of (7) in the present mode.
    #[inline]
    #[must_use]
    pub const fn active_gains(&self) -> &Gains<P::Real> {
        if self.mode.uses_position_gains() { &self.position_gains } else { &self.gains }
    }

    /// Whether any k_v of the present mode is non-zero.
    #[inline]
    #[must_use]
    pub const fn damps(&self) -> bool {
        if self.mode.uses_position_gains() { self.damps[1] } else { self.mode.feeds_back() && self.damps[0] }
    }
}

impl<P: Platform> spec::Settings<P> for Settings<P> {
    const CODES: usize = 4;

    #[inline(always)]
    fn code_limits(&self) -> CodeLimits {
        self.code_limits
    }

    fn read(p: P, words: &[u64]) -> Result<Self, ConfigError> {
        let triggers = lines(p, words)?;
        let set = |first: usize| Gains {
            proportional: six(words, first),
            integral: six(words, first + 6),
            derivative: six(words, first + 12),
        };
        let (gains, position_gains) = (set(GAINS), set(GAINS + 18));
        Ok(Self {
            mode: ControlMode::from_word(word(words, 0)).ok_or(ConfigError { word: 0 })?,
            interaction: Interaction::from_word(word(words, 1)).ok_or(ConfigError { word: 1 })?,
            level_weight: P::Real::from_word(word(words, 2)),
            drift_weight: P::Real::from_word(word(words, 3)),
            code_limits: code_limits(words, Self::CODES),
            damps: [damps(&gains), damps(&position_gains)],
            gains,
            position_gains,
            environment: Environment { stiffness: six(words, GAINS + 36), rest: six(words, GAINS + 42) },
            triggers,
        })
    }

    fn save(&self, words: &mut Writer<'_>) {
        words.word(self.mode.word());
        words.word(self.interaction.word());
        words.real(self.level_weight);
        words.real(self.drift_weight);
        save_code_limits(&self.code_limits, words);
        for gains in [&self.gains, &self.position_gains] {
            words.reals(&gains.proportional);
            words.reals(&gains.integral);
            words.reals(&gains.derivative);
        }
        words.reals(&self.environment.stiffness);
        words.reals(&self.environment.rest);
        for line in self.triggers.as_ref() {
            line.save(words);
        }
    }
}

/// The output lines in the words of settings; none if a line ends before it starts.
fn lines<P: Platform>(p: P, words: &[u64]) -> Result<LineSettings<P>, ConfigError> {
    let mut lines = *p.lines();
    let mut reader = Reader::new(words.get(LINES..).unwrap_or_default());
    for line in lines.as_mut() {
        line.restore(&mut reader).map_err(|invalid| ConfigError { word: LINES + invalid.word })?;
    }
    for (index, line) in lines.as_ref().iter().enumerate() {
        if line.stop < line.start {
            return Err(ConfigError { word: LINES + index * Line::<P::Real>::WORDS + LINE_STOP });
        }
    }
    Ok(lines)
}

/// Whether any k_v is non-zero.
fn damps<T: Real>(gains: &Gains<T>) -> bool {
    gains.derivative.iter().any(|gain| *gain != T::ZERO)
}
