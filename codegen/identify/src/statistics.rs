//! Statistics of a list of numbers.

/// Smallest and largest value of finite numbers; (+inf, -inf) if there are none.
pub fn extent(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| {
        (if x < low { x } else { low }, if x > high { x } else { high })
    })
}

/// A length (m) in µm as in a record: 1.03, not 1.0299999999999998.
pub(crate) fn micrometres(metres: f64) -> f64 {
    libm::round(metres * 1e12) / 1e6
}

/// Middle value (upper middle of an even count); 0 for an empty slice. Reorders the slice.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Standard deviation of white noise on `y`, from the median of its second differences: smooth motion has almost no
/// effect.
pub(crate) fn noise_floor(y: &[f64]) -> f64 {
    let mut second: Vec<f64> = y.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    // The median of |N(0, s)| is 0.6745 s; second differences of white noise have the variance 6 σ².
    median(&mut second) / (0.674_489_75 * 6f64.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn micrometres_are_those_of_the_record() {
        for um in [1.03, 0.00228, 69.15164, -3.0] {
            assert_eq!(micrometres(um * 1e-6).to_string(), um.to_string());
        }
    }
}
