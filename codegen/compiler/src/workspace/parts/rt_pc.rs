//! The controller on a real-time Linux PC.

use super::{Part, files};

pub static PART: Part = Part {
    folder: "rt-pc",
    member: false,
    what: "the controller on a real-time Linux PC",
    needs: "a host toolchain, Linux",
    with: &["hal", "link", "rt"],
    files: files! { "rt-pc":
        "Cargo.lock",
        "Cargo.toml",
        "src/capture.rs",
        "src/console.rs",
        "src/control.rs",
        "src/control/keeper.rs",
        "src/control/setpoints.rs",
        "src/devices.rs",
        "src/devices/comedi.rs",
        "src/devices/comedi/library.rs",
        "src/devices/simulated.rs",
        "src/handover.rs",
        "src/main.rs",
        "src/operator.rs",
        "src/options.rs",
        "src/passes.rs",
        "src/outputs.rs",
        "src/record.rs",
        "src/samples.rs",
        "src/service.rs",
        "src/service/clients.rs",
        "src/service/desk.rs",
        "src/service/link.rs",
        "src/service/listener.rs",
        "src/summary.rs",
        "src/words.rs",
    },
};
