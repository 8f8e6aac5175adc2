//! Traits of gauges and amplifiers, and drivers.

use super::{Part, files};

pub static PART: Part = Part {
    folder: "hal",
    member: false,
    what: "gauges and amplifiers: traits and drivers",
    needs: "nothing",
    with: &[],
    files: files! { "hal":
        "Cargo.toml",
        "src/ad5686r.rs",
        "src/ad7606.rs",
        "src/edge.rs",
        "src/fault.rs",
        "src/lib.rs",
        "src/lines.rs",
    },
};
