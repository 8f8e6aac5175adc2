//! Third-party packages: a step for each lock file checks that it is up to date and that the licences of its packages are allowed.
//! The full run also checks for known defects.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use serde_json::Value;

use crate::run::{Outcome, cargo};

/// Allowed licences (SPDX): they only require that their text and the names of authors are included.
const ALLOWED: [&str; 14] = [
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "NCSA",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Checks the lock file beside `manifest`, and the licences of all packages in it, for all systems.
pub fn check(root: &Path, manifest: &str) -> Outcome {
    let metadata = |more: &[&str]| {
        let base = ["metadata", "--locked", "--quiet", "--format-version=1", "--manifest-path", manifest];
        cargo(root, &[&base[..], more].concat()).stdin(Stdio::null()).output()
    };
    let all = match metadata(&[]) {
        Ok(output) => output,
        Err(error) => return Outcome::Failed(format!("cargo metadata: {error}")),
    };
    if all.status.success() {
        return judge(&all);
    }
    // Without a network, packages for other systems may not be available.
    match metadata(&["--offline", "--filter-platform", &host()]) {
        Ok(here) if here.status.success() => match judge(&here) {
            Outcome::Passed => Outcome::Skipped("licences of packages for other systems: no network".to_owned()),
            other => other,
        },
        _ => {
            let error = String::from_utf8_lossy(&all.stderr);
            Outcome::Failed(format!("{}; run: cargo xtask bless", error.trim().replace('\n', " ")))
        }
    }
}

fn judge(output: &Output) -> Outcome {
    let refused = match serde_json::from_slice::<Value>(&output.stdout) {
        Ok(metadata) if metadata["packages"].as_array().is_none_or(Vec::is_empty) => {
            return Outcome::Failed("cargo metadata: it names no package".to_owned());
        }
        Ok(metadata) => refused(&metadata),
        Err(error) => return Outcome::Failed(format!("cargo metadata: {error}")),
    };
    if refused.is_empty() {
        return Outcome::Passed;
    }
    Outcome::Failed(format!(
        "licences that are not on the list in xtask/src/packages.rs: {}; use another package, or read the licence and add it",
        refused.join(", ")
    ))
}

/// Third-party packages whose licence is not allowed, or not stated.
fn refused(metadata: &Value) -> Vec<String> {
    let packages = metadata["packages"].as_array().into_iter().flatten().filter(|one| !one["source"].is_null());
    let refused = packages.filter(|one| !one["license"].as_str().is_some_and(is_allowed));
    let name = |one: &Value| one["name"].as_str().unwrap_or("?").to_owned();
    refused.map(|one| format!("{} ({})", name(one), one["license"].as_str().unwrap_or("none stated"))).collect()
}

/// Whether the allowed licences satisfy a licence expression: `OR` offers a choice, `AND` binds tighter and requires both.
fn is_allowed(expression: &str) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut words = &words[..];
    any(&mut words) == Some(true) && words.is_empty()
}

fn any(words: &mut &[&str]) -> Option<bool> {
    let mut met = all(words)?;
    while let ["OR", rest @ ..] = *words {
        *words = rest;
        met |= all(words)?;
    }
    Some(met)
}

fn all(words: &mut &[&str]) -> Option<bool> {
    let mut met = one(words)?;
    while let ["AND", rest @ ..] = *words {
        *words = rest;
        met &= one(words)?;
    }
    Some(met)
}

fn one(words: &mut &[&str]) -> Option<bool> {
    match **words {
        ["(", ref rest @ ..] => {
            *words = rest;
            let met = any(words)?;
            let [")", rest @ ..] = *words else { return None };
            *words = rest;
            Some(met)
        }
        [licence, "WITH", exception, ref rest @ ..] => {
            *words = rest;
            Some(ALLOWED.contains(&format!("{licence} WITH {exception}").as_str()))
        }
        [licence, ref rest @ ..] => {
            *words = rest;
            Some(ALLOWED.contains(&licence))
        }
        [] => None,
    }
}

/// The target triple of this computer.
pub fn host() -> String {
    let output = Command::new("rustc").arg("-vV").output();
    let text = output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default();
    text.lines().find_map(|line| line.strip_prefix("host: ")).unwrap_or_default().to_owned()
}

/// Variable with the path of a checkout of the RustSec database; without it `cargo audit` fetches the database.
const DATABASE: &str = "SPECGEN_ADVISORY_DB";

/// Checks the packages in each lock file for known defects in the RustSec database.
pub fn advisories(root: &Path, manifests: &[String]) -> Outcome {
    let there = cargo(root, &["audit", "--version"]).stdout(Stdio::null()).stderr(Stdio::null()).status();
    if !there.is_ok_and(|status| status.success()) {
        return Outcome::Skipped("cargo-audit is not installed; run: cargo install cargo-audit --locked".to_owned());
    }
    let mut failed = Vec::new();
    for manifest in manifests {
        let lock = manifest.replace("Cargo.toml", "Cargo.lock");
        println!("{lock}");
        let mut audit = cargo(root, &["audit", "--deny", "unsound", "--file", &lock]);
        if let Some(database) = std::env::var_os(DATABASE) {
            audit.arg("--no-fetch").arg("--db").arg(database);
        }
        if !audit.status().is_ok_and(|status| status.success()) {
            failed.push(lock);
        }
    }
    if failed.is_empty() {
        return Outcome::Passed;
    }
    Outcome::Failed(format!("known defects, or no database (a checkout: {DATABASE}): {}", failed.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn licences_are_read_as_spdx_has_them() {
        for good in [
            "MIT",
            "MIT/Apache-2.0",
            "MIT OR GPL-3.0-only",
            "(MIT OR Apache-2.0) AND Unicode-3.0",
            "Apache-2.0 WITH LLVM-exception OR Apache-2.0 OR MIT",
            "GPL-2.0-only AND MIT OR ISC",
        ] {
            assert!(is_allowed(good), "{good}");
        }
        for bad in [
            "GPL-3.0-or-later",
            "MIT AND GPL-3.0-only",
            "MIT AND (GPL-3.0-only OR LGPL-2.1-only)",
            "Apache-2.0 WITH Other-exception",
            "(MIT",
            "MIT OR",
            "MIT ISC",
            "",
        ] {
            assert!(!is_allowed(bad), "{bad}");
        }
    }

    #[test]
    fn a_package_from_elsewhere_needs_a_licence_and_one_of_ours_does_not() {
        let package = |name: &str, source: Value, license: Value| serde_json::json!({ "name": name, "source": source, "license": license });
        let metadata = serde_json::json!({ "packages": [
            package("own", Value::Null, Value::Null),
            package("good", "registry".into(), "MIT".into()),
            package("silent", "registry".into(), Value::Null),
            package("viral", "registry".into(), "GPL-3.0-only".into()),
        ] });
        assert_eq!(refused(&metadata), ["silent (none stated)", "viral (GPL-3.0-only)"]);
    }
}
