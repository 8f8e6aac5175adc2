//! Figures of merit: tracking errors as in the paper's Table 2, straight-line fits as in its Table 1.

use std::fmt::Write;

use serde::Serialize;

use crate::closed_loop::{LEGS, Tracking};
use crate::coverage::Coverage;

/// Tracking error of one run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrackingRow {
    /// `invhys`, `ewma` or `pcc`.
    pub mode: String,
    /// Operating frequency, Hz.
    pub frequency_hz: f64,
    /// Root mean square of T − Y over the run and over the six legs, nm.
    pub rmse_nm: f64,
    /// The same for each leg, nm.
    pub leg_rmse_nm: [f64; LEGS],
    /// Largest |T − Y| of any leg, nm.
    pub peak_nm: f64,
    /// What was measured.
    #[serde(flatten)]
    pub coverage: Coverage,
}

impl TrackingRow {
    /// Figures of a run.
    pub fn of(mode: &str, frequency: f64, tracking: &Tracking) -> Self {
        let mut squares = [0.0; LEGS];
        let mut peak = 0.0_f64;
        for sample in &tracking.samples {
            for (leg, square) in squares.iter_mut().enumerate() {
                let error = sample.target[leg] - sample.measured[leg];
                *square += error * error;
                if error.abs() > peak {
                    peak = error.abs();
                }
            }
        }
        let count = tracking.samples.len().max(1) as f64;
        let mean_square = squares.iter().sum::<f64>() / (count * LEGS as f64);
        Self {
            mode: mode.to_owned(),
            frequency_hz: frequency,
            rmse_nm: libm::sqrt(mean_square) * 1e9,
            leg_rmse_nm: squares.map(|square| libm::sqrt(square / count) * 1e9),
            peak_nm: peak * 1e9,
            coverage: tracking.coverage(),
        }
    }
}

/// Tracking errors of several modes and frequencies.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct TrackingTable {
    /// In the order in which they were run.
    pub rows: Vec<TrackingRow>,
}

impl TrackingTable {
    /// A run, if it was made.
    pub fn row(&self, mode: &str, frequency: f64) -> Option<&TrackingRow> {
        self.rows.iter().find(|row| row.mode == mode && row.frequency_hz == frequency)
    }

    /// Its error, nm.
    pub fn rmse_nm(&self, mode: &str, frequency: f64) -> Option<f64> {
        self.row(mode, frequency).map(|row| row.rmse_nm)
    }

    /// CSV, one line per run.
    pub fn to_csv(&self) -> String {
        let mut out = String::from("mode,frequency_Hz,rmse_nm,peak_nm");
        for leg in 0..LEGS {
            // Writing to a String cannot fail, here and below.
            let _ = write!(out, ",rmse_nm[{leg}]");
        }
        out.push_str(",seconds,path_seconds\n");
        for row in &self.rows {
            let _ = write!(out, "{},{},{:.4},{:.4}", row.mode, row.frequency_hz, row.rmse_nm, row.peak_nm);
            out.extend(row.leg_rmse_nm.iter().map(|value| format!(",{value:.4}")));
            let Coverage { seconds, path_seconds } = row.coverage;
            let _ = writeln!(out, ",{seconds:.6},{path_seconds:.6}");
        }
        out
    }

    /// Text: a line per mode, a column per frequency, nm rms; the coverage below.
    pub fn to_text(&self) -> String {
        let mut modes: Vec<&str> = Vec::new();
        let mut frequencies: Vec<f64> = Vec::new();
        for row in &self.rows {
            if !modes.contains(&row.mode.as_str()) {
                modes.push(&row.mode);
            }
            if !frequencies.contains(&row.frequency_hz) {
                frequencies.push(row.frequency_hz);
            }
        }
        let mut out = String::from("nm rms  ");
        out.extend(frequencies.iter().map(|frequency| format!("{:>12}", format!("{frequency} Hz"))));
        for mode in modes {
            let _ = write!(out, "\n{mode:<8}");
            for frequency in &frequencies {
                let cell = self.rmse_nm(mode, *frequency).map_or_else(|| "-".to_owned(), |value| format!("{value:.1}"));
                let _ = write!(out, "{cell:>12}");
            }
        }
        let of = |name: &str, time: fn(&Coverage) -> f64, out: &mut String| {
            let _ = write!(out, "\n{name:<8}");
            for frequency in &frequencies {
                let row = self.rows.iter().find(|row| row.frequency_hz == *frequency);
                let cell = row.map_or_else(String::new, |row| format!("{:.3}", time(&row.coverage)));
                let _ = write!(out, "{cell:>12}");
            }
        };
        of("over s", |coverage| coverage.seconds, &mut out);
        of("path s", |coverage| coverage.path_seconds, &mut out);
        out.push('\n');
        out
    }
}

/// Straight line y = slope·x + offset.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Line {
    /// Unit of y per unit of x.
    pub slope: f64,
    /// Unit of y.
    pub offset: f64,
}

impl Line {
    /// Least squares through the points; `None` with fewer than two different x.
    pub fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let count = points.len() as f64;
        let mean_x = points.iter().map(|(x, _)| x).sum::<f64>() / count;
        let mean_y = points.iter().map(|(_, y)| y).sum::<f64>() / count;
        let spread: f64 = points.iter().map(|(x, _)| (x - mean_x) * (x - mean_x)).sum();
        let product: f64 = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
        let slope = product / spread;
        (spread > 0.0).then_some(Self { slope, offset: mean_y - slope * mean_x })
    }
}

