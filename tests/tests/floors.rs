//! The compiler's crates stand on floors, and an arrow only goes down: the manifests say so, and this reads them. Within a crate
//! no files use each other in a cycle: `floors/cycles.rs`.

mod arrows;
mod cycles;
mod modules;
mod tokens;

use specgen_tests::repository;

/// From the lowest.
const FLOORS: [&str; 13] = [
    "numerics",
    "language",
    "identify",
    "cycles",
    "toolchain",
    "ir",
    "compiler",
    "run-time",
    "studies",
    "operate",
    "report",
    "cli",
    "python",
];

/// The crates of the compiler that a manifest names.
fn below(manifest: &str) -> Vec<usize> {
    let named = |name: &str| manifest.lines().any(|line| line.contains(&format!("path = \"../{name}\"")));
    (0..FLOORS.len()).filter(|floor| named(FLOORS[*floor])).collect()
}

/// Arrows that do not go down.
fn upward(floor: usize, manifest: &str) -> Vec<&'static str> {
    below(manifest).into_iter().filter(|other| *other >= floor).map(|other| FLOORS[other]).collect()
}

#[test]
fn no_arrow_goes_up() {
    let mut arrows = 0;
    for (floor, name) in FLOORS.into_iter().enumerate() {
        let path = repository().join("codegen").join(name).join("Cargo.toml");
        let manifest = std::fs::read_to_string(&path).unwrap();
        arrows += below(&manifest).len();
        assert!(
            upward(floor, &manifest).is_empty(),
            "{name} uses {:?}, on its own floor or above",
            upward(floor, &manifest)
        );
    }
    assert!(arrows > 20, "{arrows} arrows");
    let found: Vec<_> =
        std::fs::read_dir(repository().join("codegen")).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(found.len(), FLOORS.len(), "a crate without a floor: {found:?}");
}

/// What must not see the simulator, does not.
#[test]
fn the_compiler_does_not_see_the_simulator() {
    for name in &FLOORS[..7] {
        let path = repository().join("codegen").join(name).join("Cargo.toml");
        let manifest = std::fs::read_to_string(path).unwrap();
        // Its tests may: margins are held against a simulation that shares nothing with them.
        let shipped = manifest.split("[dev-dependencies]").next().unwrap();
        assert!(!shipped.contains("host-sim"), "{name}");
    }
}

#[test]
fn an_arrow_that_goes_up_is_found() {
    let manifest =
        "[dependencies]\nspecgen-numerics = { path = \"../numerics\" }\nspecgen-cli = { path = \"../cli\" }\n";
    assert_eq!(upward(1, manifest), ["cli"]);
    assert_eq!(upward(0, manifest), ["numerics", "cli"]);
    assert!(upward(11, "specgen-report = { path = \"../report\" }").is_empty());
}
