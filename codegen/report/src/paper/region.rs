//! Fig. 29: the stability region of the adaptation.

use host_sim::controller::{ControllerError, TickController};

use crate::chart::{Axis, Chart, DASHED, DOTS, LINE, pairs};
use crate::section::{Grid, Section};
use specgen_compiler::compile::Compilation;
use specgen_studies::paper::region::{jury, limits, printed};
use specgen_studies::reproduce::write::digits;

/// ω2 of the curves; the first is EWMA.
const DRIFTS: [Option<f64>; 5] = [None, Some(0.011), Some(0.1), Some(0.4), Some(0.8)];
/// Points of a curve.
const POINTS: usize = 120;

/// Curves of (AII.18) and (AII.19) and, for six legs with their own gauges, the actual limits of their emitted controller.
///
/// # Errors
/// As [`limits`].
pub fn section(
    compiled: &Compilation,
    controller: Option<&mut dyn TickController>,
) -> Result<Section, ControllerError> {
    let mut chart = Chart::new(
        "region",
        "Fig. 29: largest stable λ = ρ/ρ̂ over ω1",
        Axis::linear("weight ω1", "per run"),
        Axis::log("largest stable λ", ""),
    );
    let levels: Vec<f64> = (0..=POINTS).map(|k| 0.02 + 0.98 * k as f64 / POINTS as f64).collect();
    for drift in DRIFTS {
        let limits: Vec<f64> = levels.iter().map(|level| jury(*level, drift)).collect();
        let name = drift.map_or_else(|| "EWMA".to_owned(), |drift| format!("PCC, ω2 = {drift}"));
        chart = chart.with(&name, LINE, pairs(&levels, &limits));
    }
    let as_printed = printed(levels[0], None);
    chart = chart.with("(AII.18) as printed", DASHED, vec![[levels[0], as_printed], [1.0, as_printed]]);
    let adaptation = &compiled.model.adaptation;
    let weights = compiled.design.as_ref().map_or([adaptation.level_weight, adaptation.drift_weight], |design| {
        [design.combined.level_bandwidth, design.combined.drift_bandwidth].map(|x| x * compiled.model.timing.period)
    });
    let highest = adaptation.gain_ratio[1];
    chart = chart.with("this spec: weight and upper end of gain_ratio", DOTS, vec![[weights[0], highest]]);
    let mut section = Section::new("region", "Stability region of the adaptation", "")
        .text("Below a curve the run-to-run law is stable on a leg without dynamics. With amplifier lag and modes the limit is lower; the compiler checks that limit, see the margins.");
    let mut table = None;
    if let Some(controller) = controller {
        let found = limits(controller, adaptation.run_interval)?;
        let mut grid = Grid::new(
            "The emitted controller on legs without dynamics, after a step of 0.2 µm",
            &[
                "ω1",
                "ω2",
                "λ as printed",
                "λ by (AII.19), corrected (AII.18)",
                "largest λ at which the emitted controller settles",
                "emitted / formula",
            ],
        );
        for limit in &found {
            grid.push(vec![
                format!("{}", limit.level),
                limit.drift.map_or_else(|| "EWMA".to_owned(), |drift| format!("{drift}")),
                digits(limit.printed),
                digits(limit.jury),
                digits(limit.emitted),
                digits(limit.emitted / limit.jury),
            ]);
        }
        let settled = found.iter().map(|limit| [limit.level, limit.emitted]).collect();
        chart = chart.with("emitted controller", DOTS, settled);
        table = Some(grid);
    }
    section = section.charts(vec![chart]);
    if let Some(table) = table {
        section = section.table(table);
    }
    Ok(section)
}
