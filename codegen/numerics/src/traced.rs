//! Numbers with a record of their computation: the controller's kernels, run on them, give a bound on their own
//! rounding errors over a box of poses.
//!
//! Each operation adds a [`Node`]: its own largest rounding error, and the derivatives of its result by the operands.
//! The difference between the controller's result and the result without rounding is the sum over all nodes of their
//! own error times the result's derivative by that node. Both are known as ranges over the box, so one backward sweep
//! bounds the error. An error that reaches the result by several paths counts once, with its sign. The derivatives are
//! those of the computed numbers; the remaining products of two errors belong to the nodes' own errors, so nothing is
//! neglected.

use core::cmp::Ordering;
use core::ops::{Add, Div, Mul, Neg, Sub};
use std::cell::RefCell;

use specgen_runtime::Real;
use specgen_runtime::snapshot::Field;

use super::form::{Form, apart, magnitude, times};

/// The computed value lies in `form`; without any rounding it would differ by at most `error`.
///
/// `SINGLE`: the controller computes in `f32`.
#[derive(Debug, Clone, Copy)]
pub struct TracedNumber<const SINGLE: bool> {
    form: Form,
    error: f64,
    /// Its node; none for an exact number.
    node: Option<u32>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    /// Operands with an error, with the derivative of the result by each.
    by: [Option<(u32, [f64; 2])>; 2],
    /// Largest own error, of either sign.
    own: f64,
    /// Known own error: that of a rounded constant.
    known: [f64; 2],
}

thread_local! {
    /// [`Real`] is `Copy + 'static`, so the numbers cannot carry a reference to their record.
    static NODES: RefCell<Vec<Node>> = const { RefCell::new(Vec::new()) };
}

/// The record of a computation.
pub struct Trace(Vec<Node>);

/// Runs a computation and returns its record.
pub fn trace<R>(run: impl FnOnce() -> R) -> (R, Trace) {
    NODES.with(|nodes| nodes.borrow_mut().clear());
    let result = run();
    (result, Trace(NODES.with(RefCell::take)))
}

fn record(node: Node) -> Option<u32> {
    NODES.with(|nodes| {
        let mut nodes = nodes.borrow_mut();
        let id = u32::try_from(nodes.len()).ok();
        nodes.push(node);
        id
    })
}

/// The bounds themselves are computed in doubles; a part in 10¹³ covers their rounding.
const ROUND_UP: f64 = 1.0 + 1e-13;
/// Exponent bits of a double: they give the power of two at or below a positive number.
const EXPONENT: u64 = 0x7ff0_0000_0000_0000;

impl Trace {
    /// The record during the computation.
    pub fn peek<R>(look: impl FnOnce(&Self) -> R) -> R {
        let record = Self(NODES.with(|nodes| nodes.borrow().clone()));
        look(&record)
    }

    /// Largest error of Σ `weights`·results.
    pub fn error<const SINGLE: bool>(&self, results: &[(TracedNumber<SINGLE>, f64)]) -> f64 {
        let derivatives = self.derivatives(results);
        let mut own = 0.0;
        let mut known = [0.0; 2];
        for (node, derivative) in self.0.iter().zip(&derivatives) {
            own += node.own * magnitude(*derivative);
            let [low, high] = times(node.known, *derivative);
            known = [known[0] + low, known[1] + high];
        }
        (own + magnitude(known)) * ROUND_UP
    }

    /// Range of the derivative of Σ `weights`·results by `number`.
    pub fn derivative<const SINGLE: bool>(
        &self,
        results: &[(TracedNumber<SINGLE>, f64)],
        number: TracedNumber<SINGLE>,
    ) -> [f64; 2] {
        let derivatives = self.derivatives(results);
        number.node.and_then(|node| derivatives.get(node as usize).copied()).unwrap_or([0.0; 2])
    }

