//! The protocol between controller and host.

use super::{Part, files};

pub static PART: Part = Part {
    folder: "link",
    member: false,
    what: "the protocol between a board and the host",
    needs: "nothing",
    with: &[],
    files: files! { "link":
        "Cargo.toml",
        "src/bytes.rs",
        "src/client.rs",
        "src/counters.rs",
        "src/endpoint.rs",
        "src/frame.rs",
        "src/lib.rs",
        "src/lockstep.rs",
        "src/message.rs",
        "src/receiver.rs",
        "src/reset_cause.rs",
        "src/samples.rs",
        "src/silence.rs",
    },
};
