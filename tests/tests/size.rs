//! Hand-written lines of product code by crate, against the budgets in `tests/size.txt`: a commit that makes a crate larger has to
//! raise a number there, and says what it paid with. A line counts if it is neither blank nor a comment.

use std::collections::BTreeMap;
use std::path::Path;

use specgen_tests::repository;

const BUDGETS: &str = "tests/size.txt";
/// A crate that is smaller than its budget by more lines has the budget lowered.
const SLACK: usize = 50;
/// Where product code is.
const FOLDERS: [&str; 4] = ["codegen", "firmware", "host-sim", "xtask"];
/// Names of folders, and of files without `.rs`, that are not product code.
const TESTS: [&str; 3] = ["tests", "benches", "examples"];
/// Emitted, and committed.
const EMITTED: &str = "firmware/controller";

/// Lines of product code in a file: without `#[cfg(test)]` items.
fn lines(text: &str) -> usize {
    let (mut count, mut depth, mut is_test) = (0, 0, false);
    for line in text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//")) {
        is_test |= line.starts_with("#[cfg(test)]");
        if !is_test {
            count += 1;
            continue;
        }
        let braces = |brace| line.matches(brace).count();
        depth = (depth + braces('{')).saturating_sub(braces('}'));
        let is_over = line.ends_with(';') || line.contains('}') || (line.contains('{') && depth == 0);
        is_test = depth > 0 || !is_over;
    }
    count
}

/// Lines by crate, of all sources below `folder`, whose path in the repository is `path`.
fn add(folder: &Path, path: &str, sizes: &mut BTreeMap<String, usize>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        let inside = format!("{path}/{name}");
        if TESTS.contains(&name.trim_end_matches(".rs")) || inside == EMITTED {
            continue;
        }
        if entry.file_type().unwrap().is_dir() {
            if name != "target" {
                add(&entry.path(), &inside, sizes);
            }
        } else if name.ends_with(".rs") {
            let package = inside.splitn(3, '/').take(2).collect::<Vec<_>>().join("/");
            *sizes.entry(package).or_default() += lines(&std::fs::read_to_string(entry.path()).unwrap());
        }
    }
}

/// What is wrong with sizes under budgets.
fn differences(sizes: &BTreeMap<String, usize>, budgets: &BTreeMap<String, usize>) -> Vec<String> {
    let judged = |(package, size): (&String, &usize)| match budgets.get(package) {
        None => Some(format!("{package} has {size} lines and no budget")),
        Some(budget) if size > budget => Some(format!("{package} has {size} lines, {budget} at most")),
        Some(budget) if size + SLACK < *budget => Some(format!("{package} has {size} lines: lower its {budget}")),
        Some(_) => None,
    };
    let gone = budgets.keys().filter(|package| !sizes.contains_key(*package));
    sizes.iter().filter_map(judged).chain(gone.map(|package| format!("{package} is no more"))).collect()
}

#[test]
fn no_crate_is_larger_than_its_budget() {
    let mut sizes = BTreeMap::new();
    FOLDERS.into_iter().for_each(|folder| add(&repository().join(folder), folder, &mut sizes));
    let total: usize = sizes.values().sum();
    let path = repository().join(BUDGETS);
    if std::env::var_os("SPECGEN_BLESS").is_some() {
        let list: String = sizes.iter().map(|(package, size)| format!("{size:6} {package}\n")).collect();
        std::fs::write(&path, list).unwrap();
    }
    let text = std::fs::read_to_string(&path).unwrap();
    let budget = |line: &str| {
        let (size, package) = line.trim().split_once(' ').unwrap();
        (package.to_owned(), size.parse().unwrap())
    };
    let found = differences(&sizes, &text.lines().map(budget).collect());
    assert!(found.is_empty(), "{}\nin all {total}; budgets: {BUDGETS}", found.join("\n"));
    assert!(sizes.len() > 20 && total > 50_000, "{sizes:?}");
}

#[test]
fn a_crate_that_grows_shrinks_comes_or_goes_is_seen() {
    let sizes = |list: &[(&str, usize)]| list.iter().map(|(name, size)| ((*name).to_owned(), *size)).collect();
    let budgets = sizes(&[("a", 100), ("b", 100)]);
    assert_eq!(differences(&sizes(&[("a", 100), ("b", 50)]), &budgets), [""; 0]);
    for wrong in
        [&[("a", 101), ("b", 100)][..], &[("a", 49), ("b", 100)], &[("a", 100)], &[("a", 100), ("b", 99), ("c", 1)]]
    {
        assert_eq!(differences(&sizes(wrong), &budgets).len(), 1, "{wrong:?}");
    }
}

#[test]
fn comments_and_tests_do_not_count() {
    let text = "//! A\n\nuse a;\n/// B\nfn f() {\n    g(); // C\n}\n#[cfg(test)]\nuse b;\nfn h() {}\n\
                #[cfg(test)]\nmod tests {\n    fn t() {\n    }\n}\nconst C: u8 = 1;\n";
    assert_eq!(lines(text), 6);
}
