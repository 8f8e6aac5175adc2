//! The device's side links as a shared library without a panic path: on any machine, without a cross compiler. The image that
//! `specgen pil` builds proves the same for the Cortex-M.

use std::path::Path;
use std::process::Command;

/// Builds `tests/proof`; what cargo printed, if it failed.
fn link(features: &[&str]) -> Result<(), String> {
    let mut command = Command::new("cargo");
    // Nothing of the cargo that runs this test leaks in.
    for name in
        ["RUSTC", "RUSTC_WRAPPER", "RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_TARGET_DIR", "CARGO_BUILD_TARGET"]
    {
        command.env_remove(name);
    }
    let output = command
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/proof"))
        .args(["rustc", "--release", "--lib", "--locked", "--target-dir"])
        .arg(Path::new(env!("CARGO_TARGET_TMPDIR")).join("link-proof"))
        .args(features)
        .args(["--", "-Clink-arg=-Wl,-z,defs", "-Clink-arg=-lc"])
        .output()
        .map_err(|error| error.to_string())?;
    if output.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&output.stderr).into_owned()) }
}

#[test]
#[ignore = "long: two builds; the image of `specgen pil` proves the same in the test run"]
fn nothing_in_the_device_can_panic_and_the_proof_fails_where_something_can() {
    if let Err(printed) = link(&[]) {
        panic!("{printed}");
    }
    let printed = link(&["--features", "spoiled"]).unwrap_err();
    assert!(printed.contains("specgen_panic_path_remains"), "{printed}");
}
