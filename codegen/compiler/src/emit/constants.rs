//! `src/constants.rs`: the emitted constants as the law asks for them, one accessor each. The text is the same for every spec of a kind;
//! what differs are the constants and types that it names.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::literal::parsed;
use crate::ir::Ir;

/// Accessor, its type, its value.
type Row = (&'static str, &'static str, &'static str);

/// Of both laws.
const SPEC: &[Row] = &[
    ("tables", "&[Table; LEGS]", "&TABLES"),
    ("dac", "&Dac<Real>", "&limits::DAC"),
    ("supervision", "&Supervision<Real>", "&supervision::SUPERVISION"),
    ("raw_limits", "&[[Real; 2]; 6]", "&gauges::RAW_LIMITS"),
    ("readings_per_leg", "&[[Real; LEGS]; 6]", "&supervision::READINGS_PER_LEG"),
    ("geometry", "&Legs<'_, Real>", "&geometry::GEOMETRY"),
    ("inverse_jacobian", "&[[Real; LEGS]; 6]", "&geometry::INVERSE_JACOBIAN"),
    ("corrections", "usize", "geometry::CORRECTIONS"),
    ("pose_bound", "&[Real; 6]", "&geometry::POSE_BOUND"),
    ("permitted", "&[(Permitted<Real>, usize)]", "&permitted::SETTINGS"),
    ("sizes", "Sizes", "permitted::STATE"),
    ("reset", "Reset<Self>", "supervision::at_rest()"),
];

/// Of a platform in task space.
const PLATFORM: &[Row] = &[
    ("period", "Real", "task_space::PERIOD"),
    ("compliance", "Real", "task_space::COMPLIANCE"),
    ("wrench_to_legs", "&[[Real; 6]; LEGS]", "&task_space::WRENCH_TO_LEGS"),
    ("legs_to_wrench", "&[[Real; LEGS]; 6]", "&task_space::LEGS_TO_WRENCH"),
    ("force_to_modes", "&[[Real; 6]; 6]", "&task_space::FORCE_TO_MODES"),
    ("legs_to_modes", "&[[Real; LEGS]; 6]", "&task_space::LEGS_TO_MODES"),
    ("modes_to_legs", "&[[Real; 6]; LEGS]", "&task_space::MODES_TO_LEGS"),
    ("body", "&specgen_runtime::Platform<Real>", "&body::PLATFORM"),
    ("affine_load", "Option<&Affine<Real>>", "const { task_space::AFFINE_LOAD.as_ref() }"),
    ("rest_force", "&[Real; LEGS]", "&task_space::REST_FORCE"),
    ("wrench_limit", "&[Real; 6]", "&task_space::WRENCH_LIMIT"),
    ("lead", "Real", "task_space::LEAD"),
    ("own_leads", "&[Real]", "&task_space::OWN_LEADS"),
    ("transfer_keep", "Real", "task_space::TRANSFER_KEEP"),
    ("transfer_negligible", "Real", "task_space::TRANSFER_NEGLIGIBLE"),
    ("cells_per_metre", "Real", "task_space::CELLS_PER_METRE"),
    ("metres_per_cell", "Real", "task_space::METRES_PER_CELL"),
    ("notch", "Option<&Notch<Real>>", "const { task_space::NOTCH.as_ref() }"),
    ("damping", "&[Resonator<Real>; task_space::DAMPED]", "&task_space::DAMPING"),
    ("hands_over", "bool", "task_space::HANDS_OVER"),
    ("correction", "&[CorrectionLimit<Real>; task_space::CORRECTED]", "&task_space::CORRECTION"),
    ("lines", "&[Line<Real>; defaults::LINES]", "&defaults::TRIGGERS"),
    ("setpoints", "&Setpoints<Real, setpoint::UserFrames>", "&setpoint::SETPOINTS"),
    ("gauges", "&Gauges<'_, Real>", "&gauges::GAUGES"),
    ("calibration", "Option<&gauges::Meaning>", "const { gauges::CALIBRATION.as_ref() }"),
    ("rate_filter", "&RateFilter<Real>", "&gauges::RATE"),
];

/// Types with a size of its own.
const PLATFORM_TYPES: &[(&str, &str)] = &[
    ("Damping", "Damping<Real, { task_space::DAMPED }>"),
    ("Correction", "Correction<Real, { task_space::CORRECTED }>"),
    ("Lines", "Triggers<Real, { defaults::LINES }>"),
    ("Frames", "setpoint::UserFrames"),
    ("Calibration", "gauges::Meaning"),
];

/// Of six legs with their own gauges.
const LEGS: &[Row] = &[
    ("lead", "Real", "hysteresis::LEAD"),
    ("lead_limit", "Real", "hysteresis::LEAD_LIMIT"),
    ("leg_setpoint", "&[Real; 2]", "&gauges::LEG_SETPOINT"),
    ("leg_gain", "Real", "defaults::LEG_GAIN"),
    ("period_seconds", "f64", "PERIOD_SECONDS"),
    ("approach_keep", "Real", "supervision::APPROACH_KEEP"),
    ("approach_negligible", "Real", "supervision::APPROACH_NEGLIGIBLE"),
];

pub fn emit(ir: &Ir) -> TokenStream {
    let spec = accessors(SPEC);
    let (module, kind, law, types, rows) = match ir.task_space {
        Some(_) => ("platform", "Platform", "TaskSpace", PLATFORM_TYPES, PLATFORM),
        None => ("legs", "SixLegs", "LegSpace", &[("Lead", "Lead<Real, { hysteresis::LED as usize }>")][..], LEGS),
    };
    let [module, kind, law] = [module, kind, law].map(|name| format_ident!("{name}"));
    let types = types.iter().map(|(name, is)| {
        let (name, is) = (format_ident!("{name}"), parsed(is));
        quote! { type #name = #is; }
    });
    let of_kind = accessors(rows);
    let imports = parsed(match ir.task_space {
        Some(_) => {
            "use specgen_runtime::setpoint::Setpoints;
            use specgen_runtime::trigger::{Line, Triggers};
            use specgen_runtime::{
                Affine, Correction, CorrectionLimit, Dac, Damping, Gauges, Legs, Notch, Permitted, RateFilter, Resonator,
            };
            use crate::{LEGS, Real, body, defaults, gauges, geometry, limits, permitted, setpoint, supervision, task_space};"
        }
        None => {
            "use specgen_law::legs::Lead;
            use specgen_runtime::{Dac, Legs, Permitted};
            use crate::{
                LEGS, PERIOD_SECONDS, Real, defaults, gauges, geometry, hysteresis, limits, permitted, supervision,
            };"
        }
    });
    quote! {
        #![doc = " The constants of this controller, as the law asks for them."]

        use specgen_law::#module::{#kind, #law};
        use specgen_law::{Reset, Spec};
        use specgen_runtime::snapshot::Sizes;
        use specgen_runtime::supervisor::Supervision;
        #imports
        use crate::hysteresis::{Memory, TABLES, Table};
        use crate::identity::Constants;

        impl Spec for Constants {
            type Real = Real;
            type Law = #law;
            type Table = Table;
            type Memory = Memory;
            #spec
        }

        impl #kind for Constants {
            #(#types)*
            #of_kind
        }
    }
}

fn accessors(rows: &[Row]) -> TokenStream {
    let accessors = rows.iter().map(|(name, result, value)| {
        let (name, result, value) = (format_ident!("{name}"), parsed(result), parsed(value));
        quote! {
            #[inline(always)]
            fn #name(&self) -> #result {
                #value
            }
        }
    });
    quote! { #(#accessors)* }
}
