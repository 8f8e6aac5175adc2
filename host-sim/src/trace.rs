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

use crate::description::{Description, DescriptionError};
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

/// Reason why a file is not a trace.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TraceError {
    /// It does not begin as a trace does.
    #[error("not a trace: it does not begin with SPGTRACE; record it again")]
    NotATrace,
    /// It is of another version of the format.
    #[error("trace format {0}, expected {VERSION}; record it with this version")]
    Version(u32),
    /// It is too short, or continues after its last row.
    #[error("the trace has {found} bytes, expected {expected}: the recording was cut or mixed; record it again")]
    Length {
        /// Bytes announced by its header.
        expected: u64,
        /// Bytes that it has.
        found: u64,
    },
    /// Its description is unusable.
    #[error("the trace's header: {0}")]
    Description(DescriptionError),
}

impl Trace {
    /// An empty trace of a controller.
    #[must_use]
    pub fn new(description: Description) -> Self {
        Self { description, words: Vec::new() }
    }

    /// A trace from rows recorded by a target.
    ///
    /// # Errors
    /// If `words` is not a whole number of rows.
    pub fn from_words(description: Description, words: Vec<u64>) -> Result<Self, TraceError> {
        let trace = Self { description, words };
        let width = trace.width();
        if trace.words.len().is_multiple_of(width) {
            return Ok(trace);
        }
        let found = trace.words.len() as u64 * 8;
        Err(TraceError::Length { expected: trace.words.len().next_multiple_of(width) as u64 * 8, found })
    }

    /// Whose run it is.
    #[must_use]
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Words per row: inputs, outputs, digest.
    #[must_use]
    pub fn width(&self) -> usize {
        self.description.input_names.len() + self.description.output_names.len() + 1
    }

    /// Number of ticks.
    #[must_use]
    pub fn len(&self) -> usize {
        self.words.len() / self.width()
    }

    /// Whether no tick was recorded.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    /// Rows in order of time.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[u64]> {
        self.words.chunks_exact(self.width())
    }

    /// All words, row after row.
    #[must_use]
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
    #[must_use]
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

    /// Reads a file's bytes.
    ///
    /// # Errors
    /// If they are not a complete trace of this version.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, TraceError> {
        let mut rest = bytes;
        let cut = |expected: u64| TraceError::Length { expected, found: bytes.len() as u64 };
        if take::<8>(&mut rest) != Some(*MAGIC) {
            return Err(TraceError::NotATrace);
        }
        let version = take(&mut rest).map(u32::from_le_bytes).ok_or(cut(24))?;
        if version != VERSION {
            return Err(TraceError::Version(version));
        }
        let header = u64::from(take(&mut rest).map(u32::from_le_bytes).ok_or(cut(24))?);
        let text = rest.split_off(..header as usize).ok_or(cut(24 + header))?;
        let description = Description::parse(&String::from_utf8_lossy(text)).map_err(TraceError::Description)?;
        let rows = take(&mut rest).map(u64::from_le_bytes).ok_or(cut(24 + header))?;

        let mut trace = Self::new(description);
        // Saturating: a damaged count must not wrap around to one that fits.
        let expected = rows.saturating_mul(trace.width() as u64).saturating_mul(8);
        if expected != rest.len() as u64 {
            return Err(cut(expected.saturating_add(24 + header)));
        }
        while let Some(word) = take(&mut rest) {
            trace.words.push(u64::from_le_bytes(word));
        }
        Ok(trace)
    }

    /// CSV for reading and plotting: numbers as shortest decimals that give the same bits, integers unchanged, the
    /// digest in hexadecimal; units in the column names.
    #[must_use]
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

/// Removes and returns the first `N` bytes.
fn take<const N: usize>(rest: &mut &[u8]) -> Option<[u8; N]> {
    let (head, tail) = rest.split_first_chunk::<N>()?;
    *rest = tail;
    Some(*head)
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
    fn a_trace_reads_back_to_the_word() {
        let trace = sample(Scalar::F64);
        let bytes = trace.to_bytes();
        assert_eq!(bytes.len() % 8, 0);
        assert_eq!(Trace::from_bytes(&bytes), Ok(trace.clone()));
        assert_eq!(Trace::from_words(trace.description().clone(), trace.words().to_vec()), Ok(trace));
    }

    #[test]
    fn a_damaged_file_is_refused_at_every_length() {
        let bytes = sample(Scalar::F64).to_bytes();
        for length in 0..bytes.len() {
            assert!(Trace::from_bytes(&bytes[..length]).is_err(), "{length}");
        }
        let mut longer = bytes.clone();
        longer.push(0);
        let error = Trace::from_bytes(&longer).unwrap_err().to_string();
        assert!(error.contains(&format!("{} bytes, expected {}", bytes.len() + 1, bytes.len())), "{error}");
        let mut other = bytes.clone();
        other[8] = 9;
        assert_eq!(Trace::from_bytes(&other), Err(TraceError::Version(9)));
        let text = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let mut count = bytes;
        count[16 + text..24 + text].fill(0xff);
        assert!(matches!(Trace::from_bytes(&count), Err(TraceError::Length { expected: u64::MAX, .. })));
    }

    #[test]
    fn half_a_row_is_refused() {
        let trace = sample(Scalar::F64);
        let words = trace.words()[..55].to_vec();
        assert!(Trace::from_words(trace.description().clone(), words).is_err());
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
