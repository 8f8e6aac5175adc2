//! Files of `watch` as columns, and figures of a platform at rest or on its path.

use std::ops::Range;
use std::path::Path;

use specgen_identify::mean;
use specgen_language::files;
use specgen_language::outcome::Failure;
use specgen_language::output::unread_file;

use super::state::{Peak, Rest};
use crate::place::AXES;

/// A line of a spectrum is above the noise by this factor, and above this frequency, Hz: drift and creep are below.
const ABOVE: (f64, f64) = (4.0, 2.0);
/// Most lines of an axis.
const LINES: usize = 2;

/// Columns by name.
pub(super) struct Rows {
    shown: String,
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Rows {
    /// Those of a file.
    ///
    /// # Errors
    /// It cannot be read, or has no row.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let text = files::text(path).map_err(|unread| unread_file(path, &unread))?;
        let mut lines = text.lines();
        let names: Vec<String> = lines.next().unwrap_or_default().split(',').map(str::to_owned).collect();
        let mut columns = vec![Vec::new(); names.len()];
        for line in lines {
            for (column, cell) in columns.iter_mut().zip(line.split(',')) {
                column.push(cell.parse().unwrap_or(f64::NAN));
            }
        }
        let shown = path.display().to_string();
        if columns.first().is_none_or(Vec::is_empty) {
            return Err(Failure::Gate(format!("{shown} has no rows: record it again with --again")));
        }
        Ok(Self { shown, names, columns })
    }

    /// The column of this name.
    ///
    /// # Errors
    /// There is none, or a gauge was not read in one of its rows.
    pub fn column(&self, name: &str) -> Result<&[f64], Failure> {
        let found = self.names.iter().position(|known| known == name).and_then(|place| self.columns.get(place));
        let column = found.ok_or_else(|| {
            Failure::Gate(format!("{}: the column {name} is missing; record it again with --again", self.shown))
        })?;
        match column.iter().position(|x| !x.is_finite()) {
            None => Ok(column),
            Some(row) => Err(Failure::Gate(format!(
                "{}: row {row} has no {name}: a gauge was at the end of its range, or failed; zero it, or widen sensor.range, \
                 and record it again with --again",
                self.shown
            ))),
        }
    }

    /// Columns of six axes or legs; `*` in the name is their number.
    fn six(&self, name: &str) -> Result<[&[f64]; 6], Failure> {
        let mut all = [&[] as &[f64]; 6];
        for (number, one) in all.iter_mut().enumerate() {
            *one = self.column(&name.replace('*', &number.to_string()))?;
        }
        Ok(all)
    }

    /// Time of each row from the first, s.
    pub fn time(&self) -> Result<Vec<f64>, Failure> {
        let time = self.column("time_s")?;
        Ok(time.iter().map(|t| t - time[0]).collect())
    }

    /// Displacement of each leg, m.
    pub fn legs(&self) -> Result<[&[f64]; 6], Failure> {
        self.six("leg[*]_m")
    }

    /// Those of a simulation, by their names.
    pub fn new(shown: &str, names: &[&str], columns: Vec<Vec<f64>>) -> Self {
        Self { shown: shown.to_owned(), names: names.iter().map(|name| (*name).to_owned()).collect(), columns }
    }

    /// Duration of a tick, s.
    pub fn period(&self) -> Result<f64, Failure> {
        let (time, ticks) = (self.column("time_s")?, self.column("ticks")?);
        let row = time.get(1).map_or(0.0, |second| second - time[0]);
        Ok(row / ticks[0])
    }

    /// Rows in a span of time, s.
    pub fn span(&self, [from, to]: [f64; 2]) -> Result<Range<usize>, Failure> {
        let time = self.time()?;
        Ok(time.partition_point(|t| *t < from)..time.partition_point(|t| *t <= to))
    }

    /// Columns of the six axes, such as `pose` and `target`, or `error` with `_mean`.
    pub fn axes(&self, name: &str, which: &str) -> Result<[&[f64]; 6], Failure> {
        let mut all = [&[] as &[f64]; 6];
        for (axis, one) in all.iter_mut().enumerate() {
            let unit = if axis < AXES.len() / 2 { "m" } else { "rad" };
            *one = self.column(&format!("{name}[{axis}]{which}_{unit}"))?;
        }
        Ok(all)
    }

