//! The table of `docs/supervisor.md` says what the runtime does.

use specgen_runtime::supervisor::{Cause, HOLDS, Phase, RAMPS_DOWN, SWITCHES_OFF, TIMED};
use specgen_tests::repository;
use std::fs;

fn rows(heading: &str) -> Vec<Vec<String>> {
    let text = fs::read_to_string(repository().join("docs/supervisor.md")).expect("the document");
    let after = text.split(heading).nth(1).expect("the table");
    let lines = after.lines().skip(2).take_while(|line| line.starts_with('|'));
    lines.map(|line| line.split('|').skip(1).map(|cell| cell.trim().to_owned()).collect()).collect()
}

#[test]
fn causes_and_what_they_do_are_those_of_the_runtime() {
    let rows = rows("| cause | word |");
    assert_eq!(rows.len(), Cause::ALL.len());
    for (row, cause) in rows.iter().zip(Cause::ALL) {
        let name = cause.name();
        assert_eq!(row[0], name);
        assert_eq!(row[1], cause.word().to_string());
        let action = match cause.bit() {
            bit if bit & SWITCHES_OFF != 0 => "switch off",
            bit if bit & RAMPS_DOWN != 0 => "ramp down",
            bit if bit & HOLDS != 0 => "hold",
            _ if cause == Cause::AmplifierFault => "`amplifier_fault`: switch off, ramp down, or hold",
            _ => "nothing",
        };
        assert_eq!(row[4], action, "{name}");
        let watched =
            matches!(cause, Cause::GaugeStuck | Cause::GaugeDisagreement | Cause::TrackingError | Cause::Oscillation);
        assert_eq!(row[3] == "at once", !watched && !TIMED.contains(&cause), "{name}");
    }
}

#[test]
fn phases_are_those_of_the_runtime() {
    let rows = rows("| phase | word |");
    assert_eq!(rows.len(), 7);
    for (word, row) in (0..).zip(&rows) {
        let phase = Phase::from_word(word).expect("a phase");
        assert_eq!(row[1], word.to_string());
        assert_eq!(row[2] == "on", phase.is_powered(), "{}", row[0]);
    }
}
