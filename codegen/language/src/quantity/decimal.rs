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
    pub fn new(digits: &str, exponent: i64) -> Self {
        let trimmed = digits.trim_start_matches('0');
        Self { digits: if trimmed.is_empty() { "0".to_owned() } else { trimmed.to_owned() }, exponent }
    }

    /// Whether the value is exactly zero.
    pub fn is_zero(&self) -> bool {
        self.digits == "0"
    }

    /// Times 10^`power`.
    pub fn shifted(&self, power: i64) -> Self {
        Self { digits: self.digits.clone(), exponent: self.exponent.saturating_add(power) }
    }

    /// The exact product.
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

    /// The f64 nearest to the quotient by `divisor`, which is not zero; ties to even.
    #[must_use]
    pub fn over(&self, divisor: &Self) -> f64 {
        let divisor_digits: Vec<u8> = divisor.digits.bytes().map(|b| b - b'0').collect();
        let mut rest: Vec<u8> = Vec::new();
        let mut quotient = String::new();
        let mut taken = 0;
        while taken < self.digits.len() || (!rest.is_empty() && quotient.len() < QUOTIENT_DIGITS) {
            let next = self.digits.as_bytes().get(taken).map_or(0, |b| b - b'0');
            if next > 0 || !rest.is_empty() {
                rest.push(next);
            }
            taken += 1;
            let mut digit = 0_u8;
            while is_at_least(&rest, &divisor_digits) {
                subtract(&mut rest, &divisor_digits);
                digit += 1;
            }
            if digit > 0 || !quotient.is_empty() {
                quotient.push(char::from(b'0' + digit));
            }
        }
        let shift = self.digits.len() as i64 - taken as i64;
        let exponent = self.exponent.saturating_sub(divisor.exponent).saturating_add(shift);
        if rest.is_empty() {
            return Self::new(&quotient, exponent).to_f64();
        }
        // Any digit marks that the quotient goes on.
        quotient.push('1');
        Self::new(&quotient, exponent.saturating_sub(1)).to_f64()
    }

    /// The nearest f64 (ties to even); infinite or zero where the range of f64 ends.
    pub fn to_f64(&self) -> f64 {
        // The text is a well-formed float by construction, so that the parse cannot fail.
        format!("{}e{}", self.digits, self.exponent).parse().unwrap_or(f64::NAN)
    }
}

/// No number halfway between two doubles has as many digits, so that these and a mark for the rest decide the rounding.
const QUOTIENT_DIGITS: usize = 800;

/// Whether one number is at least the other: digits without leading zeros.
fn is_at_least(a: &[u8], b: &[u8]) -> bool {
    a.len() > b.len() || (a.len() == b.len() && a >= b)
}

/// Takes the smaller number `b` from `a`: digits without leading zeros.
fn subtract(a: &mut Vec<u8>, b: &[u8]) {
    let offset = a.len() - b.len();
    let mut borrow = 0;
    for place in (0..a.len()).rev() {
        let taken = borrow + place.checked_sub(offset).map_or(0, |place| b[place]);
        borrow = u8::from(a[place] < taken);
        a[place] = a[place] + 10 * borrow - taken;
    }
    let zeros = a.iter().take_while(|digit| **digit == 0).count();
    a.drain(..zeros);
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
    fn quotients_are_the_nearest_doubles() {
        let over = |a: &str, exponent, b: &str| Decimal::new(a, exponent).over(&Decimal::new(b, 0));
        for (a, b) in [("1", "3"), ("22", "7"), ("1", "254"), ("9007199254740991", "3"), ("600", "60"), ("0", "7")] {
            let expected = a.parse::<f64>().expect(a) / b.parse::<f64>().expect(b);
            assert_eq!(over(a, 0, b).to_bits(), expected.to_bits(), "{a}/{b}");
        }
        // 2^53 + 1 is halfway between two doubles, and a third of the third of it a little above that.
        assert_eq!(over("27021597764222979", 0, "3"), 9_007_199_254_740_992.0);
        assert_eq!(over("27021597764222980", 0, "3"), 9_007_199_254_740_994.0);
        assert_eq!(over("1", 400, "3"), f64::INFINITY);
    }

    #[test]
    fn conversion_rounds_once() {
        assert_eq!(Decimal::new("150", -3).to_f64().to_bits(), 0.15_f64.to_bits());
        assert_eq!(Decimal::new("1", 400).to_f64(), f64::INFINITY);
        assert_eq!(Decimal::new("1", i64::MIN).to_f64(), 0.0);
    }
}
