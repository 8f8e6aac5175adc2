//! Lowers a table of poses to a spline in ticks.

use super::check::Excesses;
use super::{AXES, LONGEST, User, amount, corners, spline};
use crate::ir::{Path, Row};
use specgen_identify::waveform::Waveform;
use specgen_language::diagnostic::{Code, Diagnostic, codes};
use specgen_language::model::{Model, TaskSpace};

/// Tolerance of the period, in ticks, to be a whole number of ticks: it is a rounded quotient.
const WHOLE: f64 = 1e-6;

/// Tolerance for equal rows, as a share of the largest step and of the largest value: the rounding of a sine, and far less than
/// any intended difference from the first row.
const SAME_STEP: f64 = 1e-6;
const SAME_VALUE: f64 = 1e-9;

/// The spline of trajectory `index` through the rows of `waveform`, `period` (s) apart.
pub(super) fn lower(
    model: &Model,
    task: &TaskSpace,
    user: &User,
    index: usize,
    waveform: &Waveform,
    period: f64,
    repeat: bool,
) -> Result<(Path, Vec<Diagnostic>), Vec<Diagnostic>> {
    let tick = model.timing.period;
    let row_ticks = libm::rint(period / tick);
    if row_ticks < 1.0 || (period / tick - row_ticks).abs() > WHOLE || row_ticks * waveform.rows.len() as f64 > LONGEST
    {
        let nearest = if row_ticks < 1.0 { tick } else { row_ticks * tick };
        let (name, row, tick) = (&task.trajectories[index].name, period * 1e3, tick * 1e3);
        let message = format!("trajectory \"{name}\": rows every {row:.4} ms do not fall on the ticks of {tick:.4} ms");
        let help =
            format!("choose a whole number of ticks, such as \"{:.4} ms\", and some minutes at most", nearest * 1e3);
        let key = format!("trajectory[{index}].period");
        return Err(vec![Diagnostic::at(&model.spans, &[&key], codes::TRAJECTORY_TICKS, message, help)]);
    }
    let mut rows = waveform.rows.clone();
    let mut findings = Vec::new();
    if repeat && closes(&rows) {
        findings.push(in_file(
            waveform,
            waveform.rows.len() - 1,
            codes::WAVEFORM_CLOSED_TWICE,
            "the last row repeats the first, which follows it anyway when the table repeats".to_owned(),
            "leave the last row out",
        ));
    }
    findings.extend(steps(task, waveform, period, repeat));
    if !findings.is_empty() {
        return Err(findings);
    }
    let column = |axis: usize| -> Vec<f64> { rows.iter().map(|row| row[axis]).collect() };
    let mut bends: [Vec<f64>; 6] =
        core::array::from_fn(
            |axis| if repeat { spline::closed(&column(axis)) } else { spline::at_rest(&column(axis)) },
        );
    if repeat {
        rows.push(rows[0]);
        for bend in &mut bends {
            bend.push(bend[0]);
        }
    }
    let rows: Vec<Row> = rows
        .into_iter()
        .enumerate()
        .map(|(k, pose)| Row { pose, bend: core::array::from_fn(|axis| bends[axis][k]) })
        .collect();
    let findings = between(model, task, user, waveform, &rows, row_ticks as u32, period);
    if !findings.is_empty() {
        return Err(findings);
    }
    let path = Path::Table {
        rows,
        row_ticks: row_ticks as u32,
        per_tick: 1.0 / row_ticks,
        per_second: 1.0 / period,
        bend_rate: 6.0 / (period * period),
        repeat,
    };
    let name = &task.trajectories[index].name;
    Ok((path, corners::warning(model, name, waveform, period, repeat).into_iter().collect()))
}

/// Whether the last row repeats the first, within the rounding of the table.
fn closes(rows: &[[f64; 6]]) -> bool {
    let [first, .., last] = rows else { return false };
    let largest =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |a: f64, b| if b.abs() > a { b.abs() } else { a });
    rows.len() > 2
        && (0..6).all(|axis| {
            let step = largest(&mut rows.windows(2).map(|pair| pair[1][axis] - pair[0][axis]));
            let size = largest(&mut rows.iter().map(|row| row[axis]));
            (last[axis] - first[axis]).abs() <= SAME_STEP * step + SAME_VALUE * size
        })
}

