//! The controller on a real-time Linux PC.

use super::{Part, files};

pub const PART: Part = Part {
    folder: "rt-pc",
    member: false,
    what: "the controller on a real-time Linux PC",
    needs: "a host toolchain, Linux",
    with: &["hal", "rt"],
    files: files! { "rt-pc":
        "Cargo.lock",
        "Cargo.toml",
        "src/control.rs",
        "src/devices.rs",
        "src/devices/comedi.rs",
        "src/devices/comedi/library.rs",
        "src/devices/simulated.rs",
        "src/main.rs",
        "src/operator.rs",
        "src/options.rs",
        "src/record.rs",
        "src/service.rs",
        "src/service/socket.rs",
        "src/summary.rs",
        "src/words.rs",
    },
};
