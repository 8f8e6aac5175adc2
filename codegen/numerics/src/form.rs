//! Ranges of numbers that depend on a pose: an affine form of the six coordinates with a remainder, and an interval
//! that contains both.
//!
//! Intervals alone lose correlations: the difference of a reading and its prediction from a pose would be twice as wide
//! instead of almost zero. Affine arithmetic (de Figueiredo, Stolfi) keeps the linear dependence on the pose, and in a
//! micrometre machine almost everything is linear.

use core::cmp::Ordering;

/// Bound of the rounding of the arithmetic itself, with margin: it is done in doubles.
const OWN_ROUNDING: f64 = 1e-15;

/// `centre` + `slope`·p + e for any p in \[−1, 1\]⁶ and some |e| ≤ `rest`; always within `low` and `high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Form {
    centre: f64,
    slope: [f64; 6],
    rest: f64,
    low: f64,
    high: f64,
}

fn least(values: [f64; 4]) -> f64 {
    values.into_iter().fold(f64::INFINITY, |a, b| if b < a { b } else { a })
}

fn most(values: [f64; 4]) -> f64 {
    values.into_iter().fold(f64::NEG_INFINITY, |a, b| if b > a { b } else { a })
}

/// Ends of the products of two intervals.
pub(crate) fn times(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let ends = [a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]];
    [least(ends), most(ends)]
}

/// Order of numbers in two intervals; none if the intervals overlap.
pub(crate) fn apart(a: [f64; 2], b: [f64; 2]) -> Option<Ordering> {
    if a[1] < b[0] { Some(Ordering::Less) } else { (a[0] > b[1]).then_some(Ordering::Greater) }
}

/// Largest magnitude of an interval.
pub fn magnitude([low, high]: [f64; 2]) -> f64 {
    let (a, b) = (low.abs(), high.abs());
    if a > b { a } else { b }
}

impl Form {
    pub(crate) const fn constant(value: f64) -> Self {
        Self { centre: value, slope: [0.0; 6], rest: 0.0, low: value, high: value }
    }

    /// Coordinate `axis` of a pose, from `low` to `high`.
    pub(crate) fn coordinate(axis: usize, [low, high]: [f64; 2]) -> Self {
        let mut slope = [0.0; 6];
        slope[axis] = 0.5 * (high - low);
        Self { centre: 0.5 * (low + high), slope, rest: 0.0, low, high }
    }

    pub(crate) const fn range(self) -> [f64; 2] {
        [self.low, self.high]
    }

    pub(crate) fn magnitude(self) -> f64 {
        magnitude(self.range())
    }

    /// Smallest magnitude.
    pub(crate) fn nearest(self) -> f64 {
        if self.low <= 0.0 && self.high >= 0.0 {
            return 0.0;
        }
        let (a, b) = (self.low.abs(), self.high.abs());
        if a < b { a } else { b }
    }

    /// The value of a form that holds one only.
    pub(crate) fn point(self) -> Option<f64> {
        (self.low == self.high).then_some(self.low)
    }

    /// Largest distance from the centre.
    fn radius(self) -> f64 {
        self.slope.iter().fold(self.rest, |sum, slope| sum + slope.abs())
    }

    /// The form's range, limited to `bounds`.
    fn within(self, bounds: [f64; 2]) -> Self {
        let radius = self.radius() * (1.0 + OWN_ROUNDING);
        let (low, high) = (self.centre - radius, self.centre + radius);
        Self {
            low: if low > bounds[0] { low } else { bounds[0] },
            high: if high < bounds[1] { high } else { bounds[1] },
            ..self
        }
    }

    /// Widened by up to `more`.
    pub(crate) fn widened(self, more: f64) -> Self {
        Self { rest: self.rest + more, low: self.low - more, high: self.high + more, ..self }
    }

    pub(crate) fn negative(self) -> Self {
        Self {
            centre: -self.centre,
            slope: self.slope.map(|slope| -slope),
            rest: self.rest,
            low: -self.high,
            high: -self.low,
        }
    }

    pub(crate) fn scaled(self, factor: f64) -> Self {
        let [low, high] = times(self.range(), [factor, factor]);
        let slope = self.slope.map(|slope| slope * factor);
        Self { centre: self.centre * factor, slope, rest: self.rest * factor.abs(), low, high }
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        let size = self.centre.abs() + other.centre.abs() + self.radius() + other.radius();
        let bounds = [self.low + other.low, self.high + other.high];
        Self {
            centre: self.centre + other.centre,
            slope: core::array::from_fn(|k| self.slope[k] + other.slope[k]),
            rest: self.rest + other.rest + OWN_ROUNDING * size,
            ..self
        }
        .within([bounds[0] - OWN_ROUNDING * size, bounds[1] + OWN_ROUNDING * size])
    }

    pub(crate) fn product(self, other: Self) -> Self {
        let (a, b) = (self.centre, other.centre);
        let (wide_a, wide_b) = (self.radius(), other.radius());
        let size = (a.abs() + wide_a) * (b.abs() + wide_b);
        let [low, high] = times(self.range(), other.range());
        Self {
            centre: a * b,
            slope: core::array::from_fn(|k| a * other.slope[k] + b * self.slope[k]),
            rest: a.abs() * other.rest + b.abs() * self.rest + wide_a * wide_b + OWN_ROUNDING * size,
            ..self
        }
        .within([low - OWN_ROUNDING * size, high + OWN_ROUNDING * size])
    }

    /// 1/x for an x that is not zero.
    pub(crate) fn inverse(self) -> Self {
        let (middle, radius) = (self.centre, self.radius());
        let ends = [1.0 / self.low, 1.0 / self.high];
        let (low, high) = if ends[0] < ends[1] { (ends[0], ends[1]) } else { (ends[1], ends[0]) };
        let nearest = self.nearest();
        let square = middle * middle;
        // 1/x = 1/m − (x − m)/m² + (x − m)²/(m² x).
        Self {
            centre: 1.0 / middle,
            slope: self.slope.map(|slope| -slope / square),
            rest: self.rest / square + radius * radius / (square * nearest) + OWN_ROUNDING * 4.0 / nearest,
            ..self
        }
        .within([low * (1.0 - OWN_ROUNDING * low.signum()), high * (1.0 + OWN_ROUNDING * high.signum())])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_moves_together_cancels_and_what_does_not_adds_up() {
        let x = Form::coordinate(0, [0.9, 1.1]);
        let y = Form::coordinate(1, [0.9, 1.1]);
        let same = x.plus(x.negative());
        assert!(same.magnitude() < 1e-14, "{same:?}");
        assert!(x.plus(y.negative()).magnitude() >= 0.2);
    }

    #[test]
    fn every_value_lies_in_its_form() {
        let (x, y) = (Form::coordinate(0, [-0.3, 0.8]), Form::coordinate(1, [1.0, 2.5]));
        let form = x.product(y).plus(y.inverse().product(x)).plus(x.scaled(-3.0));
        let mut reached = [f64::INFINITY, f64::NEG_INFINITY];
        for i in 0..=100 {
            for j in 0..=100 {
                let (a, b) = (-0.3 + 1.1 * f64::from(i) / 100.0, 1.0 + 1.5 * f64::from(j) / 100.0);
                let value = a * b + a / b - 3.0 * a;
                assert!(form.low <= value && value <= form.high, "{value} {form:?}");
                reached = [f64::min(reached[0], value), f64::max(reached[1], value)];
            }
        }
        // And the form has their size.
        assert!(form.high - form.low < 4.0 * (reached[1] - reached[0]));
    }
}
