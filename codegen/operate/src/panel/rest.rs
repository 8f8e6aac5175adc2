//! Error of a machine that runs at rest, compared with the requirements and the disturbance of the spec.

use specgen_compiler::ir::Supervision;
use specgen_language::model::Model;
use specgen_runtime::setpoint::BUSY;
use specgen_runtime::supervisor::Phase;

use super::status::StatusMessage;
use crate::samples::Block;

/// Duration of a mean, s.
const WINDOW: f64 = 0.5;
const AXES: [&str; 6] = ["x", "y", "z", "θx", "θy", "θz"];

/// Mean square of the error of each axis, over consecutive windows; the first one after a motion is discarded.
#[derive(Default)]
pub struct RestError {
    /// Ticks at rest since the last motion that are in complete windows.
    settled: f64,
    ticks: f64,
    squares: [f64; 6],
    /// rms of the last window, m and rad.
    rms: Option<[f64; 6]>,
}

impl RestError {
    pub fn add(&mut self, block: &Block, period: f64) {
        for row in &block.rows {
            let rests = u64::from(row.phase) == Phase::Running.word() && row.status & BUSY == 0;
            let Some(error) = row.error.filter(|_| rests) else {
                *self = Self::default();
                continue;
            };
            let ticks = f64::from(block.every);
            self.ticks += ticks;
            for (sum, error) in self.squares.iter_mut().zip(error) {
                *sum += ticks * f64::from(error.mean) * f64::from(error.mean);
            }
            if self.ticks * period >= WINDOW {
                self.rms = (self.settled > 0.0).then(|| self.squares.map(|sum| libm::sqrt(sum / self.ticks)));
                (self.settled, self.ticks, self.squares) = (self.settled + self.ticks, 0.0, [0.0; 6]);
            }
        }
    }

    /// The message of a machine that runs at rest without a cause.
    pub fn message(&self, rules: &Supervision, model: &Model) -> StatusMessage {
        let said = |kind, what: String, advice| StatusMessage { kind, what, advice, code: None };
        let Some(rms) = self.rms else { return said("ok", "Running. Settling.".to_owned(), "") };
        // The limit that is exceeded most, of each axis: from the requirements, and what noise and environment explain.
        let limits = (0..6).flat_map(|axis| {
            let explained = 1.0 / rules.steadiness.per_limit[axis];
            let required = model.requirements.noise_of(axis);
            [required, Some((explained, "supervisor.disturbance"))]
                .into_iter()
                .flatten()
                .map(move |limit| (axis, limit))
        });
        let worst = limits
            .map(|(axis, (limit, key))| (rms[axis] / limit, axis, limit, key))
            .filter(|(part, ..)| *part > 1.0 || part.is_nan())
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, axis, limit, key)) = worst else {
            return said("ok", "Running. Nothing to do.".to_owned(), "");
        };
        let unit = if axis < 3 { "nm" } else { "nrad" };
        let (name, noise, most) = (AXES[axis], rms[axis] * 1e9, limit * 1e9);
        let what = format!(
            "Running. The error of {name} is {noise:.1}\u{2009}{unit} rms, more than the {most:.1}\u{2009}{unit} of {key}."
        );
        said("warning", what, "Check gains and load, and what shakes the platform.")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{Row, Spread};

    fn rows(status: u32, z: f32, rows: usize) -> Block {
        let spread = |mean| Spread { least: mean, mean, most: mean };
        let error = Some([0.0, 0.0, z, 0.0, 0.0, 0.0].map(spread));
        let phase = Phase::Running.word() as u8;
        let row = Row { status, phase, pose: None, target: [0.0; 6], error, volts: [spread(0.0); 6], legs: None };
        Block { number: 0, tick: 0, every: 10, rows: vec![row; rows] }
    }

    #[test]
    fn the_error_at_rest_is_that_of_the_last_window_and_a_motion_starts_anew() {
        let mut rest = RestError::default();
        rest.add(&rows(0, 9e-6, 1), 0.05);
        assert_eq!(rest.rms, None, "settling");
        rest.add(&rows(0, 2e-6, 1), 0.05);
        let rms = rest.rms.unwrap();
        assert!((rms[2] - 2e-6).abs() < 1e-12 && rms[0] == 0.0, "{rms:?}");
        rest.add(&rows(BUSY, 0.0, 1), 0.05);
        assert_eq!(rest.rms, None);
    }
}
