//! The first place where two traces differ. There is no tolerance.

use std::fmt;

use super::Trace;
use crate::word::{Scalar, WordKind};

/// The first difference of two traces.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Difference {
    /// They belong to different controllers.
    Header {
        /// The differing field of the description.
        field: &'static str,
        /// In the first trace.
        a: String,
        /// In the second.
        b: String,
    },
    /// A word.
    Word {
        /// Row, counted from 0.
        tick: usize,
        /// Name of the column.
        signal: String,
        /// Bits in the first trace.
        a: u64,
        /// Bits in the second.
        b: u64,
        /// Hexadecimal digits of the type.
        digits: usize,
        /// Distance in representable numbers, for reals that are not NaN.
        ulps: Option<u64>,
    },
    /// All common ticks are equal, but one trace is longer.
    Length {
        /// Ticks of the first.
        a: usize,
        /// Ticks of the second.
        b: usize,
    },
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Header { field, a, b } => write!(f, "header {field}: {a} vs {b}"),
            Self::Length { a, b } => write!(f, "length: {a} vs {b} ticks"),
            Self::Word { tick, signal, a, b, digits, ulps } => {
                write!(f, "tick {tick} {signal}: {a:0digits$x} vs {b:0digits$x}")?;
                match ulps {
                    Some(1) => write!(f, " (1 ulp)"),
                    Some(ulps) => write!(f, " ({ulps} ulps)"),
                    None => Ok(()),
                }
            }
        }
    }
}

/// The first difference between two traces, or `None` if every word is the same.
pub fn first_difference(a: &Trace, b: &Trace) -> Option<Difference> {
    header_difference(a, b).or_else(|| word_difference(a, b)).or_else(|| {
        let (a, b) = (a.len(), b.len());
        (a != b).then_some(Difference::Length { a, b })
    })
}

fn header_difference(a: &Trace, b: &Trace) -> Option<Difference> {
    let (a, b) = (a.description(), b.description());
    let bits = |scalar: Scalar| scalar.bits().to_string();
    let fields = [
        ("name", a.name.clone(), b.name.clone()),
        ("digest", a.digest.clone(), b.digest.clone()),
        ("version", a.version.clone(), b.version.clone()),
        ("scalar_bits", bits(a.scalar), bits(b.scalar)),
        ("config_names", a.config_names.join(","), b.config_names.join(",")),
        ("input_names", a.input_names.join(","), b.input_names.join(",")),
        ("output_names", a.output_names.join(","), b.output_names.join(",")),
    ];
    let (field, a, b) = fields.into_iter().find(|(_, a, b)| a != b)?;
    Some(Difference::Header { field, a, b })
}

fn word_difference(a: &Trace, b: &Trace) -> Option<Difference> {
    let place = a.words().iter().zip(b.words()).position(|(a, b)| a != b)?;
    let (tick, column) = (place / a.width(), place % a.width());
    let (left, right) = (a.words()[place], b.words()[place]);
    let signal = a.columns().nth(column).unwrap_or_default().to_owned();
    let scalar = a.description().scalar;
    let real = WordKind::of(&signal) == WordKind::Real;
    let wide = !real || scalar == Scalar::F64 || (left | right) >> 32 != 0;
    Some(Difference::Word {
        tick,
        a: left,
        b: right,
        digits: if wide { 16 } else { 8 },
        ulps: if real { scalar.ulps(left, right) } else { None },
        signal,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::tests::six_legs;

    fn trace(scalar: Scalar, ticks: usize, change: impl Fn(&mut Vec<u64>)) -> Trace {
        let description = six_legs(scalar);
        let width = 50;
        let mut words: Vec<u64> = (0..ticks * width).map(|k| scalar.encode(1.0 + k as f64)).collect();
        change(&mut words);
        Trace { description, words }
    }

    #[test]
    fn equal_traces_have_no_difference() {
        assert_eq!(first_difference(&trace(Scalar::F64, 9, |_| ()), &trace(Scalar::F64, 9, |_| ())), None);
    }

    #[test]
    fn one_ulp_is_found_and_named() {
        let a = trace(Scalar::F64, 600, |_| ());
        // Column 12 + 2 is voltage[2]; a later difference must not hide it.
        let b = trace(Scalar::F64, 600, |words| {
            words[417 * 50 + 14] += 1;
            words[500 * 50] = 0;
        });
        let found = first_difference(&a, &b).unwrap().to_string();
        assert_eq!(found, "tick 417 voltage[2]: 40d4604000000000 vs 40d4604000000001 (1 ulp)");
    }

    #[test]
    fn one_ulp_in_f32_and_one_bit_of_an_integer_or_a_nan_are_found() {
        let a = trace(Scalar::F32, 2, |_| ());
        let b = trace(Scalar::F32, 2, |words| words[50 + 6] -= 1);
        assert_eq!(
            first_difference(&a, &b).unwrap().to_string(),
            "tick 1 displacement[0]: 42640000 vs 4263ffff (1 ulp)"
        );
        let c = trace(Scalar::F32, 2, |words| words[49] ^= 1);
        assert!(first_difference(&a, &c).unwrap().to_string().starts_with("tick 0 state_digest: 0000000042480000"));
        let nan = |payload: u64| trace(Scalar::F32, 2, |words| words[0] = 0x7fc0_0000 | payload);
        assert_eq!(first_difference(&nan(0), &nan(1)).unwrap().to_string(), "tick 0 setpoint[0]: 7fc00000 vs 7fc00001");
    }

    #[test]
    fn another_length_or_controller_is_a_difference() {
        let a = trace(Scalar::F64, 3, |_| ());
        let longer = trace(Scalar::F64, 4, |_| ());
        assert_eq!(first_difference(&a, &longer).unwrap().to_string(), "length: 3 vs 4 ticks");
        let mut description = six_legs(Scalar::F64);
        description.digest = "01".to_owned();
        let other = Trace { description, words: a.words().to_vec() };
        assert_eq!(first_difference(&a, &other).unwrap().to_string(), "header digest: 00 vs 01");
    }
}
