//! Builds a release: sources, the command for two kinds of Linux, the Python package, the book, and the digests of all.
//!
//! Times are those of the commit, binaries contain no paths of this computer, and archives are sorted by name. So two runs of one
//! commit in one folder give the same bytes with the same compiler. This was verified for the glibc command, with all of specgen's own
//! packages compiled again. In another folder its objects are the same (compared over 122 packages); those of the wheel may differ,
//! because cargo uses absolute paths for packages outside of its workspace.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use crate::run::{Outcome, Report, cargo};
use crate::{changelog, sha256, steps, wheel};

/// Cargo's target folder for releases, whose flags differ from those of daily work.
const MADE: &str = "target/released";
/// Targets of the command: Linux with glibc 2.34 or newer; any Linux, but without commands that load a library.
const TARGETS: [&str; 2] = ["x86_64-unknown-linux-gnu", "x86_64-unknown-linux-musl"];
/// Other files in the archives of the command.
const BESIDE: [&str; 4] = ["CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT", "README.md"];
/// Manifests with the version of the product, and its table.
const VERSIONS: [(&str, &str); 3] = [
    ("Cargo.toml", "[workspace.package]"),
    ("codegen/python/Cargo.toml", "[package]"),
    ("codegen/python/pyproject.toml", "[project]"),
];
/// The spec of `specgen new mine`.
const NEW_SPEC: &str = "mine/platform.toml";
/// File of the digests.
const SUMS: &str = "SHA256SUMS";

/// `cargo xtask release VERSION [-o DIR]`; none if the arguments are invalid.
pub fn command(root: &Path, arguments: &[&str]) -> Option<ExitCode> {
    let (version, output) = match *arguments {
        [version] if !version.starts_with('-') => (version, root.join("target/dist")),
        [version, "-o", output] if !version.starts_with('-') => (version, PathBuf::from(output)),
        _ => return None,
    };
    Some(release(root, version, &output))
}

fn release(root: &Path, version: &str, output: &Path) -> ExitCode {
    let mut report = Report::new(9);
    let mut commit = Commit::default();
    report.step("tree, versions, changelog", || {
        outcome(ready(root, version).and_then(|found| {
            commit = found;
            fs::create_dir_all(output).map_err(|error| format!("{}: {error}", output.display()))
        }))
    });
    if report.has_failed() {
        return report.finish();
    }
    let name = format!("specgen-{version}");
    report.step("sources", || outcome(sources(root, &name, output)));
    let builds = Builds { root, commit: &commit };
    for target in TARGETS {
        report.step(target, || {
            outcome(builds.command(target).and_then(|built| {
                let beside = BESIDE.map(|file| root.join(file));
                let files: Vec<&Path> = beside.iter().map(PathBuf::as_path).chain([built.as_path()]).collect();
                pack(&files, &format!("{name}-{target}"), output, &commit.time)
            }))
        });
    }
    report.step("Python package", || outcome(builds.wheel(output)));
    report.step("book", || {
        let folder = output.join(format!("{name}-book"));
        match steps::maintained(root, &["book", &folder.to_string_lossy()]) {
            Outcome::Passed => outcome(pack_folder(&format!("{name}-book"), output, &commit.time)),
            other => other,
        }
    });
    report.step("test in an empty folder", || outcome(tried(root, &name, output)));
    report.step("cargo install of the sources", || outcome(builds.installed(&name, output)));
    report.step("digests", || outcome(digests(output, &name)));
    report.finish()
}

fn outcome(result: Result<(), String>) -> Outcome {
    result.map_or_else(Outcome::Failed, |()| Outcome::Passed)
}

/// The released commit.
#[derive(Default)]
struct Commit {
    /// Seconds since 1970.
    time: String,
}

