//! `specgen sim --record` and `specgen replay` as a user runs them, for both kinds of controller.

use std::fs;

use crate::support::Folder;

#[test]
fn what_sim_records_replays_bit_for_bit_and_a_changed_bit_does_not() {
    let folder = Folder::new();
    for spec in ["legs.toml", "reference.toml"] {
        let recorded = folder.json(&["sim", spec, "--record", "run.rec", "--seconds", "2"]);
        assert_eq!(recorded.code, 0, "{spec}: {}", recorded.value);
        let replayed = folder.json(&["replay", "run.rec", "--spec", spec]);
        let result = &replayed.value["result"];
        assert_eq!((replayed.code, &result["bit_equal"]), (0, &true.into()), "{spec}: {result}");
        assert_eq!(result["ticks"], recorded.value["result"]["ticks"]);
        // For people: what the words mean, volts, and where the platform or the legs were and were to be.
        let more = ["replay", "run.rec", "--spec", spec, "--csv", "out/run.csv", "--plot", "out/run.svg"];
        assert_eq!(folder.run(&more).code, 0);
        let csv = folder.read("out/run.csv");
        let (names, rows) = csv.split_once('\n').unwrap();
        let place =
            |name: &str| names.split(',').position(|one| one == name).unwrap_or_else(|| panic!("{name}: {names}"));
        let (target, at) =
            if spec == "legs.toml" { ("demand[2]_m", "displacement[2]_m") } else { ("target[2]_m", "pose[2]_m") };
        let row: Vec<&str> = rows.lines().nth(15_000.min(rows.lines().count() / 2)).unwrap().split(',').collect();
        assert_eq!(row.len(), names.split(',').count());
        let number = |name: &str| row[place(name)].parse::<f64>().unwrap();
        assert!((number(target) - number(at) - number("error[2]_m")).abs() < 1e-12, "{row:?}");
        assert!(number("voltage[5]_V") > 0.0 && number("error[2]_m").abs() < 1e-6, "{row:?}");
        assert_eq!(row[place("supervisor_text")], "running");
        assert!(folder.read("out/run.svg").contains("<path"));
        let mut bytes = fs::read(folder.path("run.rec")).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 4;
        folder.write("bad.rec", bytes);
        let text = folder.run(&["replay", "bad.rec", "--spec", spec]);
        assert!(text.code == 1 && text.stdout.contains("is damaged"), "{spec}: {} {}", text.stdout, text.stderr);
        // What is left is exported, and said to have a hole.
        folder.run(&["replay", "bad.rec", "--csv", "bad.csv"]).says(1, &["is damaged", "its rows are missing"]);
        assert!(folder.path("bad.csv").is_file());
    }
}
