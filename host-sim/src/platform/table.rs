//! Pose errors and the paper's Tables 5 to 9.

use std::fmt::Write;

use serde::Serialize;

use super::linear::Six;
use crate::coverage::Coverage;

/// Names of the pose coordinates.
pub const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// Length of the first three numbers, and of the last three.
fn norms([x, y, z, a, b, c]: Six) -> [f64; 2] {
    [libm::sqrt(x * x + y * y + z * z), libm::sqrt(a * a + b * b + c * c)]
}

/// Accumulated errors of a pose over a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PoseErrors {
    count: usize,
    squares: Six,
    peaks: Six,
    translation_norms: f64,
    orientation_norms: f64,
    largest_translation: f64,
    interval: f64,
    path: usize,
}

impl PoseErrors {
    /// No errors yet, for a path with a number of ticks of an interval (s).
    #[must_use]
    pub fn over(path: usize, interval: f64) -> Self {
        Self { interval, path, ..Self::default() }
    }

    /// Adds one error: target less true pose, m and rad.
    pub fn add(&mut self, error: &Six) {
        self.count += 1;
        for k in 0..6 {
            self.squares[k] += error[k] * error[k];
            if error[k].abs() > self.peaks[k] {
                self.peaks[k] = error[k].abs();
            }
        }
        let [translation, orientation] = norms(*error);
        self.translation_norms += translation;
        self.orientation_norms += orientation;
        if translation > self.largest_translation {
            self.largest_translation = translation;
        }
    }

    /// Number of errors.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The part of the path that they cover.
    pub fn coverage(&self) -> Coverage {
        Coverage::new(self.count, self.path, self.interval)
    }

    fn divisor(&self) -> f64 {
        self.count.max(1) as f64
    }

    /// Root mean square of each coordinate, nm and nrad.
    pub fn rms_nano(&self) -> Six {
        self.squares.map(|square| libm::sqrt(square / self.divisor()) * 1e9)
    }

    /// Largest magnitude of each coordinate, nm and nrad.
    pub fn peak_nano(&self) -> Six {
        self.peaks.map(|peak| peak * 1e9)
    }

    /// Norm of the root mean squares of x, y and z, nm.
    pub fn rms_translation_nm(&self) -> f64 {
        norms(self.rms_nano())[0]
    }

    /// Norm of the root mean squares of the three angles, nrad.
    pub fn rms_orientation_nrad(&self) -> f64 {
        norms(self.rms_nano())[1]
    }

    /// Mean of |error of P_C|, nm.
    pub fn mean_translation_nm(&self) -> f64 {
        self.translation_norms / self.divisor() * 1e9
    }

    /// Mean norm of the errors of the three angles, nrad.
    pub fn mean_orientation_nrad(&self) -> f64 {
        self.orientation_norms / self.divisor() * 1e9
    }

    /// Largest |error of P_C|, nm.
    pub fn peak_translation_nm(&self) -> f64 {
        self.largest_translation * 1e9
    }
}

/// One run in free motion, a row of Tables 5 to 8.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PoseRow {
    /// Trajectory: `case-1` or `case-2` in the paper.
    pub trajectory: String,
    /// Mode of the controller.
    pub mode: String,
    /// Operating frequency, Hz.
    pub frequency_hz: f64,
    /// What was measured.
    #[serde(flatten)]
    pub coverage: Coverage,
    /// Root mean square error of each coordinate, nm and nrad.
    pub rms_nano: Six,
    /// Largest error of P_C, nm.
    pub peak_nm: f64,
}

impl PoseRow {
    /// Figures of a run.
    pub fn of(trajectory: &str, mode: &str, frequency: f64, errors: &PoseErrors) -> Self {
        Self {
            trajectory: trajectory.to_owned(),
            mode: mode.to_owned(),
            frequency_hz: frequency,
            coverage: errors.coverage(),
            rms_nano: errors.rms_nano(),
            peak_nm: errors.peak_translation_nm(),
        }
    }

    /// Norm of the errors of x, y and z, nm.
    pub fn translation_nm(&self) -> f64 {
        norms(self.rms_nano)[0]
    }

    /// Norm of the errors of the angles, nrad.
    pub fn orientation_nrad(&self) -> f64 {
        norms(self.rms_nano)[1]
    }
}

/// Tables 5 to 8: free motion.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PoseTable {
    /// In the order in which they were run.
    pub rows: Vec<PoseRow>,
}

impl PoseTable {
    /// A run, if it was made.
    pub fn row(&self, trajectory: &str, mode: &str, frequency: f64) -> Option<&PoseRow> {
        self.rows.iter().find(|row| row.trajectory == trajectory && row.mode == mode && row.frequency_hz == frequency)
    }

