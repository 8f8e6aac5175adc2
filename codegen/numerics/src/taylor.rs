//! Functions of a motion as polynomials of second degree with a remainder: Taylor models (Makino, Berz).
//!
//! ```text
//! f(ξ) = c + Σ g_i ξ_i + Σ_{i≤j} b_ij ξ_i ξ_j + e,   |e| ≤ rest,   for every ξ in [−1, 1]¹⁸
//! ```
//! The controller's kernels, run on these numbers, give their own expansion at rest and a bound on all higher terms. In
//! a micrometre machine the third order is a thousandth of the second, so the bound is only slightly above the true
//! value.

use core::cmp::Ordering;
use core::num::NonZeroU32;
use core::ops::{Add, Div, Mul, Neg, Sub};
use std::cell::RefCell;

use super::form::apart;
use specgen_runtime::Real;
use specgen_runtime::snapshot::Field;

/// Variables: pose, rate and acceleration.
const COUNT: usize = 18;
/// Products of two of them.
const PAIRS: usize = COUNT * (COUNT + 1) / 2;
/// Bound of the rounding of the arithmetic, with margin: it is done in doubles.
const OWN_ROUNDING: f64 = 1e-15;

/// A polynomial and the bound of its remainder.
#[derive(Debug, Clone)]
pub struct Expansion {
    centre: f64,
    slope: [f64; COUNT],
    /// b_ij for i ≤ j, row by row.
    bend: [f64; PAIRS],
    rest: f64,
}

/// The pairs i ≤ j in the order of [`Expansion::bend`].
fn pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..COUNT).flat_map(|i| (i..COUNT).map(move |j| (i, j)))
}

fn size(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |sum, value| sum + value.abs())
}

impl Expansion {
    const fn constant(centre: f64) -> Self {
        Self { centre, slope: [0.0; COUNT], bend: [0.0; PAIRS], rest: 0.0 }
    }

    /// g: first derivatives by the variables, each over its half width.
    pub const fn slope(&self) -> &[f64; COUNT] {
        &self.slope
    }

    /// |f(ξ) − f(0) − Σ `slope`·ξ| is nowhere larger.
    pub fn left_by(&self, slope: &[f64; COUNT]) -> f64 {
        let mut total = self.rest;
        for (own, kept) in self.slope.iter().zip(slope) {
            total += (own - kept).abs();
        }
        // A square has one sign.
        let (mut low, mut high) = (0.0, 0.0);
        for ((i, j), bend) in pairs().zip(self.bend) {
            if i != j {
                total += bend.abs();
            } else if bend < 0.0 {
                low += bend;
            } else {
                high += bend;
            }
        }
        total + if -low > high { -low } else { high }
    }

    /// Largest distance from the centre.
    fn radius(&self) -> f64 {
        size(&self.slope) + size(&self.bend) + self.rest
    }

    fn rounded(mut self) -> Self {
        self.rest += OWN_ROUNDING * (self.centre.abs() + self.radius());
        self
    }

    fn plus(&self, other: &Self) -> Self {
        let mut sum = self.clone();
        sum.centre += other.centre;
        sum.rest += other.rest;
        for (a, b) in sum.slope.iter_mut().chain(&mut sum.bend).zip(other.slope.iter().chain(&other.bend)) {
            *a += b;
        }
        sum.rounded()
    }

