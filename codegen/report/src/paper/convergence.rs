//! Convergence of the genetic algorithm of Table 3 on this spec.

use crate::chart::{Axis, Chart, DASHED, LINE, pairs};
use crate::section::{Grid, Section};
use specgen_studies::paper::convergence::Convergence;
use specgen_studies::paper::printed::TABLE_3;
use specgen_studies::reproduce::write::convergence_text;

/// The section of a search; `command` reproduces it.
pub fn section(found: &Convergence, command: &str) -> Section {
    let found_any = found.history.iter().any(|generation| generation.best.is_some());
    let charts = if found_any { vec![chart(found)] } else { Vec::new() };
    let mut table = Grid::new("Table 3: settings", &["setting", "paper", "here"]);
    for row in TABLE_3 {
        table.push(row.map(str::to_owned).to_vec());
    }
    Section::new("convergence", "Genetic algorithm", command)
        .text(&convergence_text(found))
        .text("The spec is not changed; specgen tune writes better parameters into it, using this algorithm or CMA-ES.")
        .charts(charts)
        .table(table)
}

/// Best and median cost by generation.
pub fn chart(found: &Convergence) -> Chart {
    let x: Vec<f64> = found.history.iter().map(|generation| generation.evaluations as f64).collect();
    let of = |value: Option<f64>| value.unwrap_or(f64::NAN);
    let best: Vec<f64> = found.history.iter().map(|generation| of(generation.best)).collect();
    let median: Vec<f64> = found.history.iter().map(|generation| of(generation.median)).collect();
    Chart::new("convergence", "Cost (9) by generation", Axis::linear("strings tried", ""), Axis::log("cost", "µm s²"))
        .with("best so far", LINE, pairs(&x, &best))
        .with("median of the generation", DASHED, pairs(&x, &median))
}
