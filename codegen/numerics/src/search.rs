//! Where a condition ceases to hold.

/// Bisections of a travel: 2⁻⁴⁰ of it is far below an atom.
const BISECTIONS: u32 = 40;

/// Largest value up to `far` below which `holds`, by bisection; 0 if nowhere.
pub fn largest(far: f64, holds: impl Fn(f64) -> bool) -> f64 {
    if holds(far) {
        return far;
    }
    let (mut good, mut bad) = (0.0, far);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (good + bad);
        if holds(middle) { good = middle } else { bad = middle }
    }
    good
}
