//! Devices and tools that are available.

use std::path::Path;

use super::Grade::Warning;
use super::{Files, Finding};
use specgen_toolchain as target;

/// Devices in `/dev`: prefix of the name, subject, message if missing, fix if not permitted.
const DEVICES: [(&str, &str, &str, &str); 3] = [
    (
        "comedi",
        "acquisition card",
        "no /dev/comedi*: only simulated machines; load the card's comedi module (NI PCI-6229: `modprobe ni_pcimio`)",
        "join group `iocard`: `usermod -aG iocard $USER`, then log in again",
    ),
    (
        "ttyACM",
        "serial line",
        "no /dev/ttyACM*: no board at the USB port",
        "join group `dialout`: `usermod -aG dialout $USER`, then log in again",
    ),
    (
        "ttyUSB",
        "serial adapter",
        "no /dev/ttyUSB*: no serial adapter at the USB port",
        "join group `dialout`: `usermod -aG dialout $USER`, then log in again",
    ),
];

/// Devices.
#[must_use]
pub fn devices(files: &Files) -> Vec<Finding> {
    DEVICES
        .iter()
        .map(|(beginning, subject, missing, right)| device(files, beginning, subject, missing, right))
        .collect()
}

fn device(files: &Files, beginning: &str, subject: &'static str, missing: &str, right: &str) -> Finding {
    let names = files.names("/dev", beginning);
    let closed: Vec<&str> =
        names.iter().filter(|name| !may_use(&files.path(&format!("/dev/{name}")))).map(String::as_str).collect();
    if names.is_empty() {
        let (found, fix) = missing.split_once(": ").unwrap_or((missing, missing));
        Finding::of(subject, Warning, found, fix)
    } else if closed.is_empty() {
        Finding::good(subject, names.join(", "))
    } else {
        Finding::of(subject, Warning, format!("this user has no permission for {}", closed.join(", ")), right)
    }
}

/// Whether a device can be opened for reading and writing.
fn may_use(path: &Path) -> bool {
    std::fs::OpenOptions::new().read(true).write(true).open(path).is_ok()
}

/// Tools, each with the command that installs it.
#[must_use]
pub fn tools() -> Vec<Finding> {
    let tool = |subject, program: &str, fix: &str| match target::find_program(program) {
        Some(path) => Finding::good(subject, path.display().to_string()),
        None => Finding::of(subject, Warning, format!("no {program} on PATH"), fix),
    };
    let compiler = match target::available() {
        Ok(_) => Finding::good("cross compiler", "installed, with emulator"),
        Err(error) => Finding::of("cross compiler", Warning, error.to_string(), "specgen SPEC --setup"),
    };
    vec![
        tool("cargo", "cargo", "install Rust from rustup.rs"),
        compiler,
        tool("probe", "probe-rs", "`cargo install probe-rs-tools`, for flashing boards"),
    ]
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    use super::super::Grade::Good;
    use super::*;

    #[test]
    fn devices_are_there_missing_or_closed() {
        let root = tempfile::tempdir().unwrap();
        fs::create_dir(root.path().join("dev")).unwrap();
        let files = Files::below(root.path());
        let found = devices(&files);
        assert!(found.iter().all(|finding| finding.grade == Warning && finding.fix.is_some()));
        assert!(found[0].fix.as_deref().unwrap().contains("ni_pcimio"), "{:?}", found[0]);
        fs::write(root.path().join("dev/comedi0"), "").unwrap();
        assert_eq!(devices(&files)[0], Finding::good("acquisition card", "comedi0"));
        // Root may open any file, so use a folder, which nobody can open for writing.
        let line = root.path().join("dev/ttyACM0");
        fs::create_dir(&line).unwrap();
        fs::set_permissions(&line, fs::Permissions::from_mode(0o500)).unwrap();
        let closed = &devices(&files)[1];
        assert!(closed.found.contains("ttyACM0") && closed.fix.as_deref().unwrap().contains("dialout"), "{closed:?}");
        assert!(!tools().is_empty() && tools().iter().all(|finding| (finding.grade == Good) == finding.fix.is_none()));
    }
}
