//! Content of a chart. A page draws it by script (`page`), with zoom and export; [`plot`](super::plot) draws it as SVG.

use serde_json::{Value, json};
use specgen_studies::reproduce::write::digits;

use super::grid::Grid;

/// Largest number of points of a series over time.
const POINTS: usize = 640;
/// Largest integer that values on a linear axis are rounded to: finer than any display.
const STEPS: f64 = 20_000.0;

/// Style of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mark {
    /// A line of this width, px.
    Line(f64),
    /// A dashed line of this width, px.
    Dashed(f64),
    /// Dots of this radius, px.
    Dots(f64),
}

/// A line on a page; its script chooses the width.
pub const LINE: Mark = Mark::Line(1.3);
/// A wide line behind a dashed one.
pub const WIDE: Mark = Mark::Line(3.0);
/// A dashed line on a page.
pub const DASHED: Mark = Mark::Dashed(1.6);
/// Dots on a page.
pub const DOTS: Mark = Mark::Dots(3.5);
/// Colour of data on a page; 0 to 3 are lightness levels of an ordered series, the most important first.
pub const BLUE: usize = 4;
/// Colour of targets and predictions on a page.
pub const INK: usize = 5;
/// Colour of values above their limit on a page.
pub const ORANGE: usize = 6;
/// Colour of earlier values on a page.
pub const EDGE: usize = 7;

/// An annotation in a chart on a page.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// Usual range of values: lowest and highest y, labelled on the right.
    Band([f64; 2], [String; 2]),
    /// A limit in y with a band beyond it.
    Beyond {
        /// The limit.
        y: f64,
        /// Whether it is an upper limit.
        up: bool,
        /// Its label: name and value.
        text: String,
    },
    /// The time of an event that a finding describes.
    Cause(f64, String),
    /// A point of interest.
    Ring([f64; 2], String),
    /// A margin: x, both ends in y, label.
    Segment(f64, [f64; 2], String),
    /// A y value of interest.
    Level(f64, String),
    /// x positions marked at the bottom, with their numbers.
    Modes(Vec<f64>, Vec<String>),
}

impl Note {
    fn data(&self) -> Value {
        match self {
            Self::Band(y, text) => json!({ "k": "band", "y": y.map(short), "text": text }),
            Self::Beyond { y, up, text } => json!({ "k": "beyond", "y": short(*y), "up": up, "text": text }),
            Self::Cause(x, text) => json!({ "k": "cause", "x": short(*x), "text": text }),
            Self::Ring([x, y], text) => json!({ "k": "ring", "x": short(*x), "y": short(*y), "text": text }),
            Self::Segment(x, y, text) => json!({ "k": "segment", "x": short(*x), "y": y.map(short), "text": text }),
            Self::Level(y, text) => json!({ "k": "level", "y": short(*y), "text": text }),
            Self::Modes(x, text) => {
                json!({ "k": "modes", "x": x.iter().map(|v| short(*v)).collect::<Vec<_>>(), "text": text })
            }
        }
    }
}

/// A series of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; in a picture an empty name has no entry.
    pub name: String,
    /// Style.
    pub mark: Mark,
    /// Colour number.
    pub color: usize,
    /// x, y in the units of the axes; NaN interrupts a line.
    pub points: Vec<[f64; 2]>,
    /// First x and step, if the points are evenly spaced.
    even: Option<[f64; 2]>,
}

/// A rectangle in the units of the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Lowest and highest x.
    pub x: [f64; 2],
    /// Lowest and highest y.
    pub y: [f64; 2],
    /// From 0 (white) to 1 (dark); `None`: hatched.
    pub shade: Option<f64>,
}

/// An axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Axis {
    /// The quantity.
    pub label: String,
    /// The unit; may be empty.
    pub unit: String,
    /// Logarithmic; non-positive values are not drawn.
    pub log: bool,
}

