//! Minimal Debian roots with Rust installed.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::atomic::Ordering;
use std::time::Duration;

use specgen_language::interrupt::{self, Scratch};
use specgen_toolchain::{TRIPLE, find_program};

/// Packages that Rust needs to link programs.
const C_LINKER: [&str; 2] = ["gcc", "libc6-dev"];
/// Environment variables for the connections of cargo, rustup and apt.
const PASSED_ON: [&str; 6] =
    ["CARGO_HTTP_", "CARGO_NET_", "CARGO_REGISTRIES_", "CARGO_SOURCE_", "RUSTUP_DIST_", "RUSTUP_UPDATE_"];
const PROXIES: [&str; 4] = ["http_proxy", "https_proxy", "no_proxy", "all_proxy"];
/// Path of the server certificates in Debian.
const CERTIFICATES: &str = "etc/ssl/certs/ca-certificates.crt";

/// Settings taken from this machine.
pub struct Caller {
    /// Folder of the toolchain.
    toolchain: PathBuf,
    rustup: PathBuf,
    /// Source of the distribution in its apt, and of the security updates.
    mirror: String,
    security: Option<String>,
    /// Download settings of its apt.
    acquire: String,
    environment: Vec<(String, String)>,
}

impl Caller {
    /// # Errors
    /// What is missing, and the command that installs it.
    pub fn look() -> Result<Self, String> {
        if text("id", &["-u"])? != "0" {
            return Err(
                "this makes Debian roots, which takes root: sudo -E env PATH=\"$PATH\" cargo xtask fresh".to_owned()
            );
        }
        for (program, package) in [("debootstrap", "debootstrap"), ("unshare", "util-linux"), ("git", "git")] {
            if find_program(program).is_none() {
                return Err(format!("{program} is not installed; install it with: apt-get install {package}"));
            }
        }
        let rustup = find_program("rustup").ok_or("rustup is not on PATH; the commands at rustup.rs install it")?;
        let rustup = fs::canonicalize(&rustup).map_err(|error| format!("{}: {error}", rustup.display()))?;
        let toolchain = PathBuf::from(text("rustc", &["--print", "sysroot"])?);
        let format = "$(REPO_URI) $(RELEASE) $(COMPONENT)";
        let listed = text("apt-get", &["indextargets", "--format", format, "Identifier: Packages"])?;
        let release = fs::read_to_string("/etc/os-release").unwrap_or_default();
        let codename = release.lines().find_map(|line| line.strip_prefix("VERSION_CODENAME=")).unwrap_or("stable");
        let uri_of = |wanted: &str| {
            let fields = |line: &str| line.split(' ').map(str::to_owned).collect::<Vec<String>>();
            let found = listed
                .lines()
                .map(fields)
                .find(|fields| matches!(&fields[..], [_, release, part] if release == wanted && part == "main"));
            found.map(|fields| fields[0].clone())
        };
        let mirror = uri_of(codename).filter(|_| release.lines().any(|line| line == "ID=debian"));
        let environment = std::env::vars().filter(|(name, _)| {
            let named = PASSED_ON.iter().any(|start| name.starts_with(start))
                || PROXIES.contains(&name.to_lowercase().as_str());
            named && !name.contains("TOKEN") && !name.contains("CREDENTIAL")
        });
        Ok(Self {
            toolchain,
            rustup,
            mirror: mirror
                .ok_or("apt here has no Debian to make roots from: this needs a Debian with package lists")?,
            security: uri_of(&format!("{codename}-security")),
            acquire: acquire(&text("apt-config", &["dump", "Acquire"])?),
            environment: environment.collect(),
        })
    }

    fn sources(&self, suite: &str) -> String {
        let mut lines: Vec<String> =
            ["", "-updates"].iter().map(|end| format!("deb {} {suite}{end} main\n", self.mirror)).collect();
        lines.extend(self.security.iter().map(|uri| format!("deb {uri} {suite}-security main\n")));
        lines.concat()
    }
}

