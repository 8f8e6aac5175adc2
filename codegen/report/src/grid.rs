//! Text tables.

/// A text table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Grid {
    /// Caption above the table.
    pub caption: String,
    /// Names of the columns.
    pub head: Vec<String>,
    /// Each with as many texts as the head.
    pub rows: Vec<Vec<String>>,
}

impl Grid {
    /// A table without rows.
    pub fn new(caption: &str, head: &[&str]) -> Self {
        Self {
            caption: caption.to_owned(),
            head: head.iter().map(|text| (*text).to_owned()).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row.
    pub fn push(&mut self, row: Vec<String>) {
        self.rows.push(row);
    }
}
