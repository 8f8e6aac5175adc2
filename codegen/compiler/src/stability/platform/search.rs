//! The first crossing of a stability limit.

/// Bisections of the interval that holds the limit.
const BISECTIONS: u32 = 12;

/// Largest `x` in [low, high] below which every checked value is stable: scans upwards, each step `ratio` times the one
/// before, and bisects the first crossing. Beyond a first unstable range a loop may be stable again, but nobody should
/// rely on it. Values at the lower end that count as unstable only because they are too slow are skipped. None if
/// nothing is stable; `high` if nothing above the first stable value is unstable.
pub(super) fn largest_stable(low: f64, high: f64, ratio: f64, stable: impl Fn(f64) -> bool) -> Option<f64> {
    let mut good = low;
    while !stable(good) {
        if good >= high {
            return None;
        }
        good = if good * ratio < high { good * ratio } else { high };
    }
    while good < high {
        let next = if good * ratio < high { good * ratio } else { high };
        if stable(next) {
            good = next;
            continue;
        }
        let mut bad = next;
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (good + bad);
            if stable(middle) {
                good = middle;
            } else {
                bad = middle;
            }
        }
        return Some(good);
    }
    Some(high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_crossing_is_found_and_later_islands_are_not() {
        let stable = |x: f64| x < 0.37 || (x > 0.6 && x < 0.8);
        let found = largest_stable(1e-3, 1.0, 1.1, stable).unwrap();
        assert!((found - 0.37).abs() < 1e-4 && stable(found), "{found}");
        assert_eq!(largest_stable(0.81, 1.0, 1.1, stable), None);
        // Too slow below 0.01.
        let found = largest_stable(1e-4, 1.0, 1.3, |x| x > 0.01 && x < 0.2).unwrap();
        assert!((found - 0.2).abs() < 1e-4, "{found}");
        assert_eq!(largest_stable(0.01, 0.3, 1.5, stable), Some(0.3));
    }
}