    /// Error of each axis in the last tick of each row, in this span of time (s), m and rad. A tick reads the pose at its beginning
    /// and gives the set-point for its end: the motion of the set-point over the tick is no error.
    pub fn errors(&self, span: [f64; 2]) -> Result<[Vec<f64>; 6], Failure> {
        let (time, period, span) = (self.time()?, self.period()?, self.span(span)?);
        let [pose, target] = [self.axes("pose", "")?, self.axes("target", "")?];
        let last = time.len() - 1;
        let error = |axis: usize, row: usize| {
            let (before, after) = (row.saturating_sub(1), if row < last { row + 1 } else { last });
            let rate = (target[axis][after] - target[axis][before]) / (time[after] - time[before]);
            let moved = if after > before { period * rate } else { 0.0 };
            target[axis][row] - moved - pose[axis][row]
        };
        Ok(std::array::from_fn(|axis| span.clone().map(|row| error(axis, row)).collect()))
    }

    /// Rms of each axis within eighths of the record, each without its mean and drift: creep after a motion is slower.
    pub fn jitter(&self) -> Result<[f64; 6], Failure> {
        let (time, errors) = (self.time()?, self.errors([0.0, f64::INFINITY])?);
        let part = time.len().div_ceil(8);
        let parts = |error: &Vec<f64>| -> Vec<f64> {
            time.chunks(part).zip(error.chunks(part)).flat_map(|(time, error)| without_line(time, error)).collect()
        };
        Ok(errors.each_ref().map(|error| rms(&parts(error))))
    }

    /// Noise at rest, with the amplitude at `mains`, Hz. `readings`: of each gauge (rows) per displacement of a leg.
    pub fn rest(&self, mains: f64, readings: &[[f64; 6]; 6]) -> Result<Rest, Failure> {
        let (time, errors) = (self.time()?, self.errors([0.0, f64::INFINITY])?);
        let still = errors.map(|error| without_line(&time, &error));
        let legs = self.legs()?.map(mean);
        let gauge = |row: &[f64; 6]| row.iter().zip(legs).fold(0.0, |sum, (part, leg)| sum + part * leg);
        Ok(Rest {
            rms: still.each_ref().map(|one| rms(one)),
            mains: still.each_ref().map(|one| amplitude(&time, one, mains)),
            gauges: readings.each_ref().map(gauge),
            lines: still.iter().enumerate().flat_map(|(axis, one)| lines(&time, one, axis)).collect(),
        })
    }
}

/// The strongest lines of an axis, strongest first.
fn lines(time: &[f64], values: &[f64], axis: usize) -> Vec<Peak> {
    let count = values.len();
    let Some(row) = time.last().map(|last| last / (count - 1).max(1) as f64).filter(|row| *row > 0.0) else {
        return Vec::new();
    };
    let step = 1.0 / (row * count as f64);
    let all: Vec<f64> = (0..count / 2).map(|bin| amplitude(time, values, bin as f64 * step)).collect();
    let floor = ABOVE.0 * 2.0 * rms(values) / (count as f64).sqrt();
    let is_line = |bin: &usize| {
        let own = all[*bin];
        own > floor && own >= all[bin - 1] && all.get(bin + 1).is_none_or(|next| own > *next)
    };
    let first = libm::ceil(ABOVE.1 / step) as usize;
    let mut found: Vec<Peak> = (first.max(1)..all.len())
        .filter(is_line)
        .map(|bin| Peak { axis, frequency: bin as f64 * step, amplitude: all[bin] })
        .collect();
    found.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
    found.truncate(LINES);
    found
}

/// Root mean square.
pub(super) fn rms(values: &[f64]) -> f64 {
    mean(&values.iter().map(|x| x * x).collect::<Vec<_>>()).sqrt()
}

/// Values less their mean and their slope over time.
fn without_line(time: &[f64], values: &[f64]) -> Vec<f64> {
    let (middle, level) = (mean(time), mean(values));
    let moments = time.iter().zip(values).fold([0.0; 2], |[over, square], (t, x)| {
        [over + (t - middle) * (x - level), square + (t - middle) * (t - middle)]
    });
    let slope = if moments[1] > 0.0 { moments[0] / moments[1] } else { 0.0 };
    time.iter().zip(values).map(|(t, x)| x - level - slope * (t - middle)).collect()
}

