//! `src/identity.rs`: what every emitted controller is called: platform, digest, scalar.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::literal;
use crate::description::description;
use crate::ir::{Ir, Scalar};

pub fn emit(ir: &Ir) -> TokenStream {
    let scalar = format_ident!("f{}", ir.scalar.bits().to_string());
    let bits = literal::count(ir.scalar.bits() as usize);
    let period = literal::real(Scalar::F64, ir.defaults.period);
    let (name, digest, version) = (&ir.name, &ir.digest, &ir.specgen_version);
    let description = description(ir);
    let assumed = &ir.assumed;
    quote! {
        #![doc = " Identity and basic constants of this controller."]

        /// Floating-point type of this controller; from `controller.scalar`.
        pub type Real = #scalar;
        /// Width of [`Real`].
        pub const SCALAR_BITS: u32 = #bits;
        /// Control period, s; from `timing.period`.
        pub const PERIOD_SECONDS: f64 = #period;
        /// The spec, for the law.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Constants;
        /// Number of legs.
        pub const LEGS: usize = 6;
        /// Name of the platform.
        pub const SPEC_NAME: &str = #name;
        /// SHA-256 of the spec and of the records it names.
        pub const SPEC_DIGEST: &str = #digest;
        /// Version of the compiler.
        pub const SPECGEN_VERSION: &str = #version;
        /// Unmeasured values: paths of the spec whose values are assumed, and simulated records. A program that drives
        /// a real machine asks its user first if the list is not empty. The law does not use it.
        pub const ASSUMED: &[&str] = &[#(#assumed),*];
        /// Description of this controller: one `key=value` per line, lists separated by commas; for tools that load it.
        pub const DESCRIPTION: &str = #description;
    }
}