    /// CSV, one line per run.
    pub fn to_csv(&self) -> String {
        let mut out = String::from(
            "trajectory,mode,frequency_Hz,x_nm,y_nm,z_nm,rx_nrad,ry_nrad,rz_nrad,peak_nm,seconds,path_seconds\n",
        );
        for row in &self.rows {
            // Writing to a String cannot fail, here and below.
            let _ = write!(out, "{},{},{}", row.trajectory, row.mode, row.frequency_hz);
            out.extend(row.rms_nano.iter().map(|value| format!(",{value:.4}")));
            let Coverage { seconds, path_seconds } = row.coverage;
            let _ = writeln!(out, ",{:.4},{seconds:.6},{path_seconds:.6}", row.peak_nm);
        }
        out
    }

    /// Text, one line per run: rms errors, and `beside_paper` the paper's where it has the run.
    pub fn to_text(&self, beside_paper: bool) -> String {
        let mut out = String::from(
            "rms error  Hz mode        x nm    y nm    z nm norm nm rx nrad ry nrad rz nrad  over s  path s\n",
        );
        for row in &self.rows {
            let _ = write!(out, "{:<8}{:>5} {:<10}", row.trajectory, row.frequency_hz, row.mode);
            out.extend(with_norm(row.rms_nano).map(|value| format!("{value:>8.1}")));
            let Coverage { seconds, path_seconds } = row.coverage;
            let _ = writeln!(out, "{seconds:>8.3}{path_seconds:>8.3}");
            let paper = beside_paper.then(|| paper_rms(&row.trajectory, &row.mode, row.frequency_hz)).flatten();
            if let Some(paper) = paper {
                let _ = write!(out, "{:<24}", "         paper");
                out.extend(with_norm(paper).map(|value| format!("{value:>8.0}")));
                out.push('\n');
            }
        }
        out
    }
}

/// The first three, their norm, the others.
fn with_norm(rms: Six) -> [f64; 7] {
    let [x, y, z, a, b, c] = rms;
    [x, y, z, norms(rms)[0], a, b, c]
}

/// The paper's tables in nm and nrad: a line per trajectory and mode, columns 0.1, 1 and 10 Hz for each of x, y, z (5, 7)
/// and θx, θy, θz (6, 8).
///
/// Rotations are printed as "n rad" and read as µrad: π/72 must be mrad for legs of 60 µm to reach it.
const PAPER: &str = include_str!("paper.csv");

/// The paper's rms errors of a run (nm and nrad), if it made it.
pub fn paper_rms(trajectory: &str, mode: &str, frequency: f64) -> Option<Six> {
    let column = [0.1, 1.0, 10.0].iter().position(|f| *f == frequency)?;
    let numbers =
        PAPER.lines().find_map(|line| line.strip_prefix(trajectory)?.strip_prefix(',')?.strip_prefix(mode))?;
    let numbers: Vec<f64> =
        numbers.strip_prefix(',')?.split(',').skip(column).step_by(3).flat_map(str::parse).collect();
    numbers.try_into().ok()
}

/// One machining run, a cell of Table 9.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MachiningRow {
    /// Work part: `glass` or `aluminium` in the paper.
    pub part: String,
    /// Mode of the controller: `p` and `pf-pcc` in the paper.
    pub mode: String,
    /// Mean norm of the translation error, nm.
    pub translation_nm: f64,
    /// Mean norm of the orientation error, nrad.
    pub orientation_nrad: f64,
    /// Largest error of P_C, nm.
    pub peak_nm: f64,
    /// What was measured.
    #[serde(flatten)]
    pub coverage: Coverage,
}

/// Table 9: machining.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct MachiningTable {
    /// In the order in which they were run.
    pub rows: Vec<MachiningRow>,
}

/// Table 9 of the paper: part, mode, nm, nrad.
const PAPER_MACHINING: [(&str, &str, f64, f64); 4] = [
    ("glass", "p", 5702.0, 28.0),
    ("glass", "pf-pcc", 988.0, 1.6),
    ("aluminium", "p", 3024.0, 14.0),
    ("aluminium", "pf-pcc", 615.0, 6.9),
];

/// The paper's mean error norms of a run (nm and nrad), if it made it.
pub fn paper_machining(part: &str, mode: &str) -> Option<[f64; 2]> {
    let found = PAPER_MACHINING.iter().find(|(work, law, ..)| *work == part && *law == mode)?;
    Some([found.2, found.3])
}

impl MachiningTable {
    /// Adds a run.
    pub fn push(&mut self, part: &str, mode: &str, errors: &PoseErrors) {
        self.rows.push(MachiningRow {
            part: part.to_owned(),
            mode: mode.to_owned(),
            translation_nm: errors.mean_translation_nm(),
            orientation_nrad: errors.mean_orientation_nrad(),
            peak_nm: errors.peak_translation_nm(),
            coverage: errors.coverage(),
        });
    }

    /// A run, if it was made.
    pub fn row(&self, part: &str, mode: &str) -> Option<&MachiningRow> {
        self.rows.iter().find(|row| row.part == part && row.mode == mode)
    }

    /// Translation and orientation error of one mode over that of another on the same part.
    pub fn ratio(&self, part: &str, mode: &str, over: &str) -> Option<[f64; 2]> {
        let (a, b) = (self.row(part, mode)?, self.row(part, over)?);
        Some([a.translation_nm / b.translation_nm, a.orientation_nrad / b.orientation_nrad])
    }

