//! `src/identity.rs`: what every emitted controller is called: platform, digest, scalar.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::literal;
use crate::ir::{Ir, Scalar};

pub fn emit(ir: &Ir) -> TokenStream {
    let scalar = format_ident!("f{}", ir.scalar.bits().to_string());
    let bits = literal::count(ir.scalar.bits() as usize);
    let period = literal::real(Scalar::F64, ir.defaults.period);
    let (name, digest, version) = (&ir.name, &ir.digest, &ir.specgen_version);
    let about = format!(
        "name={name}\ndigest={digest}\nversion={version}\nkind={}\nscalar_bits={}\nleg_gain={:?}\nperiod={:?}\ngrid={}\ndrive_range={:?},{:?}\n",
        if ir.task_space.is_some() { "platform" } else { "legs" },
        ir.scalar.bits(),
        ir.defaults.leg_gain,
        ir.defaults.period,
        ir.hysteresis.grid,
        ir.actuation.voltage[0],
        ir.actuation.voltage[1],
    );
    let bias = ir.task_space.as_ref().map_or_else(String::new, |task| {
        let bias: Vec<String> = task.law.bias.iter().map(|value| format!("{value:?}")).collect();
        format!("bias={}\n", bias.join(","))
    });
    quote! {
        #![doc = " What this controller is."]

        /// Floating-point type of this controller; from `controller.scalar`.
        pub type Real = #scalar;
        /// Width of [`Real`].
        pub const SCALAR_BITS: u32 = #bits;
        /// Control period, s; from `timing.period`.
        pub const PERIOD_SECONDS: f64 = #period;
        /// Number of legs.
        pub const LEGS: usize = 6;
        /// Name of the platform.
        pub const SPEC_NAME: &str = #name;
        /// SHA-256 of the spec and of the records it names.
        pub const SPEC_DIGEST: &str = #digest;
        /// Version of the compiler.
        pub const SPECGEN_VERSION: &str = #version;
        /// Of the description what stands before the names of words, and what stands after them.
        pub(crate) const ABOUT: &str = #about;
        pub(crate) const BIAS: &str = #bias;
    }
}
