//! Tables of texts.

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
