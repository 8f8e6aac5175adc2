//! Files that are not UTF-8 text: the printed command converts each to a new file, which is then accepted.

use std::fs;
use std::process::Command;

use super::{NAMES, files, printed, run, shell};
use crate::support::{Folder, length, repository};

fn utf16(text: &str, mark: bool, swap: bool) -> Vec<u8> {
    let units = mark.then_some(0xfeff).into_iter().chain(text.encode_utf16());
    units.flat_map(|unit| if swap { unit.to_be_bytes() } else { unit.to_le_bytes() }).collect()
}

/// Whether a program is installed.
fn is_there(program: &str) -> bool {
    let found = Command::new("sh").args(["-c", &format!("command -v {program}")]).output().unwrap().status.success();
    if !found {
        crate::support::skipped(&format!("no {program}"));
    }
    found
}

#[test]
fn records_in_other_forms_are_read_as_they_are() {
    let record = fs::read(repository().join("specs/records/leg1.csv")).unwrap();
    let text = String::from_utf8(record.clone()).unwrap();
    let folder = Folder::new();
    for (name, content) in
        [("le.csv", utf16(&text, true, false)), ("be.csv", utf16(&text, true, true)), ("leg.csv.gz", gzip(&record))]
    {
        folder.write(name, &content);
        let (code, said) = run(&folder, &["identify"], name, &["--drive", "0:100", "--grid", "4"]);
        assert_eq!(code, 0, "{name}: {said}");
        let spec = format!("{name}.toml");
        let of_spec = folder.read("legs.toml").replace("records/reference-forc.csv", name);
        folder.write(&spec, of_spec.replace("grid    = 32", "grid    = 8"));
        let (code, said) = run(&folder, &["check"], &spec, &[]);
        assert_eq!(code, 0, "{name}: {said}");
    }
}

/// An array of NumPy with a row for each sample.
fn npy(rows: &[[f64; 3]]) -> Vec<u8> {
    let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, 3), }}\n", rows.len());
    let values = rows.iter().flatten().flat_map(|value| value.to_le_bytes());
    [b"\x93NUMPY\x01\0", &(header.len() as u16).to_le_bytes()[..], header.as_bytes()]
        .concat()
        .into_iter()
        .chain(values)
        .collect()
}

