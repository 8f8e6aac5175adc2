//! What is tested is what is shipped: in the test build every package has the version and the features that it has in a
//! user's build. cargo gives a package the features that anybody in the same build asks for, so a dependency of a test may
//! change the product under test.
//!
//! A user's build is `cargo build` (the default member), the test build `cargo test --workspace`. Any selection of packages
//! in between asks for features in between, so that it is the same for `cargo test -p specgen`.

use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

use specgen_tests::repository;

/// Features by package and version; as a set, because a package is built once for the host (build scripts, macros) and once
/// for the target where the two differ.
type Resolution = BTreeMap<String, BTreeSet<String>>;

/// What cargo would build for this host, dependencies of build scripts and macros among it.
fn resolve(scope: &[&str]) -> Resolution {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--locked", "--prefix=none", "--no-dedupe", "--format={p}|{f}"])
        .args(scope)
        .current_dir(repository())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    parse(&String::from_utf8(output.stdout).unwrap())
}

fn parse(tree: &str) -> Resolution {
    let mut packages = Resolution::new();
    for line in tree.lines().filter(|line| !line.is_empty()) {
        // The mark of a package that its own tests lead back to.
        let (package, features) = line.trim_end_matches(" (*)").split_once('|').unwrap();
        // `default` stands for others, which are listed beside it.
        let features = features.split(',').filter(|name| *name != "default").collect::<Vec<_>>().join(",");
        packages.entry(package.to_owned()).or_default().insert(features);
    }
    packages
}

/// One line for every package of the product that the test build has otherwise, or not at all.
fn differences(product: &Resolution, tested: &Resolution) -> Vec<String> {
    let mut lines = Vec::new();
    for (package, shipped) in product {
        match tested.get(package) {
            Some(features) if features == shipped => {}
            Some(features) => lines.push(format!("{package}: shipped with {shipped:?}, tested with {features:?}")),
            None => lines.push(format!("{package}: shipped, and not in the test build")),
        }
    }
    lines
}

#[test]
fn what_is_tested_has_the_features_of_what_is_shipped() {
    // What a procedural macro is made of compiles nothing of the product.
    let product = resolve(&["--edges=normal,build,no-proc-macro"]);
    let tested = resolve(&["--workspace", "--edges=normal,build,dev,no-proc-macro"]);
    assert!(product.len() > 80 && tested.len() > product.len(), "{} and {}", product.len(), tested.len());
    let found = differences(&product, &tested);
    assert!(
        found.is_empty(),
        "name the features where the product's manifest needs them, or keep the dependency of the tests from asking:\n{}",
        found.join("\n")
    );
}

/// Versions of a lock file by package.
fn locked(manifest: &str) -> BTreeMap<String, BTreeSet<String>> {
    let text = std::fs::read_to_string(repository().join(manifest).with_file_name("Cargo.lock")).unwrap();
    let mut packages: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for package in text.split("[[package]]").skip(1) {
        let field = |key: &str| package.lines().find_map(|line| line.strip_prefix(key)).unwrap().to_owned();
        packages.entry(field("name = ")).or_default().insert(field("version = "));
    }
    packages
}

/// It has a lock file of its own, and the bits of the command.
#[test]
fn the_python_package_is_made_of_what_the_command_is_made_of() {
    let (command, python) = (locked("Cargo.toml"), locked("codegen/python/Cargo.toml"));
    let common = python.iter().filter_map(|(name, versions)| Some((name, versions, command.get(name)?)));
    let others: Vec<_> = common.clone().filter(|(_, versions, all)| !versions.is_subset(all)).collect();
    assert!(common.count() > 100 && others.is_empty(), "other versions than the command has: {others:?}");
    assert!(python.contains_key("\"pyo3\""));
}

#[test]
fn a_difference_is_found() {
    let product = parse("a v1.0.0|std\na v1.0.0|std\nb v2.0.0|\nc v3.0.0|x,y\n");
    assert_eq!(differences(&product, &product), [""; 0]);
    // More features in the test build, another version of b, and c once more for the host without `y`.
    let tested = parse("a v1.0.0|exact,std\nb v2.0.1|\nc v3.0.0|x,y\nc v3.0.0|x (*)\nonly-tested v1.0.0|\n");
    assert_eq!(
        differences(&product, &tested),
        [
            r#"a v1.0.0: shipped with {"std"}, tested with {"exact,std"}"#,
            "b v2.0.0: shipped, and not in the test build",
            r#"c v3.0.0: shipped with {"x,y"}, tested with {"x", "x,y"}"#,
        ]
    );
}

/// Invariant 11 as far as the dependencies carry it.
#[test]
fn the_product_reads_numbers_exactly_and_has_no_code_that_picks_instructions_by_cpu() {
    let product = resolve(&["--edges=normal,build"]);
    let features = |name: &str| {
        let (_, features) = product.iter().find(|(package, _)| package.starts_with(name)).unwrap();
        features.iter().flat_map(|set| set.split(',')).collect::<BTreeSet<_>>()
    };
    assert!(features("serde_json v").contains("float_roundtrip"));
    assert!(features("simba v").contains("libm_force"));
    assert!(!product.keys().any(|package| package.starts_with("matrixmultiply ")));
    // Each of rustfft's features is a set of instructions.
    assert_eq!(features("rustfft v"), BTreeSet::from([""]));
}
