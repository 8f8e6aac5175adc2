//! Offset, slow drift and noise of a displacement signal.

/// Least-squares line y ≈ level + slope·(t − `middle`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Value at `middle`, unit of y.
    pub level: f64,
    /// Unit of y per s.
    pub slope: f64,
    /// Time at which the line has its `level`, s.
    pub middle: f64,
}

impl Line {
    /// Fits the line; slope 0 if all times are equal, all zero for no samples.
    #[must_use]
    pub fn fit(time: &[f64], y: &[f64]) -> Self {
        if time.is_empty() {
            return Self { level: 0.0, slope: 0.0, middle: 0.0 };
        }
        let count = time.len() as f64;
        let middle = time.iter().fold(0.0, |sum, t| sum + t) / count;
        let level = y.iter().fold(0.0, |sum, v| sum + v) / count;
        let (mut tt, mut ty) = (0.0, 0.0);
        for (t, v) in time.iter().zip(y) {
            tt += (t - middle) * (t - middle);
            ty += (t - middle) * (v - level);
        }
        Self { level, slope: if tt > 0.0 { ty / tt } else { 0.0 }, middle }
    }

    /// Value at time `t` (s).
    #[must_use]
    pub fn at(&self, t: f64) -> f64 {
        self.level + self.slope * (t - self.middle)
    }
}

/// Root mean square and largest absolute value; zeros for no samples.
#[must_use]
pub fn rms_and_max(errors: &[f64]) -> (f64, f64) {
    if errors.is_empty() {
        return (0.0, 0.0);
    }
    let (sum, max) = errors
        .iter()
        .fold((0.0, 0.0), |(sum, max): (f64, f64), e| (sum + e * e, if e.abs() > max { e.abs() } else { max }));
    ((sum / errors.len() as f64).sqrt(), max)
}

/// Median slope of all pairs (Theil–Sen): a line through points of which some are wrong. 0 for fewer than two points.
#[must_use]
pub fn median_slope(points: &[(f64, f64)]) -> f64 {
    // A few hundred returns are enough; taking every n-th bounds the number of pairs.
    let every = points.len().div_ceil(300).max(1);
    let points: Vec<_> = points.iter().step_by(every).collect();
    let mut slopes = Vec::new();
    for (k, (t0, y0)) in points.iter().enumerate() {
        slopes.extend(points[k + 1..].iter().filter(|(t1, _)| t1 > t0).map(|(t1, y1)| (y1 - y0) / (t1 - t0)));
    }
    super::statistics::median(&mut slopes)
}
