//! The protocol between controller and host.

use super::{Part, files};

pub const PART: Part = Part {
    folder: "link",
    member: false,
    what: "the protocol between a board and the host",
    needs: "nothing",
    with: &[],
    files: files! { "link": },
};
