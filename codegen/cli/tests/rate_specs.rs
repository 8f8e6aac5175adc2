//! Findings of `specgen check` about inconsistent rate options.

use std::fs;

use crate::support::{Folder, repository};
use specgen::everett::EverettTable;
use specgen::identify::rate::write_rate_csv;

/// `specs/legs.toml` with lines added to [hysteresis], in a folder beside its records.
fn legs_with(lines: &str) -> Folder {
    let folder = Folder::new();
    let text = fs::read_to_string(repository().join("specs/legs.toml")).unwrap();
    folder.write("legs.toml", text.replace("[hysteresis]\n", &format!("[hysteresis]\n{lines}\n")));
    folder
}

/// A second table of zeros.
fn rate_table(grid: usize, drive_max: f64) -> String {
    let nodes = vec![0.0; grid * (grid + 1) / 2];
    write_rate_csv(&EverettTable { grid, drive_min: 0.0, drive_max, nodes })
}

const DYNAMIC: &str = "rate = \"dynamic-preisach\"\nrate_tables = [\"mu1.csv\"]";

#[test]
fn a_second_table_must_have_the_grid_and_the_range_of_the_first() {
    let folder = legs_with(DYNAMIC);
    folder.write("mu1.csv", rate_table(32, 100.0));
    let run = folder.run(&["check", "legs.toml"]);
    assert_eq!(run.code, 0, "{run:?}");
    for (grid, drive_max, words) in [(16, 100.0, "16"), (32, 90.0, "90 V")] {
        folder.write("mu1.csv", rate_table(grid, drive_max));
        let run = folder.run(&["check", "legs.toml"]);
        assert_eq!(run.code, 1, "{run:?}");
        for part in ["E0642", "mu1.csv", words] {
            assert!(run.stderr.contains(part), "no `{part}` in:\n{}", run.stderr);
        }
    }
}

#[test]
fn creep_over_a_table_fitted_without_it_is_warned_of() {
    let folder = legs_with("rate = \"creep\"\ncreep_times = [\"50 ms\"]\ncreep_weights = [0.03]");
    let run = folder.run(&["check", "legs.toml"]);
    assert_eq!(run.code, 0, "{run:?}");
    assert!(run.stderr.contains("W0648"), "{}", run.stderr);
}
