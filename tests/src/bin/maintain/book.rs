//! The documentation as a book: `docs` with its generated pages, built by a pinned version of mdBook.

use std::fs;
use std::io;
use std::path::Path;
use std::process::{Command, ExitCode};

use crate::generated;
use xtask::run::{Outcome, Report, cargo, expect_success};
use xtask::setup;

/// Version of mdBook.
const VERSION: &str = "0.5.4";
/// Installation folder of mdBook.
const TOOLS: &str = "target/tools";
/// Copy of `docs` with the generated pages.
const SOURCE: &str = "target/book-source";
/// The book as HTML.
const BOOK: &str = "target/book";

/// `cargo xtask book`
pub fn command(root: &Path) -> ExitCode {
    let mut report = Report::new(1);
    report.step("book", || build(root, &root.join(BOOK)));
    if !report.has_failed() {
        println!("{BOOK}/index.html");
    }
    report.finish()
}

/// Writes the book to a folder, replacing its contents.
pub fn build(root: &Path, folder: &Path) -> Outcome {
    let source = root.join(SOURCE);
    if let Err(why) = sources(root, &source) {
        return Outcome::Failed(why);
    }
    let mdbook = root.join(TOOLS).join("bin").join(format!("mdbook{}", std::env::consts::EXE_SUFFIX));
    if !is_installed(&mdbook) {
        let mut install =
            cargo(root, &["install", "mdbook", "--locked", "--no-default-features", "--features", "search"]);
        install.args(["--version", VERSION, "--force", "--root", TOOLS]);
        if !matches!(expect_success(install, ""), Outcome::Passed) {
            return setup::missing(format!("mdbook {VERSION} cannot be installed; the pages as Markdown: {SOURCE}"));
        }
    }
    // mdBook resolves a relative folder from the folder of the sources.
    let folder = match std::path::absolute(folder) {
        Ok(folder) => folder,
        Err(error) => return Outcome::Failed(format!("{}: {error}", folder.display())),
    };
    let mut mdbook = Command::new(mdbook);
    mdbook.arg("build").arg(&source).arg("--dest-dir").arg(folder);
    expect_success(mdbook, "see above")
}

fn is_installed(mdbook: &Path) -> bool {
    let version = Command::new(mdbook).arg("--version").output();
    version.is_ok_and(|output| String::from_utf8_lossy(&output.stdout).trim_end().ends_with(VERSION))
}

/// Replaces `source` by a copy of `docs` in which generated pages are complete.
fn sources(root: &Path, source: &Path) -> Result<(), String> {
    let failed = |error: io::Error| format!("{}: {error}", source.display());
    match fs::remove_dir_all(source) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(failed(error)),
        _ => copy(&root.join("docs"), source).map_err(failed)?,
    }
    for (name, text) in generated::pages(root)? {
        fs::write(source.join(name), text).map_err(failed)?;
    }
    Ok(())
}

/// Copies a folder recursively.
fn copy(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let (path, place) = entry.map(|entry| (entry.path(), to.join(entry.file_name())))?;
        if path.is_dir() { copy(&path, &place)? } else { fs::copy(path, place).map(drop)? }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_source_of_the_book_has_every_page_of_its_contents() {
        let folder = tempfile::tempdir().unwrap();
        let source = folder.path().join("source");
        sources(&xtask::root(), &source).unwrap();
        let contents = fs::read_to_string(source.join("SUMMARY.md")).unwrap();
        let pages: Vec<&str> = contents.split("](").skip(1).filter_map(|link| link.split(')').next()).collect();
        assert!(pages.len() > 30, "{pages:?}");
        for page in &pages {
            let text = fs::read_to_string(source.join(page)).unwrap();
            assert!(!text.contains("This page is generated and not stored"), "{page}");
        }
        let commands = fs::read_to_string(source.join("commands.md")).unwrap();
        for heading in ["\n## Exit codes\n", "\n## specgen identify gauge\n", "\n## specgen check\n"] {
            assert!(commands.contains(heading), "{heading}");
        }
    }
}