    /// f times a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        scaled.centre *= factor;
        scaled.rest *= factor.abs();
        for value in scaled.slope.iter_mut().chain(&mut scaled.bend) {
            *value *= factor;
        }
        scaled.rounded()
    }

    fn times(&self, other: &Self) -> Self {
        let (a, b) = (self, other);
        let ([a1, a2], [b1, b2]) = ([size(&a.slope), size(&a.bend)], [size(&b.slope), size(&b.bend)]);
        let mut product = b.scaled(a.centre);
        for (value, slope) in product.slope.iter_mut().zip(a.slope) {
            *value += b.centre * slope;
        }
        for ((i, j), (value, bend)) in pairs().zip(product.bend.iter_mut().zip(a.bend)) {
            let crossed = if i == j { 0.0 } else { a.slope[j] * b.slope[i] };
            *value += b.centre * bend + a.slope[i] * b.slope[j] + crossed;
        }
        product.rest += b.centre.abs() * a.rest + a1 * b2 + a2 * b1 + a2 * b2;
        product.rest += (a1 + a2) * b.rest + (b1 + b2) * a.rest + a.rest * b.rest;
        let mut product = product.rounded();
        product.rest += OWN_ROUNDING * (a.centre.abs() + a.radius()) * (b.centre.abs() + b.radius());
        product
    }

    /// 1/f = (1 − δ + δ² − δ³/(1 + δ))/c with δ = f/c − 1; unbounded if f may be zero.
    fn inverse(&self) -> Self {
        let inverse = 1.0 / self.centre;
        let mut off = self.scaled(inverse);
        off.centre = 0.0;
        let most = off.radius();
        let mut result = off.times(&off).plus(&off.scaled(-1.0));
        result.centre += 1.0;
        result.rest += if most < 1.0 { most * most * most / (1.0 - most) } else { f64::INFINITY };
        result.scaled(inverse)
    }
}

thread_local! {
    /// [`Real`] is `Copy + 'static`, so the numbers refer to their expansion by its index here.
    static EXPANSIONS: RefCell<Vec<Expansion>> = const { RefCell::new(Vec::new()) };
}

/// A number of a computation under [`expand`]: a constant, or an expansion of that computation.
///
/// Small, and its operations are calls, because the kernels have thousands of them.
#[derive(Debug, Clone, Copy)]
pub struct Taylor {
    constant: f64,
    /// Index of its expansion, from 1.
    place: Option<NonZeroU32>,
}

/// Expands the results of `run` in eighteen variables, each within ± its `width` of zero. Also returns the number of
/// operations on anything but constants.
pub fn expand<const N: usize>(
    widths: &[f64; COUNT],
    run: impl FnOnce([Taylor; COUNT]) -> [Taylor; N],
) -> ([Expansion; N], usize) {
    EXPANSIONS.with(|kept| kept.borrow_mut().clear());
    let variables = core::array::from_fn(|k| {
        let mut variable = Expansion::constant(0.0);
        variable.slope[k] = widths[k];
        Taylor::of(variable)
    });
    let results = run(variables).map(Taylor::expansion);
    (results, EXPANSIONS.with(RefCell::take).len() - COUNT)
}

impl Taylor {
    const fn constant(constant: f64) -> Self {
        Self { constant, place: None }
    }

    fn of(expansion: Expansion) -> Self {
        let constant = expansion.centre;
        let place = EXPANSIONS.with(|kept| {
            let mut kept = kept.borrow_mut();
            kept.push(expansion);
            u32::try_from(kept.len()).ok().and_then(NonZeroU32::new)
        });
        Self { constant, place }
    }

    fn expansion(self) -> Expansion {
        let constant = Expansion::constant(self.constant);
        self.place.map_or(constant, |place| EXPANSIONS.with(|kept| kept.borrow()[place.get() as usize - 1].clone()))
    }

    const fn known(self) -> Option<f64> {
        if self.place.is_none() { Some(self.constant) } else { None }
    }

    /// Lowest and highest value.
    fn range(self) -> [f64; 2] {
        let radius = self.place.map_or(0.0, |_| self.expansion().radius());
        [self.constant - radius, self.constant + radius]
    }
}

impl Add for Taylor {
    type Output = Self;
    #[inline(never)]
    fn add(self, other: Self) -> Self {
        match (self.known(), other.known()) {
            (Some(a), Some(b)) => Self::constant(a + b),
            (Some(0.0), None) => other,
            (None, Some(0.0)) => self,
            _ => Self::of(self.expansion().plus(&other.expansion())),
        }
    }
}

impl Neg for Taylor {
    type Output = Self;
    #[inline(never)]
    fn neg(self) -> Self {
        match self.known() {
            Some(value) => Self::constant(-value),
            None => Self::of(self.expansion().scaled(-1.0)),
        }
    }
}

impl Sub for Taylor {
    type Output = Self;
    #[inline(never)]
    fn sub(self, other: Self) -> Self {
        match (self.known(), other.known()) {
            (Some(a), Some(b)) => Self::constant(a - b),
            (None, Some(0.0)) => self,
            _ => Self::of(self.expansion().plus(&other.expansion().scaled(-1.0))),
        }
    }
}

