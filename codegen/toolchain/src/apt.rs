//! Debian's packages, by apt: installed as root, or downloaded with a state of apt's own.

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

/// Longest time of one call: a hundred megabytes over a slow line.
const LIMIT: Duration = Duration::from_secs(1800);
/// For packages that would ask something.
const NO_QUESTIONS: &str = "DEBIAN_FRONTEND=noninteractive";
/// In the language that is understood here.
const PLAIN: &str = "LC_ALL=C";

/// Why a way of getting a tool did not lead there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Refusal {
    /// apt reaches no server; another call of it will not either.
    NoNetwork,
    /// In words.
    Other(String),
}

impl Refusal {
    /// In words.
    pub fn other(text: impl Into<String>) -> Self {
        Self::Other(text.into())
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoNetwork => f.write_str("apt has no network"),
            Self::Other(text) => f.write_str(text),
        }
    }
}

/// An apt-get, with what it takes to run it.
pub struct Apt {
    /// The words before those of a call.
    words: Vec<OsString>,
    /// Folder of its own state and cache; none for the system's.
    own: Option<PathBuf>,
}

impl Apt {
    /// The system's, if this user may install: as root, or with a sudo that asks for no password.
    ///
    /// # Errors
    /// What is in the way.
    pub fn of_the_system(places: &Places) -> Result<Self, Refusal> {
        let apt = places.program("apt-get").ok_or_else(|| Refusal::other("there is no apt-get"))?;
        let id = places.program("id").unwrap_or_else(|| "id".into());
        if first_line(Command::new(id).arg("-u")).as_deref() == Some("0") {
            return Ok(Self { words: vec![apt.into()], own: None });
        }
        let sudo = places.program("sudo").ok_or_else(|| Refusal::other("not root, and there is no sudo"))?;
        let mut asked = Command::new(&sudo);
        asked.args(["-n", "true"]).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        if !asked.status().is_ok_and(|status| status.success()) {
            return Err(Refusal::other("not root, and sudo asks for a password"));
        }
        // sudo hands no environment on.
        let words = vec![sudo.into(), "-n".into(), "env".into(), NO_QUESTIONS.into(), PLAIN.into(), apt.into()];
        Ok(Self { words, own: None })
    }

    /// One that only downloads, into `folder`, as if nothing were installed.
    ///
    /// # Errors
    /// What the file system says.
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
            // As root apt would become another user, who may not write here.
            "-oAPT::Sandbox::User=root".into(),
            "-oAcquire::Languages=none".into(),
        ];
        Ok(Self { words: words.into(), own: Some(folder) })
    }

    /// How it is run, for people.
    #[must_use]
    pub fn shown(&self, packages: &[&str]) -> String {
        let sudo = self.words.first().is_some_and(|word| Path::new(word).ends_with("sudo"));
        format!("{}apt-get install {}", if sudo { "sudo " } else { "" }, packages.join(" "))
    }

    /// Installs packages; rather not at all than with the removal of another.
    ///
    /// # Errors
    /// Why not, in words.
    pub fn install(&self, packages: &[&str]) -> Result<(), Refusal> {
        self.run(&["--no-remove"], packages)
    }

    /// Downloads packages with all that they depend on; the files.
    ///
    /// # Errors
    /// Why not, in words.
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
        // Lists may be old or absent on a fresh machine; if they cannot be had, the rest may still succeed.
        let update = self.call(&["update", "-qq"], &[])?;
        // Not `-qq`: what would be removed is not said then.
        let options = [&["install", "-y", "-q", "--no-install-recommends"], options].concat();
        let install = self.call(&options, packages)?;
        if install.success() {
            return Ok(());
        }
        let said = [update.stderr, install.stderr, install.stdout].join("\n");
        Err(refusal(&said))
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

/// What apt printed, in one line.
fn refusal(said: &str) -> Refusal {
    const NO_NETWORK: [&str; 6] = [
        "Temporary failure resolving",
        "Could not resolve",
        "Could not connect",
        "Unable to connect",
        "Network is unreachable",
        "Connection timed out",
    ];
    if NO_NETWORK.iter().any(|words| said.contains(words)) {
        return Refusal::NoNetwork;
    }
    let mut removed = said.lines().skip_while(|line| !line.contains("will be REMOVED")).skip(1);
    let line = |start: &str| said.lines().find_map(|line| line.strip_prefix(start)).map(str::trim);
    Refusal::other(match removed.next() {
        Some(packages) => format!("apt-get would have to remove {}", packages.trim()),
        None => format!("apt-get refuses: {}", line("E:").unwrap_or("it does not say why")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_apt_prints_becomes_one_line() {
        let removal = "The following packages will be REMOVED:\n  qemu-utils\nThe following NEW packages\n\
                       E: Packages need to be removed but remove is disabled.\n";
        assert_eq!(refusal(removal).to_string(), "apt-get would have to remove qemu-utils");
        let offline = "W: Failed to fetch x  Temporary failure resolving 'x'\nE: Unable to locate package a\n";
        assert_eq!(refusal(offline), Refusal::NoNetwork);
        let unknown = refusal("E: Unable to locate package a\n");
        assert_eq!(unknown.to_string(), "apt-get refuses: Unable to locate package a");
        assert!(refusal("").to_string().contains("does not say why"));
    }
}
