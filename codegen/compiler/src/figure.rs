//! Numbers in messages.

/// Names of the coordinates of a pose.
pub(crate) const AXES: [&str; 6] = ["x", "y", "z", "theta_x", "theta_y", "theta_z"];

/// `value` with four digits, without trailing zeros.
pub(crate) fn figure(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let size = value.abs();
    if (1e-3..1e6).contains(&size) {
        let decimals = (3.0 - libm::floor(libm::log10(size))).max(0.0) as usize;
        let text = format!("{value:.decimals$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{value:.3e}")
    }
}

/// `value` with so many decimals; zero has no sign.
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.bytes().all(|letter| b"-0.".contains(&letter));
    if is_zero { text.trim_start_matches('-').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::{figure, fixed};

    #[test]
    fn zero_has_no_sign() {
        let found = [-0.0, -0.004, -0.006, 0.0, 73.7].map(|value| fixed(value, 2));
        assert_eq!(found, ["0.00", "0.00", "-0.01", "0.00", "73.70"]);
    }

    #[test]
    fn figures_have_four_digits_and_no_more() {
        for (value, text) in [
            (0.0, "0"),
            (150.0, "150"),
            (0.08, "0.08"),
            (-1.23456, "-1.235"),
            (2.5e-9, "2.500e-9"),
            (123_456.7, "123457"),
        ] {
            assert_eq!(figure(value), text);
        }
    }
}