/// Checks that the tree is committed, and that the version is the same everywhere.
fn ready(root: &Path, version: &str) -> Result<Commit, String> {
    let changed = printed(Command::new("git").current_dir(root).args(["status", "--porcelain"]))?;
    if !changed.is_empty() {
        return Err(format!("commit or remove these first:\n{changed}"));
    }
    for (file, table) in VERSIONS {
        let text = read(&root.join(file))?;
        let found = version_in(&text, table).unwrap_or("none");
        if found != version {
            return Err(format!("{file} has version {found}: write \"{version}\" below {table} and commit it"));
        }
    }
    changelog::is_released(root, version)?;
    let time = printed(Command::new("git").current_dir(root).args(["log", "-1", "--format=%ct"]))?;
    Ok(Commit { time })
}

/// `version = "…"` in a table of a TOML file.
fn version_in<'a>(text: &'a str, table: &str) -> Option<&'a str> {
    let mut lines = text.lines().skip_while(|line| line.trim() != table).skip(1);
    let line = lines.by_ref().take_while(|line| !line.starts_with('[')).find(|line| line.starts_with("version"))?;
    line.split('"').nth(1)
}

/// All files of the commit, for `cargo install --path …/codegen/cli --locked`.
fn sources(root: &Path, name: &str, output: &Path) -> Result<(), String> {
    let archive = output.join(format!("{name}.tar"));
    let mut git = Command::new("git");
    git.current_dir(root)
        .args(["archive", "--format=tar", &format!("--prefix={name}/"), "-o"])
        .arg(&archive)
        .arg("HEAD");
    done(&mut git)?;
    zip(&archive)
}

struct Builds<'a> {
    root: &'a Path,
    commit: &'a Commit,
}

impl Builds<'_> {
    /// Sets up a build without paths of this computer.
    fn environment(&self, command: &mut Command) {
        let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
        let home = home.or_else(|| Some(std::env::home_dir()?.join(".cargo"))).unwrap_or_default();
        let flags = [(home.join("registry/src"), "crates"), (self.root.to_owned(), "specgen")]
            .map(|(from, to)| format!("--remap-path-prefix={}={to}", from.display()));
        command.env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}"));
        command.env("CARGO_TARGET_DIR", self.root.join(MADE)).env("SOURCE_DATE_EPOCH", &self.commit.time);
    }

    fn command(&self, target: &str) -> Result<PathBuf, String> {
        let installed = printed(Command::new("rustup").args(["target", "list", "--installed"])).unwrap_or_default();
        if !installed.lines().any(|line| line == target) {
            done(Command::new("rustup").args(["target", "add", target]))?;
        }
        let mut build = cargo(self.root, &["build", "--release", "--locked", "--bin", "specgen", "--target", target]);
        self.environment(&mut build);
        done(&mut build)?;
        Ok(self.root.join(MADE).join(target).join("release/specgen"))
    }

    fn wheel(&self, output: &Path) -> Result<(), String> {
        let tools = self.root.join(wheel::TOOLS);
        let made = self.root.join(MADE).join("wheel");
        let list = self.root.join(wheel::FOLDER).join("tools.txt");
        match wheel::environment(&tools, &[OsStr::new("-r"), list.as_ref()]) {
            Outcome::Failed(why) => return Err(why),
            Outcome::Passed | Outcome::Skipped(_) => {}
        }
        if let Outcome::Failed(why) = wheel::build(self.root, &tools, &made, |maturin| {
            maturin.args(["--target", TARGETS[0]]);
            self.environment(maturin);
        }) {
            return Err(why);
        }
        let wheel = wheel::wheel(&made)?;
        let place = output.join(wheel.file_name().unwrap_or_default());
        fs::copy(&wheel, &place).map(drop).map_err(|error| format!("{}: {error}", place.display()))
    }

    /// Installs the command as a user with only the sources does.
    fn installed(&self, name: &str, output: &Path) -> Result<(), String> {
        let folder = self.root.join(MADE).join("tried");
        done(Command::new("tar").current_dir(&folder).arg("-xzf").arg(output.join(format!("{name}.tar.gz"))))?;
        let sources = folder.join(name).join("codegen/cli");
        let place = folder.join("installed");
        // It reuses third-party packages from the build of the command.
        let mut install = cargo(&folder, &["install", "--quiet", "--locked", "--target", TARGETS[0], "--path"]);
        install.arg(sources).arg("--root").arg(&place);
        self.environment(&mut install);
        done(&mut install)?;
        let says = printed(Command::new(place.join("bin/specgen")).arg("--version"))?;
        let version = name.trim_start_matches("specgen-");
        if says.contains(version) { Ok(()) } else { Err(format!("installed, specgen --version says {says}")) }
    }
}

