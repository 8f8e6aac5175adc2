//! An unusable record is refused with the line or time, the expectation, and a fix; nothing is written. Each is made from a good one,
//! and tested both in a spec and with `identify`.

use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use crate::support::{Document, Folder, length};
use serde_json::Value;

const HEADER: &str = "time_s,drive_V,displacement_um";
const BAD: &str = "records/bad.csv";

/// Rows of the good record as numbers: eight reversal curves from 0 V to 100 V.
fn good(folder: &Folder) -> Vec<[f64; 3]> {
    let text = folder.read("records/leg1.csv");
    let (header, rows) = text.split_once('\n').unwrap();
    assert_eq!(header, HEADER);
    let number = |field: &str| field.parse::<f64>().unwrap();
    let rows = rows.lines().filter(|line| !line.starts_with('#'));
    let rows: Vec<[f64; 3]> =
        rows.map(|line| line.split(',').map(number).collect::<Vec<_>>().try_into().unwrap()).collect();
    assert!(rows.len() > 500);
    rows
}

fn csv(rows: &[[f64; 3]]) -> String {
    rows.iter().fold(format!("{HEADER}\n"), |mut text, [t, u, y]| {
        writeln!(text, "{t},{u},{y}").unwrap();
        text
    })
}

/// A caller in the same process has arguments of its own.
#[test]
fn the_suggested_line_has_the_words_of_the_call() {
    static STOP: AtomicBool = AtomicBool::new(false);
    let folder = Folder::new();
    let record = folder.path("records/leg1.csv").display().to_string();
    let words = ["identify", &record, "--grid", "8"].map(OsString::from);
    let document = specgen::cli::call(words, &STOP, |_| {}, None).to_string();
    assert!(document.contains(&format!("`specgen identify --drive=0:100 {record} --grid 8`")), "{document}");
}

/// A folder with a spec for the bad record, with grid 8 because the good one has eight curves.
fn prepared() -> Folder {
    let folder = Folder::new();
    folder.spec("platform.toml", &[("records/reference-forc.csv", BAD), ("grid    = 32", "grid    = 8")]);
    folder
}

/// The documents of both ways to use the record.
fn met(folder: &Folder) -> [Document; 2] {
    [
        folder.json(&["platform.toml", "-o", "out", "--no-build"]),
        folder.json(&["identify", BAD, "--drive", "0:100", "--grid", "8", "-o", "table.csv"]),
    ]
}

/// Expected refusal: line, if there is one, code, words of the message, words of the fix.
struct Expected {
    line: Option<usize>,
    code: &'static str,
    message: &'static [&'static str],
    help: &'static str,
}

fn expect(
    line: impl Into<Option<usize>>,
    code: &'static str,
    message: &'static [&'static str],
    help: &'static str,
) -> Expected {
    Expected { line: line.into(), code, message, help }
}

/// Asserts that the record is refused in both ways, with the expected finding, and nothing is written.
fn refused(content: impl AsRef<[u8]>, expected: &Expected) {
    let folder = prepared();
    folder.write(BAD, content);
    let before = folder.listing();
    let [spec, identify] = met(&folder);
    assert_eq!(spec.error(), "platform.toml is refused; nothing was written");
    assert_eq!(identify.error(), format!("{BAD} is refused; nothing was written"));
    for document in [spec, identify] {
        assert_eq!(document.code, 1);
        let fits = |finding: &&Value| {
            finding["code"] == expected.code
                && expected.message.iter().all(|word| finding["message"].as_str().unwrap().contains(word))
        };
        let Some(finding) = document.findings().iter().find(fits) else {
            panic!("no {} with {:?} in {:#}", expected.code, expected.message, document.value);
        };
        assert_eq!(finding["file"], BAD);
        assert_eq!(finding["line"].as_u64().map(|line| line as usize), expected.line, "{finding:#}");
        assert!(finding["help"].as_str().unwrap().contains(expected.help), "{finding:#}");
    }
    // As text, one of four in the short run.
    static NUMBER: AtomicUsize = AtomicUsize::new(0);
    if NUMBER.fetch_add(1, Ordering::Relaxed).is_multiple_of(length(4, 1)) {
        let place = expected.line.map_or(format!("--> {BAD}"), |line| format!("--> {BAD}:{line}"));
        folder
            .run(&["check", "platform.toml"])
            .says(1, &[&format!("error[{}]: ", expected.code), &place, expected.help]);
    }
    assert_eq!(folder.listing(), before);
}

/// The good record with one change.
fn changed(change: impl FnOnce(&mut Vec<[f64; 3]>)) -> String {
    let mut rows = good(&Folder::new());
    change(&mut rows);
    csv(&rows)
}