/// Settings of apt about how it downloads, but not about what.
fn acquire(dump: &str) -> String {
    let is_empty = |line: &&str| line.ends_with("\"\";");
    let wanted = dump
        .lines()
        .filter(|line| !is_empty(line) && !line.contains("::IndexTargets") && !line.contains("::Changelogs"));
    wanted.map(|line| format!("{line}\n")).collect()
}

/// A root, removed when dropped.
pub struct Root {
    folder: Scratch,
}

impl Root {
    /// # Errors
    /// What failed, with what it printed.
    pub fn new(suite: &str, caller: &Caller) -> Result<Self, String> {
        let folder = Scratch::new().map_err(|error| format!("a folder for temporary files: {error}"))?;
        let root = Self { folder };
        let mut command = namespace(false, None);
        command.args(["debootstrap", "--variant=minbase", suite]).arg(root.path()).arg(&caller.mirror);
        succeed(&mut command, "debootstrap (is debian-archive-keyring up to date?)")?;
        // By default only the owner may enter a temporary folder; here it is the root folder of all users.
        succeed(Command::new("chmod").arg("755").arg(root.path()), "chmod")?;
        root.write("etc/apt/sources.list", &caller.sources(suite))?;
        root.write("etc/apt/apt.conf.d/00caller", &caller.acquire)?;
        for file in ["etc/resolv.conf", "etc/hosts", CERTIFICATES] {
            if let Ok(content) = fs::read_to_string(Path::new("/").join(file)) {
                root.write(file, &content)?;
            }
        }
        root.install(&C_LINKER)?;
        Ok(root)
    }

    fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Writes a file.
    ///
    /// # Errors
    /// What the file system says.
    pub fn write(&self, file: &str, content: &str) -> Result<(), String> {
        let path = self.path().join(file);
        let parent = path.parent().unwrap_or(self.path());
        let written = fs::create_dir_all(parent).and_then(|()| fs::write(&path, content));
        written.map_err(|error| format!("{}: {error}", path.display()))
    }

    /// Installs packages.
    ///
    /// # Errors
    /// What apt says.
    pub fn install(&self, packages: &[&str]) -> Result<(), String> {
        let words =
            format!("apt-get update -qq && apt-get install -y -qq --no-install-recommends {}", packages.join(" "));
        self.succeed(&words)
    }

    /// Installs `package` from backports, so that apt would have to remove it to install `other`.
    ///
    /// # Errors
    /// What apt says, or that it would not.
    pub fn conflict(&self, package: &str, other: &str) -> Result<(), String> {
        let sources = fs::read_to_string(self.path().join("etc/apt/sources.list")).unwrap_or_default();
        let words: Vec<&str> = sources.lines().next().unwrap_or_default().split(' ').collect();
        let [deb, mirror, suite, part] = words[..] else { return Err("sources.list has no first line".to_owned()) };
        let backports = format!("{suite}-backports");
        self.write("etc/apt/sources.list.d/backports.list", &format!("{deb} {mirror} {backports} {part}\n"))?;
        self.install(&["-t", &backports, package])?;
        let simulated = format!("! apt-get install -s --no-install-recommends --no-remove {other}");
        self.succeed(&simulated).map_err(|_| format!("{package} of {backports} is not in the way of {other} any more"))
    }

    fn succeed(&self, words: &str) -> Result<(), String> {
        let mut command = namespace(false, Some(self.path()));
        command.arg("chroot").arg(self.path()).args(["env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin"]);
        command.args(["DEBIAN_FRONTEND=noninteractive", "LC_ALL=C", "sh", "-c", words]);
        succeed(&mut command, words)
    }

