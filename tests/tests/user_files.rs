//! Every file of a user is opened by `specgen_language::files` and written by `codegen/language/src/output.rs`, which look at its kind and at
//! what it is to the command. Whatever else opens, writes or moves a file is listed in `tests/user_files.txt`, with its number of places
//! and whose file it is.

use std::path::{Path, PathBuf};

use specgen_tests::repository;

/// What opens, writes or replaces a file without a look at it.
const DOORS: [&str; 10] = [
    "File::open(",
    "File::create(",
    "File::create_new(",
    "fs::read(",
    "fs::read_to_string(",
    "fs::write(",
    "fs::rename(",
    "fs::copy(",
    "OpenOptions::new()",
    "File::options()",
];

/// Places by file: path, count, whose files they are.
const LISTED: &str = include_str!("../user_files.txt");

/// Sources of what is shipped, without their tests.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let is_test = path.file_stem().is_some_and(|stem| stem == "tests");
        if path.is_dir() && !is_test {
            sources(&path, found);
        } else if path.extension().is_some_and(|end| end == "rs") && !is_test {
            found.push(path);
        }
    }
}

/// How often a source opens a file by itself.
fn doors(text: &str) -> usize {
    let code = text.lines().take_while(|line| !line.contains("#[cfg(test)]"));
    let code: Vec<&str> = code.filter_map(|line| line.split("//").next()).collect();
    let count = |line: &str| -> usize {
        let of = |door: &&str| {
            let places = line.match_indices(door.trim_end_matches("()"));
            // `PendingFile::create` is another one's.
            places.filter(|(at, _)| !line[..*at].ends_with(char::is_alphanumeric)).count()
        };
        DOORS.iter().map(of).sum()
    };
    code.into_iter().filter(|line| !line.trim_start().starts_with("use ")).map(count).sum()
}

#[test]
fn no_file_of_a_user_is_opened_by_another_door() {
    let root = repository();
    let mut files = Vec::new();
    for entry in std::fs::read_dir(root.join("codegen")).unwrap() {
        sources(&entry.unwrap().path().join("src"), &mut files);
    }
    ["host-sim/src", "firmware/rt/src", "firmware/rt-pc/src"]
        .iter()
        .for_each(|folder| sources(&root.join(folder), &mut files));
    let mut found: Vec<(String, usize)> = Vec::new();
    for file in files {
        let count = doors(&std::fs::read_to_string(&file).unwrap());
        let name = file.strip_prefix(&root).unwrap().to_str().unwrap().to_owned();
        found.extend((count > 0).then_some((name, count)));
    }
    found.sort();
    let row = |line: &str| {
        let mut words = line.splitn(3, ' ').map(str::to_owned);
        (words.next().unwrap(), words.next().unwrap().parse().unwrap())
    };
    let listed: Vec<(String, usize)> = LISTED.lines().map(row).collect();
    let new: Vec<_> = found.iter().filter(|one| !listed.contains(one)).collect();
    assert!(new.is_empty(), "open these by specgen_language::files, write them by cli::file: {new:#?}");
    let gone: Vec<_> = listed.iter().filter(|one| !found.contains(one)).collect();
    assert!(gone.is_empty(), "no longer so, take them from the list: {gone:#?}");
}

#[test]
fn a_door_is_seen() {
    let cases = [
        ("let text = std::fs::read_to_string(path)?;", 1),
        ("fs::write(a, b).and_then(|()| fs::rename(a, c))", 2),
        ("OpenOptions::new().write(true).open(path)", 1),
        ("hdf5_pure::File::open(path); fs::rename(a, b)", 2),
        ("use std::fs::File::open(", 0),
        ("// fs::read(path)\nPendingFile::create(path)", 0),
        ("#[cfg(test)]\nfs::read(path)", 0),
    ];
    for (text, count) in cases {
        assert_eq!(doors(text), count, "{text}");
    }
}
