//! Standalone test suites in their own workspaces, whose dependencies take long to compile. A suite runs only if its inputs have
//! changed since it last passed. The full run always runs it and commits the digest of the inputs.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::run::{Outcome, cargo, expect_success};

/// File beside the manifest: SHA-256 of the inputs of the last good run.
const JUDGED: &str = "judged.txt";

/// A standalone test suite.
pub struct Suite {
    /// Manifest of the workspace; all of its own sources are inputs.
    pub manifest: &'static str,
    /// Other inputs: files by folder and suffix.
    pub inputs: &'static [(&'static str, &'static str)],
}

impl Suite {
    /// Runs the suite unless its inputs are those of the last good run.
    pub fn unless_unchanged(&self, root: &Path) -> Outcome {
        match self.digest(root) {
            Ok(digest) if fs::read_to_string(self.kept(root)).is_ok_and(|kept| kept.trim() == digest) => {
                println!("passed before, and inputs are unchanged: {digest}");
                Outcome::Passed
            }
            Ok(_) => self.run(root),
            Err(error) => Outcome::Failed(error.to_string()),
        }
    }

    /// Runs the suite; if it passes, writes the digest of its inputs.
    pub fn run_and_keep(&self, root: &Path) -> Outcome {
        let outcome = self.run(root);
        if !matches!(outcome, Outcome::Passed) {
            return outcome;
        }
        match self.digest(root).and_then(|digest| fs::write(self.kept(root), format!("{digest}\n"))) {
            Ok(()) => Outcome::Passed,
            Err(error) => Outcome::Failed(format!("{}: {error}", self.kept(root).display())),
        }
    }

    /// Runs the suite and its lints.
    fn run(&self, root: &Path) -> Outcome {
        let package = ["--quiet", "--locked", "--all-targets", "--manifest-path", self.manifest];
        for (command, more) in [("clippy", &["--", "-D", "warnings"][..]), ("test", &[])] {
            let outcome = expect_success(cargo(root, &[&[command], &package[..], more].concat()), "see above");
            if !matches!(outcome, Outcome::Passed) {
                return outcome;
            }
        }
        Outcome::Passed
    }

    fn folder(&self) -> &'static str {
        self.manifest.trim_end_matches("/Cargo.toml")
    }

    fn kept(&self, root: &Path) -> PathBuf {
        root.join(self.folder()).join(JUDGED)
    }

    /// Digest of names and contents of all inputs.
    fn digest(&self, root: &Path) -> io::Result<String> {
        let own = [(self.folder(), ".rs"), (self.folder(), ".toml"), (self.folder(), ".lock")];
        let mut files = Vec::new();
        for (folder, end) in self.inputs.iter().copied().chain(own) {
            for entry in fs::read_dir(root.join(folder))? {
                let name = entry?.file_name();
                if name.to_string_lossy().ends_with(end) {
                    files.push(Path::new(folder).join(name));
                }
            }
        }
        files.sort();
        let mut bytes = Vec::new();
        for file in files {
            let content = fs::read(root.join(&file))?;
            bytes.extend(format!("{} {}\n", file.display(), content.len()).into_bytes());
            bytes.extend(content);
        }
        Ok(crate::sha256(&bytes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_of_any_input_is_seen() {
        let trial = Suite { manifest: "trial/Cargo.toml", inputs: &[("specs", ".toml"), ("specs", "schema.json")] };
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let files =
            ["specs/platform.schema.json", "specs/a.toml", "trial/lib.rs", "trial/Cargo.toml", "trial/Cargo.lock"];
        for file in files {
            fs::create_dir_all(root.join(file).parent().unwrap()).unwrap();
            fs::write(root.join(file), file).unwrap();
        }
        let before = trial.digest(root).unwrap();
        fs::write(trial.kept(root), &before).unwrap();
        assert_eq!(trial.digest(root).unwrap(), before);
        assert!(matches!(trial.unless_unchanged(root), Outcome::Passed));
        for file in files {
            fs::write(root.join(file), "other").unwrap();
            assert_ne!(trial.digest(root).unwrap(), before, "{file}");
            fs::write(root.join(file), file).unwrap();
        }
        fs::write(root.join("specs/c.toml"), "").unwrap();
        assert_ne!(trial.digest(root).unwrap(), before, "a new spec");
    }
}
