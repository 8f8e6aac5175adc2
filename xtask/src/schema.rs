//! The published schema under a validator that others wrote. To compile that takes half a minute, so it is run where something
//! that it judges has changed since it last found all good, and in the soak.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::run::{Outcome, cargo, expect_success};

/// Its own workspace, because of its dependencies.
pub const PACKAGE: &str = "tests/schema/Cargo.toml";
/// SHA-256 of all that was judged last.
const JUDGED: &str = "tests/schema/judged.txt";

/// Validates, unless all that would be judged is what was judged last.
pub fn changed(root: &Path) -> Outcome {
    match digest(root) {
        Ok(digest) if fs::read_to_string(root.join(JUDGED)).is_ok_and(|kept| kept.trim() == digest) => {
            println!("unchanged since the validator found it good: {digest}");
            Outcome::Passed
        }
        Ok(_) => validate(root),
        Err(error) => Outcome::Failed(error.to_string()),
    }
}

/// Validates, and writes down what was found good.
pub fn validate(root: &Path) -> Outcome {
    let clippy = ["clippy", "--quiet", "--locked", "--all-targets", "--manifest-path", PACKAGE, "--", "-D", "warnings"];
    let outcome = expect_success(cargo(root, &clippy), "see what is reported above");
    if !matches!(outcome, Outcome::Passed) {
        return outcome;
    }
    let test = ["test", "--quiet", "--locked", "--manifest-path", PACKAGE];
    let outcome = expect_success(cargo(root, &test), "see the test above");
    if !matches!(outcome, Outcome::Passed) {
        return outcome;
    }
    match digest(root).and_then(|digest| fs::write(root.join(JUDGED), format!("{digest}\n"))) {
        Ok(()) => Outcome::Passed,
        Err(error) => Outcome::Failed(format!("{JUDGED}: {error}")),
    }
}

/// Of the schema, the specs that it is tried on, and the trial itself: names and contents.
fn digest(root: &Path) -> io::Result<String> {
    let mut files = vec![PathBuf::from("specs/platform.schema.json")];
    for (folder, end) in [("specs", "toml"), ("specs/features", "toml"), ("tests/schema", ""), ("tests/schema", "rs")] {
        for entry in fs::read_dir(root.join(folder))? {
            let path = Path::new(folder).join(entry?.file_name());
            let cargo = path.file_stem().is_some_and(|stem| stem == "Cargo");
            if path.extension().is_some_and(|found| found == end) || end.is_empty() && cargo {
                files.push(path);
            }
        }
    }
    files.sort();
    let mut judged = Vec::new();
    for file in files {
        let content = fs::read(root.join(&file))?;
        judged.extend(format!("{} {}\n", file.display(), content.len()).into_bytes());
        judged.extend(content);
    }
    Ok(specgen::workspace::sha256(&judged))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_of_anything_that_is_judged_is_seen() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let files = [
            "specs/platform.schema.json",
            "specs/a.toml",
            "specs/features/b.toml",
            "tests/schema/lib.rs",
            "tests/schema/Cargo.toml",
            "tests/schema/Cargo.lock",
        ];
        for file in files {
            fs::create_dir_all(root.join(file).parent().unwrap()).unwrap();
            fs::write(root.join(file), file).unwrap();
        }
        let before = digest(root).unwrap();
        fs::write(root.join(JUDGED), &before).unwrap();
        assert_eq!(digest(root).unwrap(), before);
        assert!(matches!(changed(root), Outcome::Passed));
        for file in files {
            fs::write(root.join(file), "other").unwrap();
            assert_ne!(digest(root).unwrap(), before, "{file}");
            fs::write(root.join(file), file).unwrap();
        }
        fs::write(root.join("specs/c.toml"), "").unwrap();
        assert_ne!(digest(root).unwrap(), before, "a new spec");
    }
}