    /// Lowest and highest derivative of the weighted sum of `results` by each node.
    fn derivatives<const SINGLE: bool>(&self, results: &[(TracedNumber<SINGLE>, f64)]) -> Vec<[f64; 2]> {
        let mut derivatives = vec![[0.0; 2]; self.0.len()];
        for (result, weight) in results {
            if let Some(node) = result.node {
                let at = &mut derivatives[node as usize];
                *at = [at[0] + weight, at[1] + weight];
            }
        }
        // Operands come before their results.
        for id in (0..self.0.len()).rev() {
            let derivative = derivatives[id];
            for (operand, by) in self.0[id].by.into_iter().flatten() {
                let [low, high] = times(by, derivative);
                let at = &mut derivatives[operand as usize];
                *at = [at[0] + low, at[1] + high];
            }
        }
        derivatives
    }
}

impl<const SINGLE: bool> TracedNumber<SINGLE> {
    /// Half a unit in the last place of 1.
    const UNIT: f64 = if SINGLE { 5.960_464_477_539_063e-8 } else { 1.110_223_024_625_156_5e-16 };

    /// Coordinate `axis` of the pose, from `low` to `high`, exact.
    pub fn coordinate(axis: usize, low: f64, high: f64) -> Self {
        Self { form: Form::coordinate(axis, [low, high]), error: 0.0, node: None }
    }

    /// A constant of the controller; the exact value is smaller by `low` to `high`.
    pub fn constant(value: f64, [low, high]: [f64; 2]) -> Self {
        Self::exact(Form::constant(value)).off_by([low, high])
    }

    /// The same, counted as exact: an input of a later computation. It keeps a node for derivatives.
    pub fn given(self) -> Self {
        Self::exact(self.form.widened(self.error)).noted()
    }

    /// A number that exceeds an exact one by `low` to `high`.
    pub fn off_by(self, known: [f64; 2]) -> Self {
        if known == [0.0; 2] {
            return self;
        }
        let by = [self.node.map(|node| (node, [1.0; 2])), None];
        Self {
            form: self.form,
            error: self.error + magnitude(known) * ROUND_UP,
            node: record(Node { by, own: 0.0, known }),
        }
    }

    /// Widened by up to `more`.
    pub fn widened(self, more: f64) -> Self {
        Self { form: self.form.widened(more), ..self }
    }

    const fn exact(form: Form) -> Self {
        Self { form, error: 0.0, node: None }
    }

    fn noted(self) -> Self {
        Self { node: record(Node { by: [None; 2], own: 0.0, known: [0.0; 2] }), ..self }
    }

    /// Smallest and largest value.
    pub const fn range(self) -> [f64; 2] {
        self.form.range()
    }

    /// Largest magnitude.
    pub fn magnitude(self) -> f64 {
        self.form.magnitude()
    }

    /// Whether the controller adds nothing here.
    fn nothing(self) -> bool {
        self.form.point() == Some(0.0) && self.error == 0.0
    }

    /// The result of an operation. `most`: largest rounding error. `crossed`: product of the errors of two operands.
    fn rounded(form: Form, by: [(Self, [f64; 2]); 2], most: f64, crossed: f64) -> Self {
        // Half a unit in the last place is constant over a binade: that of its lower end.
        let largest = form.magnitude() * ROUND_UP;
        let half_bit = Self::UNIT * f64::from_bits(largest.to_bits() & EXPONENT);
        let rounding = if half_bit < most { half_bit } else { most };
        let carried = by.iter().fold(0.0, |sum, (operand, by)| sum + operand.error * magnitude(*by));
        let own = rounding + crossed;
        let by = by.map(|(operand, by)| operand.node.map(|node| (node, by)));
        let node = if own == 0.0 && by == [None; 2] { None } else { record(Node { by, own, known: [0.0; 2] }) };
        Self { form: form.widened(rounding), error: (carried + own) * ROUND_UP, node }
    }
}

