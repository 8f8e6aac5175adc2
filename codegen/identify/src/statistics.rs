//! Statistics of lists of numbers: extent, mean, median, noise, lines over time.

use crate::least_squares::mean_square;

/// Smallest and largest value of finite numbers; (+inf, -inf) if there are none.
pub fn extent(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| {
        (if x < low { x } else { low }, if x > high { x } else { high })
    })
}

/// A length (m) in µm as in a record: 1.03, not 1.0299999999999998.
pub(crate) fn micrometres(metres: f64) -> f64 {
    libm::round(metres * 1e12) / 1e6
}

/// Middle value (upper middle of an even count); 0 for an empty slice. Reorders the slice.
pub(crate) fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Standard deviation of white noise on `y`, from the median of its second differences: smooth motion has almost no
/// effect.
pub(crate) fn noise_floor(y: &[f64]) -> f64 {
    let mut second: Vec<f64> = y.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    // The median of |N(0, s)| is 0.6745 s; second differences of white noise have the variance 6 σ².
    median(&mut second) / (0.674_489_75 * 6f64.sqrt())
}

/// Arithmetic mean; 0 for an empty slice.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |sum, v| sum + v) / values.len().max(1) as f64
}

/// The mean, and its standard error from the spread of the values.
pub(crate) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let (count, mean) = (values.len() as f64, mean(values));
    let spread = values.iter().fold(0.0, |sum, v| sum + (v - mean) * (v - mean)) / (count - 1.0);
    (mean, (spread / count).sqrt())
}

/// `values` without their mean.
pub(crate) fn centred(mut values: Vec<f64>) -> Vec<f64> {
    let mean = mean(&values);
    values.iter_mut().for_each(|v| *v -= mean);
    values
}

/// Derivative over time by central differences, one-sided at the ends and beside samples that `keep` excludes: a jump
/// after a sample is not its rate.
pub(crate) fn rates(time: &[f64], values: &[f64], keep: &[bool]) -> Vec<f64> {
    let last = time.len() - 1;
    (0..=last)
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), if k < last { k + 1 } else { last });
            let (a, b) = (if keep[a] { a } else { k }, if keep[b] { b } else { k });
            if b > a { (values[b] - values[a]) / (time[b] - time[a]) } else { 0.0 }
        })
        .collect()
}

/// Median sampling interval.
pub(crate) fn median_interval(time: &[f64]) -> f64 {
    median(&mut time.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>())
}

/// A stretch of equal samples of a channel while another one moves.
pub(crate) struct Standstill {
    /// Its first sample.
    pub(crate) first: usize,
    /// Number of its samples.
    pub(crate) run: usize,
    /// Least and largest value of the other channel in it.
    pub(crate) input: [f64; 2],
}

/// Samples after a step of a drive in which a gauge may still rest: it lags.
pub(crate) const LAG: usize = 16;

/// The sample after the step that makes most of the travel of `values`, if one does.
pub(crate) fn step(values: &[f64]) -> Option<usize> {
    let (low, high) = extent(values);
    (1..values.len()).find(|&k| (values[k] - values[k - 1]).abs() > 0.5 * (high - low))
}

/// Stretches of at least `least` samples over which `output` is exactly constant while `input` travels [`TRAVEL`] of its
/// range: a sensor that is stuck or at its limit. A rest that ends within [`LAG`] of a step of the input is none.
pub(crate) fn standstills(input: &[f64], output: &[f64], least: usize) -> Vec<Standstill> {
    let (low, high) = extent(input);
    let mut found = Vec::new();
    let mut first = 0;
    while first < output.len() {
        let run = output[first..].iter().take_while(|v| **v == output[first]).count();
        let (from, to) = extent(&input[first..first + run]);
        let rests = || step(&input[first..first + run]).is_some_and(|step| run - step <= LAG);
        if run >= least && to - from > TRAVEL * (high - low) && !rests() {
            found.push(Standstill { first, run, input: [from, to] });
        }
        first += run;
    }
    found
}

/// Fraction of the input's range over which an output may stay exactly equal.
const TRAVEL: f64 = 0.05;

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
        let (middle, level) = (mean(time), mean(y));
        let (mut tt, mut ty) = (0.0, 0.0);
        for (t, v) in time.iter().zip(y) {
            tt += (t - middle) * (t - middle);
            ty += (t - middle) * (v - level);
        }
        Self { level, slope: if tt > 0.0 { ty / tt } else { 0.0 }, middle }
    }

    /// `y` without the line, at `time` (s).
    pub(crate) fn removed(&self, time: &[f64], y: &[f64]) -> Vec<f64> {
        y.iter().zip(time).map(|(v, t)| v - self.at(*t)).collect()
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
    let max = errors.iter().fold(0.0, |max: f64, e| if e.abs() > max { e.abs() } else { max });
    (mean_square(errors).sqrt(), max)
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
    median(&mut slopes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gauge_that_lags_a_step_is_not_stuck() {
        let drive = |k: usize| if k < 30 { 0.0 } else { 25.0 * (1 + (k - 30) / 40) as f64 };
        let input: Vec<f64> = (0..200).map(drive).collect();
        let late = |lag: usize| -> Vec<f64> { (0..200).map(|k: usize| drive(k.saturating_sub(lag))).collect() };
        assert!(standstills(&input, &late(1), 1).is_empty() && standstills(&input, &late(LAG), 1).is_empty());
        assert_eq!(standstills(&input, &late(LAG + 1), 1).len(), 4);
        let ramp: Vec<f64> = (0..200).map(f64::from).collect();
        assert_eq!(standstills(&ramp, &[1.0; 200], 1).len(), 1);
    }

    #[test]
    fn micrometres_are_those_of_the_record() {
        for um in [1.03, 0.00228, 69.15164, -3.0] {
            assert_eq!(micrometres(um * 1e-6).to_string(), um.to_string());
        }
    }
}
