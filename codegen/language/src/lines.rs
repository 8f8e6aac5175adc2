//! The lines of a text.

/// The lines of a text, for finding the line of a byte.
#[derive(Debug)]
pub struct Lines<'a> {
    pub(crate) text: &'a str,
    /// First byte of each line.
    pub(crate) starts: Vec<usize>,
}

impl<'a> Lines<'a> {
    /// Of a text.
    pub fn new(text: &'a str) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i + 1);
        Self { text, starts: std::iter::once(0).chain(breaks).collect() }
    }

    /// Index of the line of a byte, and the byte itself. Any byte: it is limited to the text, and a byte within a character counts as its
    /// beginning.
    pub(crate) fn locate(&self, byte: usize) -> (usize, usize) {
        let mut byte = byte.min(self.text.len());
        while !self.text.is_char_boundary(byte) {
            byte -= 1;
        }
        // The first line starts at 0, so there is always one at or before `byte`.
        (self.starts.partition_point(|start| *start <= byte) - 1, byte)
    }
}
