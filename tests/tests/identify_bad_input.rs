//! Every way in which a record can be wrong gives a message that names the place and the fix, and nothing panics.

use std::fmt::Write as _;
use std::path::Path;

use crate::identify_support::{self, Drive, generator};
use rand_chacha::rand_core::Rng;
use specgen::diagnostic::{Diagnostic, Place, Severity};
use specgen::identify::{Options, Reading, Record, identify, read_file, read_record};

const RANGE: [f64; 2] = [0.0, 100.0];

/// Time (s), drive (V), displacement (µm) of a plausible record: eight curves and a play of 4 V.
fn good() -> Vec<[f64; 3]> {
    let drive = Drive::at(0.0, 100.0).reversal_curves(8, RANGE, 50.0);
    let mut play = 0.0_f64;
    let row = |(t, u): (f64, &f64)| {
        play = play.clamp(u - 4.0, u + 4.0);
        [t, *u, 0.4 * u + 0.2 * play]
    };
    drive.time().into_iter().zip(&drive.samples).map(row).collect()
}

fn csv(rows: &[[f64; 3]]) -> String {
    rows.iter().fold("time_s,drive_V,displacement_um\n".to_owned(), |mut text, [t, u, y]| {
        writeln!(text, "{t},{u},{y}").unwrap();
        text
    })
}

fn read(bytes: &[u8]) -> Result<Record, Vec<Diagnostic>> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("record.csv");
    std::fs::write(&path, bytes).unwrap();
    read_record(&path, "record.csv", &Reading::default())
}

/// Errors of reading, or of identification if reading succeeds.
fn errors(bytes: &[u8]) -> Vec<Diagnostic> {
    match read(bytes).and_then(|record| identify(&record, &Options::new(8, RANGE))) {
        Ok(_) => panic!("must be refused"),
        Err(all) => {
            for d in &all {
                assert!(matches!(&d.place, Place::File { path, .. } if path == "record.csv"), "{d:?}");
            }
            all
        }
    }
}

/// Asserts one finding whose code and message fit, and returns its line.
fn expect(all: &[Diagnostic], code: &str, text: &str) -> Option<usize> {
    match &identify_support::expect(all, code, text).place {
        Place::File { line, .. } => *line,
        other => panic!("{other:?}"),
    }
}

fn changed(change: impl FnOnce(&mut Vec<[f64; 3]>)) -> String {
    let mut rows = good();
    change(&mut rows);
    csv(&rows)
}

/// The good record with every sample changed.
fn each(change: impl FnMut(&mut [f64; 3])) -> String {
    changed(|rows| rows.iter_mut().for_each(change))
}

/// The record of an actuator of 0.5 um/V under `drive`.
fn straight(drive: &Drive) -> String {
    csv(&drive.time().iter().zip(&drive.samples).map(|(t, u)| [*t, *u, 0.5 * u]).collect::<Vec<_>>())
}

/// Asserts that the record `text` is refused, and returns the line of the finding.
fn refused(text: &str, code: &str, words: &str) -> Option<usize> {
    expect(&errors(text.as_bytes()), code, words)
}

#[test]
fn the_good_record_is_accepted() {
    let record = read(csv(&good()).as_bytes()).unwrap();
    assert!(record.warnings.is_empty(), "{:?}", record.warnings);
    let result = identify(&record, &Options::new(8, RANGE)).unwrap();
    assert!(result.warnings.is_empty(), "{:?}", result.warnings);
    assert_eq!(result.report.reversal_curves, 8);
}

#[test]
fn byte_order_mark_windows_lines_comments_and_column_order_are_accepted() {
    let mut text = "\u{feff}# made by hand\r\nDisplacement_um, note ,TIME_S,drive_v\r\n".to_owned();
    good().iter().for_each(|[t, u, y]| write!(text, "{y},x,{t},{u}\r\n").unwrap());
    let record = read(text.as_bytes()).unwrap();
    assert_eq!(record.drive, good().iter().map(|r| r[1]).collect::<Vec<_>>());
}

