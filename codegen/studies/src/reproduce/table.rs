//! A table of the paper beside ours.

use host_sim::coverage::Coverage;
use serde::Serialize;

use crate::paper::remark::Remark;

/// A value, or a setting in words.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Cell {
    /// In the unit of the row.
    Number(f64),
    /// In words.
    Text(String),
}

/// One comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// What was done, such as `pcc`.
    pub case: String,
    /// What was measured, such as `x`.
    pub quantity: String,
    /// Operating frequency, Hz, if there is one.
    pub frequency_hz: Option<f64>,
    /// Of both values; empty for ratios and words.
    pub unit: &'static str,
    /// As printed.
    pub paper: Cell,
    /// Of the emitted controller.
    pub ours: Cell,
    /// Ours over the paper's.
    pub ratio: Option<f64>,
    /// Why they differ; none where there is nothing to compare.
    pub remark: Option<Remark>,
    /// Over what ours was measured, of the error on a path.
    #[serde(flatten)]
    pub coverage: Option<Coverage>,
}

impl Row {
    /// Two numbers, and why they differ if they do.
    #[must_use]
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

    /// The same, ours measured over this part of a path; none where it was not made.
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
    /// What it is called in the paper, and what it shows.
    pub title: &'static str,
    /// How ours was made.
    pub how: String,
    /// The command that makes it alone.
    pub command: &'static str,
    /// Rows in the order of the paper.
    pub rows: Vec<Row>,
}

impl Table {
    /// Remarks that its rows need, each once.
    #[must_use]
    pub fn remarks(&self) -> Vec<Remark> {
        let mut remarks: Vec<Remark> = self.rows.iter().filter_map(|row| row.remark).collect();
        remarks.sort_unstable();
        remarks.dedup();
        remarks
    }
}
