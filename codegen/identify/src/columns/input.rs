//! Lines of a file or of text, one after the other, whatever its size.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read};

/// Longest line of numbers, bytes.
const LONGEST: usize = 1 << 16;

/// Lines of bytes without their ends.
pub(super) struct Input<'a> {
    reader: BufReader<Box<dyn Read + 'a>>,
    /// Lines that were read ahead, with their numbers.
    ahead: VecDeque<(usize, Vec<u8>)>,
    read: usize,
}

impl<'a> Input<'a> {
    pub(super) fn new(source: impl Read + 'a) -> Self {
        Self { reader: BufReader::with_capacity(1 << 16, Box::new(source)), ahead: VecDeque::new(), read: 0 }
    }

    /// Puts the next line into `line` and gives its number, counted from 1; `None` at the end.
    pub(super) fn next(&mut self, line: &mut Vec<u8>) -> io::Result<Option<usize>> {
        match self.ahead.pop_front() {
            Some((number, text)) => {
                *line = text;
                Ok(Some(number))
            }
            None => self.fetch(line),
        }
    }

    /// The first lines, at most `count`. [`Input::next`] returns them again from index `from` on, see
    /// [`Input::put_back`].
    pub(super) fn head(&mut self, count: usize) -> io::Result<Vec<(usize, Vec<u8>)>> {
        let mut lines = Vec::new();
        let mut line = Vec::new();
        while lines.len() < count {
            match self.fetch(&mut line)? {
                Some(number) => lines.push((number, std::mem::take(&mut line))),
                None => break,
            }
        }
        Ok(lines)
    }

    /// Returns lines to be read again before the rest.
    pub(super) fn put_back(&mut self, lines: Vec<(usize, Vec<u8>)>) {
        self.ahead = lines.into();
    }

    fn fetch(&mut self, line: &mut Vec<u8>) -> io::Result<Option<usize>> {
        line.clear();
        (&mut self.reader).take(LONGEST as u64).read_until(b'\n', line)?;
        if line.is_empty() {
            return Ok(None);
        }
        self.read += 1;
        if self.read == 1 && line.starts_with(b"\xef\xbb\xbf") {
            line.drain(..3);
        }
        if line.last() == Some(&b'\n') {
            line.pop();
            if line.last() == Some(&b'\r') {
                line.pop();
            }
        } else if line.len() >= LONGEST && !line.contains(&0) {
            return Err(io::Error::other(format!("line {} is longer than {} KiB", self.read, LONGEST >> 10)));
        }
        Ok(Some(self.read))
    }
}
