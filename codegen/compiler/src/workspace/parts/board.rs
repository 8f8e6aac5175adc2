//! The tick on real converters.

use super::{Part, files};

pub static PART: Part = Part {
    folder: "board",
    member: false,
    what: "what all boards have in common: one tick on real converters, what is said over the link",
    needs: "nothing",
    with: &["hal", "link"],
    files: files! { "board":
        "Cargo.toml",
        "src/catch_up.rs",
        "src/cycle.rs",
        "src/desk.rs",
        "src/download.rs",
        "src/exchange.rs",
        "src/gather.rs",
        "src/health.rs",
        "src/lib.rs",
        "src/learn.rs",
        "src/recording.rs",
        "src/report.rs",
        "src/samples.rs",
        "src/schedule.rs",
        "src/stepper.rs",
        "src/words.rs",
    },
};
