//! The controller on a real-time Linux PC.

use super::{Part, files};

pub const PART: Part = Part {
    folder: "rt-pc",
    member: false,
    what: "the controller on a real-time Linux PC",
    needs: "a host toolchain, Linux",
    with: &["hal", "link"],
    files: files! { "rt-pc": },
};
