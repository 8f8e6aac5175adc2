//! `src/config.rs` of a platform: what may change while running. Reads
//! [`ir::PlatformDefaults`](crate::ir::PlatformDefaults).

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::literal;
use crate::ir::{Gains, Interaction, Ir, Law, Mode, PlatformDefaults};

pub fn emit(ir: &Ir, d: &PlatformDefaults) -> TokenStream {
    let real = |value| literal::real(ir.scalar, value);
    let six = |values: &[f64; 6]| literal::reals(ir.scalar, values);
    let law = match d.law {
        Law::Invhys => quote! { Law::Invhys },
        Law::Ewma => quote! { Law::Ewma },
        Law::Pcc => quote! { Law::Pcc },
    };
    let mode = match d.mode {
        Mode::P => quote! { ControlMode::P },
        Mode::F => quote! { ControlMode::F(#law) },
        Mode::PF => quote! { ControlMode::PF(#law) },
    };
    let import_law = (d.mode != Mode::P).then(|| quote! { , Law });
    let interaction = match d.interaction {
        Interaction::Neglected => quote! { Interaction::Neglected },
        Interaction::Modelled => quote! { Interaction::Modelled },
        Interaction::Measured => quote! { Interaction::Measured },
    };
    let gains = |gains: &Gains| {
        let (proportional, integral, derivative) =
            (six(&gains.proportional), six(&gains.integral), six(&gains.derivative));
        quote! { Gains { proportional: [#proportional], integral: [#integral], derivative: [#derivative] } }
    };
    let (combined, position) = (gains(&d.gains), gains(&d.position_gains));
    let (stiffness, rest) = (six(&d.environment_stiffness), six(&d.environment_rest));
    let (level_weight, drift_weight) = (real(d.level_weight), real(d.drift_weight));
    let leg_gain = real(ir.scalar.round(ir.defaults.leg_gain));
    let max_step = literal::integer(ir.defaults.max_step);
    let period = ir.defaults.period;
    let step_doc = format!(" The largest step is `actuator.slew_rate` over a `timing.period` of {period} s.");
    quote! {
        #![doc = " What may change while running. Its defaults are the spec's; another tuning is another `Config`, never another build."]

        use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction #import_law};

        use crate::words::{CONFIG_CODES, CONFIG_GAINS, CONFIG_WEIGHTS};
        use crate::{Real, limits};

        /// ρ̂ of a leg, m/V; from `actuator`. Mode P takes the leg as linear: u = q/ρ̂.
        pub const LEG_GAIN: Real = #leg_gain;
        /// Largest gain, stiffness and weight that a [`Config`] takes: products with it stay finite in both scalars.
        pub const LARGEST_GAIN: Real = 1e15;
        /// Largest |component| of the pose at which the environment is unloaded, m and rad.
        pub const LARGEST_REST: Real = 1.0;

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
            mode: ControlMode,
            interaction: Interaction,
            level_weight: Real,
            drift_weight: Real,
            code_limits: CodeLimits,
            gains: Gains<Real>,
            position_gains: Gains<Real>,
            environment: Environment,
            damps: [bool; 2],
        }

        impl Default for Config {
            fn default() -> Self {
                Self::new()
            }
        }

        impl Config {
            /// The spec's settings.
            #[doc = #step_doc]
            #[must_use]
            pub const fn new() -> Self {
                let gains = #combined;
                let position_gains = #position;
                Self {
                    mode: #mode,
                    interaction: #interaction,
                    level_weight: #level_weight,
                    drift_weight: #drift_weight,
                    code_limits: CodeLimits { min: limits::CODES[0], max: limits::CODES[1], max_step: #max_step },
                    gains,
                    position_gains,
                    environment: Environment { stiffness: [#stiffness], rest: [#rest] },
                    damps: [damps(&gains), damps(&position_gains)],
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
            /// A weight outside [0, 1]. That they are stable on the platform is for the
            /// compiler to check, not for this function.
            pub fn with_weights(self, level_weight: Real, drift_weight: Real) -> Result<Self, ConfigError> {
                if !(0.0..=1.0).contains(&level_weight) {
                    return Err(ConfigError { word: CONFIG_WEIGHTS });
                }
                if !(0.0..=1.0).contains(&drift_weight) {
                    return Err(ConfigError { word: CONFIG_WEIGHTS + 1 });
                }
                Ok(Self { level_weight, drift_weight, ..self })
            }

            /// The same with other code limits.
            ///
            /// # Errors
            /// A step below one code, or limits that leave the spec's voltage limits or are empty.
            pub const fn with_code_limits(self, code_limits: CodeLimits) -> Result<Self, ConfigError> {
                if code_limits.max_step < 1 {
                    return Err(ConfigError { word: CONFIG_CODES });
                }
                if code_limits.min < limits::CODES[0] || code_limits.min > limits::CODES[1] {
                    return Err(ConfigError { word: CONFIG_CODES + 1 });
                }
                if code_limits.max < code_limits.min || code_limits.max > limits::CODES[1] {
                    return Err(ConfigError { word: CONFIG_CODES + 2 });
                }
                Ok(Self { code_limits, ..self })
            }

            /// The same with other gains for P/F and for P alone.
            ///
            /// # Errors
            /// A gain that is negative, not finite or above [`LARGEST_GAIN`]. That they are stable on the platform is for
            /// the compiler to check, not for this function.
            pub fn with_gains(self, gains: Gains<Real>, position_gains: Gains<Real>) -> Result<Self, ConfigError> {
                let mut word = CONFIG_GAINS;
                for set in [&gains, &position_gains] {
                    for gain in [&set.proportional, &set.integral, &set.derivative] {
                        within(gain, 0.0, LARGEST_GAIN, word)?;
                        word += 6;
                    }
                }
                let damps = [damps(&gains), damps(&position_gains)];
                Ok(Self { gains, position_gains, damps, ..self })
            }

            /// The same with another environment.
            ///
            /// # Errors
            /// A stiffness that is negative, not finite or above [`LARGEST_GAIN`], or a pose beyond [`LARGEST_REST`].
            pub fn with_environment(self, environment: Environment) -> Result<Self, ConfigError> {
                within(&environment.stiffness, 0.0, LARGEST_GAIN, CONFIG_GAINS + 36)?;
                within(&environment.rest, -LARGEST_REST, LARGEST_REST, CONFIG_GAINS + 42)?;
                Ok(Self { environment, ..self })
            }
        }

        /// Every value is within the range, or the word of the first that is not.
        fn within(values: &[Real; 6], low: Real, high: Real, first_word: usize) -> Result<(), ConfigError> {
            for (axis, value) in values.iter().enumerate() {
                if !(low..=high).contains(value) {
                    return Err(ConfigError { word: first_word + axis });
                }
            }
            Ok(())
        }

        /// Whether any k_v is other than zero.
        const fn damps(gains: &Gains<Real>) -> bool {
            let [x, y, z, tilt_x, tilt_y, tilt_z] = gains.derivative;
            x != 0.0 || y != 0.0 || z != 0.0 || tilt_x != 0.0 || tilt_y != 0.0 || tilt_z != 0.0
        }
    }
}
