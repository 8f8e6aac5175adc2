//! `src/hysteresis.rs`: the Everett tables. Reads [`ir::Hysteresis`](crate::ir::Hysteresis); exports `table` and the types
//! of table and memory.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::literal;
use crate::ir::Ir;

pub fn emit(ir: &Ir) -> TokenStream {
    let h = &ir.hysteresis;
    let (grid, memory) = (literal::count(h.grid), literal::count(h.memory));
    let names: Vec<_> = (0..h.tables.len()).map(|k| format_ident!("EVERETT_{k}")).collect();
    let tables = h.tables.iter().zip(&names).enumerate().map(|(k, (nodes, name))| {
        let legs: Vec<String> =
            (0..).zip(&h.table_of_leg).filter(|(_, table)| **table == k).map(|(leg, _): (usize, _)| leg.to_string()).collect();
        let doc = format!(
            " Everett function of leg {}, m: E(i, j) for `up` threshold i = 0..=N and, in each row, `down` threshold j = 0..=i; from `hysteresis.records`.",
            legs.join(", ")
        );
        let nodes = literal::reals(ir.scalar, nodes);
        quote! {
            #[doc = #doc]
            static #name: [Real; NODES] = [#nodes];
        }
    });
    let of_leg = h.table_of_leg.iter().map(|k| &names[*k]);
    quote! {
        #![doc = " Preisach tables of the legs; the model that uses them is in `specgen_runtime::memory`."]

        use specgen_runtime::{Everett, ReversalMemory};

        use crate::{LEGS, Real};

        /// N: cells per axis of the Preisach plane; from `hysteresis.grid`.
        pub const GRID: usize = #grid;
        /// Nodes of a table.
        pub const NODES: usize = (GRID + 1) * (GRID + 2) / 2;
        /// Capacity of the reversal memory, extrema; from `hysteresis.memory`.
        pub const MEMORY: usize = #memory;
        /// Everett function of one leg.
        pub type Table = Everett<Real, GRID, NODES>;
        /// Reversal memory of one leg.
        pub type Memory = ReversalMemory<Real, MEMORY>;

        /// Tables of the six legs.
        pub static TABLES: [Table; LEGS] = [#(Everett { nodes: &#of_leg }),*];

        #(#tables)*
    }
}
