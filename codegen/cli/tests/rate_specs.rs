//! Findings about inconsistent rate options, in a spec and in the lines of one leg.

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

/// The lines that `identify rate -o` writes, beside their tables.
#[test]
fn predict_takes_the_lines_of_one_leg_and_names_what_is_wrong_in_them() {
    let folder = Folder::new();
    let nodes = (1..=8).flat_map(|up| (0..up).map(move |down| 1e-6 * f64::from(up - down))).collect();
    let table = EverettTable { grid: 8, drive_min: 0.0, drive_max: 100.0, nodes };
    folder.write("leg.csv", specgen::identify::write_table_csv(&table));
    let drive = (0..200).map(|k| format!("{},{}\n", 0.01 * f64::from(k), 50 - (k - 100_i32).abs() / 2));
    folder.write("drive.csv", format!("time_s,drive_V\n{}", drive.collect::<String>()));
    let lines = "[hysteresis]\ngrid = 8\nrecords = [\"leg.csv\"]\nrate = \"creep\"\ncreep_times = [\"50 ms\"]\n";
    let mode = "[actuator]\nresonance = \"735 Hz\"\ndamping_ratio = 0.015\nresonance_gain = 0.65\n";
    let predicted = |lines: &str| {
        folder.write("leg.toml", lines);
        folder.run(&["identify", "predict", "leg.toml", "drive.csv"])
    };
    let whole = format!("{lines}creep_weights = [0.03]\ndead_time = \"1.5 ms\"\n{mode}");
    let run = predicted(&whole);
    assert_eq!(run.code, 0, "{run:?}");
    // 0.65 of the table's 8 um in 100 V.
    for part in ["1.500 ms", "735.0 Hz", "gain 0.05200"] {
        assert!(run.stdout.contains(part), "no `{part}` in:\n{}", run.stdout);
    }
    let wrong = [
        (lines.to_owned(), "creep_weights"),
        (whole.replace("0.03", "0.03, 0.04"), "creep_weights"),
        (whole.replace("leg.csv", "other.csv"), "E0501"),
        (whole.replace("1.5 ms", "1.5"), "dead_time"),
    ];
    for (lines, part) in wrong {
        let run = predicted(&lines);
        assert_eq!(run.code, 1, "{run:?}");
        assert!(run.stderr.contains(part), "no `{part}` in:\n{}", run.stderr);
    }
}
