//! `src/config.rs` of six legs: what may change while running. Reads [`ir::Defaults`](crate::ir::Defaults).

use proc_macro2::TokenStream;
use quote::quote;

use crate::emit::{config, literal};
use crate::ir::{Ir, Law, Setpoint};

pub fn emit(ir: &Ir) -> TokenStream {
    let d = &ir.defaults;
    let law = match d.law {
        Law::Invhys => quote! { Law::Invhys },
        Law::Ewma => quote! { Law::Ewma },
        Law::Pcc => quote! { Law::Pcc },
    };
    let setpoint = match d.setpoint {
        Setpoint::Pose => quote! { SetpointKind::Pose },
        Setpoint::Leg => quote! { SetpointKind::Leg },
    };
    let level_weight = literal::real(ir.scalar, d.level_weight);
    let drift_weight = literal::real(ir.scalar, d.drift_weight);
    let run_interval = literal::count(d.run_interval as usize);
    let max_step = literal::integer(d.max_step);
    let leg_gain = literal::real(ir.scalar, ir.scalar.round(d.leg_gain));
    let step_doc = format!(" The largest step is `actuator.slew_rate` over a `timing.period` of {} s.", d.period);
    let code_limits = config::code_limits();
    quote! {
        #![doc = " What may change while running. Its defaults are the spec's; another tuning is another `Config`, never another build."]

        use specgen_runtime::{CodeLimits, Law};

        use crate::words::{CONFIG_CODES, CONFIG_WORDS};
        use crate::{Real, limits, permitted};

        /// ρ̂ of a leg, m/V; from `actuator`. The virtual drive of (AII.1) is X = q̂/ρ̂; the tick itself needs only q̂.
        pub const LEG_GAIN: Real = #leg_gain;

        /// What the six set-point numbers are.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum SetpointKind {
            /// Pose from rest: m, rad.
            Pose,
            /// Leg displacements, m.
            Leg,
        }

        /// A value that a [`Config`] cannot hold.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub struct ConfigError {
            /// The word of [`crate::CONFIG_NAMES`] that is out of range.
            pub word: usize,
        }

        /// Checked settings. Every value it holds keeps the tick within its promises.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Config {
            law: Law,
            setpoint: SetpointKind,
            level_weight: Real,
            drift_weight: Real,
            run_interval: u32,
            code_limits: CodeLimits,
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
                Self {
                    law: #law,
                    setpoint: #setpoint,
                    level_weight: #level_weight,
                    drift_weight: #drift_weight,
                    run_interval: #run_interval,
                    code_limits: CodeLimits { min: limits::CODES[0], max: limits::CODES[1], max_step: #max_step },
                }
            }

            /// Adaptation law; from `adaptation.mode`.
            #[inline]
            #[must_use]
            pub const fn law(&self) -> Law {
                self.law
            }

            /// Meaning of the set-point; from `controller.setpoint`.
            #[inline]
            #[must_use]
            pub const fn setpoint(&self) -> SetpointKind {
                self.setpoint
            }

            /// ω (EWMA) or ω1 (PCC) per run, within [0, 1]; from `adaptation.level_weight`.
            #[inline]
            #[must_use]
            pub const fn level_weight(&self) -> Real {
                self.level_weight
            }

            /// ω2 (PCC) per run, within [0, 1]; from `adaptation.drift_weight`.
            #[inline]
            #[must_use]
            pub const fn drift_weight(&self) -> Real {
                self.drift_weight
            }

            /// Control ticks per run, at least one; from `adaptation.run_interval`.
            #[inline]
            #[must_use]
            pub const fn run_interval(&self) -> u32 {
                self.run_interval
            }

            /// Voltage limits and slew limit in converter codes.
            #[inline]
            #[must_use]
            pub const fn code_limits(&self) -> CodeLimits {
                self.code_limits
            }

            /// The same with another law.
            #[must_use]
            pub const fn with_law(self, law: Law) -> Self {
                Self { law, ..self }
            }

            /// The same with another meaning of the set-point.
            #[must_use]
            pub const fn with_setpoint(self, setpoint: SetpointKind) -> Self {
                Self { setpoint, ..self }
            }

            /// The same with other weights per run.
            ///
            /// # Errors
            /// A weight outside its range in [`permitted::SETTINGS`]. That they are stable on the platform is for the
            /// compiler to check, not for this function.
            pub fn with_weights(self, level_weight: Real, drift_weight: Real) -> Result<Self, ConfigError> {
                Self { level_weight, drift_weight, ..self }.checked()
            }

            /// The same with another run interval.
            ///
            /// # Errors
            /// An interval outside its range.
            pub fn with_run_interval(self, run_interval: u32) -> Result<Self, ConfigError> {
                Self { run_interval, ..self }.checked()
            }

            #code_limits
        }
    }
}