/// Packs files in a folder `name` as `name.tar.gz`. The same files and time (s since 1970) give the same bytes.
fn pack(files: &[&Path], name: &str, output: &Path, time: &str) -> Result<(), String> {
    let failed = |path: &Path| {
        let shown = path.display().to_string();
        move |error: std::io::Error| format!("{shown}: {error}")
    };
    let folder = output.join(name);
    fs::create_dir_all(&folder).map_err(failed(&folder))?;
    for file in files {
        fs::copy(file, folder.join(file.file_name().unwrap_or_default())).map_err(failed(file))?;
    }
    pack_folder(name, output, time)
}

/// Replaces a folder in `output` with `name.tar.gz`.
fn pack_folder(name: &str, output: &Path, time: &str) -> Result<(), String> {
    let folder = output.join(name);
    let archive = output.join(format!("{name}.tar"));
    let mut tar = Command::new("tar");
    tar.current_dir(output).args(["--sort=name", "--owner=0", "--group=0", "--numeric-owner", "--mode=u=rwX,go=rX"]);
    tar.arg(format!("--mtime=@{time}")).args(["--format=ustar", "-cf"]).arg(archive.file_name().unwrap_or_default());
    let packed = done(tar.arg(name));
    fs::remove_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    packed?;
    zip(&archive)
}

/// Compresses an archive, without name and time.
fn zip(archive: &Path) -> Result<(), String> {
    done(Command::new("gzip").args(["-9", "-n", "-f"]).arg(archive))
}

/// Tests each command in an empty folder: it prints its version, creates a spec and checks it. The wheel compiles that spec.
fn tried(root: &Path, name: &str, output: &Path) -> Result<(), String> {
    let version = name.trim_start_matches("specgen-");
    let folder = root.join(MADE).join("tried");
    match fs::remove_dir_all(&folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            return Err(format!("{}: {error}", folder.display()));
        }
        _ => fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?,
    }
    for target in TARGETS {
        let archive = format!("{name}-{target}");
        done(Command::new("tar").current_dir(&folder).arg("-xzf").arg(output.join(format!("{archive}.tar.gz"))))?;
        let place = folder.join(&archive);
        let command = |words: &[&str]| {
            let mut command = Command::new(place.join("specgen"));
            command.current_dir(&place).env_clear().args(words);
            command
        };
        let says = printed(&mut command(&["--version"]))?;
        if !says.contains(version) {
            return Err(format!("{archive}/specgen --version says {says}"));
        }
        done(command(&["check", "--help"]).stdout(Stdio::null()))?;
        done(&mut command(&["new", "mine", "--like", "reference"]))?;
        done(&mut command(&["check", NEW_SPEC]))?;
        if target != TARGETS[0] {
            // Commands that load a library must be refused, with a fix.
            let refused = command(&["sim", NEW_SPEC]).output().map_err(|error| format!("{archive}: {error}"))?;
            let says = String::from_utf8_lossy(&refused.stderr);
            if refused.status.code() != Some(3) || !says.contains(TARGETS[0]) {
                return Err(format!("{archive}/specgen sim: {}: {says}", refused.status));
            }
        }
    }
    let fresh = folder.join("fresh");
    let wheel =
        output.join(made_of(output, name)?.into_iter().find(|file| file.ends_with(".whl")).ok_or("there is no wheel")?);
    if let Outcome::Failed(why) = wheel::environment(&fresh, &[wheel.as_ref()]) {
        return Err(why);
    }
    let script = format!("import specgen; print(specgen.compile('{NEW_SPEC}').digest)");
    let place = folder.join(format!("{name}-{}", TARGETS[0]));
    done(Command::new(fresh.join("bin/python")).current_dir(place).args(["-c", &script]))
}

