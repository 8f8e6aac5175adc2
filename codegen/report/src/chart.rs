//! Charts as data for the page's script: few digits, thinned, so that a report stays small.

use serde::Serialize;

/// Points of a series that is drawn over time.
const POINTS: usize = 640;
/// Largest integer that a value is rounded to: what is drawn is finer than a printed page.
const STEPS: f64 = 20_000.0;

/// Values of one coordinate.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Values {
    /// `a` + `d` k for k below `n`.
    Even {
        /// First.
        a: f64,
        /// Difference.
        d: f64,
        /// How many.
        n: usize,
    },
    /// `k` times integers.
    Scaled {
        /// Factor.
        k: f64,
        /// Integers.
        v: Vec<i32>,
    },
    /// As they are, none where there is no value.
    Plain(Vec<Option<f64>>),
}

impl Values {
    /// With `STEPS` over the largest magnitude.
    #[must_use]
    pub fn scaled(values: &[f64]) -> Self {
        let largest = values.iter().fold(0.0, |largest: f64, v| if v.abs() > largest { v.abs() } else { largest });
        let k = short(if largest > 0.0 { largest / STEPS } else { 1.0 });
        Self::Scaled { k, v: values.iter().map(|v| libm::round(v / k) as i32).collect() }
    }

    /// Five digits each; for logarithmic axes.
    #[must_use]
    pub fn plain(values: &[f64]) -> Self {
        Self::Plain(values.iter().map(|v| v.is_finite().then(|| short(*v))).collect())
    }
}

/// Rounded to five digits.
fn short(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    /// A line.
    Line,
    /// A dashed line.
    Dash,
    /// Dots.
    Dots,
}

/// Points drawn in one way.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// In the legend.
    pub name: String,
    /// How.
    pub style: Style,
    /// Number of its colour.
    pub color: usize,
    /// Of the x axis.
    pub x: Values,
    /// Of the y axis.
    pub y: Values,
}

/// An axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Axis {
    /// What.
    pub label: String,
    /// In what unit.
    pub unit: String,
    /// In decades.
    pub log: bool,
}

impl Axis {
    /// Even.
    #[must_use]
    pub fn linear(label: &str, unit: &str) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), log: false }
    }

    /// In decades.
    #[must_use]
    pub fn log(label: &str, unit: &str) -> Self {
        Self { log: true, ..Self::linear(label, unit) }
    }
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chart {
    /// For file names and the page's own links.
    pub id: String,
    /// Above it, with the figure of the paper.
    pub title: String,
    /// Across.
    pub x: Axis,
    /// Upward.
    pub y: Axis,
    /// Later ones on top.
    pub series: Vec<Series>,
}

impl Chart {
    /// Without series.
    #[must_use]
    pub fn new(id: &str, title: &str, x: Axis, y: Axis) -> Self {
        Self { id: id.to_owned(), title: title.to_owned(), x, y, series: Vec::new() }
    }

    /// Adds points.
    #[must_use]
    pub fn with(mut self, name: &str, style: Style, x: Values, y: Values) -> Self {
        let color = self.series.len();
        self.series.push(Series { name: name.to_owned(), style, color, x, y });
        self
    }

    /// Gives the last series the colour of that number; several may share one.
    #[must_use]
    pub fn colored(mut self, color: usize) -> Self {
        if let Some(last) = self.series.last_mut() {
            last.color = color;
        }
        self
    }

    /// Adds `values` at even times: the first at `start`, `step` apart (s). Long ones are thinned to the lowest and highest
    /// of each stretch, so that no peak is lost.
    #[must_use]
    pub fn over_time(self, name: &str, style: Style, [start, step]: [f64; 2], values: &[f64]) -> Self {
        let (every, thin) = thinned(values);
        let x = Values::Even { a: short(start), d: short(step * every), n: thin.len() };
        self.with(name, style, x, Values::scaled(&thin))
    }
}

/// Lowest and highest of stretches, in their order; and how many values one of them stands for.
fn thinned(values: &[f64]) -> (f64, Vec<f64>) {
    let length = 2 * values.len().div_ceil(POINTS);
    if values.len() <= POINTS {
        return (1.0, values.to_vec());
    }
    let mut thin = Vec::with_capacity(POINTS + 2);
    for stretch in values.chunks(length) {
        let (mut low, mut high) = (0, 0);
        for (index, value) in stretch.iter().enumerate() {
            if *value < stretch[low] {
                low = index;
            }
            if *value > stretch[high] {
                high = index;
            }
        }
        let (first, second) = if low < high { (low, high) } else { (high, low) };
        thin.extend([stretch[first], stretch[second]]);
    }
    (0.5 * length as f64, thin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_every_peak_and_its_time() {
        let mut values = vec![0.0; 100_000];
        values[70_000] = 5.0;
        values[20_000] = -3.0;
        let (every, thin) = thinned(&values);
        assert!(thin.len() <= POINTS + 2);
        let place = |wanted: f64| thin.iter().position(|v| *v == wanted).unwrap() as f64 * every;
        assert!((place(5.0) - 70_000.0).abs() < 2.0 * every && (place(-3.0) - 20_000.0).abs() < 2.0 * every);
    }

    #[test]
    fn short_series_are_as_they_are_and_rounding_is_below_a_pixel() {
        let values: Vec<f64> = (0..POINTS).map(|k| libm::sin(k as f64) * 3e-7).collect();
        assert_eq!(thinned(&values), (1.0, values.clone()));
        let Values::Scaled { k, v } = Values::scaled(&values) else { panic!("scaled") };
        for (back, value) in v.iter().zip(&values) {
            assert!((f64::from(*back) * k - value).abs() <= 3e-7 / STEPS);
        }
        assert_eq!(Values::scaled(&[0.0]), Values::Scaled { k: 1.0, v: vec![0] });
    }
}