#[test]
fn files_that_are_no_text() {
    for path in [Path::new("no/such/file.csv"), &std::env::temp_dir()] {
        expect(&read_record(path, "record.csv", &Reading::default()).unwrap_err(), "E0501", "cannot be read");
    }
    refused("", "E0504", "is empty");
    refused("\n\n", "E0504", "is empty");
    assert_eq!(expect(&errors(b"time_s,drive_V,displacement_um\n0,1,\xff\n"), "E0503", "0xff"), Some(2));
    assert_eq!(expect(&errors(b"\x7fELF\x00\x01"), "E0503", "0x00"), Some(1));
    refused("time_s,drive_V,displacement_um\n", "E0509", "has 0 samples");
}

#[test]
fn a_huge_file_that_is_no_text_is_refused_without_reading_it_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("huge.csv");
    // A sparse file: a length, but no blocks.
    std::fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
    let all = read_record(&path, "record.csv", &Reading::default()).unwrap_err();
    expect(&all, "E0503", "0x00");
    let table = read_file(&path, "table.csv").unwrap_err();
    assert!(table[0].code == "E0502" && table[0].message.contains("larger than 256 MiB"), "{table:?}");
}

#[test]
fn columns() {
    let text = csv(&good());
    refused(&text.replacen("drive_V", "drve_V", 1), "E0504", "`drive_V` is missing");
    let all = errors(text.replacen("displacement_um", "displacement_foot", 1).as_bytes());
    assert!(all[0].help.contains("`displacement_nm`"), "{all:?}");
    let all = errors(text.replacen("time_s,drive_V,displacement_um", "a,b,c", 1).as_bytes());
    assert_eq!(all.len(), 3, "all three columns are reported: {all:?}");
    assert!(all[0].help.contains("--columns time_s=a,drive_V=b,displacement_um=c"), "{all:?}");
}

#[test]
fn bad_numbers_are_all_reported_with_line_and_column_and_counted() {
    let mut lines: Vec<String> = csv(&good()).lines().map(str::to_owned).collect();
    lines[4] = "0.03,abc,1".to_owned();
    lines[5] = "0.04,NaN,1".to_owned();
    lines[6] = "0.05,1,inf".to_owned();
    lines[7] = "0.06,1".to_owned();
    let all = errors(lines.join("\n").as_bytes());
    assert_eq!(expect(&all, "E0506", "`drive_V` is `abc`"), Some(5));
    assert_eq!(expect(&all, "E0508", "`drive_V` is `NaN`"), Some(6));
    assert_eq!(expect(&all, "E0508", "`displacement_um` is `inf`"), Some(7));
    assert_eq!(expect(&all, "E0506", "`displacement_um` is missing"), Some(8));
    for line in &mut lines[10..52] {
        *line = "0,x,0".to_owned();
    }
    let all = errors(lines.join("\n").as_bytes());
    assert!(all.iter().any(|d| d.message.contains("more lines")), "{all:?}");
    assert!(all.len() < 15, "{} findings", all.len());
}

#[test]
fn time() {
    assert_eq!(refused(&changed(|r| r[40][0] = r[39][0]), "E0510", "must increase"), Some(42));
    refused(&each(|r| r[0] = -r[0]), "E0510", "must increase");
    let record = read(changed(|r| drop(r.drain(300..350))).as_bytes()).unwrap();
    assert_eq!((record.time[0], record.warnings[0].code), (3.5, "N0523"), "{:?}", record.warnings);
    assert!(record.warnings[0].message.contains("0 s to 2.99 s"), "{:?}", record.warnings);
    let mut k = 0;
    let bursts = changed(|r| {
        r.retain(|_| {
            k += 1;
            k % 100 <= 60
        });
    });
    assert_eq!(refused(&bursts, "E0511", "between 0.59 s and 0.99 s"), Some(62));
    refused(&changed(|r| r.truncate(50)), "E0509", "has 50 samples");
}

#[test]
fn signals_that_do_not_move_or_do_not_fit() {
    refused(&each(|r| r[1] = 3.0), "E0512", "`drive_V` is 3");
    refused(&each(|r| r[2] = 3.0), "E0512", "`displacement_um` is 3");
    refused(&each(|r| r[2] = r[2].min(40.0)), "E0513", "is limited at 40");
    refused(&changed(|r| r[200..300].iter_mut().for_each(|r| r[2] = 9.0)), "E0513", "is stuck at 9");
    refused(&each(|r| r[2] = -r[2]), "E0514", "falls when the drive rises");
    let mut random = generator(1);
    refused(&each(|r| r[2] = (random.next_u64() >> 40) as f64 * 1e-6), "E0514", "hardly follows");
}

