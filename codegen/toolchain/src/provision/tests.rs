//! The order of methods, tested with fake programs: no test here uses a network or installs anything.

use super::*;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

const QEMU: &str = "case \"$1\" in\n--version) echo 'QEMU 9';;\n-machine) echo 'mps2-an500  a machine';;\nesac";
/// An emulator whose library is missing.
const BROKEN_QEMU: &str = "exit 127";
const ROOT: &str = "echo 0";
const USER: &str = "echo 1000";
const OFFLINE: &str = "case \"$*\" in *update*) echo \"W: Temporary failure resolving 'x'\" >&2; exit 0;; esac\n\
                       echo 'E: Unable to locate package' >&2; exit 100";

/// A machine with only these programs.
struct Machine {
    folder: tempfile::TempDir,
    messages: Vec<String>,
    cache: bool,
}

impl Machine {
    fn with(programs: &[(&str, &str)]) -> Self {
        let machine = Self { folder: tempfile::tempdir().unwrap(), messages: Vec::new(), cache: true };
        fs::create_dir(machine.path("bin")).unwrap();
        for (name, script) in programs {
            machine.program(name, script);
        }
        machine
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn program(&self, name: &str, script: &str) {
        let file = self.path("bin").join(name);
        fs::write(&file, format!("#!/bin/sh\n{script}\n")).unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
    }

    fn places(&self) -> Places {
        Places { programs: vec![self.path("bin")], unpacked: self.cache.then(|| self.path("tools")) }
    }

    fn emulator(&mut self) -> Result<Emulator, TargetError> {
        emulator(&self.places(), &mut |line| self.messages.push(line.to_owned()))
    }

    fn compiler(&mut self) -> Result<Toolchain, TargetError> {
        compiler(&self.places(), &mut |line| self.messages.push(line.to_owned()))
    }

    /// A fake apt-get that installs by writing an emulator, fails with a conflict if `conflict`, and "downloads" one package.
    fn apt(&self, conflict: bool) {
        let bin = self.path("bin");
        let installs = if conflict {
            "printf 'The following packages will be REMOVED:\\n  qemu-utils\\n'; echo 'E: refused' >&2; exit 100"
                .to_owned()
        } else {
            format!("cp {0}/emulator {0}/qemu-system-arm", bin.display())
        };
        self.program("emulator", QEMU);
        self.program(
            "apt-get",
            &format!(
                "echo \"$*\" >> {}\nfor word; do case \"$word\" in -oDir::Cache=*) cache=${{word#*=}};; esac; done\n\
                 case \"$*\" in\n*update*) ;;\n*--download-only*) touch $cache/archives/qemu_1.deb $cache/archives/libc6_2.deb;;\n\
                 *--no-remove*) {installs};;\nesac",
                self.path("calls").display()
            ),
        );
        self.program(
            "dpkg-deb",
            &format!(
                "case \"$2\" in *libc6*) exit 1;; esac\nmkdir -p $3/usr/bin $3/usr/lib/any-linux-gnu $3/usr/share/doc\n\
                 cp {}/emulator $3/usr/bin/qemu-system-arm",
                bin.display()
            ),
        );
    }

    fn calls(&self) -> String {
        fs::read_to_string(self.path("calls")).unwrap_or_default()
    }

    fn left(&self) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(self.path("tools"))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }
}

fn is_below(path: &Path, folder: &Path) -> bool {
    path.starts_with(folder)
}

#[test]
fn a_working_tool_is_used_and_nothing_is_run() {
    let mut machine = Machine::with(&[("qemu-system-arm", QEMU), ("id", ROOT)]);
    machine.apt(false);
    assert!(is_below(&machine.emulator().unwrap().program, &machine.path("bin")));
    assert_eq!((machine.calls(), machine.messages.len()), (String::new(), 0));
}

#[test]
fn root_installs_and_removes_nothing() {
    let mut machine = Machine::with(&[("id", ROOT)]);
    machine.apt(false);
    assert!(is_below(&machine.emulator().unwrap().program, &machine.path("bin")));
    assert!(machine.calls().contains("--no-install-recommends --no-remove qemu-system-arm"), "{}", machine.calls());
    assert!(!machine.path("tools").exists());
}

#[test]
fn sudo_is_used_only_if_it_requires_no_password() {
    let sudo = "shift; exec \"$@\"";
    let mut machine = Machine::with(&[("id", USER), ("sudo", sudo)]);
    machine.apt(false);
    assert!(is_below(&machine.emulator().unwrap().program, &machine.path("bin")));
    assert!(
        machine.messages.iter().any(|line| line == "running: sudo apt-get install qemu-system-arm"),
        "{:?}",
        machine.messages
    );

    let mut machine = Machine::with(&[("id", USER), ("sudo", "exit 1")]);
    machine.apt(false);
    assert!(is_below(&machine.emulator().unwrap().program, &machine.path("tools")));
    assert!(machine.messages.contains(&"apt-get install: not root, and sudo requires a password".to_owned()));
    assert!(!machine.calls().contains("--no-remove"));
}

