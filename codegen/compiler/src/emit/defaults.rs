//! `src/defaults.rs`: the spec's settings, from which the law's `Config::new` starts. Reads [`ir::Defaults`](crate::ir::Defaults)
//! and, for a platform, [`ir::PlatformDefaults`](crate::ir::PlatformDefaults).

use std::fmt::Debug;

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

use super::literal;
use crate::ir::{Gains, Ir, PlatformDefaults};

pub fn emit(ir: &Ir) -> TokenStream {
    let leg_gain = literal::real(ir.scalar, ir.scalar.round(ir.defaults.leg_gain));
    let (imports, of_kind) = match &ir.task_space {
        None => legs(ir),
        Some(task) => platform(ir, &task.defaults),
    };
    quote! {
        #![doc = " The spec's settings: what `Config::new` holds."]

        #imports
        use crate::identity::Constants;
        use crate::{Real, limits};

        /// ρ̂ of a leg, m/V; from `actuator`. X = q̂/ρ̂ is the virtual drive of (AII.1); mode P takes the leg as linear: u = q/ρ̂.
        pub const LEG_GAIN: Real = #leg_gain;
        #of_kind
    }
}

/// Code limits of converter and amplifiers.
fn code_limits(ir: &Ir) -> TokenStream {
    let max_step = literal::integer(ir.defaults.max_step);
    quote! { CodeLimits { min: limits::CODES[0], max: limits::CODES[1], max_step: #max_step } }
}

fn legs(ir: &Ir) -> (TokenStream, TokenStream) {
    let d = &ir.defaults;
    let real = |value| literal::real(ir.scalar, value);
    let (law, setpoint) = (variant(&d.law), variant(&d.setpoint));
    let (level_weight, drift_weight) = (real(d.level_weight), real(d.drift_weight));
    let run_interval = literal::count(d.run_interval as usize);
    let code_limits = code_limits(ir);
    let constants = quote! {
        /// Values of `Config::new`.
        pub(crate) const DEFAULTS: Settings<Constants> = Settings {
            law: Law::#law,
            setpoint: SetpointKind::#setpoint,
            level_weight: #level_weight,
            drift_weight: #drift_weight,
            run_interval: #run_interval,
            code_limits: #code_limits,
        };
    };
    let imports = quote! {
        use specgen_law::legs::Settings;
        use specgen_runtime::{CodeLimits, Law, SetpointKind};
    };
    (imports, constants)
}

fn platform(ir: &Ir, d: &PlatformDefaults) -> (TokenStream, TokenStream) {
    let real = |value| literal::real(ir.scalar, value);
    let six = |values: &[f64; 6]| literal::reals(ir.scalar, values);
    let (law, mode, interaction) = (variant(&d.law), variant(&d.mode), variant(&d.interaction));
    let has_law = d.mode != specgen_runtime::ControlMode::P;
    let with_law = has_law.then(|| quote! { (Law::#law) });
    let import_law = has_law.then(|| quote! { , Law });
    let gains = |of: &Gains| literal::constant!(ir.scalar, gains, of);
    let (combined, position) = (gains(&d.gains), gains(&d.position_gains));
    let (stiffness, rest) = (six(&d.environment_stiffness), six(&d.environment_rest));
    let (level_weight, drift_weight) = (real(d.level_weight), real(d.drift_weight));
    let (lines, triggers) = (literal::count(d.triggers.len()), literal::constant!(ir.scalar, lines, d));
    let input = d.input;
    let code_limits = code_limits(ir);
    let [damps, position_damps] =
        [&d.gains, &d.position_gains].map(|gains| gains.derivative.iter().any(|gain| ir.scalar.round(*gain) != 0.0));
    let constants = quote! {
        /// Values of `Config::new`.
        pub(crate) const DEFAULTS: Settings<Constants> = Settings {
            mode: ControlMode::#mode #with_law,
            interaction: Interaction::#interaction,
            level_weight: #level_weight,
            drift_weight: #drift_weight,
            code_limits: #code_limits,
            gains: #combined,
            position_gains: #position,
            environment: Environment { stiffness: [#stiffness], rest: [#rest] },
            damps: [#damps, #position_damps],
            triggers: TRIGGERS,
        };
        /// Output lines; from `trigger`.
        pub const LINES: usize = #lines;
        /// Whether there is an input line; from `trigger`.
        pub const INPUT: bool = #input;
        /// Source of each output.
        pub(crate) const TRIGGERS: [Line<Real>; LINES] = #triggers;
    };
    let imports = quote! {
        use specgen_law::platform::{Environment, Settings};
        use specgen_runtime::trigger::Line;
        use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction #import_law};
    };
    (imports, constants)
}

/// The name of a variant, without its fields.
fn variant(value: &impl Debug) -> Ident {
    let shown = format!("{value:?}");
    format_ident!("{}", shown.split('(').next().unwrap_or(&shown))
}