    /// CSV, one line per run.
    pub fn to_csv(&self) -> String {
        let mut out = String::from("part,mode,translation_nm,orientation_nrad,peak_nm,seconds,path_seconds\n");
        for row in &self.rows {
            let MachiningRow { part, mode, translation_nm, orientation_nrad, peak_nm, coverage } = row;
            let Coverage { seconds, path_seconds } = coverage;
            let _ = write!(out, "{part},{mode},{translation_nm:.4},{orientation_nrad:.4},{peak_nm:.4}");
            let _ = writeln!(out, ",{seconds:.6},{path_seconds:.6}");
        }
        out
    }

    /// Text, one line per run, and `beside_paper` with the paper's figures where it has them. Its orientations are those of the
    /// print: at or below what its own gauges can see (2.2 nm on ±80 mm is 20 nrad).
    pub fn to_text(&self, beside_paper: bool) -> String {
        let mut out = String::from("mean error norm            nm      nrad  over s  path s");
        out.push_str(if beside_paper { "   paper nm      nrad\n" } else { "\n" });
        for row in &self.rows {
            let (part, mode, nm, nrad) = (&row.part, &row.mode, row.translation_nm, row.orientation_nrad);
            let (seconds, path) = (row.coverage.seconds, row.coverage.path_seconds);
            let _ = write!(out, "{part:<11}{mode:<10}{nm:>8.2}{nrad:>10.1}{seconds:>8.3}{path:>8.3}");
            let paper = beside_paper.then(|| paper_machining(&row.part, &row.mode)).flatten();
            if let Some([nm, nrad]) = paper {
                let _ = write!(out, "{nm:>11.0}{nrad:>10.1}");
            }
            out.push('\n');
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn errors() -> PoseErrors {
        let mut errors = PoseErrors::over(3, 0.5);
        errors.add(&[3e-9, 0.0, 4e-9, 1e-9, 2e-9, 2e-9]);
        errors.add(&[-3e-9, 0.0, 4e-9, -10e-9, 0.0, 0.0]);
        errors.add(&[0.0; 6]);
        errors
    }

    #[test]
    fn figures_are_those_worked_out_by_hand() {
        let errors = errors();
        let rms = errors.rms_nano();
        assert!((rms[0] - libm::sqrt(6.0)).abs() < 1e-12 && (rms[2] - libm::sqrt(32.0 / 3.0)).abs() < 1e-12);
        assert!((errors.rms_translation_nm() - libm::sqrt(50.0 / 3.0)).abs() < 1e-12);
        assert!((errors.rms_orientation_nrad() - libm::sqrt(109.0 / 3.0)).abs() < 1e-12);
        assert!((errors.mean_translation_nm() - 10.0 / 3.0).abs() < 1e-12);
        assert!((errors.mean_orientation_nrad() - 13.0 / 3.0).abs() < 1e-12);
        assert!((errors.peak_translation_nm() - 5.0).abs() < 1e-12);
        assert!((errors.peak_nano()[3] - 10.0).abs() < 1e-12);
        assert_eq!((errors.count(), errors.coverage()), (3, Coverage { seconds: 1.5, path_seconds: 1.5 }));
    }

    #[test]
    fn rows_stand_beside_the_paper_s() {
        let mut table = PoseTable::default();
        table.rows.push(PoseRow::of("case-1", "pf-pcc", 10.0, &errors()));
        table.rows.push(PoseRow::of("case-3", "pf-pcc", 10.0, &errors()));
        let text = table.to_text(true);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 4, "{text}");
        assert!(!table.to_text(false).contains("paper"));
        assert!(lines[2].contains("paper") && lines[2].contains("631") && lines[2].ends_with("325"), "{text}");
        assert!(lines[1].ends_with("   1.500   1.500"), "{text}");
        let csv = table.to_csv();
        let row = csv.lines().nth(1).unwrap();
        assert!(row.starts_with("case-1,pf-pcc,10,2.4495,0.0000,3.2660,"), "{row}");
        assert!(row.ends_with(",1.500000,1.500000"), "{row}");
        assert!(table.row("case-1", "pf-pcc", 1.0).is_none());
    }

    #[test]
    fn the_paper_s_own_ratio_is_5_8_on_glass() {
        let mut table = MachiningTable::default();
        table.push("glass", "p", &errors());
        table.push("glass", "pf-pcc", &errors());
        assert_eq!(table.ratio("glass", "p", "pf-pcc"), Some([1.0, 1.0]));
        assert_eq!(table.ratio("aluminium", "p", "pf-pcc"), None);
        let text = table.to_text(true);
        assert!(text.lines().nth(1).unwrap().ends_with("5702      28.0"), "{text}");
        assert!((PAPER_MACHINING[0].2 / PAPER_MACHINING[1].2 - 5.77).abs() < 0.01);
    }
}