#[test]
fn after_a_conflict_packages_are_unpacked_and_found_by_the_next_run() {
    let mut machine = Machine::with(&[("id", ROOT)]);
    machine.apt(true);
    let found = machine.emulator().unwrap();
    assert!(is_below(&found.program, &machine.path("tools/qemu-system-arm")));
    assert_eq!(found.libraries, [machine.path("tools/qemu-system-arm/usr/lib/any-linux-gnu")]);
    assert!(machine.messages.contains(&"apt-get install: apt-get would have to remove qemu-utils".to_owned()));
    // No partial results, archives or documentation.
    assert_eq!(machine.left(), ["lock", "qemu-system-arm"]);
    assert!(!machine.path("tools/qemu-system-arm/usr/share/doc").exists());
    let calls = machine.calls();
    assert!(is_below(&Emulator::find_in(&machine.places()).unwrap().program, &machine.path("tools")));
    machine.emulator().unwrap();
    assert_eq!(machine.calls(), calls, "unpacked twice");
}

#[test]
fn a_broken_tool_is_not_used_and_is_replaced() {
    let mut machine = Machine::with(&[("id", USER), ("qemu-system-arm", BROKEN_QEMU)]);
    machine.apt(false);
    let unpacked = machine.path("tools/qemu-system-arm/usr/bin");
    fs::create_dir_all(&unpacked).unwrap();
    fs::copy(machine.path("bin/qemu-system-arm"), unpacked.join("qemu-system-arm")).unwrap();
    let error = Emulator::find_in(&machine.places()).unwrap_err().to_string();
    assert!(error.contains("does not run or does not support mps2-an500"), "{error}");
    assert!(is_below(&machine.emulator().unwrap().program, &unpacked));
    assert!(machine.messages.contains(&"apt-get install: not root, and sudo was not found".to_owned()));
    assert_eq!(machine.left(), ["lock", "qemu-system-arm"]);
}

#[test]
fn a_missing_network_is_reported_once_and_nothing_is_left() {
    for id in [ROOT, USER] {
        let mut machine = Machine::with(&[("id", id), ("apt-get", OFFLINE), ("dpkg-deb", "exit 1")]);
        let error = machine.emulator().unwrap_err();
        assert!(error.is_of_a_tool());
        let text = error.to_string();
        assert_eq!(text.matches("apt has no network connection").count(), 1, "{text}");
        assert_eq!(text.lines().count(), 1, "{text}");
        assert!(id == ROOT || machine.left() == ["lock"]);
    }
}

#[test]
fn if_nothing_works_every_method_is_reported() {
    let mut machine = Machine::with(&[("id", USER)]);
    machine.cache = false;
    let text = machine.emulator().unwrap_err().to_string();
    for words in ["apt-get was not found", "no cache folder", "XDG_CACHE_HOME", "install it manually: "] {
        assert!(text.contains(words), "no `{words}` in: {text}");
    }
    let text = machine.compiler().unwrap_err().to_string();
    assert!(text.contains("rustup was not found") && text.contains("install it manually: rustup target add"), "{text}");
}

#[test]
fn rustup_comes_before_the_distribution() {
    let mut machine = Machine::with(&[("id", ROOT), ("cargo", ""), ("apt-get", OFFLINE)]);
    let sysroot = machine.path("sysroot");
    let library = sysroot.join("lib/rustlib/thumbv7em-none-eabihf/lib");
    let linker = sysroot.join("lib/rustlib/host/bin");
    fs::create_dir_all(&linker).unwrap();
    fs::write(linker.join("rust-lld"), "").unwrap();
    machine.program(
        "rustc",
        &format!(
            "case \"$2\" in\nsysroot) echo {};;\nhost-tuple) echo host;;\n*) echo rustc;;\nesac",
            sysroot.display()
        ),
    );
    machine.program("rustup", "echo 'error: could not download' >&2; exit 1");
    let text = machine.compiler().unwrap_err().to_string();
    assert!(
        text.contains("rustup target add: could not download; apt-get install: apt has no network connection"),
        "{text}"
    );
    machine.program("rustup", &format!("mkdir -p {}", library.display()));
    machine.messages.clear();
    assert!(machine.compiler().is_ok());
    assert!(machine.messages.iter().all(|line| !line.contains("apt-get install:")), "{:?}", machine.messages);
}
