//! Prediction of the displacement for a drive, and its error if the file has a displacement.

use serde::Serialize;

use super::open_weight;
use super::start::RecordColumns;
use super::{Inertia, RateModel, forward};
use crate::branches;
use crate::cause::{self, Cause};
use crate::distrust::{JUMP, settling};
use crate::everett::EverettTable;
use crate::findings::Findings;
use crate::leg_model::LegModel;
use crate::record::{self, Record, later};
use crate::regressor::Plane;
use crate::signals::{self, Input, Signals};
use crate::staircase::Staircase;
use crate::statistics::{Line, extent, mean, noise_floor, rms_and_max};
use specgen_language::diagnostic::{Diagnostic, codes};

/// Fraction by which the drive may leave the range of the table; it is limited to the range.
const BEYOND: f64 = 0.05;

/// Least number of compared samples.
const LEAST: usize = 8;

/// A drive record: reversal curves or any other drive, with or without displacement.
#[derive(Debug, Clone)]
pub struct Drive {
    /// Name of the file as the user gave it.
    pub shown_as: String,
    /// s, rising.
    pub time: Vec<f64>,
    /// V.
    pub drive: Vec<f64>,
    /// m.
    pub displacement: Option<Vec<f64>>,
    /// Samples that are not compared: glitches, and those after a jump.
    weightless: Vec<bool>,
    /// Half the interval for which a converter holds a command, s; 0 for a measured voltage.
    pub held: f64,
    /// Findings of its file that refuse nothing.
    pub warnings: Vec<Diagnostic>,
}

impl From<&Record> for Drive {
    fn from(record: &Record) -> Self {
        Self {
            shown_as: record.shown_as.clone(),
            time: record.time.clone(),
            drive: record.drive.clone(),
            displacement: Some(record.displacement.clone()),
            weightless: record.weightless.clone(),
            held: record.held(),
            warnings: Vec::new(),
        }
    }
}

impl Drive {
    /// A voltage (V) over `time` (s, rising) without a displacement.
    #[must_use]
    pub fn of_voltage(shown_as: &str, time: Vec<f64>, voltage: Vec<f64>) -> Self {
        let weightless = vec![false; time.len()];
        Self {
            shown_as: shown_as.to_owned(),
            time,
            drive: voltage,
            displacement: None,
            weightless,
            held: 0.0,
            warnings: Vec::new(),
        }
    }
}

/// Reads `time_s`, `drive_V` or `monitor_V`, and `displacement_um` if it is there.
///
/// # Errors
/// All findings of the file.
pub fn read_drive(input: Input, shown_as: &str) -> Result<Drive, Vec<Diagnostic>> {
    let mut signals = signals::read(input, shown_as, &record::wanted(false))?;
    let (time, drive, monitored, displacement) = record::quantities(&mut signals);
    let held = if monitored { 0.0 } else { record::hold(&time) };
    let weightless = vec![false; time.len()];
    let Signals { shown_as, warnings, .. } = signals;
    Ok(Drive { shown_as, time, drive, displacement, weightless, held, warnings })
}

/// Error of a prediction. Lengths in m; percentages are of `range`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictionError {
    /// Samples compared.
    pub samples: usize,
    /// Samples after a jump of the drive, not compared because the actuator is still ringing.
    pub samples_after_jumps: usize,
    /// Of the compared displacement.
    pub range: f64,
    /// Root mean square error after one offset and one linear drift.
    pub rms: f64,
    /// Largest magnitude of that error.
    pub max: f64,
    /// `rms` in % of the range.
    pub rms_percent: f64,
    /// `max` in % of the range.
    pub max_percent: f64,
    /// The linear drift that was removed, m/s.
    pub drift: f64,
    /// Causes of the error.
    pub cause: Cause,
}

