//! Traits of gauges and amplifiers, and drivers.

use super::{Part, files};

pub const PART: Part = Part {
    folder: "hal",
    member: false,
    what: "gauges and amplifiers: traits and drivers",
    needs: "nothing",
    with: &[],
    files: files! { "hal": },
};
