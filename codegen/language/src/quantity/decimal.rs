//! Exact decimal arithmetic for unit conversion, so that "150 mm" is the double nearest to 0.15.
//!
//! A power of ten only moves the decimal point; other factors multiply the digits. The one rounding is the
//! conversion to f64 at the end.

/// An unsigned decimal: `digits` · 10^`exponent`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Decimal {
    digits: String,
    exponent: i64,
}

impl Decimal {
    /// `digits` (ASCII digits only) · 10^`exponent`.
    #[must_use]
    pub fn new(digits: &str, exponent: i64) -> Self {
        let trimmed = digits.trim_start_matches('0');
        Self { digits: if trimmed.is_empty() { "0".to_owned() } else { trimmed.to_owned() }, exponent }
    }

    /// Whether the value is exactly zero.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.digits == "0"
    }

    /// Times 10^`power`.
    #[must_use]
    pub fn shifted(&self, power: i64) -> Self {
        Self { digits: self.digits.clone(), exponent: self.exponent.saturating_add(power) }
    }

    /// The exact product.
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        let left: Vec<u32> = self.digits.bytes().rev().map(|b| u32::from(b - b'0')).collect();
        let right: Vec<u32> = other.digits.bytes().rev().map(|b| u32::from(b - b'0')).collect();
        let mut sums = vec![0_u32; left.len() + right.len()];
        for (i, l) in left.iter().enumerate() {
            // Carry in every row: a cell then never holds more than one digit and a carry.
            let mut carry = 0;
            for (j, r) in right.iter().enumerate() {
                let sum = sums[i + j] + l * r + carry;
                sums[i + j] = sum % 10;
                carry = sum / 10;
            }
            sums[i + right.len()] = carry;
        }
        let digits: String = sums.iter().rev().filter_map(|d| char::from_digit(*d, 10)).collect();
        Self::new(&digits, self.exponent.saturating_add(other.exponent))
    }

    /// The nearest f64 (ties to even); infinite or zero where the range of f64 ends.
    #[must_use]
    pub fn to_f64(&self) -> f64 {
        // The text is a well-formed float by construction, so that the parse cannot fail.
        format!("{}e{}", self.digits, self.exponent).parse().unwrap_or(f64::NAN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_exact() {
        let product = Decimal::new("99999999999999999999", -5).times(&Decimal::new("98765432109876543210", 2));
        assert_eq!(product, Decimal::new("9876543210987654320901234567890123456790", -3));
        assert!(Decimal::new("000", 3).times(&Decimal::new("17", 0)).is_zero());
    }

    #[test]
    fn conversion_rounds_once() {
        assert_eq!(Decimal::new("150", -3).to_f64().to_bits(), 0.15_f64.to_bits());
        assert_eq!(Decimal::new("1", 400).to_f64(), f64::INFINITY);
        assert_eq!(Decimal::new("1", i64::MIN).to_f64(), 0.0);
    }
}
