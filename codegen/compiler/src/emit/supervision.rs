//! `src/supervision.rs`: constants of the supervisor. Reads [`ir::Supervision`](crate::ir::Supervision).

use proc_macro2::TokenStream;
use quote::quote;
use specgen_language::model::FaultAction;

use super::literal;
use crate::ir::{Ir, RateModel};

pub fn emit(ir: &Ir) -> TokenStream {
    let s = &ir.supervision;
    let real = |value| literal::real(ir.scalar, value);
    let count = |value: u32| literal::count(value as usize);
    let counts = |values: &[u32]| {
        let values = counts_in(values);
        quote! { [#values] }
    };
    let (arm_ticks, rest) = (count(s.arm_ticks), literal::integer(s.rest));
    let (ramp_step, ramp_every) = (literal::integer(s.ramp_step), count(s.ramp_every));
    let (host_ticks, stall_ticks) = (count(s.host_ticks), count(s.stall_ticks));
    let (timeout, weight) = (counts(&s.timeout), counts(&s.weight));
    let (stuck_motion, stuck_samples) = (real(s.stuck_motion), count(s.stuck_samples));
    let (disagreement, disagreement_samples) = (real(s.disagreement), count(s.disagreement_samples));
    let (tracking, tracking_samples) = (literal::reals(ir.scalar, &s.tracking), count(s.tracking_samples));
    let (leap, repeats) = (literal::reals(ir.scalar, &s.leap), count(s.repeats));
    let steadiness = &s.steadiness;
    let per_limit = literal::reals(ir.scalar, &steadiness.per_limit);
    let [follow, motion] = [steadiness.follow, steadiness.motion].map(real);
    let [keep_explained, keep_fallen] = [steadiness.keep, steadiness.keep_fallen].map(real);
    let [one_way, first, next] = [steadiness.one_way, steadiness.first, steadiness.next].map(count);
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
                /// What is left after a tick of the way to the set-point when the law begins; from `supervisor.arm_time`.
                pub const APPROACH_KEEP: Real = #keep;
                /// A way this short, m and rad, is none.
                pub const APPROACH_NEGLIGIBLE: Real = 1e-13;
            }
        }
    };
    let amplifier_fault = match s.amplifier_fault {
        FaultAction::Off => quote! { Off },
        FaultAction::RampDown => quote! { RampDown },
        FaultAction::Hold => quote! { Hold },
    };
    let at_rest = at_rest(ir);
    let wiring = wiring(ir);
    let alike = s.wiring.iter().flat_map(|wiring| &wiring.alike).map(|set| counts_in(set));
    let uses = s.wiring.is_some().then(|| quote! { , Wiring });
    let limits = s.risen.is_none().then(|| quote! { , limits });
    quote! {
        #![doc = " What the supervisor takes for a fault; from `supervisor`."]

        use specgen_law::Reset;
        use specgen_runtime::supervisor::{Reaction, Steadiness, Supervision #uses};

        use crate::identity::Constants;
        use crate::hysteresis::Memory;
        use crate::{Real #limits};

        /// Bounds and times, these in ticks, or in samples of six ticks.
        pub const SUPERVISION: Supervision<Real> = Supervision {
            arm_ticks: #arm_ticks,
            rest: #rest,
            ramp_step: #ramp_step,
            ramp_every: #ramp_every,
            timeout: #timeout,
            weight: #weight,
            stuck_motion: #stuck_motion,
            stuck_samples: #stuck_samples,
            disagreement: #disagreement,
            disagreement_samples: #disagreement_samples,
            tracking: [#tracking],
            tracking_samples: #tracking_samples,
            leap: [#leap],
            repeats: #repeats,
            steadiness: Steadiness {
                per_limit: [#per_limit],
                follow: #follow,
                motion: #motion,
                keep: #keep_explained,
                keep_fallen: #keep_fallen,
                one_way: #one_way,
                first: #first,
                next: #next,
            },
            amplifier_fault: Reaction::#amplifier_fault,
            wiring: #wiring,
        };
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

/// The wiring check.
fn wiring(ir: &Ir) -> TokenStream {
    let Some(wiring) = &ir.supervision.wiring else { return quote! { None } };
    let reals = |values: &[f64]| {
        let values = literal::reals(ir.scalar, values);
        quote! { [#values] }
    };
    let (ticks, height) = (literal::count(wiring.ticks as usize), literal::integer(wiring.height));
    let [pulse, mains] = wiring.turn.map(|turn| reals(&turn));
    let (lag, weights, per_metre) = (reals(&wiring.lag), reals(&wiring.weights), reals(&wiring.per_metre));
    let (gauge_gain, residual) = (reals(&wiring.gauge_gain), literal::real(ir.scalar, wiring.residual));
    let leg_gain = match &wiring.leg_gain {
        Some(range) => {
            let range = reals(range);
            quote! { Some(#range) }
        }
        None => quote! { None },
    };
    quote! {
        Some(Wiring {
            ticks: #ticks,
            height: #height,
            turn: [#pulse, #mains],
            lag: #lag,
            weights: #weights,
            per_metre: #per_metre,
            gauge_gain: #gauge_gain,
            leg_gain: #leg_gain,
            residual: #residual,
        })
    }
}

/// How legs stand at reset, which is at rest. One for all where they rest at the lowest voltage, at which every history is
/// forgotten.
fn at_rest(ir: &Ir) -> TokenStream {
    let real = |value| literal::real(ir.scalar, value);
    let (doc, memory, displacement, code) = match &ir.supervision.risen {
        None => (
            " Reset: lowest voltage after a sweep to the highest and back, gauges zeroed there.",
            quote! { [Memory::new(); 6] },
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
                quote! { Memory::risen(#drive, #displacement #rate) }
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
