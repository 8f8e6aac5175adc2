//! Committed generated files: checks that they are up to date, or regenerates them.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;
use xtask::run::Outcome;

mod help;
mod make;
mod trace;

/// Files by path relative to [`GeneratedFolder::folder`], with `/` between the parts.
pub type Files = BTreeMap<String, String>;

/// A folder of generated files.
pub struct GeneratedFolder {
    /// Relative to the repository.
    pub folder: &'static str,
    /// Whether every file in it is generated, so that any other is an error.
    pub whole: bool,
    /// Generates its expected contents from the repository, or returns the reason why it cannot.
    pub make: fn(&Path) -> Result<Files, String>,
}

/// All generated folders. `cargo xtask test` compares them, `cargo xtask bless` writes them.
const GENERATED: &[GeneratedFolder] = &[
    // Records first, because the compiled specs below read them.
    GeneratedFolder { folder: "specs/records", whole: true, make: make::records },
    GeneratedFolder { folder: "specs", whole: false, make: make::schema },
    GeneratedFolder { folder: "firmware/controller", whole: true, make: make::reference_controller },
    GeneratedFolder {
        folder: "firmware/board/tests/passes/controller/src",
        whole: true,
        make: make::controller_with_passes,
    },
    GeneratedFolder { folder: "tests/golden", whole: true, make: make::goldens },
];

/// Hand-written folders within folders of generated files.
const BY_HAND: [&str; 1] = ["law"];

/// Pages of the book that are not committed, by their names in `docs`.
///
/// # Errors
/// A spec does not compile, or an equation has no code or no test.
pub fn pages(root: &Path) -> Result<Files, String> {
    make::pages(root)
}

/// Compares every folder with its expected contents, and generates the pages of the book.
pub fn check(root: &Path) -> Outcome {
    let stale = match all(root, GENERATED, differences).and_then(|stale| pages(root).map(|_| stale)) {
        Ok(stale) => stale,
        Err(why) => return Outcome::Failed(why),
    };
    if stale.is_empty() {
        return Outcome::Passed;
    }
    for line in &stale {
        println!("{line}");
    }
    Outcome::Failed(format!("{} files differ; run: cargo xtask bless", stale.len()))
}

/// Regenerates every folder.
pub fn bless(root: &Path) -> Outcome {
    match all(root, GENERATED, replace) {
        Ok(written) => {
            for line in &written {
                println!("{line}");
            }
            Outcome::Passed
        }
        Err(why) => Outcome::Failed(why),
    }
}

/// Generates each folder and passes it to `act`; collects the results.
fn all(
    root: &Path,
    list: &[GeneratedFolder],
    act: fn(&Path, &GeneratedFolder, &Files) -> io::Result<Vec<String>>,
) -> Result<Vec<String>, String> {
    let mut lines = Vec::new();
    for generated in list {
        let files = (generated.make)(root).map_err(|why| format!("{}: {why}", generated.folder))?;
        lines.extend(act(root, generated, &files).map_err(|error| format!("{}: {error}", generated.folder))?);
    }
    Ok(lines)
}

/// One line per file that is missing, differs, or should not exist.
fn differences(root: &Path, generated: &GeneratedFolder, files: &Files) -> io::Result<Vec<String>> {
    let folder = generated.folder;
    let mut lines = Vec::new();
    let mut present = committed(&root.join(folder))?;
    for (path, text) in files {
        match present.remove(path) {
            None => lines.push(format!("missing: {folder}/{path}")),
            Some(found) if found != text.as_bytes() => {
                lines.push(format!("stale: {folder}/{path}, first in line {}", first_difference(&found, text)));
            }
            Some(_) => {}
        }
    }
    if generated.whole {
        lines.extend(present.keys().map(|path| format!("not generated: {folder}/{path}")));
    }
    Ok(lines)
}

/// Makes the folder contain exactly these files; one line per change.
fn replace(root: &Path, generated: &GeneratedFolder, files: &Files) -> io::Result<Vec<String>> {
    let lines = differences(root, generated, files)?;
    let base = root.join(generated.folder);
    if generated.whole {
        for path in committed(&base)?.keys().filter(|path| !files.contains_key(*path)) {
            fs::remove_file(base.join(path))?;
        }
    }
    for (path, text) in files {
        let file = base.join(path);
        if let Some(parent) = file.parent() {
            fs::create_dir_all(parent)?;
        }
        fs::write(file, text)?;
    }
    Ok(lines)
}

/// Number of the first line that differs, counted from 1.
fn first_difference(found: &[u8], text: &str) -> usize {
    let same = found.iter().zip(text.as_bytes()).take_while(|(a, b)| a == b).count();
    text.as_bytes().iter().take(same).filter(|&&byte| byte == b'\n').count() + 1
}

/// Files below `folder`, without [`BY_HAND`] and cargo's `target`; empty if there is no such folder.
fn committed(folder: &Path) -> io::Result<BTreeMap<String, Vec<u8>>> {
    let mut found = BTreeMap::new();
    let mut open = vec![(folder.to_owned(), String::new())];
    while let Some((path, prefix)) = open.pop() {
        let entries = match fs::read_dir(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            entries => entries?,
        };
        for entry in entries {
            let entry = entry?;
            let name = format!("{prefix}{}", entry.file_name().display());
            if !entry.file_type()?.is_dir() {
                found.insert(name, fs::read(entry.path())?);
            } else if !BY_HAND.contains(&name.as_str()) && entry.file_name() != "target" {
                open.push((entry.path(), format!("{name}/")));
            }
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_difference_is_found_and_blessing_removes_it() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("made");
        fs::create_dir_all(folder.join("src")).unwrap();
        fs::write(folder.join("src/same.rs"), "a\n").unwrap();
        fs::write(folder.join("src/stale.rs"), "a\nb\nc\n").unwrap();
        fs::write(folder.join("extra.rs"), "").unwrap();
        let files: Files = [("src/same.rs", "a\n"), ("src/stale.rs", "a\nb\nd\n"), ("new/missing.rs", "x")]
            .map(|(path, text)| (path.to_owned(), text.to_owned()))
            .into();

        let made = GeneratedFolder { folder: "made", whole: true, make: |_| Ok(Files::new()) };
        let found = differences(root.path(), &made, &files).unwrap();
        let expected = [
            "missing: made/new/missing.rs",
            "stale: made/src/stale.rs, first in line 3",
            "not generated: made/extra.rs",
        ];
        assert_eq!(found, expected);
        assert_eq!(replace(root.path(), &made, &files).unwrap(), expected);
        assert_eq!(differences(root.path(), &made, &files).unwrap(), [""; 0]);
        assert!(!folder.join("extra.rs").exists());
    }
}
