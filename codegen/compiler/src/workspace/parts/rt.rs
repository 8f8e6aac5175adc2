//! Real-time Linux without a controller.

use super::{Part, files};

pub static PART: Part = Part {
    folder: "rt",
    member: false,
    what: "what a control loop needs of Linux: clock, rights, book of late ticks, shared memory",
    needs: "Linux",
    with: &[],
    files: files! { "rt":
        "Cargo.toml",
        "src/account.rs",
        "src/allocation.rs",
        "src/clock.rs",
        "src/exchange.rs",
        "src/exchange/mapping.rs",
        "src/exchange/tests.rs",
        "src/exchange/words.rs",
        "src/histogram.rs",
        "src/lib.rs",
        "src/scheduling.rs",
        "src/signals.rs",
    },
};