/// Files that need options: those of every message are given, and the file is read.
#[test]
fn suggested_options_are_accepted() {
    let text = fs::read_to_string(repository().join("specs/records/leg1.csv")).unwrap();
    let number = |field: &str| field.parse::<f64>().unwrap();
    let rows = text.lines().skip(1).filter(|line| !line.starts_with('#'));
    let rows: Vec<[f64; 3]> =
        rows.map(|line| line.split(',').map(number).collect::<Vec<_>>().try_into().unwrap()).collect();
    let file = |header: &str, separator: &str| {
        let line = |row: &[f64; 3]| row.map(|value| value.to_string()).join(separator) + "\n";
        (header.to_owned() + &rows.iter().map(line).collect::<String>()).into_bytes()
    };
    let untimed = |separator: &str| rows.iter().map(|[_, u, y]| format!("{u}{separator}{y}\n")).collect::<String>();
    let numbered = rows.iter().enumerate().map(|(k, [_, u, y])| format!("{k};{u};{y}\n")).collect::<String>();
    let empty_first = rows.iter().map(|[t, u, y]| format!(",{t},{u},{y}\n")).collect::<String>();
    let nanometres = rows.iter().map(|[t, u, y]| format!("{y};{t};{u}\n", y = 1e3 * y)).collect::<String>();
    let files: [(&str, Vec<u8>); 16] = [
        ("commas.csv", file("Time,s;Ch 1,V;Ch2,um\n", ";")),
        ("pairs.csv", file("Time,s,Ch1,V,Ch2,um\n", ",")),
        ("numbers.csv", file("", ",")),
        ("empty.csv", empty_first.clone().into_bytes()),
        ("index.csv", format!(",t,U,y\n{empty_first}").into_bytes()),
        ("untimed.txt", format!("U\ty\n{}", untimed("\t")).into_bytes()),
        ("untimed.csv", untimed(";").into_bytes()),
        ("samples.csv", format!("sample;U;it's $y\n{numbered}").into_bytes()),
        ("near.csv", file("tme_s,drive,displacement_ft\n", ",")),
        ("same.csv", file("a,a,a=`b`\n", ",")),
        ("scope.csv", file("Model,X\nSource,CH1,CH2\nTIME,CH1,CH2\n", ",")),
        ("rows.npy", npy(&rows)),
        ("volts.csv", file("Time (s),Voltage (V),Gauge (V)\n", ",")),
        ("labview.lvm", file("X_Value\tVoltage_0\tVoltage_1\n", "\t")),
        ("units.csv", format!("Weg (nm);Elapsed;Spannung [V]\n{nanometres}").into_bytes()),
        ("moments.csv", file("Time Stamp (sec),Field (Oe),Moment (emu)\n", ",")),
    ];
    for (name, content) in files {
        let folder = Folder::new();
        folder.write(name, content);
        let identify = ["--drive", "0:100", "--grid", "4"];
        let (code, said) = run(&folder, &["identify"], name, &identify);
        assert_eq!(code, 1, "{name}: {said}");
        let options: Vec<&str> =
            said.split('`').filter(|text| text.starts_with("--")).filter(|text| text.contains(' ')).collect();
        assert!(!options.is_empty(), "{name}: {said}");
        assert!(name != "volts.csv" || options[0].contains("drive_V=Voltage (V),"), "{options:?}");
        for options in options {
            let line = format!("specgen identify {name} --drive 0:100 --grid 4 {}", options.replace("HZ", "12.8"));
            let output = shell(&folder, &line);
            assert!(output.status.success(), "{line}: {output:?}");
        }
    }
}

/// A gzip file with stored content.
fn gzip(content: &[u8]) -> Vec<u8> {
    let mut packed = b"\x1f\x8b\x08\0\0\0\0\0\0\xff".to_vec();
    let mut pieces = content.chunks(65_535).peekable();
    while let Some(piece) = pieces.next() {
        packed.push(u8::from(pieces.peek().is_none()));
        let length = piece.len() as u16;
        packed.extend(length.to_le_bytes());
        packed.extend((!length).to_le_bytes());
        packed.extend(piece);
    }
    let crc = !content.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    });
    packed.extend(crc.to_le_bytes());
    packed.extend((content.len() as u32).to_le_bytes());
    packed
}

#[test]
fn specs_in_other_encodings_become_text_and_stay() {
    if !is_there("iconv") {
        return;
    }
    let forms = [(true, false), (true, true), (false, false), (false, true)];
    for (number, name) in NAMES.into_iter().enumerate() {
        if number >= length(4, NAMES.len()) {
            break;
        }
        for &(mark, swap) in length(&forms[number % 4..][..1], &forms) {
            let folder = Folder::new();
            let text = folder.read("minimal.toml");
            let name = format!("{name}.toml");
            folder.write(&name, utf16(&text, mark, swap));
            let before = files(&folder);
            let (code, said) = run(&folder, &["check"], &name, &[]);
            let lines = printed(&said, "iconv");
            assert!(code == 1 && lines.len() == 1, "{name}: {said}");
            let output = shell(&folder, &lines[0]);
            assert!(output.status.success(), "{output:?}");
            let new = name.replace(".toml", ".utf8.toml");
            let mut after = files(&folder);
            let made = after.remove(&new).unwrap_or_else(|| panic!("no {new}: {said}"));
            assert_eq!(after, before, "{}", lines[0]);
            assert_eq!(String::from_utf8(made).unwrap().trim_start_matches('\u{feff}'), text);
            assert_eq!(run(&folder, &["check"], &new, &[]).0, 0);
        }
    }
}
