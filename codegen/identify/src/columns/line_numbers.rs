//! Line number of each sample of a file, in a few numbers, however long the file is.

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
        assert_eq!(LineNumbers::consecutive(2, 3).iter().collect::<Vec<_>>(), [2, 3, 4]);
    }
}