/// Findings about steps from row to row beyond the permitted speed.
fn steps(task: &TaskSpace, waveform: &Waveform, period: f64, repeat: bool) -> Vec<Diagnostic> {
    let rows = &waveform.rows;
    let following = |k: usize| if k + 1 < rows.len() { Some(k + 1) } else { repeat.then_some(0) };
    let mut findings = Vec::new();
    for (k, row) in rows.iter().enumerate() {
        let Some(next) = following(k) else { continue };
        for (axis, speed) in task.setpoint.stream_speed.into_iter().enumerate() {
            let step = rows[next][axis] - row[axis];
            if step.abs() > speed * period {
                let (name, jump, row) = (AXES[axis], amount(axis, step), period * 1e3);
                let allowed = amount(axis, speed * period);
                let message = format!(
                    "{name} jumps by {jump} within a row of {row:.4} ms; control.setpoint.stream_speed allows {allowed}"
                );
                let help = "check the unit in the column's name and the spec's period, or add rows";
                findings.push(in_file(waveform, next, codes::TRAJECTORY_JUMPS, message, help));
            }
        }
        if findings.len() >= MOST_FINDINGS {
            break;
        }
    }
    findings
}

/// Most jumps that are reported.
const MOST_FINDINGS: usize = 5;

/// Checks workspace and speed at every tick of the spline.
fn between(
    model: &Model,
    task: &TaskSpace,
    user: &User,
    waveform: &Waveform,
    rows: &[Row],
    row_ticks: u32,
    period: f64,
) -> Vec<Diagnostic> {
    let mut excesses = Excesses::default();
    for (k, pair) in rows.windows(2).enumerate() {
        for tick in 0..=row_ticks {
            let b = f64::from(tick) / f64::from(row_ticks);
            let (pose, rate) = at(&pair[0], &pair[1], b, period);
            excesses.look(user, &task.setpoint, (k as f64 + b) * period, pose, rate);
        }
    }
    let [place, speed] = excesses.messages(model, user, &task.setpoint);
    let line = |time: f64| {
        let row = libm::rint(time / period) as usize;
        row % waveform.rows.len()
    };
    let mut findings = Vec::new();
    if let Some((worst, message)) = place {
        let help =
            format!("check the unit in the column's name; or {}", excesses.fix_of_place(user).unwrap_or_default());
        findings.push(in_file(waveform, line(worst.time), codes::TRAJECTORY_OUTSIDE, message, &help));
    }
    if let Some((worst, message)) = speed {
        let help =
            format!("check unit and period, smooth the table, or {}", excesses.fix_of_speed().unwrap_or_default());
        findings.push(in_file(waveform, line(worst.time), codes::TRAJECTORY_TOO_FAST, message, &help));
    }
    findings
}

/// Pose and rate of the spline at b = 0..1 between two rows.
pub(super) fn at(row: &Row, following: &Row, b: f64, period: f64) -> ([f64; 6], [f64; 6]) {
    let a = 1.0 - b;
    let of = |axis: usize| {
        let (y, m, n) = (row.pose[axis], row.bend[axis], following.bend[axis]);
        let rise = following.pose[axis] - y;
        let pose = y + b * rise + a * (a * a - 1.0) * m + b * (b * b - 1.0) * n;
        (pose, (rise + (1.0 - 3.0 * a * a) * m + (3.0 * b * b - 1.0) * n) / period)
    };
    (core::array::from_fn(|axis| of(axis).0), core::array::from_fn(|axis| of(axis).1))
}

fn in_file(waveform: &Waveform, row: usize, code: Code, message: String, help: &str) -> Diagnostic {
    Diagnostic::in_file(&waveform.shown_as, waveform.lines.get(row).copied(), code, message, help)
}