fn text_changed(change: impl FnOnce(String) -> String) -> String {
    change(csv(&good(&Folder::new())))
}

/// Replaces line `line`, counted from 1.
fn with_line(line: usize, new: &str) -> String {
    text_changed(|text| {
        let mut lines: Vec<&str> = text.lines().collect();
        lines[line - 1] = new;
        lines.join("\n") + "\n"
    })
}

/// Otherwise the refusals below might have other causes.
#[test]
fn the_unchanged_record_is_accepted_both_ways() {
    let folder = prepared();
    folder.write(BAD, csv(&good(&folder)));
    for document in met(&folder) {
        assert_eq!(document.code, 0, "{:#}", document.value);
        assert!(document.findings().is_empty(), "{:#}", document.value);
    }
    assert!(folder.path("out/law/src/platform/step.rs").is_file() && folder.path("table.csv").is_file());
}

#[test]
fn a_missing_column_is_named() {
    let two =
        |text: String| text.lines().map(|line| line.rsplit_once(',').unwrap().0.to_owned() + "\n").collect::<String>();
    let missing = &["`displacement_um` is missing", "`time_s`, `drive_V`"];
    refused(text_changed(two), &expect(1, "E0504", missing, "displacement_um"));
    let headless = text_changed(|text| text.split_once('\n').unwrap().1.to_owned());
    refused(headless, &expect(1, "E0504", &["`time_s` is missing"], "the first line must be the header"));
    let other = text_changed(|text| text.replace("drive_V", "drive_A"));
    refused(other, &expect(1, "E0504", &["`drive_V` is missing", "`drive_A`"], "`drive_mV`"));
    let commas = text_changed(|text| {
        text.lines()
            .enumerate()
            .map(|(k, line)| if k == 0 { line.to_owned() } else { in_comma_decimals(line) } + "\n")
            .collect()
    });
    refused(commas, &expect(2, "E0506", &["has 6 numbers for 3 columns"], "`0,0;0,0;"));
    let twice = text_changed(|text| text.replace("displacement_um", "drive_V"));
    refused(twice, &expect(1, "E0505", &["`drive_V` appears twice", "columns 2 and 3"], "keep one"));
}

/// A line of numbers with decimal commas.
fn in_comma_decimals(line: &str) -> String {
    let number = |field: &str| if field.contains('.') { field.replace('.', ",") } else { format!("{field},0") };
    line.split(',').map(number).collect::<Vec<_>>().join(",")
}

#[test]
fn a_value_that_is_no_number_is_named_by_its_line() {
    for (row, message, help, code) in [
        ("1,abc,2", &["`drive_V` is `abc`", "not a number"][..], "plain number", "E0506"),
        ("1,2 V,2", &["`drive_V` is `2 V`", "not a number"], "plain number", "E0506"),
        ("1,,2", &["`drive_V` is empty"], "complete or delete", "E0506"),
        ("1,2", &["`displacement_um` is missing", "too short"], "complete or delete the line", "E0506"),
        ("1,2,NaN", &["`displacement_um` is `NaN`", "not a finite number"], "delete the sample", "E0508"),
        ("1,-inf,2", &["`drive_V` is `-inf`"], "delete the sample", "E0508"),
        ("1,2,1e999", &["`displacement_um` is `1e999`"], "delete the sample", "E0508"),
    ] {
        refused(with_line(200, row), &Expected { line: Some(200), code, message, help });
    }
}

#[test]
fn time_that_does_not_rise_is_named_by_its_line_and_time() {
    // Row k is in line k + 2.
    let repeated = changed(|rows| rows[300][0] = rows[299][0]);
    refused(repeated, &expect(302, "E0510", &["23.359375 s", "must increase"], "delete the repeated sample"));
    let swapped = changed(|rows| rows.swap(300, 301));
    refused(swapped, &expect(303, "E0510", &["23.515625 s to 23.4375 s"], "sort or re-record"));
    // Two runs.
    let folder = prepared();
    folder.write(BAD, changed(|rows| rows[300..].iter_mut().for_each(|row| row[0] -= 20.0)));
    for document in met(&folder) {
        assert!(
            document.finding("N0523")["message"].as_str().unwrap().contains("starts again"),
            "{:#}",
            document.value
        );
    }
}

