//! Calibration polynomials: the range of raw words for which they are valid.

use super::finding;
use crate::ir::Scalar;
use specgen_language::diagnostic::{Diagnostic, codes};
use specgen_language::model::Model;

/// Steps of the search for an end of the range, per first guess.
const STEPS: u32 = 4096;
/// Extent of the search, in first guesses by the slope at rest.
const REACH: f64 = 4.0;

/// Raw words for readings within `sensor.range`, per gauge: metres, or volts if there is a calibration.
///
/// A polynomial must be monotonic across the range. It is used only there: beyond, two raw words may have the same reading.
pub(super) fn raw_limits(model: &Model, calibration: Option<&[Vec<f64>; 6]>) -> Result<[[f64; 2]; 6], Vec<Diagnostic>> {
    let range = model.sensor.range;
    let Some(of_gauge) = calibration else {
        return Ok([range; 6]);
    };
    let mut limits = [[0.0; 2]; 6];
    let mut findings = Vec::new();
    for (k, (coefficients, limits)) in of_gauge.iter().zip(&mut limits).enumerate() {
        match invert(coefficients, range) {
            Some(found) => *limits = found,
            None => findings.push(finding(
                model,
                codes::CALIBRATION_AMBIGUOUS,
                &format!("gauge[{k}].calibration"),
                format!(
                    "the calibration of gauge {k} is not monotonic across sensor.range, {:.3} µm to {:.3} µm",
                    range[0] * 1e6,
                    range[1] * 1e6
                ),
                "check the units and signs of the coefficients, lowest power first, or narrow sensor.range to where the calibration is monotonic"
                    .to_owned(),
            )),
        }
    }
    if findings.is_empty() { Ok(limits) } else { Err(findings) }
}

/// Rounded coefficients, padded with zeros to one length.
pub(super) fn padded(of_gauge: &[Vec<f64>; 6], scalar: Scalar) -> [Vec<f64>; 6] {
    let longest = of_gauge.iter().fold(1, |longest, c| if c.len() > longest { c.len() } else { longest });
    of_gauge.clone().map(|mut coefficients| {
        coefficients.resize(longest, 0.0);
        coefficients.into_iter().map(|c| scalar.round(c)).collect()
    })
}

fn value(coefficients: &[f64], raw: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| c + raw * sum)
}

fn slope(coefficients: &[f64], raw: f64) -> f64 {
    let powers = coefficients.iter().enumerate().skip(1).rev();
    powers.fold(0.0, |sum, (power, c)| power as f64 * c + raw * sum)
}

/// Raw words at the two ends of `range`, in ascending order; none unless the polynomial is monotonic between them.
fn invert(coefficients: &[f64], [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    let linear = *coefficients.get(1)?;
    let span = high - low;
    // So small a slope would need raw words beyond those of any converter.
    if linear.abs() * 1e9 <= span {
        return None;
    }
    // The reading at rest is zero: find its raw word from the origin by Newton's method, and start there.
    let mut rest = 0.0;
    for _ in 0..50 {
        rest -= value(coefficients, rest) / slope(coefficients, rest);
    }
    let zero = value(coefficients, rest).abs();
    if zero.is_nan() || zero > 1e-6 * span {
        return None;
    }
    let direction = slope(coefficients, rest);
    let step = REACH * span / direction.abs() / f64::from(STEPS);
    let end = |towards: f64| {
        let target = if (towards > 0.0) == (direction > 0.0) { high } else { low };
        let mut at = rest;
        for _ in 0..STEPS {
            let next = at + towards * step;
            if slope(coefficients, next) * direction <= 0.0 {
                return None;
            }
            let passed =
                if target == high { value(coefficients, next) >= high } else { value(coefficients, next) <= low };
            if passed {
                return Some(bisect(coefficients, target, at, next));
            }
            at = next;
        }
        None
    };
    Some([end(-1.0)?, end(1.0)?])
}

/// Argument at which the polynomial, monotonic between `a` and `b`, has the value `target`.
fn bisect(coefficients: &[f64], target: f64, mut a: f64, mut b: f64) -> f64 {
    let rising = value(coefficients, b) > value(coefficients, a);
    for _ in 0..100 {
        let middle = 0.5 * (a + b);
        if (value(coefficients, middle) < target) == rising { a = middle } else { b = middle }
    }
    0.5 * (a + b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_of_the_range_are_where_the_polynomial_reaches_them() {
        let range = [-25e-6, 25e-6];
        // 5 µm/V with an offset and some curvature; and one that falls.
        for coefficients in [vec![1e-6, 5e-6, 0.1e-6], vec![0.0, -5e-6], vec![-2e-6, 4e-6, 0.0, 0.01e-6]] {
            let [low, high] = invert(&coefficients, range).unwrap();
            assert!(low < high);
            let mut ends = [value(&coefficients, low), value(&coefficients, high)];
            ends.sort_by(f64::total_cmp);
            assert!((ends[0] - range[0]).abs() < 1e-15 && (ends[1] - range[1]).abs() < 1e-15, "{ends:?}");
        }
    }

    #[test]
    fn a_polynomial_that_turns_within_the_range_is_refused() {
        let range = [-25e-6, 25e-6];
        // Turns at −2.5 V, where it reads −6.25 µm.
        assert_eq!(invert(&[0.0, 5e-6, 1e-6], range), None);
        assert_eq!(invert(&[0.0], range), None);
        assert_eq!(invert(&[1e-6, 0.0, 1e-6], range), None);
        // Coefficients in µm taken for metres: the range is a few µV, which is odd but can be inverted; in nm for µm it is not.
        assert_eq!(invert(&[0.0, 1e-16], range), None);
    }
}
