//! `src/hysteresis.rs`: the Everett tables. Reads [`ir::Hysteresis`](crate::ir::Hysteresis); exports `TABLES` and the types
//! of table and memory: of the static model, or of one with rate dependence or creep. All three have the same interface.

use proc_macro2::{Ident, Literal, TokenStream};
use quote::{format_ident, quote};

use super::literal;
use crate::ir::{Ir, LEGS, Plays, RateModel, Scalar};

pub fn emit(ir: &Ir) -> TokenStream {
    let h = &ir.hysteresis;
    let (grid, memory) = (literal::count(h.grid), literal::count(h.memory));
    let doc = "Everett function of leg {}, m: E(i, j) for `up` threshold i = 0..=N and, in each row, `down` threshold j = 0..=i; from `hysteresis.records`.";
    let (mut tables, of_leg) = statics(ir.scalar, &h.tables, &h.table_of_leg, "EVERETT", doc);
    let Rate { imports, types: [table, memory_type], entries, constants } = rate(ir, &of_leg);
    if h.has_plays() {
        tables.clear();
    }
    let rate_doc = rate_doc(ir);
    // A platform applies its lead to the load, see `task_space.rs`.
    let lead = ir.task_space.is_none().then(|| {
        let (ticks, limit) = h.lead.as_ref().map_or((0.0, 0.0), |lead| (lead.ticks, lead.limit));
        let (ticks, limit, led) = (literal::real(ir.scalar, ticks), literal::real(ir.scalar, limit), h.lead.is_some());
        let resonance = h.lead.as_ref().and_then(|lead| lead.resonance.as_ref());
        let bent = resonance.is_some();
        let [lag, bend, growth] = resonance.map_or([0.0; 3], |r| [r.lag, r.bend, r.gain_growth]);
        let [lag, bend, growth] = [lag, bend, growth].map(|value| literal::real(ir.scalar, value));
        quote! {
            /// Whether the set-points of the legs lead, to compensate their dead time and resonance.
            pub const LED: bool = #led;
            /// Lead of the leg set-points, ticks; from `hysteresis.dead_time`.
            pub const LEAD: Real = #ticks;
            /// Whether the resonance of the legs is compensated.
            pub const BENT: bool = #bent;
            /// Lag of the resonance, ticks; from `actuator.resonance` and `damping_ratio`.
            pub const LAG: Real = #lag;
            /// Addition to a set-point over the second difference of the voltage; from `actuator.resonance`.
            pub const BEND: Real = #bend;
            /// Relative growth of a leg's gain over the distance from its last turn, 1/m; from `actuator.resonance_gain`.
            pub const GAIN_GROWTH: Real = #growth;
            /// Largest lead that is added to a demand, m; from `actuator.slew_rate`.
            pub const LEAD_LIMIT: Real = #limit;
        }
    });
    quote! {
        #![doc = " Preisach tables of the legs; the model that uses them is in `specgen_runtime::memory`."]
        #(#![doc = #rate_doc])*

        use specgen_runtime::#imports;

        use crate::{LEGS, Real};

        /// N: cells per axis of the Preisach plane; from `hysteresis.grid`.
        pub const GRID: usize = #grid;
        /// Nodes of a table.
        pub const NODES: usize = (GRID + 1) * (GRID + 2) / 2;
        /// Capacity of the reversal memory, extrema; from `hysteresis.memory`.
        pub const MEMORY: usize = #memory;
        #constants
        #lead
        /// Everett function of one leg.
        pub type Table = #table;
        /// Reversal memory of one leg.
        pub type Memory = #memory_type;

        /// Tables of the six legs.
        pub static TABLES: [Table; LEGS] = [#(#entries),*];

        #(#tables)*
    }
}

/// Parts that depend on the rate model.
struct Rate {
    imports: TokenStream,
    /// Types of a table and of a memory.
    types: [TokenStream; 2],
    /// The table of each leg.
    entries: Vec<TokenStream>,
    constants: TokenStream,
}

fn rate(ir: &Ir, of_leg: &[Ident]) -> Rate {
    let still = of_leg.iter().map(|leg| quote! { Everett { nodes: &#leg } });
    match &ir.hysteresis.rate {
        None => Rate {
            imports: quote! { {Everett, ReversalMemory} },
            types: [quote! { Everett<Real, GRID, NODES> }, quote! { ReversalMemory<Real, MEMORY> }],
            entries: still.collect(),
            constants: TokenStream::new(),
        },
        Some(RateModel::DynamicPreisach { tables, table_of_leg, tolerance }) => {
            let doc = "Second Everett function of leg {}, m per cell a tick, laid out as the first; from `hysteresis.rate_tables`.";
            let (rates, rate_of_leg) = statics(ir.scalar, tables, table_of_leg, "RATE", doc);
            let tolerance = literal::real(ir.scalar, *tolerance);
            let entries = still.zip(rate_of_leg).map(|(still, rate)| {
                quote! { DynamicEverett { still: #still, rate: Everett { nodes: &#rate }, tolerance: TOLERANCE } }
            });
            Rate {
                imports: quote! { {DynamicEverett, DynamicMemory, Everett} },
                types: [
                    quote! { DynamicEverett<Real, Everett<Real, GRID, NODES>> },
                    quote! { DynamicMemory<Real, MEMORY> },
                ],
                entries: entries.collect(),
                constants: quote! {
                    /// Miss of the demand at which the inverse is found, m: an eighth of a converter code.
                    const TOLERANCE: Real = #tolerance;
                    #(#rates)*
                },
            }
        }
        Some(RateModel::BoucWen { legs, plays }) => {
            let creep = literal::count(legs[0].gains.len());
            let entries = of_leg.iter().enumerate().map(|(leg, table)| {
                let leg = literal::count(leg);
                quote! { BoucWenEverett { still: Everett { nodes: &#table }, around: &AROUND_OF_LEGS[#leg] } }
            });
            let around = legs.iter().map(|leg| {
                let list = |values: &[f64]| literal::reals(ir.scalar, values);
                let (gains, weights, carried) = (list(&leg.gains), list(&leg.weights), list(&leg.carried));
                let (read_out, inverse, travel) = (list(&leg.read_out), list(&leg.inverse), list(&leg.travel));
                let [direct, share, slope, beta_plus_gamma, beta_minus_gamma, limit, rest] =
                    [leg.direct, leg.share, leg.slope, leg.beta_plus_gamma, leg.beta_minus_gamma, leg.limit, leg.rest]
                        .map(|value| literal::real(ir.scalar, value));
                quote! {
                    BoucWen {
                        creep: Creep { gains: [#gains], weights: [#weights], carried: [#carried], direct: #direct },
                        share: #share,
                        read_out: [#read_out],
                        inverse: [#inverse],
                        travel: [#travel],
                        slope: #slope,
                        beta_plus_gamma: #beta_plus_gamma,
                        beta_minus_gamma: #beta_minus_gamma,
                        limit: #limit,
                        rest: #rest,
                    }
                }
            });
            if let Some(plays) = plays {
                return widened(ir.scalar, plays.as_ref(), &creep, around.collect());
            }
            Rate {
                imports: quote! { {BoucWen, BoucWenEverett, BoucWenMemory, Creep, Everett} },
                types: [
                    quote! { BoucWenEverett<'static, Real, Everett<Real, GRID, NODES>, CREEP> },
                    quote! { BoucWenMemory<Real, MEMORY, CREEP> },
                ],
                entries: entries.collect(),
                constants: quote! {
                    /// Creep operators.
                    pub const CREEP: usize = #creep;
                    /// What is around the table of each leg, over a tick of `timing.period`; from `hysteresis.records`.
                    pub(crate) static AROUND_OF_LEGS: [BoucWen<Real, CREEP>; LEGS] = [#(#around),*];
                },
            }
        }
        Some(RateModel::Creep { gains, weights, carried, direct }) => {
            let count = literal::count(gains.len());
            let list = |values: &[f64]| literal::reals(ir.scalar, values);
            let (gains, weights, carried) = (list(gains), list(weights), list(carried));
            let direct = literal::real(ir.scalar, *direct);
            Rate {
                imports: quote! { {Creep, CreepEverett, CreepMemory, Everett} },
                types: [
                    quote! { CreepEverett<'static, Real, Everett<Real, GRID, NODES>, CREEP> },
                    quote! { CreepMemory<Real, MEMORY, CREEP> },
                ],
                entries: still.map(|still| quote! { CreepEverett { still: #still, creep: &CREEP_OF_LEGS } }).collect(),
                constants: quote! {
                    /// Creep operators; from `hysteresis.creep_times`.
                    pub const CREEP: usize = #count;
                    /// Creep of every leg over a tick of `timing.period`; from `hysteresis.creep_times` and `creep_weights`.
                    pub(crate) static CREEP_OF_LEGS: Creep<Real, CREEP> = Creep {
                        gains: [#gains],
                        weights: [#weights],
                        carried: [#carried],
                        direct: #direct,
                    };
                },
            }
        }
    }
}

/// Legs with plays in place of their tables.
fn widened(scalar: Scalar, plays: &[Plays; LEGS], creep: &Literal, around: Vec<TokenStream>) -> Rate {
    let entries = (0..LEGS).map(|leg| {
        let leg = literal::count(leg);
        quote! { BoucWenEverett { still: &PLAYS_OF_LEGS[#leg], around: &AROUND_OF_LEGS[#leg] } }
    });
    let plays = plays.iter().map(|leg| {
        let [thresholds, weights] = [&leg.thresholds, &leg.weights].map(|values| literal::reals(scalar, values));
        let [full_scale, slope, rest, widening, per_rate, decay] =
            [leg.full_scale, leg.slope, leg.rest, leg.widening, leg.per_rate, leg.decay]
                .map(|value| literal::real(scalar, value));
        quote! {
            Plays {
                full_scale: #full_scale,
                thresholds: [#thresholds],
                weights: [#weights],
                slope: #slope,
                rest: #rest,
                widening: #widening,
                per_rate: #per_rate,
                decay: #decay,
            }
        }
    });
    Rate {
        imports: quote! { {BoucWen, BoucWenEverett, Creep, Plays, WidenedMemory} },
        types: [
            quote! { BoucWenEverett<'static, Real, &'static Plays<Real>, CREEP> },
            quote! { WidenedMemory<Real, CREEP> },
        ],
        entries: entries.collect(),
        constants: quote! {
            /// Creep operators.
            pub const CREEP: usize = #creep;
            /// What is around the plays of each leg, over a tick of `timing.period`; from `hysteresis.records`.
            pub(crate) static AROUND_OF_LEGS: [BoucWen<Real, CREEP>; LEGS] = [#(#around),*];
            /// Plays of each leg, which widen with the rate; from `hysteresis.records`.
            pub(crate) static PLAYS_OF_LEGS: [Plays<Real>; LEGS] = [#(#plays),*];
        },
    }
}

/// A `static` for each distinct table, and the name of each leg's.
fn statics(
    scalar: Scalar,
    tables: &[Vec<f64>],
    table_of_leg: &[usize; LEGS],
    prefix: &str,
    doc: &str,
) -> (Vec<TokenStream>, Vec<Ident>) {
    let names: Vec<Ident> = (0..tables.len()).map(|k| format_ident!("{prefix}_{k}")).collect();
    let statics = tables.iter().zip(&names).enumerate().map(|(k, (nodes, name))| {
        let legs: Vec<String> = (0..)
            .zip(table_of_leg)
            .filter(|(_, table)| **table == k)
            .map(|(leg, _): (usize, _)| leg.to_string())
            .collect();
        let doc = format!(" {}", doc.replace("{}", &legs.join(", ")));
        let nodes = literal::reals(scalar, nodes);
        quote! {
            #[doc = #doc]
            pub(crate) static #name: [Real; NODES] = [#nodes];
        }
    });
    (statics.collect(), table_of_leg.iter().map(|k| names[*k].clone()).collect())
}

/// Lines for the documentation of the module about what the model adds to the static one.
fn rate_doc(ir: &Ir) -> Vec<&'static str> {
    let mut lines = Vec::new();
    match &ir.hysteresis.rate {
        None => {}
        Some(RateModel::DynamicPreisach { .. }) => lines.extend([
            " Γ is the dynamic Preisach model (6), with the rate from one tick to the next; see `specgen_runtime::dynamic`.",
            " Where (6) cannot be inverted safely the static inverse is used, and `STATIC_INVERSE` says so.",
        ]),
        Some(RateModel::BoucWen { .. }) => {
            lines.push(" Γ is a table with a Bouc-Wen state, a read-out and creep; see `specgen_runtime::bouc_wen`.");
            if ir.hysteresis.has_plays() {
                lines.push(" Plays that widen with the rate are in place of the table; see `specgen_runtime::plays`.");
            }
        }
        Some(RateModel::Creep { .. }) => {
            lines.push(" Γ is the static model followed by creep; see `specgen_runtime::creep`.");
        }
    }
    if let Some(lead) = &ir.hysteresis.lead {
        lines.push(" T is advanced by `LEAD` ticks at its own rate, for the dead time of the legs.");
        if lead.resonance.is_some() {
            lines.push(" For their resonance, `LAG` and `BEND` times the differences of the voltage are added.");
        }
    }
    if !lines.is_empty() {
        lines.insert(0, "");
    }
    lines
}
