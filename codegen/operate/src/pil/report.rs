//! The report of a processor-in-the-loop run.

use std::fmt::Write as _;
use std::time::Duration;

use host_sim::closed_loop::RunError;
use host_sim::platform::table::{MachiningTable, PoseTable};
use host_sim::table::TrackingTable;
use serde::Serialize;
use serde_json::Value;

use specgen_compiler::compile::Compilation;
use specgen_language::outcome::Outcome;
use specgen_language::table::{left, right, row};
use specgen_studies::runs::TrajectoryErrors;

use super::difference::Difference;
use super::lockstep::Cost;

/// The report of a processor-in-the-loop run.
#[derive(Debug, Default, Serialize)]
pub struct Report {
    /// Name of the spec.
    pub name: String,
    /// Digest of the spec.
    pub digest: String,
    /// The device.
    pub device: String,
    /// Ticks in which host and device were equal.
    pub ticks: u64,
    /// The first difference.
    pub first_difference: Option<Difference>,
    /// Control interval, s.
    pub interval: f64,
    /// Run time of the loops, s.
    pub seconds: f64,
    /// Part of it spent waiting for the device.
    #[serde(serialize_with = "as_seconds")]
    pub waited: Duration,
    /// Damaged frames from the device, which were requested again.
    pub damaged_frames: u32,
    /// Unit of the costs; empty if they are not counted.
    pub counted: &'static str,
    /// Costs of the parts of a tick.
    pub costs: Vec<Cost>,
    /// Static bound of a tick's stack, bytes; none for a board, or if the call graph cannot be bounded.
    pub stack_bound: Option<u64>,
    /// Legs: errors of the trajectory.
    pub tracking: TrackingTable,
    /// Platform, without a work part.
    #[serde(serialize_with = "rows")]
    pub free_motion: PoseTable,
    /// Platform, against a work part.
    pub machining: Value,
    /// Platform, a trajectory generated on the device.
    pub on_board: Option<TrajectoryErrors>,
    /// Runs that ended before the end of their path.
    pub ended_early: Vec<String>,
    /// Errors as text.
    #[serde(skip)]
    pub errors: String,
    /// The line about their plot.
    #[serde(skip)]
    pub plot: Option<String>,
}

fn as_seconds<S: serde::Serializer>(time: &Duration, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(time.as_secs_f64())
}

fn rows<S: serde::Serializer>(table: &PoseTable, serializer: S) -> Result<S::Ok, S::Error> {
    table.rows.serialize(serializer)
}

impl Report {
    pub(super) fn new(compiled: &Compilation, device: String, stack_bound: Option<u64>) -> Self {
        Self {
            name: compiled.ir.name.clone(),
            digest: compiled.ir.digest.clone(),
            device,
            interval: compiled.model.timing.period,
            stack_bound,
            ..Self::default()
        }
    }

    /// Records a run that ended before the end of its path, without a score.
    pub(super) fn ended(&mut self, name: &str, error: &RunError) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.errors, "{name}: not scored: {error}, as on the host");
        self.ended_early.push(name.to_owned());
    }

    /// Puts the table of free motion before other errors.
    pub(super) fn write_free_motion(&mut self) {
        let text = self.free_motion.to_text(false);
        self.errors.insert_str(0, &text);
    }

    /// Puts the table of work parts before other errors.
    pub(super) fn write_machining(&mut self, table: &MachiningTable) {
        self.errors.insert_str(0, &table.to_text(false));
        self.machining = serde_json::json!(table);
    }

    /// Closed-loop ticks per second of real time.
    fn rate(&self) -> f64 {
        if self.seconds > 0.0 { self.ticks as f64 / self.seconds } else { 0.0 }
    }
}

impl Outcome for Report {
    fn text(&self) -> String {
        let mut out = format!(
            "{}: {} in the loop; host and device equal in every bit of {} ticks\n",
            self.name, self.device, self.ticks
        );
        out.push_str(&self.errors);
        // Writing to a String cannot fail, here and below.
        if !self.costs.is_empty() {
            let columns = [left(18), right(10), right(10), right(12), right(10)];
            row(&mut out, &columns, &[&self.counted, &"calls", &"min", &"mean", &"max"]);
            for cost in &self.costs {
                let (name, mean) = (format_args!("  {}", cost.name), format_args!("{:.1}", cost.mean));
                row(&mut out, &columns, &[&name, &cost.calls, &cost.min, &mean, &cost.max]);
            }
        }
        if let Some(stack) = self.costs.first().and_then(|whole| whole.stack) {
            let bound = self.stack_bound.map_or_else(String::new, |bound| format!(", static bound {bound} bytes"));
            let _ = writeln!(out, "stack of a tick: peak {} bytes{bound}", stack);
        }
        if self.damaged_frames > 0 {
            let _ = writeln!(out, "{} damaged frames were requested again", self.damaged_frames);
        }
        let rate = self.rate();
        let (factor, hertz) = (rate * self.interval, (1.0 / self.interval).round());
        let share = 100.0 * self.waited.as_secs_f64() / if self.seconds > 0.0 { self.seconds } else { 1.0 };
        let _ = writeln!(
            out,
            "{rate:.0} steps/s in closed loop, {factor:.2} × real time at {hertz} Hz; {share:.0} % of it waiting for the device"
        );
        out + self.plot.as_deref().unwrap_or_default()
    }
}
