//! Section 4 of the paper: Tables 5 to 8 (free motion) and 9 (machining).

use host_sim::closed_loop::RunError;
use host_sim::controller::TickController;
use host_sim::platform::scenario::{FREE_MODES, MACHINING_MODES};
use host_sim::platform::table::{MachiningTable, PoseTable, paper_machining, paper_rms};
use host_sim::platform::{PlatformScenario, WorkPart};
use host_sim::trajectory::{PaperPath, PaperPose};

use super::table::{Row, Table};
use crate::paper::remark::Remark;

/// Operating frequencies, Hz.
pub const FREQUENCIES: [f64; 3] = [0.1, 1.0, 10.0];
/// The free motions.
pub const CASES: [(&str, PaperPath); 2] = [("case-1", PaperPath::Case1), ("case-2", PaperPath::Case2)];
/// Work parts.
pub fn parts() -> [(&'static str, WorkPart); 2] {
    [("glass", WorkPart::glass()), ("aluminium", WorkPart::aluminium())]
}
/// Frequency of the machining path, Hz.
pub const MACHINING_FREQUENCY: f64 = 1.0;

/// Runs a case at a frequency in every mode and adds the results to `table`.
///
/// # Errors
/// As [`PlatformScenario::run`].
pub fn free_motion(
    scenario: &PlatformScenario,
    controller: &mut dyn TickController,
    (name, path): (&str, PaperPath),
    frequency: f64,
    table: &mut PoseTable,
) -> Result<(), RunError> {
    let trajectory = PaperPose::corrected(path, frequency);
    table.rows.extend(scenario.free_motion(controller, &FREE_MODES, (name, frequency), &trajectory)?.rows);
    Ok(())
}

/// Tables 5 and 6 (case 1) or 7 and 8 (case 2) from the runs.
pub fn tables(runs: &PoseTable, case: &str) -> [Table; 2] {
    let first = case == "case-1";
    let ids = if first { ["table-5", "table-6"] } else { ["table-7", "table-8"] };
    let titles = if first {
        [
            "Table 5, Figs 11, 13, 15: case 1, moving along x, y and z: translation error",
            "Table 6, Figs 12, 14, 16: case 1, moving along x, y and z: rotation error",
        ]
    } else {
        [
            "Table 7, Figs 17, 19, 21: case 2, moving along z and rotating about x and y: translation error",
            "Table 8, Figs 18, 20, 22: case 2, moving along z and rotating about x and y: rotation error",
        ]
    };
    let rows = |turning: bool| {
        let mut rows = Vec::new();
        for (mode, _) in FREE_MODES {
            for axis in 0..3 {
                for frequency in FREQUENCIES {
                    let place = if turning { 3 + axis } else { axis };
                    let paper = paper_rms(case, mode, frequency).map_or(f64::NAN, |values| values[place]);
                    let run = runs.row(case, mode, frequency);
                    let ours = run.map_or(f64::NAN, |row| row.rms_nano[place]);
                    let suspect = first && mode == "pf-pcc" && place == 2 && frequency == FREQUENCIES[0];
                    let reason = match (turning, suspect) {
                        (true, _) => Remark::Angles,
                        (false, true) => Remark::Suspect,
                        (false, false) => Remark::Tracking,
                    };
                    let (quantity, unit) = (
                        [["x", "y", "z"], ["θx", "θy", "θz"]][usize::from(turning)][axis],
                        if turning { "nrad" } else { "nm" },
                    );
                    let row = Row::numbers([mode, quantity], Some(frequency), unit, [paper, ours], reason);
                    rows.push(row.over(run.map(|row| row.coverage)));
                }
            }
        }
        rows
    };
    [false, true].map(|turning| Table {
        id: ids[usize::from(turning)],
        title: titles[usize::from(turning)],
        how: "P/F, rms error of the true pose against bias plus corrected path, over the whole path; one machine within tolerances (seed 1), one nominal record for six legs".to_owned(),
        command: "specgen sim specs/reference.toml --frequency 0.1,1,10",
        rows: rows(turning),
    })
}

/// Runs one work part in both modes and adds the results to `table`.
///
/// # Errors
/// As [`PlatformScenario::against`].
pub fn machining(
    scenario: &PlatformScenario,
    controller: &mut dyn TickController,
    part: (&str, WorkPart),
    table: &mut MachiningTable,
) -> Result<(), RunError> {
    let trajectory = PaperPose::corrected(PaperPath::Machining, MACHINING_FREQUENCY);
    table.rows.extend(scenario.machining(controller, &MACHINING_MODES, &[part], &trajectory)?.rows);
    Ok(())
}

/// Table 9 from the runs.
pub fn table_9(runs: &MachiningTable) -> Table {
    let mut rows = Vec::new();
    for (part, _) in parts() {
        for (mode, _) in MACHINING_MODES {
            let paper = paper_machining(part, mode).unwrap_or([f64::NAN; 2]);
            let run = runs.row(part, mode);
            let ours = run.map_or([f64::NAN; 2], |row| [row.translation_nm, row.orientation_nrad]);
            let coverage = run.map(|row| row.coverage);
            let case = format!("{part}, {mode}");
            let at = Some(MACHINING_FREQUENCY);
            let row = |what, unit, k: usize, reason| {
                Row::numbers([&case, what], at, unit, [paper[k], ours[k]], reason).over(coverage)
            };
            rows.push(row("translation error norm", "nm", 0, Remark::WorkParts));
            rows.push(row("orientation error norm", "nrad", 1, Remark::BelowResolution));
        }
        if let (Some(ours), Some([p, _]), Some([pf, _])) =
            (runs.ratio(part, "p", "pf-pcc"), paper_machining(part, "p"), paper_machining(part, "pf-pcc"))
        {
            let case = format!("{part}, P over P/F");
            let values = [p / pf, ours[0]];
            rows.push(Row::numbers([&case, "translation"], Some(MACHINING_FREQUENCY), "", values, Remark::WorkParts));
        }
    }
    Table {
        id: "table-9",
        title: "Table 9, Figs 23 to 28: machining, P against P/F",
        how: "mean of the norm of the true error over the whole path; in contact with a linear work part from the start of the path"
            .to_owned(),
        command: "specgen sim specs/reference.toml",
        rows,
    }
}