/// Straight-line relation of one run, Y = λ q̂ + δ with q̂ = ρ̂ X, so that ρ = λ ρ̂.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinearityRow {
    /// Operating frequency, Hz.
    pub frequency_hz: f64,
    /// λ = ρ/ρ̂.
    pub gain_ratio: f64,
    /// δ, µm.
    pub offset_um: f64,
    /// ρ relative to that of the table's first row.
    pub relative_slope: f64,
}

/// Straight-line relations at several frequencies.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct LinearityTable {
    /// In the order in which they were run.
    pub rows: Vec<LinearityRow>,
}

impl LinearityTable {
    /// Adds a run, fitted over its last `samples` samples and all legs; returns `false` if they define no line.
    pub fn push(&mut self, frequency: f64, tracking: &Tracking, samples: usize) -> bool {
        let start = tracking.samples.len().saturating_sub(samples);
        let points: Vec<(f64, f64)> = tracking.samples[start..]
            .iter()
            .flat_map(|sample| sample.requested.into_iter().zip(sample.measured))
            .collect();
        let Some(line) = Line::fit(&points) else {
            return false;
        };
        let reference = self.rows.first().map_or(line.slope, |row| row.gain_ratio);
        self.rows.push(LinearityRow {
            frequency_hz: frequency,
            gain_ratio: line.slope,
            offset_um: line.offset * 1e6,
            relative_slope: line.slope / reference,
        });
        true
    }

    /// CSV, one line per frequency.
    pub fn to_csv(&self) -> String {
        let mut out = String::from("frequency_Hz,gain_ratio,offset_um,relative_slope\n");
        for row in &self.rows {
            let LinearityRow { frequency_hz, gain_ratio, offset_um, relative_slope } = row;
            let _ = writeln!(out, "{frequency_hz},{gain_ratio:.6},{offset_um:.5},{relative_slope:.6}");
        }
        out
    }

    /// Text, one line per frequency.
    pub fn to_text(&self) -> String {
        let mut out = String::from("        Hz    slope/model   offset um   slope/first\n");
        for row in &self.rows {
            let LinearityRow { frequency_hz, gain_ratio, offset_um, relative_slope } = row;
            let _ = writeln!(out, "{frequency_hz:>10}{gain_ratio:>15.4}{offset_um:>12.4}{relative_slope:>14.4}");
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_loop::TrackingSample;

    fn tracking(samples: usize, gain: f64, offset: f64) -> Tracking {
        let samples: Vec<TrackingSample> = (0..samples)
            .map(|n| {
                let target = [n as f64 * 1e-6; LEGS];
                let measured = target.map(|t| gain * t + offset);
                TrackingSample { time: n as f64, target, requested: target, measured }
            })
            .collect();
        Tracking { interval: 1.0, path: samples.len(), samples }
    }

    #[test]
    fn rmse_is_in_nanometres_over_samples_and_legs() {
        let mut run = tracking(4, 1.0, 3e-9);
        assert!((TrackingRow::of("pcc", 1.0, &run).rmse_nm - 3.0).abs() < 1e-9);
        run.samples[2].measured[1] += 9e-9;
        let row = TrackingRow::of("pcc", 1.0, &run);
        // Leg 1: √((3·9 + 144)/4); all: √((23·9 + 144)/24).
        assert!((row.leg_rmse_nm[1] - (171.0_f64 / 4.0).sqrt()).abs() < 1e-6);
        assert!((row.rmse_nm - (351.0_f64 / 24.0).sqrt()).abs() < 1e-6);
        assert!((row.peak_nm - 12.0).abs() < 1e-6);
    }

    #[test]
    fn slopes_are_relative_to_the_first_row() {
        let mut table = LinearityTable::default();
        assert!(table.push(0.1, &tracking(50, 1.02, 0.6e-6), 20));
        assert!(table.push(1.0, &tracking(50, 0.51, 0.5e-6), 20));
        assert!((table.rows[0].gain_ratio - 1.02).abs() < 1e-12);
        assert!((table.rows[0].offset_um - 0.6).abs() < 1e-9);
        assert!((table.rows[1].relative_slope - 0.5).abs() < 1e-12);
        assert!(!table.push(10.0, &tracking(1, 1.0, 0.0), 20));
    }

    #[test]
    fn tables_print_as_text_and_csv() {
        let mut table = TrackingTable::default();
        for (mode, gain) in [("invhys", 0.9), ("pcc", 1.0)] {
            for frequency in [0.1, 10.0] {
                table.rows.push(TrackingRow::of(mode, frequency, &tracking(3, gain, 0.0)));
            }
        }
        assert_eq!(
            table.to_text(),
            "nm rms        0.1 Hz       10 Hz\ninvhys         129.1       129.1\npcc              0.0         0.0\n\
             over s         3.000       3.000\npath s         3.000       3.000\n"
        );
        assert_eq!(
            table.to_csv().lines().nth(1),
            Some(&*format!("invhys,0.1,129.0994,200.0000{},3.000000,3.000000", ",129.0994".repeat(6)))
        );
        assert_eq!(table.rmse_nm("ewma", 0.1), None);
    }
}
