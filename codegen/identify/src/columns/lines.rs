//! Lines of a file or of text, one after the other, whatever its size, and the line of each sample.

use std::collections::VecDeque;
use std::io::{self, BufRead, BufReader, Read};
use std::ops::Range;

use super::head::Line;

/// Longest line of numbers, bytes.
const LONGEST: usize = 1 << 16;

/// Lines of bytes without their ends.
pub(super) struct LineReader<'a> {
    reader: BufReader<Box<dyn Read + 'a>>,
    /// Lines that were read ahead, with their numbers.
    ahead: VecDeque<Line>,
    read: usize,
    /// Last byte of a line: of old programs, a carriage return alone.
    end: u8,
}

impl<'a> LineReader<'a> {
    pub(super) fn new(source: impl Read + 'a) -> Self {
        Self {
            reader: BufReader::with_capacity(1 << 16, Box::new(source)),
            ahead: VecDeque::new(),
            read: 0,
            end: b'\n',
        }
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

    /// Skips the lines before `line`, counted from 1; returns whether any of them `has` a property.
    pub(super) fn skip_to(&mut self, line: usize, has: impl Fn(&[u8]) -> bool) -> io::Result<bool> {
        let (mut any, mut skipped) = (false, Vec::new());
        while self.read + 1 < line && self.fetch(&mut skipped)?.is_some() {
            any |= has(&skipped);
        }
        Ok(any)
    }

    /// The first lines, at most `count`. [`LineReader::next`] returns them again from index `from` on, see
    /// [`LineReader::put_back`].
    pub(super) fn head(&mut self, count: usize) -> io::Result<Vec<Line>> {
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
    pub(super) fn put_back(&mut self, lines: Vec<Line>) {
        self.ahead = lines.into();
    }

    fn fetch(&mut self, line: &mut Vec<u8>) -> io::Result<Option<usize>> {
        line.clear();
        if self.read == 0 {
            let first = self.reader.fill_buf()?;
            self.end = if first.contains(&b'\r') && !first.contains(&b'\n') { b'\r' } else { b'\n' };
        }
        (&mut self.reader).take(LONGEST as u64).read_until(self.end, line)?;
        if line.is_empty() {
            return Ok(None);
        }
        self.read += 1;
        if self.read == 1 && line.starts_with(b"\xef\xbb\xbf") {
            line.drain(..3);
        }
        if line.last() == Some(&self.end) {
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

/// The line of each sample, in ascending order.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct LineNumbers {
    /// First sample and its line of each run of lines without a line between them.
    runs: Vec<(usize, usize)>,
    len: usize,
}

impl LineNumbers {
    /// `len` samples from line `first` on.
    pub(crate) fn consecutive(first: usize, len: usize) -> Self {
        Self { runs: vec![(0, first)], len }
    }

    pub(crate) fn push(&mut self, line: usize) {
        if self.len == 0 || self.at(self.len - 1) + 1 != line {
            self.runs.push((self.len, line));
        }
        self.len += 1;
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// The line of `sample`; 1 if there is none.
    pub(crate) fn at(&self, sample: usize) -> usize {
        let after = self.runs.partition_point(|(first, _)| *first <= sample);
        after.checked_sub(1).map_or(1, |run| self.runs[run].1 + sample - self.runs[run].0)
    }

    /// The lines of some of the samples.
    pub(crate) fn part(&self, samples: Range<usize>) -> Self {
        let mut part = Self::default();
        samples.for_each(|sample| part.push(self.at(sample)));
        part
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.len).map(|sample| self.at(sample))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_back() {
        let lines = [2, 3, 4, 7, 8, 20];
        let mut numbers = LineNumbers::default();
        lines.iter().for_each(|line| numbers.push(*line));
        assert_eq!((numbers.iter().collect::<Vec<_>>(), numbers.len(), numbers.runs.len()), (lines.to_vec(), 6, 3));
        assert_eq!(numbers.part(2..5).iter().collect::<Vec<_>>(), [4, 7, 8]);
        assert_eq!(LineNumbers::consecutive(2, 3).iter().collect::<Vec<_>>(), [2, 3, 4]);
    }
}
