//! A table of the paper with our results.

use host_sim::coverage::Coverage;
use serde::Serialize;

use crate::paper::remark::Remark;

/// A number or a text.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Cell {
    /// A number in the unit of the row.
    Number(f64),
    /// A text.
    Text(String),
}

/// One comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The condition, such as `pcc`.
    pub case: String,
    /// The measured quantity, such as `x`.
    pub quantity: String,
    /// Operating frequency, Hz, if any.
    pub frequency_hz: Option<f64>,
    /// Unit of both values; empty for ratios and texts.
    pub unit: &'static str,
    /// As printed.
    pub paper: Cell,
    /// Result of the emitted controller.
    pub ours: Cell,
    /// Ours divided by the paper's.
    pub ratio: Option<f64>,
    /// Why they differ; `None` if there is nothing to compare.
    pub remark: Option<Remark>,
    /// The measured part of the path, for errors along a path.
    #[serde(flatten)]
    pub coverage: Option<Coverage>,
}

impl Row {
    /// Two numbers, and the reason for a difference.
    pub fn numbers(
        [case, quantity]: [&str; 2],
        frequency_hz: Option<f64>,
        unit: &'static str,
        [paper, ours]: [f64; 2],
        reason: Remark,
    ) -> Self {
        Self {
            case: case.to_owned(),
            quantity: quantity.to_owned(),
            frequency_hz,
            unit,
            paper: Cell::Number(paper),
            ours: Cell::Number(ours),
            ratio: Some(ours / paper),
            remark: Some(Remark::of(paper, ours, reason)),
            coverage: None,
        }
    }

    /// The same, with the measured part of the path; `None` if no path was run.
    #[must_use]
    pub fn over(self, coverage: Option<Coverage>) -> Self {
        Self { coverage, ..self }
    }
}

/// A table or figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// For file names: `table-5`.
    pub id: &'static str,
    /// Its name in the paper, and its content.
    pub title: &'static str,
    /// How our values were obtained.
    pub how: String,
    /// The command that produces it alone.
    pub command: &'static str,
    /// Rows in the paper's order.
    pub rows: Vec<Row>,
}

impl Table {
    /// Remarks used by its rows, without duplicates.
    pub fn remarks(&self) -> Vec<Remark> {
        let mut remarks: Vec<Remark> = self.rows.iter().filter_map(|row| row.remark).collect();
        remarks.sort_unstable();
        remarks.dedup();
        remarks
    }
}
