//! Installs Debian packages as root, or downloads them with a private apt state.

use super::places::Places;
use super::process::{self, first_line};
use specgen_language::interrupt::Scratch;
use std::ffi::OsString;
use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Time limit of one call: enough for a hundred megabytes on a slow connection.
const LIMIT: Duration = Duration::from_secs(1800);
/// For packages that would ask questions.
const NO_QUESTIONS: &str = "DEBIAN_FRONTEND=noninteractive";
/// The parser below reads English messages only.
const PLAIN: &str = "LC_ALL=C";

/// Why a method of getting a tool failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refusal {
    /// apt reaches no server, so further calls are pointless.
    NoNetwork,
    /// Any other reason, as text.
    Other(String),
}

impl Refusal {
    /// A refusal with this text.
    pub fn other(text: impl Into<String>) -> Self {
        Self::Other(text.into())
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoNetwork => f.write_str("apt has no network connection"),
            Self::Other(text) => f.write_str(text),
        }
    }
}

/// How to call apt-get.
pub struct Apt {
    /// Program and leading arguments of every call.
    words: Vec<OsString>,
    /// Folder of its private state and cache; `None` for the system's apt.
    own: Option<PathBuf>,
}

impl Apt {
    /// The system's apt, if this user may install: as root, or through sudo without a password.
    ///
    /// # Errors
    /// Why this user may not install.
    pub fn of_the_system(places: &Places) -> Result<Self, Refusal> {
        let apt = places.program("apt-get").ok_or_else(|| Refusal::other("apt-get was not found"))?;
        let id = places.program("id").unwrap_or_else(|| "id".into());
        if first_line(Command::new(id).arg("-u")).as_deref() == Some("0") {
            return Ok(Self { words: vec![apt.into()], own: None });
        }
        let sudo = places.program("sudo").ok_or_else(|| Refusal::other("not root, and sudo was not found"))?;
        let mut asked = Command::new(&sudo);
        asked.args(["-n", "true"]).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        if !asked.status().is_ok_and(|status| status.success()) {
            return Err(Refusal::other("not root, and sudo requires a password"));
        }
        // sudo clears the environment.
        let words = vec![sudo.into(), "-n".into(), "env".into(), NO_QUESTIONS.into(), PLAIN.into(), apt.into()];
        Ok(Self { words, own: None })
    }

    /// An apt that only downloads into `folder`, and treats every package as not installed.
    ///
    /// # Errors
    /// If the folders cannot be created.
    pub fn of_its_own(apt: &Path, folder: &Path) -> io::Result<Self> {
        let folder = folder.join("apt");
        for path in ["state/lists/partial", "cache/archives/partial"] {
            fs::create_dir_all(folder.join(path))?;
        }
        fs::write(folder.join("status"), "")?;
        let at = |key: &str, path: &str| {
            let mut option = OsString::from(format!("-oDir::{key}="));
            option.push(folder.join(path));
            option
        };
        let words = [
            apt.into(),
            at("State", "state"),
            at("State::status", "status"),
            at("Cache", "cache"),
            at("Log", "log"),
            // As root, apt would switch to a user who may not write here.
            "-oAPT::Sandbox::User=root".into(),
            "-oAcquire::Languages=none".into(),
        ];
        Ok(Self { words: words.into(), own: Some(folder) })
    }

    /// The command as shown to the user.
    pub fn shown(&self, packages: &[&str]) -> String {
        let sudo = self.words.first().is_some_and(|word| Path::new(word).ends_with("sudo"));
        format!("{}apt-get install {}", if sudo { "sudo " } else { "" }, packages.join(" "))
    }

    /// Installs packages. Refuses if another package would have to be removed.
    ///
    /// # Errors
    /// Why the installation failed.
    pub fn install(&self, packages: &[&str]) -> Result<(), Refusal> {
        self.run(&["--no-remove"], packages)
    }

    /// Downloads packages with all their dependencies and returns the files.
    ///
    /// # Errors
    /// Why the download failed.
    pub fn download(&self, packages: &[&str]) -> Result<Vec<PathBuf>, Refusal> {
        self.run(&["--download-only"], packages)?;
        let folder = self.own.as_deref().unwrap_or(Path::new("/var")).join("cache/archives");
        let entries =
            fs::read_dir(&folder).map_err(|error| Refusal::other(format!("{}: {error}", folder.display())))?;
        let files = entries.flatten().map(|entry| entry.path());
        let mut archives: Vec<PathBuf> =
            files.filter(|path| path.extension().is_some_and(|end| end == "deb")).collect();
        archives.sort();
        Ok(archives)
    }

    fn run(&self, options: &[&str], packages: &[&str]) -> Result<(), Refusal> {
        // Package lists may be old or absent. If they cannot be updated, the installation may still succeed.
        let update = self.call(&["update", "-qq"], &[])?;
        // Not `-qq`: that hides which packages would be removed.
        let options = [&["install", "-y", "-q", "--no-install-recommends"], options].concat();
        let install = self.call(&options, packages)?;
        if install.success() {
            return Ok(());
        }
        let output = [update.stderr, install.stderr, install.stdout].join("\n");
        Err(refusal(&output))
    }

    fn call(&self, options: &[&str], packages: &[&str]) -> Result<process::ProgramOutput, Refusal> {
        let failed = |error: io::Error| Refusal::other(format!("apt-get cannot be run: {error}"));
        let scratch = Scratch::new().map_err(failed)?;
        let mut command = Command::new(&self.words[0]);
        command.args(&self.words[1..]).args(options).args(packages);
        for setting in [NO_QUESTIONS, PLAIN] {
            let (name, value) = setting.split_once('=').unwrap_or((setting, ""));
            command.env(name, value);
        }
        process::run(&mut command, scratch.path(), LIMIT).map_err(failed)
    }
}

/// One line from the output of apt.
fn refusal(output: &str) -> Refusal {
    const NO_NETWORK: [&str; 6] = [
        "Temporary failure resolving",
        "Could not resolve",
        "Could not connect",
        "Unable to connect",
        "Network is unreachable",
        "Connection timed out",
    ];
    if NO_NETWORK.iter().any(|words| output.contains(words)) {
        return Refusal::NoNetwork;
    }
    let mut removed = output.lines().skip_while(|line| !line.contains("will be REMOVED")).skip(1);
    let line = |start: &str| output.lines().find_map(|line| line.strip_prefix(start)).map(str::trim);
    Refusal::other(match removed.next() {
        Some(packages) => format!("apt-get would have to remove {}", packages.trim()),
        None => format!("apt-get failed: {}", line("E:").unwrap_or("no reason given")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn apt_output_is_reduced_to_one_line() {
        let removal = "The following packages will be REMOVED:\n  qemu-utils\nThe following NEW packages\n\
                       E: Packages need to be removed but remove is disabled.\n";
        assert_eq!(refusal(removal).to_string(), "apt-get would have to remove qemu-utils");
        let offline = "W: Failed to fetch x  Temporary failure resolving 'x'\nE: Unable to locate package a\n";
        assert_eq!(refusal(offline), Refusal::NoNetwork);
        let unknown = refusal("E: Unable to locate package a\n");
        assert_eq!(unknown.to_string(), "apt-get failed: Unable to locate package a");
        assert!(refusal("").to_string().contains("no reason given"));
    }
}