/// Names of the files of this version in the folder, which may contain other versions.
fn made_of(output: &Path, name: &str) -> Result<Vec<String>, String> {
    let read = fs::read_dir(output).map_err(|error| format!("{}: {error}", output.display()))?;
    let mut files: Vec<String> = read.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect();
    let of_it = |file: &String| file.strip_prefix(name).is_some_and(|rest| rest.starts_with(['.', '-']));
    files.retain(of_it);
    files.sort();
    Ok(files)
}

/// Writes the digests, and prints the list of files.
fn digests(output: &Path, name: &str) -> Result<(), String> {
    let files = made_of(output, name)?;
    let mut sums = String::new();
    println!("{:58}{:>9}  SHA-256", "", "bytes");
    for file in &files {
        let bytes = fs::read(output.join(file)).map_err(|error| format!("{file}: {error}"))?;
        let digest = sha256(&bytes);
        println!("{file:58}{:>9}  {}…", bytes.len(), &digest[..8]);
        sums += &format!("{digest}  {file}\n");
    }
    println!("in {}; whole digests in {SUMS}", output.display());
    fs::write(output.join(SUMS), sums).map_err(|error| format!("{SUMS}: {error}"))
}

fn read(path: &Path) -> Result<String, String> {
    fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
}

fn done(command: &mut Command) -> Result<(), String> {
    let shown = command.get_program().display().to_string();
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{shown}: {status}; see above")),
        Err(error) => Err(format!("{shown}: {error}")),
    }
}

/// Output of a command, without the trailing newline.
fn printed(command: &mut Command) -> Result<String, String> {
    let shown = command.get_program().display().to_string();
    let output = command.output().map_err(|error| format!("{shown}: {error}"))?;
    if !output.status.success() {
        return Err(format!("{shown}: {}", String::from_utf8_lossy(&output.stderr)));
    }
    Ok(String::from_utf8_lossy(&output.stdout).trim_end().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_is_that_of_its_table() {
        let text = "[package]\nname = \"a\"\nversion = \"1.2.3\"\n[dependencies]\nversion = \"9\"\n";
        assert_eq!(version_in(text, "[package]"), Some("1.2.3"));
        assert_eq!(version_in(text, "[dependencies]"), Some("9"));
        assert_eq!(version_in("[package]\nname = \"a\"\n[x]\nversion = \"9\"\n", "[package]"), None);
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        for (file, table) in VERSIONS {
            let found = version_in(&read(&root.join(file)).unwrap(), table).map(str::to_owned);
            assert_eq!(found.as_deref(), Some(env!("CARGO_PKG_VERSION")), "{file}");
        }
    }

    #[test]
    fn an_archive_of_the_same_files_has_the_same_bytes_and_their_licences() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let made = |seconds: u64| {
            let (output, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
            let program = other.path().join("specgen");
            fs::write(&program, "a program").unwrap();
            let time = std::time::UNIX_EPOCH + std::time::Duration::from_secs(seconds);
            fs::File::open(&program).unwrap().set_modified(time).unwrap();
            let beside = BESIDE.map(|file| root.join(file));
            let files: Vec<&Path> = beside.iter().map(PathBuf::as_path).chain([program.as_path()]).collect();
            pack(&files, "specgen-1-x", output.path(), "1700000000").unwrap();
            let listed =
                printed(Command::new("tar").arg("-tzf").arg(output.path().join("specgen-1-x.tar.gz"))).unwrap();
            (fs::read(output.path().join("specgen-1-x.tar.gz")).unwrap(), listed)
        };
        let (first, listed) = made(1_600_000_000);
        assert!(first == made(1_650_000_000).0);
        assert!(
            listed.contains("/LICENSE-MIT") && listed.contains("/LICENSE-APACHE") && listed.contains("/specgen"),
            "{listed}"
        );
    }
}
