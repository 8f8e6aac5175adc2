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
fn records_in_other_forms_become_text_and_stay() {
    let record = fs::read(repository().join("specs/records/leg1.csv")).unwrap();
    let text = String::from_utf8(record.clone()).unwrap();
    let kinds: [(&str, &str, Vec<u8>, bool); 8] = [
        (".csv", "iconv", utf16(&text, true, false), true),
        (".csv", "iconv", utf16(&text, true, true), true),
        (".csv", "gunzip", gzip(&record), true),
        (".csv.gz", "gunzip", gzip(&record), true),
        (".mat", "python3", b"MATLAB 5.0 MAT-file, damaged".to_vec(), false),
        (".h5", "python3", b"\x89HDF\r\n\x1a\ndamaged".to_vec(), false),
        (".tdms", "python3", b"TDSmdamaged".to_vec(), false),
        (".npy", "python3", b"\x93NUMPY\x01\0".to_vec(), false),
    ];
    for (number, (ending, program, content, is_record)) in kinds.into_iter().enumerate() {
        if !is_there(program) {
            continue;
        }
        // In the short run, one name for each.
        for name in length(&NAMES[number % NAMES.len()..][..1], &NAMES) {
            let folder = Folder::new();
            let name = format!("{name}{ending}");
            folder.write(&name, &content);
            // An existing file is not overwritten.
            folder.write("leg.utf8.csv", "mine");
            let before = files(&folder);
            let identify = ["--drive", "0:100", "--grid", "4"];
            let (code, text) = run(&folder, &["identify"], &name, &identify);
            let lines = printed(&text, program);
            let [line] = &lines[..] else { panic!("{name}: {text}") };
            assert_eq!(code, 1, "{text}");
            let output = shell(&folder, line);
            assert!(output.status.success(), "{line}: {output:?}");
            let mut after = files(&folder);
            let new: Vec<String> = after.keys().filter(|file| !before.contains_key(*file)).cloned().collect();
            let [new] = &new[..] else { panic!("{line}: {new:?}") };
            let made = after.remove(new).unwrap();
            assert_eq!(after, before, "{line}");
            assert!(text.contains(new.as_str()), "the help names {new}: {text}");
            if is_record {
                assert!(made == record, "{line}");
                let (code, text) = run(&folder, &["identify"], new, &identify);
                assert_eq!(code, 0, "{text}");
            } else {
                assert!(made.starts_with(b"a_V,b\n1,") || made.starts_with(b"1,2"), "{line}");
            }
        }
    }
    // The record is relative to the spec, not to the current folder.
    if is_there("iconv") {
        let folder = Folder::new();
        fs::create_dir_all(folder.path("my specs/records")).unwrap();
        fs::copy(folder.path("legs.toml"), folder.path("my specs/legs.toml")).unwrap();
        folder.write("my specs/records/reference-forc.csv", utf16(&text, true, false));
        let before = files(&folder);
        let (_, text) = run(&folder, &["check"], "my specs/legs.toml", &[]);
        let line = printed(&text, "iconv").remove(0);
        assert!(shell(&folder, &line).status.success(), "{line}");
        let mut after = files(&folder);
        assert!(
            after.remove("my specs/records/reference-forc.utf8.csv").unwrap() == record && after == before,
            "{line}"
        );
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
