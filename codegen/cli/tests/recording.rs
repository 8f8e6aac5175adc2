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
