//! The changelog: each change is a fragment in its own file, so that changes never conflict. A release merges the fragments.

use std::fs;
use std::path::{Path, PathBuf};

/// Folder of fragments: `SUBJECT-added.md`, `-changed.md` or `-fixed.md`, each an entry without a bullet.
const FOLDER: &str = "changelog";
/// Suffixes of names, and their sections.
const SECTIONS: [(&str, &str); 3] = [("added", "Added"), ("changed", "Changed"), ("fixed", "Fixed")];
/// The heading above the newest release.
const UNRELEASED: &str = "## Unreleased\n";

/// Moves all fragments into CHANGELOG.md, below a heading of `version`.
///
/// # Errors
/// A fragment has no section or is empty, there is no fragment, the version exists, or a file cannot be read or written.
pub fn release(root: &Path, version: &str) -> Result<(), String> {
    let fragments = fragments(&root.join(FOLDER))?;
    let path = root.join("CHANGELOG.md");
    let old = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let new = with_release(
        &old,
        version,
        &fragments.iter().map(|(_, section, text)| (*section, text.as_str())).collect::<Vec<_>>(),
    )?;
    fs::write(&path, new).map_err(|error| format!("{}: {error}", path.display()))?;
    for (path, ..) in fragments {
        fs::remove_file(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    Ok(())
}

/// Checks that CHANGELOG.md has `version`, and that no fragment is left.
///
/// # Errors
/// Something is missing; the text has the command that adds it.
pub fn is_released(root: &Path, version: &str) -> Result<(), String> {
    let path = root.join("CHANGELOG.md");
    let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let left = fragments(&root.join(FOLDER))?.len();
    if left > 0 || !text.lines().any(|line| line == format!("## {version}")) {
        return Err(format!(
            "{left} fragments are not in CHANGELOG.md, or it has no {version}: cargo xtask changelog {version}, and commit it"
        ));
    }
    Ok(())
}

/// Path, section and text of each fragment, sorted by name.
fn fragments(folder: &Path) -> Result<Vec<(PathBuf, &'static str, String)>, String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut paths: Vec<PathBuf> = entries.map_while(Result::ok).map(|entry| entry.path()).collect();
    paths.retain(|path| path.file_name().is_some_and(|name| name != "README.md"));
    paths.sort();
    let read = |path: PathBuf| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let section = SECTIONS.iter().find(|(end, _)| stem.ends_with(&format!("-{end}"))).map(|(_, section)| *section);
        let section = section.ok_or_else(|| {
            format!("{}: expected a name that ends in -added.md, -changed.md or -fixed.md", path.display())
        })?;
        let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
        if text.trim().is_empty() {
            return Err(format!("{} is empty: write the entry, or remove the file", path.display()));
        }
        Ok((path, section, text))
    };
    paths.into_iter().map(read).collect()
}

/// The changelog with a release of these entries (section, text), in the order of sections, below the heading for unreleased changes.
fn with_release(old: &str, version: &str, entries: &[(&str, &str)]) -> Result<String, String> {
    if entries.is_empty() {
        return Err(format!("no fragment in {FOLDER}/: there is nothing to release"));
    }
    if old.lines().any(|line| line == format!("## {version}")) {
        return Err(format!("CHANGELOG.md already has {version}"));
    }
    let (head, released) =
        old.split_once(UNRELEASED).ok_or_else(|| format!("CHANGELOG.md has no line `{}`", UNRELEASED.trim()))?;
    let mut text = format!("{head}{UNRELEASED}\n## {version}\n");
    for (_, section) in SECTIONS {
        let of: Vec<&str> = entries.iter().filter(|(name, _)| *name == section).map(|(_, text)| text.trim()).collect();
        if !of.is_empty() {
            text.push_str(&format!("\n### {section}\n"));
            // Lines after the first belong to the bullet.
            of.iter().for_each(|entry| text.push_str(&format!("- {}\n", entry.replace('\n', "\n  "))));
        }
    }
    Ok(format!("{text}\n{}", released.trim_start_matches('\n')))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fragments_become_a_release_in_the_order_of_sections() {
        let old = "# Changelog\n\n## Unreleased\n\n## 0.1.0\n\n### Added\n- A.\n";
        let entries = [("Fixed", "F.\n"), ("Added", "One,\nin two lines.\n"), ("Added", "Two.")];
        let new = with_release(old, "0.2.0", &entries).unwrap();
        let wanted = "# Changelog\n\n## Unreleased\n\n## 0.2.0\n\n### Added\n- One,\n  in two lines.\n- Two.\n\n### Fixed\n- F.\n\n## 0.1.0\n\n### Added\n- A.\n";
        assert_eq!(new, wanted);
        for (old, version, entries) in
            [(old, "0.1.0", &entries[..]), ("# Changelog\n", "0.2.0", &entries), (old, "0.2.0", &[])]
        {
            assert!(with_release(old, version, entries).is_err(), "{version}");
        }
    }

    #[test]
    fn every_fragment_has_a_section_and_a_text() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        assert!(fragments(&root.join(FOLDER)).is_ok());
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in [("x.md", "Text."), ("x-added.md", " \n")] {
            fs::write(folder.path().join(name), text).unwrap();
            assert!(fragments(folder.path()).unwrap_err().contains(name), "{name}");
            fs::remove_file(folder.path().join(name)).unwrap();
        }
        fs::write(folder.path().join("x-fixed.md"), "Text.").unwrap();
        assert_eq!(fragments(folder.path()).unwrap()[0].1, "Fixed");
    }
}
