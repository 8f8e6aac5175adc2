//! `src/permitted.rs`: the table of what settings may be. Reads [`ir::Permitted`](crate::ir::Permitted).

use proc_macro2::TokenStream;
use quote::quote;

use super::literal;
use crate::ir::{Ir, Range, Scalar};

pub fn emit(ir: &Ir) -> TokenStream {
    let table = &ir.permitted;
    // Most gains have one range: a row for each would take a kilobyte of flash.
    let ranges: Vec<Range> = table.words().map(|(_, range)| range).collect();
    let rows: Vec<TokenStream> = ranges
        .chunk_by(|a, b| a == b)
        .map(|alike| {
            let (range, words) = (of_range(ir.scalar, alike[0]), literal::count(alike.len()));
            quote! { (#range, #words) }
        })
        .collect();
    let count = literal::count(rows.len());
    let names = table.names();
    let words = literal::count(ranges.len());
    let of = |most: f64| literal::real(Scalar::F64, most);
    let state = &table.state;
    let axes = [
        state.place,
        state.user,
        state.rate,
        state.acceleration,
        state.pose,
        state.pose_rate,
        state.apart,
        state.wrench,
    ];
    let [place, user, rate, acceleration, pose, pose_rate, apart, wrench] = axes.map(|six| {
        let six = six.map(of);
        quote! { [#(#six),*] }
    });
    let one = [state.error, state.leg, state.leg_rate, state.line, state.request, state.reading, state.stiffness];
    let [error, leg, leg_rate, line, request, reading, stiffness] = one.map(of);
    quote! {
        #![doc = " What settings may be, and how large the numbers of a state may become: nothing beyond the limits of the spec."]

        use specgen_runtime::Permitted;
        use specgen_runtime::snapshot::Sizes;

        use crate::{Real, hysteresis, limits};

        /// Words of the settings.
        pub(crate) const WORDS: usize = #words;
        /// Their names.
        pub(crate) const NAMES: [&str; WORDS] = [#(#names),*];
        /// Ranges of the words of [`crate::CONFIG_NAMES`] in their order, both ends included, each for so many words; `code_min` is at
        /// most `code_max`.
        pub const SETTINGS: [(Permitted<Real>, usize); #count] = [#(#rows),*];
        /// Largest numbers of a state, under any of these settings.
        pub const STATE: Sizes = Sizes {
            place: #place, user: #user, rate: #rate, acceleration: #acceleration, pose: #pose, pose_rate: #pose_rate, error: #error,
            apart: #apart, wrench: #wrench, leg: #leg, leg_rate: #leg_rate, line: #line, request: #request, reading: #reading, stiffness: #stiffness,
            codes: limits::CODES, grid: hysteresis::GRID as f64, memory: hysteresis::MEMORY,
        };
    }
}

fn of_range(scalar: Scalar, range: Range) -> TokenStream {
    match range {
        Range::Whole(least, most) => {
            let (least, most) = (literal::integer(least), literal::integer(most));
            quote! { Permitted::Whole(#least, #most) }
        }
        Range::Number(least, most) => {
            let (least, most) = (literal::real(scalar, least), literal::real(scalar, most));
            quote! { Permitted::Number(#least, #most) }
        }
    }
}