/// A sweep with 5 s per branch, labelled as 5 µs.
#[test]
fn a_record_in_another_unit_of_time_is_named() {
    let folder = prepared();
    folder.write(BAD, text_changed(|text| text.replace("time_s", "time_us")));
    let [spec, identify] = met(&folder);
    let says = |document: &Document, word: &str| {
        let mut findings = document.findings().iter().filter(|finding| finding["code"] == "W0519");
        findings.any(|finding| finding["message"].as_str().unwrap().contains(word))
    };
    assert_eq!((spec.code, identify.code), (0, 0), "{:#}", spec.value);
    assert!(says(&spec, "crosses its range") && says(&spec, "actuator.slew_rate"), "{:#}", spec.value);
    assert!(says(&identify, "crosses its range"), "{:#}", identify.value);
}

#[test]
fn a_gap_is_named_by_its_times() {
    let bursts =
        changed(|rows| *rows = rows.chunks(60).flat_map(|part| &part[..part.len().min(40)]).copied().collect());
    let between = &["nothing was recorded between 3.046875 s and 4.6875 s", "21 sampling intervals"];
    refused(bursts, &expect(42, "E0511", between, "without gaps"));
}

#[test]
fn a_signal_that_never_changes_is_named() {
    let drive = changed(|rows| rows.iter_mut().for_each(|row| row[1] = 12.5));
    refused(drive, &expect(None, "E0512", &["`drive_V` is 12.5 in every sample"], "channel connected"));
    let displacement = changed(|rows| rows.iter_mut().for_each(|row| row[2] = 3.0));
    refused(displacement, &expect(None, "E0512", &["`displacement_um` is 3", "every sample"], "channel connected"));
    let stuck = changed(|rows| rows.iter_mut().for_each(|row| row[2] = row[2].min(40.0)));
    let message = &["the displacement is limited at 40", "while the drive goes through"];
    let line = 2 + good(&Folder::new()).iter().position(|row| row[2] >= 40.0).unwrap();
    refused(stuck, &expect(line, "E0513", message, "range and the connection"));
}

#[test]
fn too_few_reversal_curves_are_counted() {
    refused(changed(|rows| rows.truncate(150)), &expect(None, "E0606", &["100 V"], "rise to the upper end"));
    refused(csv(&dense(1)), &expect(None, "E0607", &["1 reversal curve", "grid of 8"], "reversal"));
}

/// `curves` full loops of 200 samples between 0 V and 100 V, with some hysteresis.
fn dense(curves: usize) -> Vec<[f64; 3]> {
    let mut play = 0.0_f64;
    (0..=200 * curves)
        .map(|k| {
            let phase = (k % 200) as f64 / 100.0;
            let drive = 100.0 * if phase <= 1.0 { phase } else { 2.0 - phase };
            play = play.clamp(drive - 5.0, drive + 5.0);
            [k as f64 * 0.01, drive, 0.4 * drive + 0.2 * play]
        })
        .collect()
}

#[test]
fn a_file_that_holds_no_record_is_refused() {
    refused("", &expect(None, "E0504", &["is empty"], HEADER));
    refused("\n \n", &expect(None, "E0504", &["is empty"], HEADER));
    refused(format!("{HEADER}\n"), &expect(None, "E0509", &["has 0 samples", "100"], "more samples"));
    refused(changed(|rows| rows.truncate(20)), &expect(None, "E0509", &["has 20 samples"], "more samples"));
    let mut binary = csv(&good(&Folder::new())).into_bytes();
    let at = binary.iter().position(|&b| b == b'\n').unwrap() + 5;
    binary[at] = 0;
    refused(&binary, &expect(2, "E0503", &["not a text file", "0x00"], "CSV text in UTF-8"));
    binary[at] = 0xe9;
    refused(&binary, &expect(2, "E0503", &["not a text file", "0xe9"], "CSV text in UTF-8"));
}

#[test]
fn a_record_that_is_not_there_is_named() {
    let folder = prepared();
    let before = folder.listing();
    let [spec, identify] = met(&folder);
    let finding = spec.finding("E0306");
    assert_eq!(
        (spec.code, &finding["key"], &finding["file"]),
        (1, &"hysteresis.records[0]".into(), &"platform.toml".into())
    );
    assert!(finding["message"].as_str().unwrap().contains(BAD) && finding["line"].is_u64(), "{finding:#}");
    assert_eq!((identify.code, &identify.finding("E0501")["file"]), (1, &BAD.into()));
    fs::create_dir(folder.path(BAD)).unwrap();
    let [spec, identify] = met(&folder);
    assert_eq!((spec.code, identify.code), (1, 1));
    identify.finding("E0501");
    fs::remove_dir(folder.path(BAD)).unwrap();
    assert_eq!(folder.listing(), before);
}