    /// A user with rustup and a copy of the toolchain, without its target for microcontrollers.
    ///
    /// # Errors
    /// What could not be copied.
    pub fn home(&self, is_root: bool, caller: &Caller) -> Result<Home<'_>, String> {
        let (user, folder) = if is_root { ("root", "/root") } else { ("user", "/home/user") };
        if !is_root {
            self.succeed("useradd --create-home --shell /bin/sh user")?;
        }
        let mut environment = caller.environment.clone();
        environment.extend([
            ("HOME".to_owned(), folder.to_owned()),
            ("USER".to_owned(), user.to_owned()),
            (
                "PATH".to_owned(),
                format!("{folder}/.cargo/bin:/usr/local/bin:/usr/bin:/bin:/usr/local/sbin:/usr/sbin:/sbin"),
            ),
        ]);
        let home = Home { root: self, user, folder, environment };
        let name = caller.toolchain.file_name().unwrap_or_default();
        let to = home.outside(".rustup/toolchains").join(name);
        let bin = home.outside(".cargo/bin");
        let made = fs::create_dir_all(&to).and_then(|()| fs::create_dir_all(&bin));
        made.map_err(|error| format!("{}: {error}", to.display()))?;
        // Without the documentation, which is half of a toolchain.
        let mut copy = Command::new("sh");
        copy.args(["-c", "tar -C \"$0\" --exclude=./share/doc -cf - . | tar -C \"$1\" -xf -"])
            .arg(&caller.toolchain)
            .arg(&to);
        succeed(&mut copy, "copying the toolchain")?;
        fs::copy(&caller.rustup, bin.join("rustup")).map_err(|error| format!("rustup: {error}"))?;
        for name in ["cargo", "rustc", "rustdoc", "rustfmt", "cargo-fmt", "cargo-clippy", "clippy-driver"] {
            std::os::unix::fs::symlink("rustup", bin.join(name)).map_err(|error| format!("{name}: {error}"))?;
        }
        self.write(
            home.outside_name(".rustup/settings.toml").as_str(),
            &format!("version = \"12\"\ndefault_toolchain = \"{}\"\nprofile = \"default\"\n", name.display()),
        )?;
        if let Some(config) = cargo_configuration() {
            self.write(home.outside_name(".cargo/config.toml").as_str(), &config)?;
        }
        self.succeed(&format!("chown -R {user}: {folder}"))?;
        // It may not be installed.
        home.run(&format!("cd; rustup target remove {TRIPLE}"), false)?;
        Ok(home)
    }
}

/// The caller's settings of cargo for the registry.
fn cargo_configuration() -> Option<String> {
    let home =
        std::env::var_os("CARGO_HOME").map(PathBuf::from).or_else(|| Some(std::env::home_dir()?.join(".cargo")))?;
    ["config.toml", "config"].iter().find_map(|name| fs::read_to_string(home.join(name)).ok())
}

/// A user in a root.
pub struct Home<'a> {
    root: &'a Root,
    user: &'static str,
    /// Path inside the root.
    folder: &'static str,
    environment: Vec<(String, String)>,
}

/// Name of the clone.
const CLONE: &str = "specgen";

