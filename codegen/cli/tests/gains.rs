//! `specgen identify gains` as a user runs it, on a simulated machine with legs outside the controller's model class: the gains of its
//! legs, and the platform's error with the resulting tables.
//! `SPECGEN_FULL=1 cargo test --release -p specgen --test all gains -- --include-ignored --nocapture` prints the figures.

use crate::support::{Folder, length};

const RECORDS: &str = "records = [\"records/reference-forc.csv\"]  # one for all six legs, or six";

/// Stroke and workspace for a table with less gain.
const LESS: [(&str, &str); 3] = [
    ("\"60 um\"", "\"53.4 um\""),
    ("[\"50 um\", \"50 um\", \"52 um\"]", "[\"43 um\", \"43 um\", \"50.5 um\"]"),
    ("[\"0.4 mrad\", \"0.35 mrad\", \"0.5 mrad\"]", "[\"0.34 mrad\", \"0.3 mrad\", \"0.43 mrad\"]"),
];

/// Writes `name`: `reference.toml` at 10 Hz with other records, and with less stroke if `less`.
fn spec(folder: &Folder, name: &str, records: &str, less: bool) {
    let mut text = folder.read("reference.toml");
    for (old, new) in LESS.iter().filter(|_| less).chain(&[(RECORDS, records)]) {
        assert!(text.contains(old), "{old}");
        text = text.replace(old, new);
    }
    folder.write(name, text.replace("frequency = \"1 Hz\"", "frequency = \"10 Hz\""));
}

/// A table with every node `factor` times as large.
fn scaled(table: &str, factor: f64) -> String {
    let (header, rows) = table.split_once('\n').unwrap();
    let mut text = format!("{header}\n");
    for row in rows.lines().filter(|row| !row.starts_with('#')) {
        let (thresholds, node) = row.rsplit_once(',').unwrap();
        text += &format!("{thresholds},{:?}\n", node.parse::<f64>().unwrap() * factor);
    }
    text
}

/// Error of the translation in case 1 at 10 Hz, nm rms.
fn case_1(folder: &Folder, spec: &str, plant: &str) -> f64 {
    let run = folder.run(&["sim", spec, "--trajectory", "case-1", "--plant", plant]);
    let line = run.stdout.lines().find(|line| line.trim_start().starts_with("x,y,z")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

#[test]
fn a_run_of_the_machine_gives_the_gain_of_each_leg_and_tables_that_take_its_error_away() {
    let folder = Folder::new();
    // (plant, the table over the true one, bar for case 1 in nm)
    let all = [
        ("plays", 1.0 / 0.85, 30.0),
        ("plays", 1.0, 30.0),
        ("plays", 1.0 / 1.2, 30.0),
        ("bouc-wen", 1.0, 75.0),
        ("bouc-wen", 1.0 / 0.85, 75.0),
    ];
    for (plant, factor, bar) in length(&all[..1], &all) {
        folder.run(&["forc", "reference.toml", "-o", "forc.csv", "--grid", "32", "--plant", plant]).says(0, &[]);
        folder.run(&["identify", "forc.csv", "--drive", "0:100", "--grid", "32", "-o", "table.csv"]).says(0, &[]);
        folder.write("off.csv", scaled(&folder.read("table.csv"), *factor));
        spec(&folder, "off.toml", "records = [\"off.csv\"]", *factor < 0.9);
        let record = ["sim", "off.toml", "--record", "run.rec", "--seconds", length("1", "4"), "--plant", plant];
        folder.run(&record).says(0, &[]);
        let found = folder.json(&["identify", "gains", "run.rec", "--spec", "off.toml", "-o", "tables/own"]);
        let legs = found.value["result"]["legs"].as_array().unwrap_or_else(|| panic!("{}", found.value));
        let of = |name: &str| legs.iter().map(|leg| leg[name].as_f64().unwrap()).collect::<Vec<_>>();
        let gains = of("gain");
        println!("{plant}, table x {factor:.3}: lambda {gains:.3?} ± {:.4?}", of("error"));
        assert_eq!(gains.len(), 6);
        // The legs of the machine are within ±10 % of the spec's.
        assert!(gains.iter().all(|gain| (0.89..=1.11).contains(&(gain * factor))), "{gains:?}");
        let (left, before) = (of("residual_rms"), of("residual_before"));
        let least = if *plant == "plays" { 0.4 } else { 1.0 };
        assert!(left.iter().zip(&before).all(|(left, before)| *left < least * before), "{left:?} {before:?}");
        let text = folder.run(&["identify", "gains", "run.rec", "--spec", "off.toml", "-o", "tables/own"]);
        let line = text.stdout.lines().find(|line| line.starts_with("records = ")).unwrap();
        spec(&folder, "own.toml", line, *factor < 0.9);
        if length(false, true) {
            let errors = ["off.toml", "own.toml"].map(|spec| case_1(&folder, spec, plant));
            println!("  case 1 at 10 Hz: {:.1} nm, with the tables {:.1} nm", errors[0], errors[1]);
            assert!(errors[1] < errors[0] && errors[1] <= *bar, "{errors:?}");
        } else {
            folder.run(&["check", "own.toml"]).says(0, &[]);
        }
    }

    // An unsuitable run is refused, with a way to make a suitable one.
    folder.run(&["sim", "off.toml", "--record", "short.rec", "--seconds", "0.01"]).says(0, &[]);
    folder
        .run(&["identify", "gains", "short.rec", "--spec", "off.toml"])
        .says(1, &["record at least a second of a slow wave on all axes"]);
    folder
        .run(&["identify", "gains", "run.rec", "--spec", "own.toml"])
        .says(1, &["was recorded with spec digest", "give the spec that the target was built from"]);
    folder
        .run(&["identify", "gains", "run.rec", "--spec", "off.toml", "-o", "../elsewhere"])
        .says(2, &["expected a folder within that of the spec, such as `gains`"]);
    folder
        .run(&["identify", "gains", "run.rec", "--spec", "legs.toml"])
        .says(1, &["six legs with their own gauges have one record each", "specgen identify linear"]);
    assert!(!folder.path("../elsewhere").exists());
}
