//! Every input that `cargo xtask fuzz` found worth keeping, through the targets of `tests/fuzz`: those that once failed, and the
//! smallest set that reaches all that was ever reached.

#[path = "../fuzz/targets/mod.rs"]
pub mod targets;

use std::fs;

use specgen_tests::repository;

#[test]
fn every_kept_input_passes_through_its_target() {
    for (name, target) in targets::TARGETS {
        let folder = repository().join("tests/fuzz/corpus").join(name);
        let files: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        for file in &files {
            let input = fs::read(file).unwrap();
            if std::panic::catch_unwind(|| target(&input)).is_err() {
                panic!("{}", file.display());
            }
        }
        println!("{name}: {} inputs", files.len());
        assert!(files.len() >= 20, "{name}: {} inputs", files.len());
    }
}