impl Home<'_> {
    fn outside_name(&self, name: &str) -> String {
        format!("{}/{name}", self.folder.trim_start_matches('/'))
    }

    fn outside(&self, name: &str) -> PathBuf {
        self.root.path().join(self.outside_name(name))
    }

    /// Clones the repository at HEAD.
    ///
    /// # Errors
    /// What git says.
    pub fn clone(&self, repository: &Path) -> Result<(), String> {
        let to = self.outside(CLONE);
        succeed(
            Command::new("git").args(["clone", "--quiet", "--no-hardlinks"]).arg(repository).arg(&to),
            "git clone",
        )?;
        // Cloning a linked work tree would check out the branch of another one.
        let head = text("git", &["-C", &repository.display().to_string(), "rev-parse", "HEAD"])?;
        succeed(
            Command::new("git").arg("-C").arg(&to).args(["checkout", "--quiet", "--detach", &head]),
            "git checkout",
        )?;
        self.root.succeed(&format!("chown -R {0}: {1}/{CLONE}", self.user, self.folder))
    }

    /// Runs a command in the clone, as the user types it. Returns the exit code and the complete output.
    ///
    /// # Errors
    /// It could not be run.
    pub fn run(&self, words: &str, offline: bool) -> Result<(i32, String), String> {
        let mut command = namespace(offline, Some(self.root.path()));
        command.arg("chroot").arg(format!("--userspec={0}:{0}", self.user)).arg(self.root.path()).args(["env", "-i"]);
        command.args(self.environment.iter().map(|(name, value)| format!("{name}={value}")));
        command.args(["sh", "-c", &format!("cd {}/{CLONE} 2>/dev/null; {words}", self.folder)]);
        let (status, printed) = watched(&mut command)?;
        Ok((status.code().unwrap_or(-1), printed))
    }

    /// The same as [`Home::run`] for a command that must succeed.
    ///
    /// # Errors
    /// It failed.
    pub fn expect_success(&self, words: &str) -> Result<(), String> {
        match self.run(words, false)? {
            (0, _) => Ok(()),
            (code, printed) => Err(format!("{words} ends with {code}:\n{printed}")),
        }
    }

    /// # Errors
    /// The file is not in the clone.
    pub fn expect_file(&self, name: &str) -> Result<(), String> {
        let path = self.outside(CLONE).join(name);
        if path.is_file() { Ok(()) } else { Err(format!("{name} was not written")) }
    }
}

/// A command that runs in its own mount and process namespaces: no mount remains in a root, and nothing of this machine can be
/// removed through one.
fn namespace(offline: bool, root: Option<&Path>) -> Command {
    let mut command = Command::new("unshare");
    command.args(["--mount", "--pid", "--fork", "--kill-child"]);
    if offline {
        command.arg("--net");
    }
    if let Some(root) = root {
        // Tests need terminals and shared memory; they are those of this machine.
        let mounts = "mount -t proc proc \"$0/proc\" && mount --rbind /dev \"$0/dev\" && exec \"$@\"";
        command.args(["sh", "-c", mounts]).arg(root);
    }
    command
}

fn succeed(command: &mut Command, what: &str) -> Result<(), String> {
    let (status, printed) = watched(command)?;
    if status.success() {
        return Ok(());
    }
    let lines: Vec<&str> = printed.lines().collect();
    Err(format!("{what}: {status}\n{}", lines[lines.len().saturating_sub(20)..].join("\n")))
}

/// Runs a command until it ends or Ctrl-C. Returns its status and complete output. No process of a [`namespace`] survives it, so that
/// its root can be removed.
fn watched(command: &mut Command) -> Result<(ExitStatus, String), String> {
    let program = command.get_program().display().to_string();
    let failed = |error: std::io::Error| format!("{program}: {error}");
    let scratch = Scratch::new().map_err(failed)?;
    let path = scratch.path().join("printed");
    let file = fs::File::create(&path).map_err(failed)?;
    let second = file.try_clone().map_err(failed)?;
    let mut child = command.stdin(Stdio::null()).stdout(file).stderr(second).spawn().map_err(failed)?;
    loop {
        if let Some(status) = child.try_wait().map_err(failed)? {
            let printed = fs::read(&path).map_err(failed)?;
            return Ok((status, String::from_utf8_lossy(&printed).into_owned()));
        }
        if interrupt::heed().load(Ordering::SeqCst) {
            child.kill().and_then(|()| child.wait()).map_err(failed)?;
            return Err("interrupted".to_owned());
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Output of a program.
fn text(program: &str, words: &[&str]) -> Result<String, String> {
    let output = Command::new(program).args(words).stdin(Stdio::null()).output();
    let output = output.map_err(|error| format!("{program}: {error}"))?;
    if !output.status.success() {
        return Err(format!("{program} {} ends with {}", words.join(" "), output.status));
    }
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_of_downloads_are_handed_on_and_nothing_else() {
        let dump = "Acquire \"\";\nAcquire::Check-Date \"false\";\nAcquire::IndexTargets::deb::a \"b\";\n";
        assert_eq!(acquire(dump), "Acquire::Check-Date \"false\";\n");
    }
}