#[test]
fn wrong_units_and_swapped_columns() {
    refused(&each(|r| r[1] *= 1e3), "E0603", "in mV?");
    refused(&each(|r| r[1] *= 1e-3), "E0603", "in kV?");
    // The displacement of 60 um stands in the drive column, the 100 V in the other.
    refused(&each(|r| r.swap(1, 2)), "E0604", "table is to cover 0 V to 100 V");
    let record = read(each(|r| r[2] *= 1e3).as_bytes()).unwrap();
    assert!(record.warnings.iter().any(|d| d.code == "W0515" && d.message.contains("in nm?")), "{:?}", record.warnings);
    assert!(record.warnings.iter().all(|d| d.severity == Severity::Warning));
}

#[test]
fn records_that_do_not_cover_the_plane() {
    let curves = |count, range: [f64; 2]| straight(&Drive::at(range[0], 100.0).reversal_curves(count, range, 50.0));
    refused(&curves(8, [0.0, 60.0]), "E0606", "no cell with an up_threshold above 60 V");
    refused(&curves(8, [40.0, 100.0]), "E0606", "no cell with a down_threshold below 40 V");
    let wide = "to 150 V (at 24.04 s), but the table is to cover 0 V to 100 V; it leaves that range at 13.33 s";
    refused(&curves(8, [0.0, 150.0]), "E0605", wide);
    refused(&curves(1, RANGE), "E0607", "1 reversal curves");
    let rise: Vec<_> = (0..200).map(|k| [f64::from(k) * 0.01, f64::from(k) * 0.5, f64::from(k) * 0.3]).collect();
    refused(&csv(&rise), "E0607", "0 reversal curves");
    let fall: Vec<_> = rise.iter().map(|[t, u, y]| [*t, 99.5 - u, 60.0 - y]).collect();
    refused(&csv(&fall), "E0607", "never rises");
}

#[test]
fn a_part_of_the_plane_that_no_curve_enters_is_named() {
    // No reversal between 25 V and 75 V: cells in that band of up_thresholds always switch off together.
    let drive = [6.25, 12.5, 18.75, 25.0, 75.0, 81.25, 87.5, 93.75, 100.0];
    let drive = drive.iter().fold(Drive::at(0.0, 100.0), |drive, top| drive.ramp(*top, 50.0).ramp(0.0, 50.0));
    let record = read(straight(&drive).as_bytes()).unwrap();
    let result = identify(&record, &Options::new(16, RANGE)).unwrap();
    expect(&result.warnings, "W0609", "up_threshold 25.000 to 75.000 V, down_threshold 0.000 to 68.750 V");
    assert!((0.3..0.7).contains(&result.report.excited_share), "{}", result.report.excited_share);
}

#[test]
fn impossible_options() {
    let record = read(csv(&good()).as_bytes()).unwrap();
    for grid in [0, 1, 129, 10_000] {
        expect(&identify(&record, &Options::new(grid, RANGE)).unwrap_err(), "E0601", "grid of");
    }
    for drive in [[100.0, 0.0], [0.0, 0.0], [f64::NAN, 1.0], [0.0, f64::INFINITY]] {
        expect(&identify(&record, &Options::new(8, drive)).unwrap_err(), "E0602", "drive range");
    }
}

/// Bytes changed, cut and repeated at random places of a good file: any answer is right, as long as there is one.
#[test]
fn damaged_files_never_panic() {
    let text = csv(&good()).into_bytes();
    let mut random = generator(99);
    let mut at = |n: usize| (random.next_u64() % n as u64) as usize;
    for _ in 0..300 {
        let mut bytes = text.clone();
        for _ in 0..1 + at(20) {
            let (place, kind) = (at(bytes.len()), at(4));
            match kind {
                0 => bytes[place] = at(256) as u8,
                1 => bytes[place] = b"0123456789.,-e\n"[at(15)],
                2 => bytes.truncate(place.max(1)),
                _ => {
                    let piece = bytes[place..(place + 30).min(bytes.len())].to_vec();
                    bytes.extend(piece);
                }
            }
        }
        let _ = read(&bytes).and_then(|record| identify(&record, &Options::new(8, RANGE)).map(|_| ()));
    }
}