impl<const SINGLE: bool> Add for TracedNumber<SINGLE> {
    type Output = Self;
    #[inline(never)]
    fn add(self, other: Self) -> Self {
        if self.nothing() {
            return other;
        }
        if other.nothing() {
            return self;
        }
        // Rounding changes a sum by less than its smaller part: the larger one would be as close.
        let (a, b) = (self.magnitude(), other.magnitude());
        let most = if a < b { a } else { b };
        Self::rounded(self.form.plus(other.form), [(self, [1.0; 2]), (other, [1.0; 2])], most, 0.0)
    }
}

impl<const SINGLE: bool> Neg for TracedNumber<SINGLE> {
    type Output = Self;
    #[inline(never)]
    fn neg(self) -> Self {
        let by = [self.node.map(|node| (node, [-1.0; 2])), None];
        let node = self.node.and_then(|_| record(Node { by, own: 0.0, known: [0.0; 2] }));
        Self { form: self.form.negative(), error: self.error, node }
    }
}

impl<const SINGLE: bool> Sub for TracedNumber<SINGLE> {
    type Output = Self;
    #[inline(never)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

/// A factor by which products are exact.
fn is_power_of_two(value: f64) -> bool {
    value.is_normal() && value.to_bits().trailing_zeros() >= 52
}

impl<const SINGLE: bool> Mul for TracedNumber<SINGLE> {
    type Output = Self;
    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        // ã b̃ − a b = ã δb + b̃ δa − δa δb.
        let by = [(self, other.range()), (other, self.range())];
        let crossed = self.error * other.error;
        for (a, b) in [(self, other), (other, self)] {
            if let Some(factor) = a.form.point().filter(|factor| *factor == 0.0 || is_power_of_two(*factor)) {
                return Self::rounded(b.form.scaled(factor), by, 0.0, crossed);
            }
        }
        Self::rounded(self.form.product(other.form), by, f64::INFINITY, crossed)
    }
}

impl<const SINGLE: bool> Div for TracedNumber<SINGLE> {
    type Output = Self;
    #[inline(never)]
    fn div(self, other: Self) -> Self {
        let nearest = other.form.nearest();
        if nearest <= other.error || nearest == 0.0 {
            let everything = Form::constant(0.0).widened(f64::INFINITY);
            return Self { form: everything, error: f64::INFINITY, node: None };
        }
        // With q = a/b: ã/b̃ − q = (δa − q δb)/b̃, and q = ã/b̃ less the error of the quotient.
        let inverse = other.form.inverse();
        let quotient = self.form.product(inverse);
        let [low, high] = times(quotient.range(), inverse.range());
        let by = [(self, inverse.range()), (other, [-high, -low])];
        let off = (self.error + quotient.magnitude() * other.error) / (nearest - other.error);
        let most = match other.form.point() {
            Some(divisor) if is_power_of_two(divisor) => 0.0,
            _ => f64::INFINITY,
        };
        Self::rounded(quotient, by, most, off * other.error / nearest)
    }
}

impl<const SINGLE: bool> PartialEq for TracedNumber<SINGLE> {
    /// The kernels that run on this type compare only with zero.
    #[inline(never)]
    fn eq(&self, other: &Self) -> bool {
        self.error == 0.0
            && other.error == 0.0
            && self.form.point().is_some()
            && self.form.point() == other.form.point()
    }
}

impl<const SINGLE: bool> PartialOrd for TracedNumber<SINGLE> {
    /// By ranges that do not overlap.
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        if self == other { Some(Ordering::Equal) } else { apart(self.range(), other.range()) }
    }
}

impl<const SINGLE: bool> Field for TracedNumber<SINGLE> {
    const WORDS: usize = 1;
}

impl<const SINGLE: bool> Real for TracedNumber<SINGLE> {
    const ZERO: Self = Self::exact(Form::constant(0.0));
    const HALF: Self = Self::exact(Form::constant(0.5));
    const ONE: Self = Self::exact(Form::constant(1.0));
    const SINGLE: bool = SINGLE;

