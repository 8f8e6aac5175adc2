//! The trace format: the output of every run, on a host or on a target, compared bit for bit.
//!
//! A file is, in little-endian:
//! ```text
//! "SPGTRACE"                      8 bytes
//! format version                  u32 (= 1)
//! length of the description       u32, a multiple of 8
//! description                     UTF-8 key=value lines, padded with line ends
//! number of rows                  u64
//! rows                            u64 words: inputs, outputs, state digest
//! ```

use std::fmt::Write;

use crate::description::Description;
use crate::word::WordKind;

mod difference;

pub use difference::{Difference, first_difference};

const MAGIC: &[u8; 8] = b"SPGTRACE";
const VERSION: u32 = 1;

/// A run of a controller: one row per tick.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Trace {
    description: Description,
    words: Vec<u64>,
}

impl Trace {
    /// An empty trace of a controller.
    pub fn new(description: Description) -> Self {
        Self { description, words: Vec::new() }
    }

    /// Whose run it is.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Words per row: inputs, outputs, digest.
    pub fn width(&self) -> usize {
        self.description.input_names.len() + self.description.output_names.len() + 1
    }

    /// Number of ticks.
    pub fn len(&self) -> usize {
        self.words.len() / self.width()
    }

    /// Whether no tick was recorded.
    pub fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    /// Rows in order of time.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[u64]> {
        self.words.chunks_exact(self.width())
    }

    /// All words, row after row.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// Names of the columns: inputs, outputs, `state_digest`.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        let description = &self.description;
        let names = description.input_names.iter().chain(&description.output_names);
        names.map(String::as_str).chain(std::iter::once("state_digest"))
    }

    /// Adds a tick.
    ///
    /// # Panics
    /// If `input` or `output` does not have the number of words in the description.
    pub fn push(&mut self, input: &[u64], output: &[u64], digest: u64) {
        assert_eq!(input.len(), self.description.input_names.len(), "input words");
        assert_eq!(output.len(), self.description.output_names.len(), "output words");
        self.words.extend_from_slice(input);
        self.words.extend_from_slice(output);
        self.words.push(digest);
    }

    /// The file's bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut text = self.description.to_text().into_bytes();
        text.resize(text.len().next_multiple_of(8), b'\n');
        let mut out = Vec::with_capacity(24 + text.len() + self.words.len() * 8);
        out.extend_from_slice(MAGIC);
        out.extend_from_slice(&VERSION.to_le_bytes());
        // A description is a few kilobytes of names.
        out.extend_from_slice(&(text.len() as u32).to_le_bytes());
        out.extend_from_slice(&text);
        out.extend_from_slice(&(self.len() as u64).to_le_bytes());
        for word in &self.words {
            out.extend_from_slice(&word.to_le_bytes());
        }
        out
    }

    /// CSV for reading and plotting: numbers as shortest decimals that give the same bits, integers unchanged, the
    /// digest in hexadecimal; units in the column names.
    pub fn to_csv(&self) -> String {
        let titles: Vec<String> = std::iter::once("tick".to_owned()).chain(self.columns().map(title)).collect();
        let kinds: Vec<WordKind> = self.columns().map(WordKind::of).collect();
        let mut out = titles.join(",");
        out.push('\n');
        let digest = self.width() - 1;
        for (tick, row) in self.rows().enumerate() {
            // Writing to a String cannot fail.
            let _ = write!(out, "{tick}");
            for (column, (word, kind)) in row.iter().zip(&kinds).enumerate() {
                let _ = match kind {
                    _ if column == digest => write!(out, ",{word:016x}"),
                    WordKind::Integer => write!(out, ",{word}"),
                    WordKind::Real if self.description.scalar.bits() == 32 => {
                        write!(out, ",{:?}", f32::from_bits(*word as u32))
                    }
                    WordKind::Real => write!(out, ",{:?}", f64::from_bits(*word)),
                };
            }
            out.push('\n');
        }
        out
    }
}

/// Column title with the unit: `voltage[2]` becomes `voltage[2]_V`.
///
/// `setpoint` has none: the configuration selects pose or leg displacements, in m and rad.
fn title(name: &str) -> String {
    let unit = match name.split('[').next() {
        Some("voltage") => "_V",
        Some("displacement" | "requested" | "demand" | "level" | "drift") => "_m",
        _ => "",
    };
    format!("{name}{unit}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::tests::six_legs;
    use crate::word::Scalar;

    fn sample(scalar: Scalar) -> Trace {
        let mut trace = Trace::new(six_legs(scalar));
        for tick in 0..3_u64 {
            let input: Vec<u64> = (0..12).map(|k| scalar.encode((tick * 100 + k) as f64 + 0.1)).collect();
            let output: Vec<u64> = (0..37).map(|k| scalar.encode(k as f64)).collect();
            trace.push(&input, &output, tick ^ 0xdead_beef);
        }
        trace
    }

    #[test]
    fn a_file_has_a_header_the_description_and_every_word() {
        let trace = sample(Scalar::F64);
        let bytes = trace.to_bytes();
        let word = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        assert_eq!((&bytes[..8], word(8) as u32), (&MAGIC[..], VERSION));
        let rows = 16 + (word(8) >> 32) as usize;
        let text = std::str::from_utf8(&bytes[16..rows]).unwrap();
        assert_eq!(Description::parse(text).as_ref(), Ok(trace.description()));
        assert_eq!(word(rows), 3);
        let words: Vec<u64> = (rows + 8..bytes.len()).step_by(8).map(word).collect();
        assert_eq!(words, trace.words());
    }

    #[test]
    fn the_csv_has_units_and_exact_numbers() {
        for scalar in [Scalar::F32, Scalar::F64] {
            let csv = sample(scalar).to_csv();
            let mut lines = csv.lines();
            let header = lines.next().unwrap();
            assert!(header.starts_with("tick,setpoint[0],"), "{header}");
            assert!(
                header.contains(",displacement[0]_m,") && header.contains(",voltage[5]_V,requested[0]_m"),
                "{header}"
            );
            assert!(header.ends_with(",status,state_digest"), "{header}");
            let row: Vec<&str> = lines.nth(1).unwrap().split(',').collect();
            assert_eq!(row.len(), 51);
            assert_eq!(&row[..2], ["1", "100.1"]);
            assert_eq!(row[50], "00000000deadbeee");
        }
    }
}