/// The displacement that a model predicts for a drive.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Prediction {
    /// Name of the record.
    pub record: String,
    /// Samples before the drive first moves; they have no prediction.
    pub samples_skipped: usize,
    /// Samples whose drive was outside the table's range and was limited to it.
    pub samples_clipped: usize,
    /// Lag of the displacement behind the drive column, s.
    pub dead_time: f64,
    /// Assumed contribution of a mode.
    pub inertia: Option<Inertia>,
    /// Fraction of the weight left open by the first drive that was on before the record: 0 after a rise from the
    /// lowest drive, 1 after a fall from the highest. From the displacement; ½ without one.
    pub start_on: f64,
    /// Comparison with the displacement of the record, if it has one.
    pub compared: Option<PredictionError>,
    /// Time of each sample after the skipped ones, s.
    #[serde(skip)]
    pub time: Vec<f64>,
    /// Drive of each, V.
    #[serde(skip)]
    pub drive: Vec<f64>,
    /// Prediction for each, m: above negative saturation, or with the offset and drift of the displacement.
    #[serde(skip)]
    pub displacement: Vec<f64>,
    /// Displacement of each, m, if the record has it.
    #[serde(skip)]
    pub measured: Option<Vec<f64>>,
    /// Whether each is compared.
    #[serde(skip)]
    pub keep: Vec<bool>,
}

/// Runs the static `table` over `record`, whose displacement lags its drive column by `dead_time` (s).
///
/// # Errors
/// As [`predict`].
pub fn validate(table: &EverettTable, record: &Record, dead_time: f64) -> Result<Prediction, Vec<Diagnostic>> {
    predict(&RateModel::of_table(table.clone(), dead_time), &Drive::from(record))
}

/// Rms error (m) of leg models on `record`, each with its dead time (s); as [`predict`] where it refuses.
pub fn error_on(record: &Record) -> impl Fn(&LegModel, f64) -> Result<f64, Vec<Diagnostic>> {
    let drive = Drive::from(record);
    move |model, dead_time| {
        let model = RateModel { dead_time, ..RateModel::of_leg(model.clone()) };
        Ok(predict(&model, &drive)?.compared.map_or(f64::INFINITY, |compared| compared.rms))
    }
}

