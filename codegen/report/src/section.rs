//! Parts of a page.

use serde_json::{Value, json};

use super::chart::Chart;
pub use super::grid::Grid;
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
    /// What is shown by choice, above the parts; may be empty.
    pub panes: Vec<Pane>,
}

/// One of several contents of a section, by a segmented choice in its head.
#[derive(Debug, Clone, PartialEq)]
pub struct Pane {
    /// The values that choose it, one for each choice of the section.
    pub values: Vec<String>,
    /// From top to bottom.
    pub parts: Vec<Part>,
}

/// A piece of a section. Texts are plain; the page escapes them.
#[derive(Debug, Clone, PartialEq)]
pub enum Part {
    /// What a section shows, in a sentence: its result.
    Lead(String),
    /// A paragraph.
    Text(String),
    /// Lines as they are, from a command.
    Lines(String),
    /// A table.
    Table(Grid),
    /// A chart.
    Chart(Chart),
    /// Small charts, of which one is shown large.
    Multiples(Multiples),
    /// Rows on one axis.
    Rows(Rows),
    /// The platform, to turn and to play: data of the script, by a name of its own.
    View(&'static str, Value),
    /// Columns beside each other.
    Columns(Vec<Vec<Part>>),
    /// A part of the page in HTML of this crate's own.
    Html(String),
}

/// Small charts, of which one is shown large.
#[derive(Debug, Clone, PartialEq)]
pub struct Multiples {
    /// Name on the page.
    pub id: String,
    /// By the order in which they stand: the large form, from top to bottom, the last of which is the small one.
    pub items: Vec<Vec<Chart>>,
    /// Groups of one unit, which share one scale.
    pub groups: Vec<Group>,
    /// The one that is large at first.
    pub selected: usize,
}

/// Small charts of one unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Above them.
    pub title: String,
    /// Which ones.
    pub items: Vec<usize>,
    /// Limits of y; none: each has its own.
    pub range: Option<[f64; 2]>,
}

impl Multiples {
    /// Charts that have nothing in common but their place; the first is large.
    #[must_use]
    pub fn gallery(id: &str, charts: Vec<Chart>) -> Self {
        let all = (0..charts.len()).collect();
        let groups = vec![Group { title: String::new(), items: all, range: None }];
        Self { id: id.to_owned(), items: charts.into_iter().map(|chart| vec![chart]).collect(), groups, selected: 0 }
    }

    /// For the page's script.
    pub(crate) fn data(&self) -> Value {
        let range = |item: usize| self.groups.iter().find(|group| group.items.contains(&item)).and_then(|g| g.range);
        let item = |(k, charts): (usize, &Vec<Chart>)| {
            let ids: Vec<&str> = charts.iter().map(|chart| chart.id.as_str()).collect();
            json!({ "large": ids, "small": ids.last(), "range": range(k) })
        };
        self.items.iter().enumerate().map(item).collect()
    }
}

/// Rows on one axis, drawn by the page's script: dots with a line, or bars that add up on a squared axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// Name on the page.
    pub id: String,
    /// Above it.
    pub title: String,
    /// What is drawn, as the script takes it.
    pub data: Value,
    /// Its numbers.
    pub numbers: Grid,
}

impl Section {
    /// A section without parts.
    #[must_use]
    pub fn new(id: &'static str, title: &str, command: &str) -> Self {
        Self { id, title: title.to_owned(), command: command.to_owned(), parts: Vec::new(), panes: Vec::new() }
    }

    /// Adds a part.
    #[must_use]
    pub fn part(mut self, part: Part) -> Self {
        self.parts.push(part);
        self
    }

    /// Adds the sentence that says its result.
    #[must_use]
    pub fn lead(self, text: &str) -> Self {
        self.part(Part::Lead(text.to_owned()))
    }

    /// Adds a paragraph.
    #[must_use]
    pub fn text(self, text: &str) -> Self {
        self.part(Part::Text(text.to_owned()))
    }

    /// Adds a table.
    #[must_use]
    pub fn table(self, table: Grid) -> Self {
        self.part(Part::Table(table))
    }

    /// Adds small charts, the first of which is large at first; one alone is only large.
    #[must_use]
    pub fn charts(self, mut charts: Vec<Chart>) -> Self {
        match charts.len() {
            0 => self,
            1 => self.part(Part::Chart(charts.remove(0))),
            _ => {
                let id = format!("{}-{}", self.id, self.parts.len());
                self.part(Part::Multiples(Multiples::gallery(&id, charts)))
            }
        }
    }

    /// Adds lines.
    #[must_use]
    pub fn lines(self, lines: &str) -> Self {
        self.part(Part::Lines(lines.to_owned()))
    }

    /// Adds what is shown for these values of its choices.
    #[must_use]
    pub fn pane(mut self, values: &[&str], parts: Vec<Part>) -> Self {
        self.panes.push(Pane { values: values.iter().map(|value| (*value).to_owned()).collect(), parts });
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
