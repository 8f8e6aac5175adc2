//! Numbers as source text: the shortest decimal that reads back to the same bits.

use std::fmt::{self, Debug};

use proc_macro2::{Literal, TokenStream};
use quote::quote;

use crate::ir::Scalar;

/// A finite number of the controller's scalar type, without a type suffix.
pub fn real(scalar: Scalar, value: f64) -> TokenStream {
    let magnitude = value.abs();
    let text = match scalar {
        Scalar::F32 => format!("{:?}", magnitude as f32),
        Scalar::F64 => format!("{magnitude:?}"),
    };
    let literal: Literal = match text.parse() {
        Ok(literal) => literal,
        // Lowering keeps every constant finite; `{:?}` of a finite number is a literal.
        Err(_) => unreachable!("{text} is not a literal"),
    };
    if value.is_sign_negative() {
        quote! { -#literal }
    } else {
        quote! { #literal }
    }
}

/// A constant of the runtime in this scalar: `$make` of [`constants`](crate::constants) from parts of the IR.
macro_rules! constant {
    ($scalar:expr, $make:ident $(, $part:expr)+) => {{
        use std::marker::PhantomData;
        use $crate::constants::$make;
        use $crate::ir::scalar::Rounding;
        use $crate::emit::literal::printed;
        match $scalar {
            $crate::ir::Scalar::F32 => printed(&$make(&Rounding::<f32>(PhantomData) $(, $part)+)),
            $crate::ir::Scalar::F64 => printed(&$make(&Rounding::<f64>(PhantomData) $(, $part)+)),
        }
    }};
}
pub(crate) use constant;

/// Text of `{:?}` and its valid Rust: paths of variants, references to slices, a name.
const MEANT: [(&str, &str); 11] = [
    ("amplifier_fault: ", "amplifier_fault: specgen_runtime::supervisor::Reaction::"),
    (" kind: ", " kind: specgen_runtime::trigger::Kind::"),
    (", direction: ", ", direction: specgen_runtime::trigger::Direction::"),
    ("(Whole", "(PermittedRange::Whole"),
    ("(Number", "(PermittedRange::Number"),
    ("Series { sine: [", "Series { sine: &["),
    (" versine: [", " versine: &["),
    (" root: [", " root: &["),
    (" arc_sine: [", " arc_sine: &["),
    (" arc_tangent: [", " arc_tangent: &["),
    (" trajectories: []", " trajectories: &TRAJECTORIES"),
];

/// A constant as Rust.
pub fn printed(constant: &impl Debug) -> TokenStream {
    let text = MEANT.iter().fold(format!("{constant:?}"), |text, (printed, meant)| text.replace(printed, meant));
    parsed(&text)
}

/// Rust code inside a constant instead of a value.
pub struct RustExpression<'a>(pub &'a TokenStream);

impl Debug for RustExpression<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self.0, f)
    }
}

/// Parses text that is known to be valid Rust.
pub fn parsed(text: &str) -> TokenStream {
    match text.parse() {
        Ok(tokens) => tokens,
        Err(error) => unreachable!("{text} is not valid Rust: {error}"),
    }
}

/// Numbers separated by commas.
pub fn reals<'a>(scalar: Scalar, values: impl IntoIterator<Item = &'a f64>) -> TokenStream {
    let values = values.into_iter().map(|value| real(scalar, *value));
    quote! { #(#values),* }
}

/// Rows of three numbers.
pub fn vectors(scalar: Scalar, rows: &[[f64; 3]]) -> TokenStream {
    let rows = rows.iter().map(|row| reals(scalar, row));
    quote! { [#([#rows]),*] }
}

/// Rows of six numbers.
pub fn matrix(scalar: Scalar, rows: &[[f64; 6]]) -> TokenStream {
    let rows = rows.iter().map(|row| reals(scalar, row));
    quote! { [#([#rows]),*] }
}

/// An unsigned integer without suffix.
pub fn count(value: usize) -> Literal {
    Literal::usize_unsuffixed(value)
}

/// A signed integer without suffix.
pub fn integer(value: i32) -> TokenStream {
    let magnitude = Literal::u32_unsuffixed(value.unsigned_abs());
    if value < 0 {
        quote! { -#magnitude }
    } else {
        quote! { #magnitude }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(scalar: Scalar, value: f64) -> String {
        real(scalar, value).to_string().replace(' ', "")
    }

    #[test]
    fn literals_read_back_to_the_same_bits() {
        let edge = [0.0, -0.0, 1.0, -1.5, 1e-300, 5e-324, f64::MAX, f64::MIN_POSITIVE, 0.1, 1.0 / 3.0, 1.2e-8];
        let mut state = 1_u64;
        let random = std::iter::repeat_with(|| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            f64::from_bits(state)
        });
        for value in edge.into_iter().chain(random.filter(|v| v.is_finite()).take(10_000)) {
            let text = parsed(Scalar::F64, value);
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{text}");
            let single = value as f32;
            if single.is_finite() {
                let text = parsed(Scalar::F32, f64::from(single));
                assert_eq!(text.parse::<f32>().unwrap().to_bits(), single.to_bits(), "{text}");
            }
        }
    }
}
