//! Files of `watch` as columns, and figures of a platform at rest or on its path.

use std::path::Path;

use specgen_identify::mean;
use specgen_language::files;
use specgen_language::outcome::Failure;
use specgen_language::output::unread_file;

use super::state::Rest;
use crate::place::AXES;

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
        let found = self.names.iter().position(|known| known == name);
        let found = found.and_then(|place| self.columns.get(place)).filter(|all| all.iter().all(|x| x.is_finite()));
        found.map(Vec::as_slice).ok_or_else(|| {
            Failure::Gate(format!(
                "{}: the column {name} is missing or not whole; record it again with --again",
                self.shown
            ))
        })
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

    /// Set-point less pose of each axis in the last tick of each row, in this span of time (s), m and rad.
    pub fn errors(&self, [from, to]: [f64; 2]) -> Result<[Vec<f64>; 6], Failure> {
        let time = self.time()?;
        let span = time.partition_point(|t| *t < from)..time.partition_point(|t| *t <= to);
        let mut errors: [Vec<f64>; 6] = Default::default();
        for (axis, errors) in errors.iter_mut().enumerate() {
            let unit = if axis < AXES.len() / 2 { "m" } else { "rad" };
            let [pose, target] = ["pose", "target"].map(|of| self.column(&format!("{of}[{axis}]_{unit}")));
            let both = target?[span.clone()].iter().zip(&pose?[span.clone()]);
            *errors = both.map(|(target, pose)| target - pose).collect();
        }
        Ok(errors)
    }

    /// Noise at rest, with the amplitude at `mains`, Hz.
    pub fn rest(&self, mains: f64) -> Result<Rest, Failure> {
        let (time, errors) = (self.time()?, self.errors([0.0, f64::INFINITY])?);
        let still = errors.map(|error| without_line(&time, &error));
        Ok(Rest { rms: still.each_ref().map(|one| rms(one)), mains: still.map(|one| amplitude(&time, &one, mains)) })
    }
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

/// Amplitude at a frequency (Hz) of values over many of its periods.
fn amplitude(time: &[f64], values: &[f64], frequency: f64) -> f64 {
    let sums = time.iter().zip(values).fold([0.0; 2], |[sine, cosine], (t, x)| {
        let phase = core::f64::consts::TAU * frequency * t;
        [sine + x * libm::sin(phase), cosine + x * libm::cos(phase)]
    });
    2.0 / values.len() as f64 * libm::hypot(sums[0], sums[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_and_hum_are_found_beside_a_drift() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rest.csv");
        let title =
            |of: &str| (0..6).map(|k| format!(",{of}[{k}]_{}", if k < 3 { "m" } else { "rad" })).collect::<String>();
        let mut text = format!("time_s{}{}\n", title("pose"), title("target"));
        for row in 0..1000 {
            let time = 7.0 + f64::from(row) * 4e-3;
            let noise = if row % 2 == 0 { 2e-9 } else { -2e-9 };
            let hum = 5e-9 * libm::sin(core::f64::consts::TAU * 50.0 * time + 0.3);
            let pose = 1e-6 + 3e-9 * time + noise + hum;
            text += &format!("{time}{}{}\n", format!(",{pose:e}").repeat(6), ",1e-6".repeat(6));
        }
        std::fs::write(&path, &text).unwrap();
        let rest = Rows::read(&path).unwrap().rest(50.0).unwrap();
        assert!((rest.mains[0] - 5e-9).abs() < 1e-11, "{rest:?}");
        assert!((rest.rms[5] - 16.5e-9_f64.sqrt() * 1e-9_f64.sqrt()).abs() < 2e-11, "{rest:?}");
        std::fs::write(&path, text.replacen("1e-6", "nan", 1)).unwrap();
        let error = Rows::read(&path).unwrap().errors([0.0, 1.0]).unwrap_err().message();
        assert!(error.contains("is missing or not whole"), "{error}");
    }
}
