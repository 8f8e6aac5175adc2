//! What `identify` writes, the spec reads: the same controller from a record and from the table identified from it.

use specgen::compile::compile;
use specgen::identify::{self, Options};
use specgen_tests::{compile_edited, repository};
use std::fs;

const RECORD: &str = "specs/records/leg1.csv";

fn table(grid: usize, drive: [f64; 2]) -> String {
    let record = identify::read_record(&repository().join(RECORD), "leg1.csv", &identify::Reading::default()).unwrap();
    identify::write_table_csv(&identify::identify(&record, &Options::new(grid, drive)).unwrap().table)
}

const EDITS: [(&str, &str); 2] =
    [("grid    = 8", "grid    = 8"), ("../records/reference-forc.csv", "../records/leg1.csv")];

#[test]
fn a_table_gives_the_controller_of_its_record() {
    let from_record = compile_edited("from-record", "features/small-grid.toml", &EDITS, &[]);
    let edits = [("../records/reference-forc.csv", "../records/table.csv")];
    let more = [("table.csv", table(8, [0.0, 100.0]))];
    let from_table = compile_edited("from-table", "features/small-grid.toml", &edits, &more);
    assert!(from_record.records[0].is_some() && from_table.records[0].is_none());
    let (a, b) = (&from_record.ir.hysteresis.tables[0], &from_table.ir.hysteresis.tables[0]);
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        // The file holds micrometres: one rounding there and one back.
        assert!((a - b).abs() <= 4.0 * f64::EPSILON * a.abs(), "{a:e} {b:e}");
    }
}

#[test]
fn a_table_of_another_grid_or_range_or_with_a_negative_weight_is_refused() {
    let good = table(8, [0.0, 100.0]);
    let raised: Vec<String> = good
        .lines()
        .map(|line| if line.starts_with("50.0,25.0,") { "50.0,25.0,0.001".to_owned() } else { line.to_owned() })
        .collect();
    assert_ne!(raised.join("\n"), good.trim_end());
    for (what, text, code) in [
        ("grid", table(4, [0.0, 100.0]), "E0614"),
        ("range", good.replace("100.0,", "101.0,"), "E0613"),
        ("weight", raised.join("\n"), "E0613"),
        ("cut", good.lines().take(20).collect::<Vec<_>>().join("\n"), "E0613"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let spec = fs::read_to_string(repository().join("specs/features/small-grid.toml")).unwrap();
        fs::write(folder.path().join("table.csv"), text).unwrap();
        let path = folder.path().join("platform.toml");
        fs::write(&path, spec.replace("../records/reference-forc.csv", "table.csv")).unwrap();
        let refused = compile(&path).expect_err(what);
        assert!(refused.findings.iter().any(|finding| finding.code == code), "{what}: {:?}", refused.findings);
        assert!(refused.findings.iter().all(|finding| !finding.help.is_empty()), "{what}");
    }
}
