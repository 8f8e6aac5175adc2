//! Boundary of a condition, and minimum of a function.

/// Bisections of a travel: 2⁻⁴⁰ of it is far smaller than an atom.
const BISECTIONS: u32 = 40;

/// Largest value up to `far` up to which `holds`, by bisection; 0 if there is none.
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

/// Minimum of `cost` near `start`, by the simplex method of Nelder and Mead (Computer Journal 7, 1965) with a first
/// simplex of `steps`, after about `most` evaluations; and the cost there.
pub fn simplex(start: &[f64], steps: &[f64], most: usize, mut cost: impl FnMut(&[f64]) -> f64) -> (Vec<f64>, f64) {
    let size = start.len();
    let mut points: Vec<(Vec<f64>, f64)> = Vec::with_capacity(size + 1);
    for corner in 0..=size {
        let mut point = start.to_vec();
        if let (Some(value), Some(step)) = (point.get_mut(corner), steps.get(corner)) {
            *value += step;
        }
        let value = cost(&point);
        points.push((point, value));
    }
    let mut spent = size + 1;
    while spent < most {
        // Stable: of equal points the older one comes first.
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        let worst = points[size].clone();
        let middle: Vec<f64> = (0..size)
            .map(|k| points[..size].iter().map(|point| point.0[k]).fold(0.0, |sum, x| sum + x) / size as f64)
            .collect();
        let mut tried = |factor: f64| {
            let point: Vec<f64> = middle.iter().zip(&worst.0).map(|(m, w)| m + factor * (m - w)).collect();
            let value = cost(&point);
            spent += 1;
            (point, value)
        };
        let reflected = tried(1.0);
        let better = if reflected.1 < points[0].1 {
            let expanded = tried(2.0);
            Some(if expanded.1 < reflected.1 { expanded } else { reflected })
        } else if reflected.1 < points[size - 1].1 {
            Some(reflected)
        } else {
            let contracted = if reflected.1 < worst.1 { tried(0.5) } else { tried(-0.5) };
            (contracted.1 < worst.1).then_some(contracted)
        };
        if let Some(better) = better {
            points[size] = better;
            continue;
        }
        let best = points[0].0.clone();
        for (point, value) in &mut points[1..] {
            for (x, b) in point.iter_mut().zip(&best) {
                *x = b + 0.5 * (*x - b);
            }
            *value = cost(point);
            spent += 1;
        }
    }
    points.sort_by(|a, b| a.1.total_cmp(&b.1));
    points.swap_remove(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_simplex_finds_the_bottom_of_a_bent_valley() {
        let cost = |x: &[f64]| {
            let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
            a * a + 100.0 * b * b
        };
        let (found, least) = simplex(&[-1.2, 1.0], &[0.1, 0.1], 400, cost);
        assert!(least < 1e-9 && (found[0] - 1.0).abs() < 1e-4, "{found:?}");
        // A point with infinite cost is never accepted.
        let (found, _) = simplex(&[0.5], &[0.1], 60, |x| if x[0] > 0.7 { f64::INFINITY } else { -x[0] });
        assert!(found[0] <= 0.7 && found[0] > 0.69, "{found:?}");
    }
}
