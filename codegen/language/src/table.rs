//! Tables as text: cells in columns, a row a line.

use std::fmt::{Display, Write as _};

/// A column. A longer text is not cut.
#[derive(Clone, Copy)]
pub struct Column {
    gap: &'static str,
    width: usize,
    right: bool,
}

/// Words, from the left edge of so many characters.
pub const fn left(width: usize) -> Column {
    Column { gap: "", width, right: false }
}

/// Numbers, up to the right edge of so many characters.
pub const fn right(width: usize) -> Column {
    Column { gap: "", width, right: true }
}

impl Column {
    /// The same behind something that is not padded.
    pub const fn behind(self, gap: &'static str) -> Self {
        Self { gap, ..self }
    }
}

/// Adds a row to `text`; the heads of the columns are one, too.
pub fn row(text: &mut String, columns: &[Column], cells: &[&dyn Display]) {
    for (Column { gap, width, right }, cell) in columns.iter().copied().zip(cells) {
        // A cell that is put together does not pad itself.
        let cell = cell.to_string();
        // Writing to a String cannot fail.
        let _ = if right { write!(text, "{gap}{cell:>width$}") } else { write!(text, "{gap}{cell:<width$}") };
    }
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_stand_under_their_heads() {
        let columns = [left(6), right(4), right(6).behind(" |"), left(0).behind("  ")];
        let mut text = String::new();
        row(&mut text, &columns, &[&"name", &"N", &"δ µm", &"of"]);
        row(&mut text, &columns, &[&"a", &12, &format_args!("{:.1}", 2.34), &"longer than it"]);
        assert_eq!(text, "name     N |  δ µm  of\na       12 |   2.3  longer than it\n");
    }
}