    fn from_f64(value: f64) -> Self {
        let kept = if SINGLE { f64::from(value as f32) } else { value };
        Self::constant(kept, [kept - value; 2])
    }
    fn truncate(self) -> i32 {
        self.range()[0] as i32
    }
    fn from_i32(value: i32) -> Self {
        Self::from_f64(f64::from(value))
    }
    fn is_finite(self) -> bool {
        self.magnitude().is_finite() && self.error.is_finite()
    }
    fn abs(self) -> Self {
        match self.partial_cmp(&Self::ZERO) {
            Some(Ordering::Less) => -self,
            Some(_) => self,
            // Of either sign: the derivative is between −1 and 1.
            None => {
                let half = 0.5 * self.magnitude();
                let form = Form::constant(half).widened(half);
                Self::rounded(form, [(self, [-1.0, 1.0]), (Self::ZERO, [0.0; 2])], 0.0, 0.0)
            }
        }
    }
    fn to_word(self) -> u64 {
        self.range()[0].to_bits()
    }
    fn from_word(word: u64) -> Self {
        Self::from_f64(f64::from_bits(word))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    type Single = TracedNumber<true>;

    /// Bound of the result of `run` for two coordinates from 1 to 1.001.
    fn bound(run: impl Fn(Single, Single) -> Single) -> f64 {
        let (result, trace) = trace(|| run(Single::coordinate(0, 1.0, 1.001), Single::coordinate(1, 1.0, 1.001)));
        trace.error(&[(result, 1.0)])
    }

    #[test]
    fn single_precision_stays_within_its_bound_and_near_it() {
        // x² − y² with much cancellation, over x + y: f32 against f64.
        let bound = bound(|x, y| (x * x - y * y) / (x + y));
        let mut worst = 0.0_f64;
        for k in 0..20_000_u32 {
            let a = (1.0 + 0.001 * f64::from(k) / 20_000.0) as f32;
            let b = (1.001 - 0.001 * f64::from(k * 7 % 20_000) / 20_000.0) as f32;
            let (x, y) = (f64::from(a), f64::from(b));
            worst = worst.max((f64::from((a * a - b * b) / (a + b)) - (x * x - y * y) / (x + y)).abs());
        }
        assert!(worst <= bound && bound < 2.0 * worst, "{worst:e} {bound:e}");
    }

    #[test]
    fn an_error_that_comes_twice_counts_with_its_sign() {
        // The same product added and subtracted: only the rounding of the sum remains.
        let twice = bound(|x, y| {
            let product = x * y;
            (product + x) - product
        });
        let once = bound(|x, y| x * y + x);
        assert!(twice < 1.5 * once, "{twice:e} {once:e}");
        let apart = bound(|x, y| (x * y + x) - y * x);
        assert!(apart > twice, "{apart:e} {twice:e}");
    }

    #[test]
    fn a_divisor_that_may_be_zero_has_no_bound() {
        let (quotient, _) = trace(|| Single::ONE / Single::coordinate(0, -1.0, 1.0));
        assert!(!quotient.is_finite());
        let (good, _) = trace(|| Single::ONE / Single::coordinate(0, 2.0, 4.0));
        assert!(good.is_finite() && good.magnitude() >= 0.5);
    }

    #[test]
    fn exact_operations_have_no_error_and_constants_theirs() {
        assert_eq!(bound(|x, _| x * Single::HALF), 0.0);
        assert_eq!(bound(|x, _| x + Single::ZERO), 0.0);
        assert!(bound(|x, _| x + x) > 0.0);
        let kept = f64::from(0.1_f32) - 0.1;
        let found = bound(|_, _| Single::from_f64(0.1) + Single::from_f64(0.1));
        assert!(found >= 2.0 * kept.abs());
    }
}
