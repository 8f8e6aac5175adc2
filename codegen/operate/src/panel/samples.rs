//! Messages with blocks of samples for pages.
//!
//! A message: number 1 and the count of blocks (u32 each), its own number (u32), nothing (u32), when it was sent (f64, ms since 1970),
//! where the platform of the last row is from rest (6 f64, m and rad); then each block: first tick (f64), number, ticks a row, rows,
//! nothing (u32 each); then its rows: status, phase (u32 each), pose, set-point, error, voltages (f32 each; error and voltages least,
//! mean, most of each axis and leg); pose and error that are not measured are NaN. Little-endian.

use crate::motion::Motion;
use crate::samples::{Block, Spread};

/// What a message is: see above.
const SAMPLES: u32 = 1;

/// The message of these blocks.
pub fn message(number: u32, blocks: &[Block], motion: Option<&Motion>, sent: f64) -> Vec<u8> {
    let mut bytes = Vec::new();
    for value in [SAMPLES, blocks.len() as u32, number, 0] {
        bytes.extend(value.to_le_bytes());
    }
    bytes.extend(sent.to_le_bytes());
    let last = blocks.last().and_then(|block| block.rows.last());
    let standing = last.and_then(|row| motion?.platform(&row.pose?)).unwrap_or([f64::NAN; 6]);
    standing.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
    for block in blocks {
        bytes.extend((block.tick as f64).to_le_bytes());
        for value in [block.number, block.every, block.rows.len() as u32, 0] {
            bytes.extend(value.to_le_bytes());
        }
        for row in &block.rows {
            bytes.extend(row.status.to_le_bytes());
            bytes.extend(u32::from(row.phase).to_le_bytes());
            // Of what is not measured a page shows nothing, by the status.
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
