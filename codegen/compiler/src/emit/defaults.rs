//! `src/defaults.rs`: the spec's settings, which `Config::new` of the law begins with. Reads [`ir::Defaults`](crate::ir::Defaults)
//! and, of a platform, [`ir::PlatformDefaults`](crate::ir::PlatformDefaults).

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::literal;
use crate::ir::{self, Gains, Interaction, Ir, Law, Mode, PlatformDefaults, Setpoint};

pub fn emit(ir: &Ir) -> TokenStream {
    let leg_gain = literal::real(ir.scalar, ir.scalar.round(ir.defaults.leg_gain));
    let max_step = literal::integer(ir.defaults.max_step);
    let step_doc = format!(
        " Most converter codes that a leg moves in a tick: `actuator.slew_rate` over a `timing.period` of {} s.",
        ir.defaults.period
    );
    let (imports, of_kind) = match &ir.task_space {
        None => legs(ir),
        Some(task) => platform(ir, &task.defaults),
    };
    quote! {
        #![doc = " The spec's settings: what `Config::new` holds."]

        #imports
        use crate::Real;

        /// ρ̂ of a leg, m/V; from `actuator`. X = q̂/ρ̂ is the virtual drive of (AII.1); mode P takes the leg as linear: u = q/ρ̂.
        pub const LEG_GAIN: Real = #leg_gain;
        #[doc = #step_doc]
        pub(crate) const MAX_STEP: i32 = #max_step;
        #of_kind
    }
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
    let constants = quote! {
        /// From `adaptation.mode`.
        pub(crate) const LAW: Law = #law;
        /// From `controller.setpoint`.
        pub(crate) const SETPOINT: SetpointKind = #setpoint;
        /// From `adaptation.level_weight`.
        pub(crate) const LEVEL_WEIGHT: Real = #level_weight;
        /// From `adaptation.drift_weight`.
        pub(crate) const DRIFT_WEIGHT: Real = #drift_weight;
        /// Ticks of a run; from `adaptation.run_interval`.
        pub(crate) const RUN_INTERVAL: u32 = #run_interval;
    };
    (quote! { use specgen_runtime::{Law, SetpointKind}; }, constants)
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
    let constants = quote! {
        /// From `control.mode` and `adaptation.mode`.
        pub(crate) const MODE: ControlMode = #mode;
        /// From `control.interaction`.
        pub(crate) const INTERACTION: Interaction = #interaction;
        /// From `adaptation`.
        pub(crate) const LEVEL_WEIGHT: Real = #level_weight;
        /// From `adaptation`.
        pub(crate) const DRIFT_WEIGHT: Real = #drift_weight;
        /// Of P/F; from `gains` or the start rule.
        pub(crate) const GAINS: Gains<Real> = #combined;
        /// Of P; from `gains` or the start rule.
        pub(crate) const POSITION_GAINS: Gains<Real> = #position;
        /// K_e; from `environment`.
        pub(crate) const ENVIRONMENT_STIFFNESS: [Real; 6] = [#stiffness];
        /// h_e; from `environment`.
        pub(crate) const ENVIRONMENT_REST: [Real; 6] = [#rest];
        /// Output lines; from `trigger`.
        pub const LINES: usize = #lines;
        /// Whether there is an input line; from `trigger`.
        pub const INPUT: bool = #input;
        /// What each output shows.
        pub(crate) const TRIGGERS: [Line<Real>; LINES] = [#(#triggers),*];
    };
    let imports = quote! {
        use specgen_runtime::trigger::Line;
        use specgen_runtime::{ControlMode, Gains, Interaction #import_law};
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
