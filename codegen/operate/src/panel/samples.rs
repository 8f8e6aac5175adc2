//! Messages with blocks of samples for pages.
//!
//! A message, little-endian: type 1, number of blocks, number of the message, 0 (u32 each), send time (f64, ms since 1970), pose of
//! the platform relative to rest in the last row (6 f64, m and rad); then for each block: first tick (f64), number, ticks per row,
//! rows, 0 (u32 each); then its rows: status, phase (u32 each), pose, set-point, error, voltages (f32 each; error and voltages with
//! minimum, mean and maximum of each axis and leg). A pose or error that is not measured is NaN.

use crate::motion::Motion;
use crate::samples::{Block, Spread};

/// Type of the message.
const SAMPLES: u32 = 1;

/// The message of these blocks.
pub fn message(number: u32, blocks: &[Block], motion: Option<&Motion>, sent: f64) -> Vec<u8> {
    let mut bytes = Vec::new();
    for value in [SAMPLES, blocks.len() as u32, number, 0] {
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend(sent.to_le_bytes());
    let last = blocks.last().and_then(|block| block.rows.last());
    let location = last.and_then(|row| motion?.platform(&row.pose?)).unwrap_or([f64::NAN; 6]);
    location.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    for block in blocks {
        bytes.extend((block.tick as f64).to_le_bytes());
        for value in [block.number, block.every, block.rows.len() as u32, 0] {
            bytes.extend(value.to_le_bytes());
        }
        for row in &block.rows {
            bytes.extend(row.status.to_le_bytes());
            bytes.extend(u32::from(row.phase).to_le_bytes());
            // The page hides what the status marks as not measured.
            let nothing = Spread { least: f32::NAN, mean: f32::NAN, most: f32::NAN };
            let (pose, error) = (row.pose.unwrap_or([f64::NAN; 6]), row.error.unwrap_or([nothing; 6]));
            for value in pose.iter().chain(&row.target) {
                bytes.extend((*value as f32).to_le_bytes());
            }
            for Spread { least, mean, most } in error.iter().chain(&row.volts) {
                for value in [least, mean, most] {
                    bytes.extend(value.to_le_bytes());
                }
            }
        }
    }
    bytes
}
