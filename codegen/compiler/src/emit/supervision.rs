//! `src/supervision.rs`: constants of the supervisor. Reads [`ir::Supervision`](crate::ir::Supervision).

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::{Ir, RateModel};

pub fn emit(ir: &Ir) -> TokenStream {
    let s = &ir.supervision;
    let real = |value| literal::real(ir.scalar, value);
    let count = |value: u32| literal::count(value as usize);
    let (host_ticks, stall_ticks) = (count(s.host_ticks), count(s.stall_ticks));
    let supervision = literal::constant!(ir.scalar, supervision, s);
    let of_kind = match &s.readings_per_leg {
        Some(rows) => {
            let rows = literal::matrix(ir.scalar, rows);
            quote! {
                /// Reading of each gauge (rows) per displacement of each leg (columns) at rest, m/m; from `gauge` and `geometry`.
                pub const READINGS_PER_LEG: [[Real; 6]; 6] = #rows;
            }
        }
        None => {
            let keep = real(s.approach_keep);
            let own = (0..6).map(|gauge| {
                let row: [f64; 6] = std::array::from_fn(|leg| if leg == gauge { 1.0 } else { 0.0 });
                let row = literal::reals(ir.scalar, &row);
                quote! { [#row] }
            });
            quote! {
                /// Reading of each gauge (rows) per displacement of each leg (columns): each leg has its own.
                pub const READINGS_PER_LEG: [[Real; 6]; 6] = [#(#own),*];
                /// Fraction of the distance to the set-point left after a tick, when the law starts; from `supervisor.arm_time`.
                pub const APPROACH_KEEP: Real = #keep;
                /// Distance below which the set-point is reached, m and rad.
                pub const APPROACH_NEGLIGIBLE: Real = 1e-13;
            }
        }
    };
    let at_rest = at_rest(ir);
    let alike = s.wiring.iter().flat_map(|wiring| &wiring.alike).map(|set| counts_in(set));
    let uses = s.wiring.is_some().then(|| quote! { , Wiring });
    let play_memory = s.risen.as_ref().is_some_and(|rest| rest.plays.is_some());
    let play_memory = play_memory.then(|| quote! { use specgen_runtime::PlayMemory; });
    let limits = s.risen.is_none().then(|| quote! { , limits });
    quote! {
        #![doc = " Thresholds and times of the supervisor's faults; from `supervisor`."]

        use specgen_law::Reset;
        #play_memory
        use specgen_runtime::supervisor::{Steadiness, Supervision #uses};

        use crate::identity::Constants;
        use crate::hysteresis::Memory;
        use crate::{Real #limits};

        /// Bounds and times. Times are in ticks, or in samples of six ticks.
        pub const SUPERVISION: Supervision<Real> = #supervision;
        /// Sets of single faults that look alike to the wiring check, as words of `Finding`.
        pub const LOOK_ALIKE: &[&[u32]] = &[#(&[#alike]),*];
        /// Ticks without a request over a link after which its host is lost; from `supervisor.host_lost`.
        pub const HOST_TICKS: u32 = #host_ticks;
        /// Missed ticks in a row of which more are the event [`STALLED`](specgen_runtime::supervisor::STALLED); from
        /// `supervisor.missed_in_a_row`.
        pub const STALL_TICKS: u32 = #stall_ticks;
        #of_kind
        #at_rest
    }
}

fn counts_in(words: &[u32]) -> TokenStream {
    let words = words.iter().map(|word| literal::count(*word as usize));
    quote! { #(#words),* }
}

/// Memories of the legs at the lowest voltage after a sweep to the highest and back.
fn new_memories(ir: &Ir) -> TokenStream {
    let Some(RateModel::BoucWen { legs, plays }) = &ir.hysteresis.rate else { return quote! { [Memory::new(); 6] } };
    let memories = legs.iter().enumerate().map(|(leg, own)| {
        let (rest, leg) = (literal::real(ir.scalar, own.rest), literal::count(leg));
        let plays = plays.as_ref().map(|_| quote! { &crate::hysteresis::PLAYS_OF_LEGS[#leg], });
        quote! { Memory::at_rest(#plays #rest) }
    });
    quote! { [#(#memories),*] }
}

/// State of the legs at reset, which is at rest. One for all if they rest at the lowest voltage, where every history is
/// erased.
fn at_rest(ir: &Ir) -> TokenStream {
    let real = |value| literal::real(ir.scalar, value);
    let (doc, memory, displacement, code) = match &ir.supervision.risen {
        None => (
            " Reset: lowest voltage after a sweep to the highest and back, gauges zeroed there.",
            new_memories(ir),
            quote! { [0.0; 6] },
            quote! { limits::CODES[0] },
        ),
        Some(rest) => {
            let drive = real(rest.drive);
            let memories = (0..6).map(|leg| {
                let displacement = real(rest.displacement[leg]);
                let rate = matches!(ir.hysteresis.rate, Some(RateModel::DynamicPreisach { .. })).then(|| {
                    let rate = real(rest.rate[leg]);
                    quote! { , #rate }
                });
                match (&rest.bouc_wen, &rest.plays) {
                    (None, _) => quote! { Memory::risen(#drive, #displacement #rate) },
                    (Some(parts), Some(plays)) => {
                        let [still, z] = parts[leg].map(real);
                        let states = literal::reals(ir.scalar, &plays[leg]);
                        quote! { Memory::risen(PlayMemory::risen(#drive, #still, [#states]), #z, #displacement) }
                    }
                    (Some(parts), None) => {
                        let [still, z] = parts[leg].map(real);
                        quote! { Memory::risen(#drive, #still, #z, #displacement) }
                    }
                }
            });
            let displacements = rest.displacement.map(real);
            (
                " Reset: at `supervisor.rest_voltage`, risen to it from the lowest voltage after a sweep to the highest and back, gauges zeroed at the lowest.",
                quote! { [#(#memories),*] },
                quote! { [#(#displacements),*] },
                literal::integer(ir.supervision.rest),
            )
        }
    };
    quote! {
        #[doc = #doc]
        pub(crate) const fn at_rest() -> Reset<Constants> {
            Reset { memory: #memory, displacement: #displacement, code: #code }
        }
    }
}