/// Amplitude at a frequency (Hz) of values over many of its periods, at equal times.
fn amplitude(time: &[f64], values: &[f64], frequency: f64) -> f64 {
    let row = time.get(1).copied().unwrap_or_default();
    let (sine, cosine) = libm::sincos(core::f64::consts::TAU * frequency * row);
    let mut turn = [1.0, 0.0];
    let sums = values.iter().fold([0.0; 2], |[real, imaginary], x| {
        let [c, s] = turn;
        turn = [c * cosine - s * sine, s * cosine + c * sine];
        [real + x * c, imaginary + x * s]
    });
    2.0 / values.len() as f64 * libm::hypot(sums[0], sums[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_motion_over_a_tick_is_no_error() {
        // 1 mm/s for rows of ten ticks of 0.1 ms; the pose follows with 5 nm.
        let set_point = |row: usize| 1e-6 * row as f64;
        let column = |of: fn(f64) -> f64| (0..20).map(|row| of(set_point(row))).collect::<Vec<f64>>();
        let titles =
            |of: &str| (0..6).map(|k| format!("{of}[{k}]_{}", if k < 3 { "m" } else { "rad" })).collect::<Vec<_>>();
        let names = [vec!["time_s".to_owned(), "ticks".to_owned()], titles("pose"), titles("target")].concat();
        let mut columns = vec![(0..20).map(|row| 1e-3 * f64::from(row)).collect(), vec![10.0; 20]];
        columns.extend(vec![column(|target| target - 1e-7 - 5e-9); 6]);
        columns.extend(vec![column(|target| target); 6]);
        let rows = Rows::new("a ramp", &names.iter().map(String::as_str).collect::<Vec<_>>(), columns);
        let errors = rows.errors([0.0, 1.0]).unwrap();
        assert!(errors[2].len() == 20 && errors[2].iter().all(|error| (error - 5e-9).abs() < 1e-15), "{errors:?}");
    }

    #[test]
    fn noise_and_hum_are_found_beside_a_drift() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rest.csv");
        let title =
            |of: &str| (0..6).map(|k| format!(",{of}[{k}]_{}", if k < 3 { "m" } else { "rad" })).collect::<String>();
        let legs = (0..6).map(|k| format!(",leg[{k}]_m")).collect::<String>();
        let mut text = format!("time_s,ticks{}{}{legs}\n", title("pose"), title("target"));
        for row in 0..1000 {
            let time = 7.0 + f64::from(row) * 4e-3;
            let noise = if row % 2 == 0 { 2e-9 } else { -2e-9 };
            let hum = 5e-9 * libm::sin(core::f64::consts::TAU * 50.0 * time + 0.3);
            let pose = 1e-6 + 3e-9 * time + noise + hum;
            text += &format!("{time},40{}{}{}\n", format!(",{pose:e}").repeat(6), ",1e-6".repeat(6), ",2e-7".repeat(6));
        }
        std::fs::write(&path, &text).unwrap();
        let rest = Rows::read(&path).unwrap().rest(50.0, &[[0.5; 6]; 6]).unwrap();
        assert!((rest.gauges[3] - 6e-7).abs() < 1e-12, "{rest:?}");
        let seen: Vec<(usize, f64)> = rest.lines.iter().map(|line| (line.axis, line.frequency)).collect();
        assert_eq!(seen, [0, 1, 2, 3, 4, 5].map(|axis| (axis, 50.0)), "{rest:?}");
        assert!((rest.mains[0] - 5e-9).abs() < 1e-11, "{rest:?}");
        assert!((rest.rms[5] - 16.5e-9_f64.sqrt() * 1e-9_f64.sqrt()).abs() < 2e-11, "{rest:?}");
        std::fs::write(&path, text.replacen("1e-6", "nan", 1)).unwrap();
        let error = Rows::read(&path).unwrap().errors([0.0, 1.0]).unwrap_err().message();
        assert!(error.contains("row 0 has no target[0]_m: a gauge was at the end of its range"), "{error}");
    }
}
