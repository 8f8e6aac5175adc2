//! `src/defaults.rs`: the spec's settings, which `Config::new` of the law begins with. Reads [`ir::Defaults`](crate::ir::Defaults)
//! and, of a platform, [`ir::PlatformDefaults`](crate::ir::PlatformDefaults).

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::literal;
use crate::ir::{self, Gains, Interaction, Ir, Law, Mode, PlatformDefaults, Setpoint};

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

/// What the converter and the amplifiers let through.
fn code_limits(ir: &Ir) -> TokenStream {
    let max_step = literal::integer(ir.defaults.max_step);
    quote! { CodeLimits { min: limits::CODES[0], max: limits::CODES[1], max_step: #max_step } }
}

fn law(law: Law) -> TokenStream {
    match law {
        Law::Invhys => quote! { Law::Invhys },
        Law::Ewma => quote! { Law::Ewma },
        Law::Pcc => quote! { Law::Pcc },
    }
}

fn legs(ir: &Ir) -> (TokenStream, TokenStream) {
    let d = &ir.defaults;
    let real = |value| literal::real(ir.scalar, value);
    let law = law(d.law);
    let setpoint = match d.setpoint {
        Setpoint::Pose => quote! { SetpointKind::Pose },
        Setpoint::Leg => quote! { SetpointKind::Leg },
    };
    let (level_weight, drift_weight) = (real(d.level_weight), real(d.drift_weight));
    let run_interval = literal::count(d.run_interval as usize);
    let code_limits = code_limits(ir);
    let constants = quote! {
        /// What `Config::new` holds.
        pub(crate) const DEFAULTS: Settings<Constants> = Settings {
            law: #law,
            setpoint: #setpoint,
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
    let law = law(d.law);
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
    let (lines, triggers) = (literal::count(d.triggers.len()), d.triggers.iter().map(|line| of_line(ir, line)));
    let input = d.input;
    let code_limits = code_limits(ir);
    let [damps, position_damps] =
        [&d.gains, &d.position_gains].map(|gains| gains.derivative.iter().any(|gain| ir.scalar.round(*gain) != 0.0));
    let constants = quote! {
        /// What `Config::new` holds.
        pub(crate) const DEFAULTS: Settings<Constants> = Settings {
            mode: #mode,
            interaction: #interaction,
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
        /// What each output shows.
        pub(crate) const TRIGGERS: [Line<Real>; LINES] = [#(#triggers),*];
    };
    let imports = quote! {
        use specgen_law::platform::{Environment, Settings};
        use specgen_runtime::trigger::Line;
        use specgen_runtime::{CodeLimits, ControlMode, Gains, Interaction #import_law};
    };
    (imports, constants)
}

fn of_line(ir: &Ir, line: &ir::Line) -> TokenStream {
    let real = |value| literal::real(ir.scalar, value);
    let whole = |value| literal::count(value as usize);
    let (kind, direction) =
        (format_ident!("{}", format!("{:?}", line.kind)), format_ident!("{}", format!("{:?}", line.direction)));
    let axis = literal::count(line.axis);
    let [start, stop, step, hysteresis] = [line.start, line.stop, line.step, line.hysteresis].map(real);
    let [first, every, last] = [line.first, line.every, line.last].map(whole);
    let width = literal::integer(line.width);
    quote! {
        Line {
            kind: specgen_runtime::trigger::Kind::#kind,
            axis: #axis,
            direction: specgen_runtime::trigger::Direction::#direction,
            start: #start,
            stop: #stop,
            step: #step,
            hysteresis: #hysteresis,
            first: #first,
            every: #every,
            last: #last,
            width: #width,
        }
    }
}
