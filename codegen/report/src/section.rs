//! Parts of a page.

use serde_json::Value;

use super::chart::Chart;
use specgen_studies::reproduce::table::{Cell, Table as Comparison};
use specgen_studies::reproduce::write::{cell, digits};

/// A part of the page with a heading.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Name of the section in links.
    pub id: &'static str,
    /// The heading.
    pub title: String,
    /// The command that makes its content again; empty: this report alone.
    pub command: String,
    /// From top to bottom.
    pub parts: Vec<Part>,
}

/// A piece of a section. Texts are plain; the page escapes them.
#[derive(Debug, Clone, PartialEq)]
pub enum Part {
    /// A paragraph.
    Text(String),
    /// Lines as they are, from a command.
    Lines(String),
    /// A table.
    Table(Grid),
    /// Charts beside each other.
    Charts(Vec<Chart>),
    /// The platform, to turn and to play: data of the script.
    View(Value),
}

/// A table of texts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Grid {
    /// What stands above the table.
    pub caption: String,
    /// Names of the columns.
    pub head: Vec<String>,
    /// As many texts each as the head.
    pub rows: Vec<Vec<String>>,
}

impl Grid {
    /// A table without rows.
    #[must_use]
    pub fn new(caption: &str, head: &[&str]) -> Self {
        Self {
            caption: caption.to_owned(),
            head: head.iter().map(|text| (*text).to_owned()).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row at the end.
    pub fn push(&mut self, row: Vec<String>) {
        self.rows.push(row);
    }
}

impl Section {
    /// A section without parts.
    #[must_use]
    pub fn new(id: &'static str, title: &str, command: &str) -> Self {
        Self { id, title: title.to_owned(), command: command.to_owned(), parts: Vec::new() }
    }

    /// Adds a paragraph.
    #[must_use]
    pub fn text(mut self, text: &str) -> Self {
        self.parts.push(Part::Text(text.to_owned()));
        self
    }

    /// Adds a table.
    #[must_use]
    pub fn table(mut self, table: Grid) -> Self {
        self.parts.push(Part::Table(table));
        self
    }

    /// Adds charts.
    #[must_use]
    pub fn charts(mut self, charts: Vec<Chart>) -> Self {
        self.parts.push(Part::Charts(charts));
        self
    }

    /// Adds lines.
    #[must_use]
    pub fn lines(mut self, lines: &str) -> Self {
        self.parts.push(Part::Lines(lines.to_owned()));
        self
    }

    /// Adds a table of the paper beside ours, with the remarks that it needs.
    #[must_use]
    pub fn comparison(mut self, table: &Comparison) -> Self {
        let mut grid =
            Grid::new(table.title, &["case", "quantity", "Hz", "unit", "paper", "ours", "ours / paper", "remark"]);
        // A run that was refused has nothing to compare; why stands above.
        let shown: Vec<_> = table.rows.iter().filter(|row| made(&row.ours)).collect();
        if shown.is_empty() {
            return self.text(&format!("{}: no run to compare.", table.title));
        }
        for row in &shown {
            grid.push(vec![
                row.case.clone(),
                row.quantity.clone(),
                row.frequency_hz.map_or_else(String::new, |hertz| format!("{hertz}")),
                row.unit.to_owned(),
                cell(&row.paper),
                cell(&row.ours),
                row.ratio.map_or_else(String::new, digits),
                row.remark.map_or_else(String::new, |remark| remark.id().to_owned()),
            ]);
        }
        self.parts.push(Part::Table(grid));
        let mut remarks: Vec<_> = shown.iter().filter_map(|row| row.remark).collect();
        remarks.sort_unstable();
        remarks.dedup();
        for remark in remarks {
            self.parts.push(Part::Text(format!("{}: {}", remark.id(), remark.text())));
        }
        self
    }
}

/// Whether there is a value.
fn made(cell: &Cell) -> bool {
    !matches!(cell, Cell::Number(value) if !value.is_finite())
}
