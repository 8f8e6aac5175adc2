//! `src/config.rs` of a platform: what may change while running. Reads
//! [`ir::PlatformDefaults`](crate::ir::PlatformDefaults).

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::{config, literal};
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
    let code_limits = config::code_limits();
    quote! {
        #![doc = " What may change while running. Its defaults are the spec's; another tuning is another `Config`, never another build."]

        use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction #import_law};

        use crate::words::{CONFIG_CODES, CONFIG_WORDS};
        use crate::{Real, limits, permitted};

        /// ρ̂ of a leg, m/V; from `actuator`. Mode P takes the leg as linear: u = q/ρ̂.
        pub const LEG_GAIN: Real = #leg_gain;
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

            #code_limits
        }

        /// Whether any k_v is other than zero.
        pub(crate) const fn damps(gains: &Gains<Real>) -> bool {
            let [x, y, z, tilt_x, tilt_y, tilt_z] = gains.derivative;
            x != 0.0 || y != 0.0 || z != 0.0 || tilt_x != 0.0 || tilt_y != 0.0 || tilt_z != 0.0
        }
    }
}
