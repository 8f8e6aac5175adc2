//! Section 3 of the paper: Tables 1 and 2 with six legs, Fig. 29.

use host_sim::closed_loop::RunError;
use host_sim::controller::TickController;
use host_sim::plant::LegParameters;
use host_sim::scenario::{LINEARITY_FREQUENCIES, LegScenario, MODES, TRACKING_FREQUENCIES};

use super::table::{Row, Table};
use crate::paper::remark::Remark;
use crate::paper::{printed, region};

/// Control ticks per period of the trajectory, as in `specgen sim`.
pub const SAMPLES: u32 = 500;

/// Six equal reference legs, prepared, with noise from `seed`.
pub fn scenario(seed: u64) -> LegScenario {
    let leg = LegParameters::reference();
    LegScenario::new(&std::array::from_fn(|_| leg.clone()), &leg.noise, seed, SAMPLES)
}

/// Table 1. `stack_gain` is ρ̂ of one stack, µm/V, and `stacks` the number of stacks per leg.
///
/// # Errors
/// As [`LegScenario::linearity`].
pub fn table_1(
    scenario: &LegScenario,
    controller: &mut dyn TickController,
    stack_gain: f64,
    stacks: u32,
) -> Result<Table, RunError> {
    let linearity = scenario.linearity(controller, &LINEARITY_FREQUENCIES)?;
    let mut rows = Vec::new();
    for (index, (ours, [frequency, bias, slope])) in linearity.rows.iter().zip(printed::TABLE_1).enumerate() {
        let at = Some(frequency);
        let row = |quantity, unit, values, reason| Row::numbers(["invhys", quantity], at, unit, values, reason);
        rows.push(row("slope ρ", "µm/V", [slope, ours.gain_ratio * stack_gain], Remark::Unexplained));
        let relative = [printed::slope_ratio(index), ours.relative_slope];
        rows.push(row("slope relative to 0.1 Hz", "", relative, Remark::Unexplained));
        rows.push(row("bias δ", "µm", [bias, ours.offset_um / f64::from(stacks)], Remark::Bias));
    }
    Ok(Table {
        id: "table-1",
        title: "Table 1, Fig. 4: linear fit of displacement over virtual voltage, inverse model only",
        how: "least-squares fit of Y over X for the last period, all six legs; slope and bias of one of five stacks"
            .to_owned(),
        command: "specgen sim specs/legs.toml",
        rows,
    })
}

/// Table 2.
///
/// # Errors
/// As [`LegScenario::tracking`].
pub fn table_2(scenario: &LegScenario, controller: &mut dyn TickController) -> Result<Table, RunError> {
    let tracking = scenario.tracking(controller, &MODES, &TRACKING_FREQUENCIES)?;
    let mut rows = Vec::new();
    for (mode, values) in printed::TABLE_2 {
        let reason = if mode == "invhys" { Remark::Unexplained } else { Remark::UpperBound };
        for (frequency, paper) in TRACKING_FREQUENCIES.into_iter().zip(values) {
            let run = tracking.row(mode, frequency);
            let ours = run.map_or(f64::NAN, |row| row.rmse_nm);
            let row = Row::numbers([mode, "T − Y, rms"], Some(frequency), "nm", [paper, ours], reason);
            rows.push(row.over(run.map(|row| row.coverage)));
        }
    }
    Ok(Table {
        id: "table-2",
        title: "Table 2, Figs 6 to 8: tracking error of the leg trajectory",
        how: format!("rms over the whole path and six legs, {SAMPLES} ticks per period, printed weights"),
        command: "specgen sim specs/legs.toml",
        rows,
    })
}

/// Fig. 29.
///
/// # Errors
/// As [`region::limits`].
pub fn figure_29(controller: &mut dyn TickController, run_interval: u32) -> Result<Table, RunError> {
    let rows = region::limits(controller, run_interval)?.into_iter().map(|limit| {
        let (case, reason) = match limit.drift {
            None => (format!("EWMA, ω = {}", limit.level), Remark::Ewma),
            Some(drift) => (format!("PCC, ω1 = {}, ω2 = {drift}", limit.level), Remark::Unexplained),
        };
        Row::numbers([&case, "largest stable λ"], None, "", [limit.printed, limit.emitted], reason)
    });
    Ok(Table {
        id: "figure-29",
        title: "Fig. 29, (AII.18) and (AII.19): largest stable adaptation ratio λ = ρ/ρ̂ for different weights",
        how: "paper: its formulas; ours: λ at which the emitted controller no longer settles after a step of 0.2 µm on legs without dynamics".to_owned(),
        command: "specgen reproduce",
        rows: rows.collect(),
    })
}
