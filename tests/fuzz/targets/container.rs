//! Files of MATLAB, HDF5, TDMS and NumPy, and packed texts: a record or a finding, in bounded memory.

use specgen::identify::{Reading, Record, decode_record};

use super::{FILE, accepted, memory};

/// `--max-size` of the targets, bytes: what the longest input unpacks to.
const MAX_SIZE: u64 = 16_000_000;
/// Memory for everything that does not grow with the size, bytes: a quarter of what is documented, so that it hides no overrun.
const SLACK: usize = 16_000_000;

/// Of a finding about columns that a record lacks.
const MISSING: &str = "is missing; ";

/// A file that begins with `magic`.
fn of(magic: &[u8], input: &[u8]) {
    let mut file = input.to_vec();
    if let Some(first) = file.get_mut(..magic.len()) {
        first.copy_from_slice(magic);
    }
    let _ = within(file, MAX_SIZE);
}

/// The options that a help suggests, with a rate for `HZ`.
fn suggested(help: &str) -> Option<Reading> {
    let (_, options) = help.split_once("`--columns ")?;
    let (options, _) = options.split_once('`')?;
    let columns = options.strip_suffix(" --rate HZ");
    let (columns, rate) = columns.map_or((options, None), |columns| (columns, Some(1e3)));
    Some(Reading::new(&[columns.trim_matches('\'').to_owned()], rate).unwrap())
}

/// The record of a file, which takes no more memory than 4 × `max_size` and a little.
pub fn within(file: Vec<u8>, max_size: u64) -> Option<Record> {
    let given = file.clone();
    let reading = Reading::default().with_max_size(max_size);
    let (outcome, peak) = memory::peak(|| decode_record(given, FILE, &reading));
    let bound = 4 * max_size as usize + SLACK;
    assert!(peak <= bound, "{peak} bytes of memory, {bound} are permitted");
    // What is suggested for missing columns is taken: nothing is missing then.
    let findings = outcome.as_ref().err().into_iter().flatten().filter(|finding| finding.message.contains(MISSING));
    if let Some(reading) = findings.into_iter().find_map(|finding| suggested(&finding.help)) {
        let again = decode_record(file, FILE, &reading.with_max_size(max_size)).err().unwrap_or_default();
        assert!(!again.iter().any(|finding| finding.message.contains(MISSING)), "{outcome:?} {again:?}");
    }
    let record = accepted(outcome)?;
    let columns = [&record.time, &record.drive, &record.displacement];
    assert!(columns.iter().all(|column| column.len() >= 100 && column.iter().all(|value| value.is_finite())));
    assert!(record.time.is_sorted_by(|a, b| a < b));
    Some(record)
}

pub fn mat(input: &[u8]) {
    of(b"MATLAB 5.0 MAT-file", input);
}

pub fn hdf5(input: &[u8]) {
    of(b"\x89HDF\r\n\x1a\n", input);
}

pub fn tdms(input: &[u8]) {
    of(b"TDSm", input);
}

/// Whatever else it may be: arrays of NumPy, gzip, UTF-16.
pub fn packed(input: &[u8]) {
    of(b"", input);
}
