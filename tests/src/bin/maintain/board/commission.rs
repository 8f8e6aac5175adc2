//! `specgen commission` with a board: the step `wiring`, a stroke for the cross-talk, and a set of reversal curves with its
//! preconditioning. The other drives count as recorded: the board's time is slower than real time.

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Instant;

use specgen::operate::commission::planned;
use specgen_compiler::compile;

use super::Trial;
use super::session::Session;

/// Reversal curves of a leg, as the option, and Hz of the mains.
const GRID: (usize, &str) = (4, "4");
const MAINS: f64 = 50.0;
/// Part of the range by which a recorded voltage may differ from the plan.
const PLANNED: f64 = 0.01;
/// Phase of an open drive.
const DRIVING: f64 = 6.0;

/// Commissions a machine with the board of this trial, in part.
pub fn run(trial: &Trial) -> Result<(), String> {
    let compiled = compile::compile(&trial.spec).map_err(|_| format!("{} is refused", trial.spec.display()))?;
    let plan = planned(&compiled, GRID.0, MAINS).map_err(|failure| failure.message())?;
    let folder = trial.folder.join("commission");
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).map_err(failed)?;
    let tried = |name: &str| name == "leg0-cross-talk" || name.starts_with("leg0-curves-") && !name.ends_with("-20");
    for drive in plan.drives.iter().filter(|drive| !tried(&drive.name)) {
        fs::write(folder.join(format!("{}.csv", drive.name)), "").map_err(failed)?;
    }
    let mut session = Session::begin(trial)?;
    let (begun, board) = (Instant::now(), session.time()?);
    // The cross-talk of one record cannot be computed.
    for (steps, code) in [(&["wiring", "curves"][..], 0), (&["cross-talk"], 1)] {
        let mut command = session.command_of(trial, "commission");
        command.args(["--yes", "--grid", GRID.1]).args(steps.iter().flat_map(|step| ["--step", *step]));
        let output = command.stdin(Stdio::null()).output().map_err(|error| format!("specgen commission: {error}"))?;
        let said = String::from_utf8_lossy(&output.stderr);
        if output.status.code() != Some(code) || !said.contains("amplifiers off") && !said.contains("disarmed") {
            return Err(format!("{}: {}: {said}", trial.target, steps.join(" ")));
        }
    }
    let seconds = (session.time()? - board) / 1e3;
    let (took, report) = (begun.elapsed().as_secs_f64(), session.report()?);
    for drive in plan.drives.iter().filter(|drive| tried(&drive.name)) {
        let path = folder.join(format!("{}.csv", drive.name));
        let [phase, volts] = columns(&path, ["phase", "volts[0]_mean_V"])?;
        let expected = drive.rows(drive.first_tick(&volts), volts.len(), 0.0);
        let [low, high] = drive.range;
        let off = volts.iter().zip(&expected).fold(0.0, |off: f64, (volts, planned)| off.max((volts - planned).abs()));
        println!("{}: {}, {} rows, at most {off:.3} V from the plan", trial.target, drive.name, volts.len());
        // Written so that a NaN is refused.
        let good = off <= PLANNED * (high - low) && phase.iter().all(|phase| (phase - DRIVING).abs() < 0.5);
        if !good || volts.len() < 100 {
            return Err(format!("{}: {} is not as planned", trial.target, path.display()));
        }
    }
    println!("{}: {seconds:.1} s of the board in {took:.1} s; {}", trial.target, report.text);
    if report.value("resets") != Some(0.0) || report.value("enable") != Some(0.0) {
        return Err(format!("{}: expected amplifiers off and no reset", trial.target));
    }
    match report.violations.first() {
        Some(text) => Err(format!("{}: against a data sheet: {text}", trial.target)),
        None => Ok(()),
    }
}

/// Two columns of a file of `watch`.
fn columns(path: &Path, names: [&str; 2]) -> Result<[Vec<f64>; 2], String> {
    let text = fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let mut lines = text.lines();
    let titles: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let places = names.map(|name| titles.iter().position(|title| *title == name));
    let [Some(first), Some(second)] = places else { return Err(format!("{} has no {names:?}", path.display())) };
    let mut found = [Vec::new(), Vec::new()];
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        for (column, place) in found.iter_mut().zip([first, second]) {
            column.push(cells.get(place).and_then(|cell| cell.parse().ok()).unwrap_or(f64::NAN));
        }
    }
    Ok(found)
}