impl Axis {
    /// A linear axis.
    pub fn linear(label: &str, unit: &str) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), log: false }
    }

    /// A logarithmic axis.
    pub fn log(label: &str, unit: &str) -> Self {
        Self { log: true, ..Self::linear(label, unit) }
    }

    /// Label and unit as one text.
    pub fn text(&self) -> String {
        if self.unit.is_empty() { self.label.clone() } else { format!("{} ({})", self.label, self.unit) }
    }

    fn data(&self) -> Value {
        json!({ "label": self.label, "unit": self.unit, "log": self.log })
    }

    /// Values with few digits, to keep pages small: five on a logarithmic axis, `STEPS` over the largest magnitude on a linear one.
    fn packed(&self, values: &[f64]) -> Value {
        if self.log {
            return json!(values.iter().map(|v| v.is_finite().then(|| short(*v))).collect::<Vec<_>>());
        }
        let largest = values.iter().fold(0.0, |largest: f64, v| if v.abs() > largest { v.abs() } else { largest });
        let k = short(if largest > 0.0 { largest / STEPS } else { 1.0 });
        json!({ "k": k, "v": values.iter().map(|v| v.is_finite().then(|| libm::round(v / k) as i32)).collect::<Vec<_>>() })
    }
}

/// Rounded to five digits.
fn short(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

/// A chart: one pair of axes and its content.
#[must_use]
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chart {
    /// For file names and page links; empty in a picture.
    pub id: String,
    /// Title, with the number of the paper's figure if any.
    pub title: String,
    /// Label of its small form on a page.
    pub short: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Later series are drawn on top.
    pub series: Vec<Series>,
    /// Behind the series; in pictures only.
    pub patches: Vec<Patch>,
    /// Legend entry for hatched patches, if any.
    pub hatched: Option<String>,
    /// Fixed y limits; `None`: from the series.
    pub y_limits: Option<[f64; 2]>,
    /// On a page: annotations.
    pub notes: Vec<Note>,
    /// On a page: whether to show a legend below, for closed curves, instead of names at the ends of lines.
    pub keys: bool,
    /// On a page: whether it is above another chart with the same x axis.
    pub bare: bool,
    /// On a page: height, px; 0 for the default.
    pub height: u32,
}

impl Chart {
    /// An empty chart.
    pub fn new(id: &str, title: &str, x: Axis, y: Axis) -> Self {
        Self { id: id.to_owned(), title: title.to_owned(), x, y, ..Self::default() }
    }

    /// Adds a series in the next colour.
    pub fn with(mut self, name: &str, mark: Mark, points: Vec<[f64; 2]>) -> Self {
        self.series.push(Series { name: name.to_owned(), mark, color: self.series.len(), points, even: None });
        self
    }

    /// Sets the colour of the last series; several may share one.
    pub fn colored(mut self, color: usize) -> Self {
        if let Some(last) = self.series.last_mut() {
            last.color = color;
        }
        self
    }

    /// Adds an annotation.
    pub fn noted(mut self, note: Note) -> Self {
        self.notes.push(note);
        self
    }

    /// Adds `values` at regular times: the first at `start`, `step` apart (s). Long series are thinned to the minimum and maximum
    /// of each stretch, so no peak is lost.
    pub fn over_time(self, name: &str, mark: Mark, [start, step]: [f64; 2], values: &[f64]) -> Self {
        let (every, thin) = thinned(values);
        let points = thin.iter().enumerate().map(|(k, value)| [start + k as f64 * step * every, *value]).collect();
        let mut chart = self.with(name, mark, points);
        if let Some(last) = chart.series.last_mut() {
            last.even = Some([start, step * every]);
        }
        chart
    }

    /// Adds a line in stretches, each with its start time and values `step` apart (s).
    pub fn in_stretches(self, name: &str, mark: Mark, step: f64, stretches: Vec<(f64, Vec<f64>)>) -> Self {
        if let [(start, values)] = &stretches[..] {
            return self.over_time(name, mark, [*start, step], values);
        }
        let mut points = Vec::new();
        for (start, values) in stretches {
            if !points.is_empty() {
                points.push([f64::NAN; 2]);
            }
            let (every, thin) = thinned(&values);
            points.extend(thin.iter().enumerate().map(|(k, value)| [start + k as f64 * step * every, *value]));
        }
        self.with(name, mark, points)
    }

    /// Data for a page's script.
    pub fn data(&self) -> Value {
        let series = |one: &Series| {
            let of = |which: usize| one.points.iter().map(|point| point[which]).collect::<Vec<_>>();
            let x = match one.even {
                Some([start, step]) => json!({ "a": short(start), "d": short(step), "n": one.points.len() }),
                None => self.x.packed(&of(0)),
            };
            let style = match one.mark {
                Mark::Line(width) if width > 2.0 => "wide",
                Mark::Line(_) => "line",
                Mark::Dashed(_) => "dash",
                Mark::Dots(_) => "dots",
            };
            json!({ "name": one.name, "style": style, "color": one.color, "x": x, "y": self.y.packed(&of(1)) })
        };
        let series: Vec<Value> = self.series.iter().map(series).collect();
        let notes: Vec<Value> = self.notes.iter().map(Note::data).collect();
        json!({
            "id": self.id, "title": self.title, "short": self.short, "x": self.x.data(), "y": self.y.data(), "series": series,
            "notes": notes, "keys": self.keys, "bare": self.bare, "height": self.height, "y_limits": self.y_limits,
        })
    }

    /// Table of its series: first and last value, minimum, maximum, rms.
    pub fn numbers(&self) -> Grid {
        let head = ["series", "points", "from", "to", "lowest", "at", "highest", "at", "rms"];
        let mut grid = Grid::new(&format!("{} ({} over {})", self.title, self.y.text(), self.x.text()), &head);
        for one in &self.series {
            let seen: Vec<&[f64; 2]> =
                one.points.iter().filter(|point| point[0].is_finite() && point[1].is_finite()).collect();
            let (Some(first), Some(last)) = (seen.first(), seen.last()) else { continue };
            let extreme = |sign: f64| {
                seen.iter().fold(**first, |best, point| if sign * point[1] > sign * best[1] { **point } else { best })
            };
            let ([low_at, low], [high_at, high]) = (extreme(-1.0), extreme(1.0));
            let square: f64 = seen.iter().map(|point| point[1] * point[1]).sum();
            let name = if one.name.is_empty() { self.y.label.clone() } else { one.name.clone() };
            let numbers = [first[0], last[0], low, low_at, high, high_at, libm::sqrt(square / seen.len() as f64)];
            grid.push([vec![name, seen.len().to_string()], numbers.map(digits).to_vec()].concat());
        }
        grid
    }
}

/// Points from two lists.
pub fn pairs(x: &[f64], y: &[f64]) -> Vec<[f64; 2]> {
    x.iter().zip(y).map(|(x, y)| [*x, *y]).collect()
}

/// Minimum and maximum of stretches, in order of time, and the number of values per returned value.
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
    fn short_series_are_unchanged_and_rounding_is_below_a_pixel() {
        let values: Vec<f64> = (0..POINTS).map(|k| libm::sin(k as f64) * 3e-7).collect();
        assert_eq!(thinned(&values), (1.0, values.clone()));
        let axis = Axis::linear("", "");
        let packed = axis.packed(&values);
        assert_eq!(packed["v"].as_array().unwrap().len(), values.len());
        for (back, value) in packed["v"].as_array().unwrap().iter().zip(&values) {
            assert!((back.as_f64().unwrap() * packed["k"].as_f64().unwrap() - value).abs() <= 3e-7 / STEPS);
        }
        assert_eq!(axis.packed(&[0.0]), json!({ "k": 1.0, "v": [0] }));
    }
}