/// Runs `model` over `drive`; `model.dead_time` counts from the drive column.
///
/// The start state is unknown and estimated from the displacement, see [`Prediction::start_on`]. Samples before the
/// drive first moves are skipped: they have no information on hysteresis. After each jump of the drive by more than 10
/// % of the table's range in one sampling interval, samples are not compared until the mode has settled to a hundredth,
/// or for 20 ms without a mode.
///
/// # Errors
/// If the drive never moves, or leaves the range of the table by more than 5 %.
pub fn predict(model: &RateModel, drive: &Drive) -> Result<Prediction, Vec<Diagnostic>> {
    let mut findings = Findings::new(&drive.shown_as);
    let table = &model.still;
    let plane = Plane { grid: table.grid, range: [table.drive_min, table.drive_max] };
    let [bottom, top] = plane.range;
    let (low, high) = extent(&drive.drive);
    let allowed = BEYOND * (top - bottom);
    if low < bottom - allowed || high > top + allowed {
        let message = format!("the drive goes from {low} V to {high} V, outside the table's {bottom} V to {top} V");
        findings.add(codes::DRIVE_RANGE, None, message, "name a record inside the range of the table");
        return Err(findings.into_diagnostics());
    }
    let Some(first) = branches::branches(&drive.drive, 0, 0.5 * plane.interval()).first().map(|b| b.first) else {
        let message = "the drive moves by less than half a grid interval".to_owned();
        findings.add(codes::VALIDATION_IDLE, None, message, "name a record that moves the drive");
        return Err(findings.into_diagnostics());
    };
    let samples_clipped = drive.drive[first..].iter().filter(|u| **u < bottom || **u > top).count();
    let time = drive.time[first..].to_vec();
    // If the drive starts earlier, the model's displacement follows it by the dead time.
    let run = |full: bool| {
        let mut memory = Staircase::negative_saturation(plane.range);
        if full {
            memory.push(top);
        }
        memory.push(drive.drive[first]);
        let (mut still, rate) = forward::still(model, &plane, &drive.time, &drive.drive, first, memory);
        if let Some(around) = &model.around {
            around.complete(&mut still, &time, &drive.drive[first..], plane.range, full);
        }
        (still, rate)
    };
    let (below, above) = (run(false), run(true));
    let open: Vec<f64> = above.0.iter().zip(&below.0).map(|(a, b)| a - b).collect();
    let finish = |values: &[f64]| later(&time, &forward::with_creep(model, &time, values), model.dead_time);
    let mut displacement = finish(&below.0);
    let mut moved = vec![0.0; time.len()];
    forward::inertia(model, &time, &drive.drive[first..], &mut moved);
    displacement.iter_mut().zip(later(&time, &moved, model.dead_time)).for_each(|(y, x)| *y += x);
    if let Some(rate) = &below.1 {
        displacement.iter_mut().zip(later(&time, rate, model.dead_time)).for_each(|(y, r)| *y += r);
    }
    let parts: Vec<Vec<f64>> = open_weight::parts(&open).iter().map(|part| finish(part)).collect();
    let measured = drive.displacement.as_ref().map(|y| y[first..].to_vec());
    let ringing = settling(model.inertia.map(|inertia| inertia.mode));
    let settled = settled(&drive.time, &drive.drive, first, JUMP * (top - bottom), ringing);
    let keep: Vec<bool> = settled.iter().zip(&drive.weightless[first..]).map(|(s, w)| *s && !w).collect();
    let kept = |values: &[f64]| -> Vec<f64> {
        values.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(value, _)| *value).collect()
    };
    if let Some(y) = &measured {
        let (low, high) = extent(&kept(y));
        if low >= high || kept(y).len() < LEAST {
            let message = "the drive moves only in a jump, or the displacement does not move".to_owned();
            findings.add(codes::VALIDATION_IDLE, None, message, "name a record that moves the drive");
            return Err(findings.into_diagnostics());
        }
    }
    let times = model.creep.iter().map(|term| term.time_constant);
    let own = RecordColumns::of(&time, keep.clone(), times, model.inertia.map(|inertia| inertia.mode));
    let slopes = match &measured {
        Some(y) => {
            open_weight::slopes(&y.iter().zip(&displacement).map(|(y, p)| y - p).collect::<Vec<_>>(), &parts, &own)
        }
        None => vec![0.5; parts.len()],
    };
    for (slope, part) in slopes.iter().zip(&parts) {
        displacement.iter_mut().zip(part).for_each(|(y, p)| *y += slope * p);
    }
    let start_on = mean(&slopes);
    let compared = measured.as_ref().map(|y| {
        let before: Vec<f64> = y.iter().zip(&displacement).map(|(y, p)| y - p).collect();
        let mut errors = before.clone();
        own.take_out_start(&mut errors);
        displacement.iter_mut().zip(before.iter().zip(&errors)).for_each(|(p, (all, left))| *p += all - left);
        let (at, of) = (kept(&time), kept(&errors));
        let line = Line::fit(&at, &of);
        displacement.iter_mut().zip(&time).for_each(|(p, t)| *p += line.at(*t));
        let (bottom_y, top_y) = extent(&kept(y));
        let range = top_y - bottom_y;
        let (rms, max) = rms_and_max(&line.removed(&at, &of));
        let (gain, noise) = (table.mean_gain(), noise_floor(y));
        PredictionError {
            samples: of.len(),
            samples_after_jumps: settled.iter().filter(|s| !**s).count(),
            range,
            rms,
            max,
            rms_percent: 100.0 * rms / range,
            max_percent: 100.0 * max / range,
            drift: line.slope,
            cause: cause::explain(&time, &drive.drive[first..], &errors, noise, gain, &keep),
        }
    });
    Ok(Prediction {
        record: drive.shown_as.clone(),
        samples_skipped: first,
        samples_clipped,
        dead_time: model.dead_time,
        inertia: model.inertia,
        start_on,
        compared,
        time,
        drive: drive.drive[first..].to_vec(),
        displacement,
        measured,
        keep,
    })
}

/// Whether each sample from `first` on is `settling` (s) clear of a step of the drive of more than `jump` (V).
fn settled(time: &[f64], drive: &[f64], first: usize, jump: f64, settling: f64) -> Vec<bool> {
    let mut until = time[first];
    (first..drive.len())
        .map(|k| {
            if k > first && (drive[k] - drive[k - 1]).abs() > jump {
                until = time[k] + settling;
            }
            time[k] >= until
        })
        .collect()
}