#[test]
fn a_drive_in_another_unit_is_refused() {
    let millivolts = changed(|rows| rows.iter_mut().for_each(|row| row[1] *= 1e3));
    refused(millivolts, &expect(None, "E0603", &["0 V (at 0 s) to 100000 V (at 40 s)", "0 V to 100 V", "mV"], "volt"));
    let kilovolts = changed(|rows| rows.iter_mut().for_each(|row| row[1] *= 1e-3));
    refused(kilovolts, &expect(None, "E0603", &["0 V (at 0 s) to 0.1 V (at 40 s)", "kV"], "volt"));
}

#[test]
fn columns_in_the_wrong_order_are_refused() {
    let swapped = changed(|rows| rows.iter_mut().for_each(|row| row.swap(1, 2)));
    refused(swapped, &expect(None, "E0604", &["span of the drive"], "swapped"));
    let negative = changed(|rows| rows.iter_mut().for_each(|row| row[2] = -row[2]));
    refused(negative, &expect(None, "E0514", &["falls when the drive rises"], "sign"));
}

#[test]
fn a_record_that_does_not_cover_the_declared_range_is_refused() {
    let lower = changed(|rows| rows.iter_mut().for_each(|row| row[1] *= 0.75));
    refused(
        lower,
        &expect(None, "E0606", &["0 V (at 0 s) to 75 V (at 40 s)", "0 V to 100 V", "above 75 V"], "upper end"),
    );
    // The same good record with other limits: below, above, and around it.
    for (limits, code, words) in [
        ("\"0 V\", \"140 V\"", "E0606", ["0 V (at 0 s) to 100 V (at 40 s)", "0 V to 140 V"]),
        ("\"-20 V\", \"100 V\"", "E0606", ["0 V (at 0 s) to 100 V (at 40 s)", "-20 V to 100 V"]),
        ("\"0 V\", \"60 V\"", "E0605", ["0 V (at 0 s) to 100 V (at 40 s)", "0 V to 60 V"]),
    ] {
        let folder = prepared();
        folder.write(BAD, csv(&good(&folder)));
        let spec = folder.read("platform.toml");
        let spec = spec.replace("voltage         = [\"0 V\", \"100 V\"]", &format!("voltage         = [{limits}]"));
        folder.write("platform.toml", spec.replace("[\"0 V\", \"150 V\"]", "[\"-150 V\", \"150 V\"]"));
        let before = folder.listing();
        let document = folder.json(&["platform.toml", "-o", "out", "--no-build"]);
        let finding = document.finding(code);
        assert_eq!((document.code, &finding["file"]), (1, &BAD.into()));
        let message = finding["message"].as_str().unwrap();
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
        assert_eq!(folder.listing(), before);
    }
}

/// `identify` alone can only warn about an unusual magnitude; a spec has the stroke of its actuator.
#[test]
fn a_displacement_in_another_unit_is_pointed_out_and_refused_by_a_spec() {
    let folder = prepared();
    for (factor, word) in [(1e3, Some("is it in nm?")), (1e-3, None), (1e-6, Some("is it in mm or m?"))] {
        let mut rows = good(&folder);
        rows.iter_mut().for_each(|row| row[2] *= factor);
        folder.write(BAD, csv(&rows));
        if let Some(word) = word {
            for document in met(&folder) {
                let finding = document.finding("W0515");
                assert!(finding["message"].as_str().unwrap().contains(word), "{finding:#}");
            }
        }
        let before = folder.listing();
        let document = folder.json(&["platform.toml", "-o", "out", "--no-build"]);
        // An impossible unit is refused in any case, one that another actuator could have only because of the spec's.
        let code = if word.is_some() { "E0623" } else { "E0615" };
        assert_eq!((document.code, &document.finding(code)["file"]), (1, &BAD.into()));
        assert_eq!(folder.listing(), before);
    }
}

/// Bad records of several legs are all reported in one run.
#[test]
fn every_bad_record_of_a_spec_is_reported() {
    let folder = prepared();
    folder.write(BAD, "time_s,drive_V\n0,1\n");
    folder.write("records/empty.csv", "");
    let good = "\"records/leg1.csv\"";
    let six = format!("\"{BAD}\", {good}, {good}, \"records/empty.csv\", {good}, {good}");
    let spec = folder.read("platform.toml").replace(&format!("\"{BAD}\""), &six);
    folder.write("platform.toml", spec);
    let document = folder.json(&["check", "platform.toml"]);
    assert_eq!(document.code, 1);
    let files: Vec<&str> = document.findings().iter().map(|finding| finding["file"].as_str().unwrap()).collect();
    assert_eq!(files, [BAD, "records/empty.csv"]);
}