impl Mul for Taylor {
    type Output = Self;
    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        match (self.known(), other.known()) {
            (Some(a), Some(b)) => Self::constant(a * b),
            (Some(0.0), None) | (None, Some(0.0)) => Self::constant(0.0),
            (Some(factor), None) => Self::of(other.expansion().scaled(factor)),
            (None, Some(factor)) => Self::of(self.expansion().scaled(factor)),
            (None, None) => Self::of(self.expansion().times(&other.expansion())),
        }
    }
}

impl Div for Taylor {
    type Output = Self;
    #[inline(never)]
    fn div(self, other: Self) -> Self {
        match (self.known(), other.known()) {
            (Some(a), Some(b)) => Self::constant(a / b),
            (None, Some(b)) => Self::of(self.expansion().scaled(1.0 / b)),
            _ => Self::of(self.expansion().times(&other.expansion().inverse())),
        }
    }
}

impl PartialEq for Taylor {
    /// The kernels that run on this type compare only with constants.
    #[inline(never)]
    fn eq(&self, other: &Self) -> bool {
        self.known().is_some() && self.known() == other.known()
    }
}

impl PartialOrd for Taylor {
    /// By ranges that do not overlap.
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        if self == other { Some(Ordering::Equal) } else { apart(self.range(), other.range()) }
    }
}

impl Field for Taylor {
    const WORDS: usize = 1;
}

impl Real for Taylor {
    const ZERO: Self = Self::constant(0.0);
    const HALF: Self = Self::constant(0.5);
    const ONE: Self = Self::constant(1.0);
    const SINGLE: bool = false;

    fn from_f64(value: f64) -> Self {
        Self::constant(value)
    }
    fn truncate(self) -> i32 {
        self.constant as i32
    }
    fn from_i32(value: i32) -> Self {
        Self::constant(f64::from(value))
    }
    fn is_finite(self) -> bool {
        self.range().iter().all(|end| end.is_finite())
    }
    fn abs(self) -> Self {
        if self < Self::ZERO { -self } else { self }
    }
    fn to_word(self) -> u64 {
        self.constant.to_bits()
    }
    fn from_word(word: u64) -> Self {
        Self::constant(f64::from_bits(word))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTHS: [f64; COUNT] = {
        let mut widths = [0.0; COUNT];
        widths[0] = 0.01;
        widths[7] = 0.02;
        widths
    };

    /// x y²/(2 + x) + 3 x − y on numbers of any kind.
    fn sample<T: Real>(x: T, y: T) -> T {
        let [two, three] = [2.0, 3.0].map(T::from_f64);
        (x * y - y * y * x) / (two + x) + three * x - y
    }

    #[test]
    fn what_is_left_of_a_first_order_is_bounded_and_not_by_much_too_much() {
        let ([found], _) = expand(&WIDTHS, |v| [sample(v[0], v[7])]);
        let mut slope = [0.0; COUNT];
        (slope[0], slope[7]) = (3.0 * WIDTHS[0], -WIDTHS[7]);
        for (own, expected) in found.slope().iter().zip(slope) {
            assert!((own - expected).abs() < 1e-15, "{found:?}");
        }
        let bound = found.left_by(&slope);
        let mut worst = 0.0_f64;
        for i in -50..=50 {
            for j in -50..=50 {
                let [x, y] = [0.01 * f64::from(i) / 50.0, 0.02 * f64::from(j) / 50.0];
                worst = worst.max((sample(x, y) - 3.0 * x + y).abs());
            }
        }
        assert!(worst <= bound && bound < 1.1 * worst, "{worst:e} {bound:e}");
        // With a slope that is wrong by a millionth, the remainder grows by as much.
        slope[0] *= 1.0 + 1e-6;
        assert!(found.left_by(&slope) > bound + 0.9e-6 * slope[0]);
    }

    #[test]
    fn a_divisor_that_may_be_zero_has_no_bound() {
        let ([found], _) = expand(&[1.0; COUNT], |v| [Taylor::ONE / (v[0] + v[1] + Taylor::ONE)]);
        assert!(!found.left_by(&[0.0; COUNT]).is_finite());
    }
}
