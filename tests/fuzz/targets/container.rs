//! Files of MATLAB, HDF5, TDMS and NumPy, and packed texts: a record or a finding, in bounded memory.

use specgen::identify::{Reading, Record, decode_record};

use super::{FILE, accepted, memory};

/// `--max-size` of the targets, bytes.
const MAX_SIZE: u64 = 1_000_000;

/// A file that begins with `magic`.
fn of(magic: &[u8], input: &[u8]) {
    let mut file = input.to_vec();
    if let Some(first) = file.get_mut(..magic.len()) {
        first.copy_from_slice(magic);
    }
    let _ = within(file, MAX_SIZE);
}

/// The record of a file, which takes no more memory than 4 × `max_size` + 64 MB.
pub fn within(file: Vec<u8>, max_size: u64) -> Option<Record> {
    let reading = Reading::default().with_max_size(max_size);
    let (outcome, peak) = memory::peak(|| decode_record(file, FILE, &reading));
    let bound = 4 * max_size as usize + 64_000_000;
    assert!(peak <= bound, "{peak} bytes of memory, {bound} are permitted");
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
