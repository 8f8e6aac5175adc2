//! Numbers of 32 digits, for oracles that must not lose to cancellation.
#![allow(clippy::should_implement_trait)] // named operations: an oracle should show what it does.

/// Σ of exact products and sums as an unevaluated pair (Dekker, Knuth): about 32 digits.
#[derive(Debug, Clone, Copy)]
pub struct Pair(pub f64, pub f64);

impl Pair {
    /// a + b, exactly.
    #[must_use]
    pub fn sum(a: f64, b: f64) -> Self {
        let s = a + b;
        let t = s - a;
        Self(s, (a - (s - t)) + (b - t))
    }
    /// The number itself.
    #[must_use]
    pub fn of(x: f64) -> Self {
        Self(x, 0.0)
    }
    /// Sum.
    #[must_use]
    pub fn add(self, other: Self) -> Self {
        let Self(s, e) = Self::sum(self.0, other.0);
        Self::sum(s, e + self.1 + other.1)
    }
    /// Product.
    #[must_use]
    pub fn mul(self, other: Self) -> Self {
        let p = self.0 * other.0;
        let e = f64::mul_add(self.0, other.0, -p) + self.0 * other.1 + self.1 * other.0;
        Self::sum(p, e)
    }
    /// Difference.
    #[must_use]
    pub fn sub(self, other: Self) -> Self {
        self.add(other.neg())
    }
    /// Quotient, by one Newton step.
    #[must_use]
    pub fn div(self, other: Self) -> Self {
        let quotient = self.0 / other.0;
        let rest = self.sub(Self::of(quotient).mul(other));
        Self::sum(quotient, (rest.0 + rest.1) / other.0)
    }
    /// Rounded to a double.
    #[must_use]
    pub fn value(self) -> f64 {
        self.0 + self.1
    }
    /// a·b for vectors.
    #[must_use]
    pub fn dot(a: [Self; 3], b: [Self; 3]) -> Self {
        a[0].mul(b[0]).add(a[1].mul(b[1])).add(a[2].mul(b[2]))
    }
    /// R = Rz(θz) Ry(θy) Rx(θx) by its textbook entries, row by row.
    #[must_use]
    pub fn rotation(angles: [f64; 3]) -> [[Self; 3]; 3] {
        let [(sx, cx), (sy, cy), (sz, cz)] = angles.map(Self::sin_cos);
        [
            [cy.mul(cz), sx.mul(sy).mul(cz).sub(cx.mul(sz)), cx.mul(sy).mul(cz).add(sx.mul(sz))],
            [cy.mul(sz), sx.mul(sy).mul(sz).add(cx.mul(cz)), cx.mul(sy).mul(sz).sub(sx.mul(cz))],
            [sy.neg(), sx.mul(cy), cx.mul(cy)],
        ]
    }
    /// Negative.
    #[must_use]
    pub fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
    /// Square root.
    #[must_use]
    pub fn sqrt(self) -> Self {
        let root = Self::of(self.0.sqrt());
        // One Newton step in pairs: r + (x − r²) / 2r.
        let rest = self.add(root.mul(root).neg());
        root.add(Self::of((rest.0 + rest.1) / (2.0 * root.0)))
    }
    /// sin and cos of a small angle by series in pairs.
    #[must_use]
    pub fn sin_cos(angle: f64) -> (Self, Self) {
        let (mut sin, mut cos) = (Self::of(0.0), Self::of(0.0));
        let mut term = Self::of(1.0);
        for k in 0..24_u32 {
            match k % 4 {
                0 => cos = cos.add(term),
                1 => sin = sin.add(term),
                2 => cos = cos.add(term.neg()),
                _ => sin = sin.add(term.neg()),
            }
            // 1/(k+1) as a pair.
            let n = f64::from(k + 1);
            let inverse = 1.0 / n;
            let inverse = Self::sum(inverse, -f64::mul_add(inverse, n, -1.0) / n);
            term = term.mul(Self::of(angle)).mul(inverse);
        }
        (sin, cos)
    }
}
