//! Small files as the programs of the bench write them: each is read as the same record, or refused with a fix that is taken.

use super::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// Time (s), drive (V), displacement (µm) of three loops of a play.
pub(super) fn rows() -> Vec<[f64; 3]> {
    let mut play = 0.0_f64;
    let row = |k: u32| {
        let phase = f64::from(k % 80);
        let drive = 2.5 * if phase < 40.0 { phase } else { 80.0 - phase } - 20.0;
        play = play.clamp(drive - 4.0, drive + 4.0);
        [f64::from(k) * 1e-3, drive, 0.25 * drive + 0.125 * play + 0.5]
    };
    (0..240).map(row).collect()
}

/// A file of `header` and a line for each sample.
pub(super) fn file(header: &str, line: impl Fn([f64; 3]) -> String) -> String {
    rows().into_iter().fold(format!("{header}\n"), |text, row| text + &line(row) + "\n")
}

pub(super) fn comma(value: f64) -> String {
    format!("{value:.6}").replace('.', ",")
}

pub(super) fn read(bytes: &[u8], columns: &[&str], rate: Option<f64>) -> Result<Record, Vec<Diagnostic>> {
    let columns: Vec<String> = columns.iter().map(|text| (*text).to_owned()).collect();
    read_as(bytes, &Reading::new(&columns, rate).unwrap())
}

pub(super) fn read_as(bytes: &[u8], reading: &Reading) -> Result<Record, Vec<Diagnostic>> {
    decode_record(bytes.to_vec(), "r.csv", reading)
}

pub(super) fn assert_same(name: &str, found: Result<Record, Vec<Diagnostic>>) -> Record {
    let record = found.unwrap_or_else(|found| panic!("{name}: {found:#?}"));
    assert_eq!(record.time.len(), rows().len(), "{name}");
    for (k, [t, u, y]) in rows().into_iter().enumerate() {
        let off = [record.time[k] - t, record.drive[k] - u, 1e6 * record.displacement[k] - y];
        assert!(off.iter().all(|off| off.abs() < 1e-9), "{name}, sample {k}: off by {off:?}");
    }
    record
}

const LABVIEW: &str = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nTime\t10:11:12,3\n***End_of_Header***\t\n\t\n\
    Channels\t2\nSamples\t240\t240\nY_Unit_Label\tVolts\tVolts\nX0\t0\t0\nDelta_X\t0,001\t0,001\n***End_of_Header***\t";

#[test]
fn every_kind_of_text_gives_the_same_record() {
    let names = "X_Value\tVoltage\tVoltage (Filtered)\tComment";
    let by_name: &[&str] = &["drive_V=Voltage", "displacement_um=Voltage (Filtered)"];
    let lines: [(&str, String, &[&str], Option<f64>); 26] = [
        ("plain", file("time_s,drive_V,displacement_um", |[t, u, y]| format!("{t},{u},{y}")), &[], None),
        (
            "semicolons, decimal commas, other units and order",
            file("Position [nm];Zeit [ms];Drive (mV)", |[t, u, y]| {
                [comma(1e3 * y), comma(1e3 * t), comma(1e3 * u)].join(";")
            }),
            &[],
            None,
        ),
        (
            "blanks",
            file("# time_s drive_V displacement_um", |[t, u, y]| format!(" {t:.6e}  {u:.6e} {y:.9e}")),
            &[],
            None,
        ),
        (
            "quotes",
            file("\"time_s\",\"drive_V\",\"displacement_um\"", |[t, u, y]| format!("\"{t}\",{u},\"{y}\"")),
            &[],
            None,
        ),
        (
            "a line of units",
            file("time\tdrive\tdisplacement\ns\tV\tµm", |[t, u, y]| format!("{t}\t{u}\t{y}")),
            &[],
            None,
        ),
        (
            "a spreadsheet's first line",
            file("sep=;\nt (s);drive_V;displacement_µm", |row| row.map(comma).join(";")),
            &[],
            None,
        ),
        ("LabVIEW", file(&format!("{LABVIEW}\n{names}"), |row| row.map(comma).join("\t")), by_name, None),
        (
            "LabVIEW without times",
            file(&format!("{LABVIEW}\n{names}"), |[_, u, y]| format!("\t{}\t{}", comma(u), comma(y))),
            by_name,
            None,
        ),
        (
            "no names",
            file("", |[t, u, y]| format!("{y};{u};{t}")),
            &["displacement_um=1", "drive_V=2", "time_s=3"],
            None,
        ),
        ("no times", file("drive_V,displacement_um", |[_, u, y]| format!("{u},{y}")), &[], Some(1e3)),
        (
            "sample numbers",
            file("Sample,drive_V,displacement_um", |[t, u, y]| format!("{:.0},{u},{y}", 1e3 * t)),
            &[],
            Some(1e3),
        ),
        (
            "a rule below the names",
            file("| time_s | drive_V | displacement_nm |\n|---|---|---|", |[t, u, y]| {
                format!("| {t} | {u} | {:?} |", 1e3 * y)
            }),
            &[],
            None,
        ),
        (
            "units above the names",
            file("ms\tV\tnm\nTime\tDrive\tPosition", |[t, u, y]| format!("{:?}\t{u}\t{:?}", 1e3 * t, 1e3 * y)),
            &[],
            None,
        ),
        (
            "blanks in names",
            file("# Time (ms)   Drive [ V ]   Position (um)", |[t, u, y]| format!("{:?}   {u}  {y}", 1e3 * t)),
            &[],
            None,
        ),
        (
            "names in a comment, one of them known",
            file("% by hand\n%t [s],U (mV),Weg (nm)", |[t, u, y]| format!("{t},{:?},{:?}", 1e3 * u, 1e3 * y)),
            &["drive_mV=2", "displacement_nm=Weg (nm)"],
            None,
        ),
        (
            "names of two words",
            file("Elapsed time  Amplifier  Position sensor", |[t, u, y]| format!("{t}  {u}  {y}")),
            &["time_s=Elapsed time", "drive_V=2", "displacement_um=Position sensor"],
            None,
        ),
        (
            "an oscilloscope's interval",
            file("X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,0.0,1e-3", |[t, u, y]| {
                format!("{},{u},{y},", 1e3 * t)
            }),
            &["drive_V=CH1", "displacement=CH2*1 um/V"],
            None,
        ),
        (
            "an interval in the preamble",
            file("# DIM = 2\n# SAMPLE_TIME = 0.001\n# END_HEADER", |[_, u, y]| format!("{u} {y} ")),
            &["drive_V=1", "displacement_um=2"],
            None,
        ),
        (
            "dates and times over midnight",
            file("Timestamp,drive_V,displacement_um", |[t, u, y]| {
                let (day, seconds) = if t < 0.1 { (4, 59.9 + t) } else { (5, t - 0.1) };
                let clock = if day == 4 { "23:59" } else { "00:00" };
                format!("2024-03-0{day}T{clock}:{seconds:06.3}Z,{u},{y}")
            }),
            &["time_s=1"],
            None,
        ),
        (
            "a last line",
            file("time_s;drive_V;displacement_um", |row| row.map(comma).join(";")) + "\nMean;1,5;2\nEnd of file\n",
            &[],
            None,
        ),
        (
            "exponents of Fortran",
            file("time_s drive_V displacement_um", |row| {
                row.map(|value| format!("{value:.9e}").replace('e', "D")).join(" ")
            }),
            &[],
            None,
        ),
        ("a column PAR1", file("PAR1,time_s,drive_V,displacement_um", |[t, u, y]| format!("1,{t},{u},{y}")), &[], None),
        (
            "a separator behind each row",
            file("Time s,Drive V,Position um", |[t, u, y]| format!("{t},{u},{y},")),
            &["drive_V=2"],
            None,
        ),
        (
            "columns of words",
            file("dir,mark,time_s,drive_V,displacement_um", |[t, u, y]| format!("up,d,{t},{u},{y}")),
            &[],
            None,
        ),
        (
            "a rule below the rows",
            file("time_s,drive_V,displacement_um", |[t, u, y]| format!("{t},{u},{y}")) + "+---+---+---+\n",
            &[],
            None,
        ),
        ("a note", file("time_s,note,drive_V,displacement_um", |[t, u, y]| format!("{t},a,{u},{y},b")), &[], None),
    ];
    for (name, text, columns, rate) in lines {
        let record = assert_same(name, read(text.as_bytes(), columns, rate));
        let notes = usize::from(name == "a last line");
        assert!(!record.monitored && record.warnings.len() == notes, "{name}: {:?}", record.warnings);
        for end in ["\r\n", "\r"] {
            assert_same(name, read(text.replace('\n', end).as_bytes(), columns, rate));
        }
    }
    let latin: Vec<u8> = file("time_s,monitor_V,displacement_?m", |[t, u, y]| format!("{t},{u},{y}"))
        .bytes()
        .map(|byte| if byte == b'?' { 0xb5 } else { byte })
        .collect();
    assert!(assert_same("Latin-1", read(&latin, &[], None)).monitored);
}

/// A file, the code and a word of the help of its refusal, and with what it is then taken.
type RefusalCase<'a> = (&'a str, &'a str, &'a str, String, &'a [&'a str], Option<f64>);

/// Each with the code, a word of the help, and the file as the help would have it.
#[test]
fn what_is_refused_says_what_is_then_taken() {
    let plain = |header: &str| file(header, |[t, u, y]| format!("{t},{u},{y}"));
    let commas = file("time_s,drive_V,displacement_um", |row| row.map(comma).join(","));
    let mended = file("time_s,drive_V,displacement_um", |row| row.map(comma).join(";"));
    let first = mended.lines().nth(1).unwrap();
    let mixed = file("time_s;drive_V;displacement_um", |[t, u, y]| format!("{};{u:.3};{}", comma(t), comma(y)));
    let cases: [RefusalCase; 7] = [
        (&commas, "E0506", first, mended.clone(), &[], None),
        (&mixed, "E0506", "same decimal sign", mixed.replace(',', "."), &[], None),
        (
            &plain("time_s,drive,displacement_um"),
            "E0504",
            "rename `drive` to `drive_V`",
            plain("time_s,drive_V,displacement_um"),
            &[],
            None,
        ),
        (
            &plain("time_s,U,displacement_um"),
            "E0504",
            "--columns drive_V=U",
            plain("time_s,U,displacement_um"),
            &["drive_V=U"],
            None,
        ),
        (
            &plain("time_s,drive_V,displacement_foot"),
            "E0504",
            "`displacement_um`",
            plain("time_s,drive_V,displacement_um"),
            &[],
            None,
        ),
        (
            &plain("sample,drive_V,displacement_um"),
            "E0504",
            "--rate HZ",
            plain("note,drive_V,displacement_um"),
            &[],
            Some(1e3),
        ),
        (
            &plain(""),
            "E0504",
            "--columns time_s=1,drive_V=2,displacement_um=3",
            plain(""),
            &["time_s=1", "drive_V=2", "displacement_um=3"],
            None,
        ),
    ];
    for (text, code, help, fixed, columns, rate) in cases {
        let found = read(text.as_bytes(), &[], None).unwrap_err();
        assert!(found[0].code == code && found[0].help.contains(help), "{help}: {found:#?}");
        assert_same(help, read(fixed.as_bytes(), columns, rate));
    }
    let found = read(b"time_s,drive_V,displacement_um\n0,0,0\n", &["drive_V=7"], None).unwrap_err();
    assert!(found[0].message.contains("names `7` for `drive_V`"), "{found:?}");
    for (magic, message, help) in [
        (&b"MATLAB 5.0 MAT-file, Platform"[..], "damaged or cut off", "arrays of numbers"),
        (b"MATLAB 7.3 MAT-file, Platform", "cannot be read", "arrays of numbers"),
        (b"\x89HDF\r\n\x1a\n", "cannot be read", "arrays of numbers"),
        (b"TDSm\x0e\0\0\0", "damaged or cut off", "arrays of numbers"),
        (b"\x93NUMPY\x01\0", "damaged or cut off", "arrays of numbers"),
        (b"PK\x03\x04", "a ZIP archive", "unpack it"),
        (&[b"PK\x03\x04", &[0; 26][..], b"[Content_Types].xml"].concat(), "a spreadsheet", "as CSV"),
        (b"\0\0\0\0\x41\x02\0\0\x01\0\0\0\0\0\0\0\x07\0\0\0time_s\0", "MAT-file of version 4", "'-v7'"),
        (b"BZh91AY", "packed by bzip2", "unpack it"),
        (b"\xfd7zXZ\0", "packed by xz", "unpack it"),
        (b"{\"time_s\": [0, 1]}", "JSON", "as CSV"),
        (b"PAR1\x15\x04\x15\x10", "a Parquet file", "as CSV"),
        (b"%PDF-1.4\n%", "a PDF document", "as CSV"),
        (b"\x1f\x8b\x08", "cannot be unpacked", "copy the file again"),
        (b"\xff\xfet\0\n", "odd number of bytes", "copy the file again"),
    ] {
        let found = read(magic, &[], None).unwrap_err();
        let fits = found[0].code == "E0503" && found[0].message.contains(message) && found[0].help.contains(help);
        assert!(fits, "{found:?}");
    }
}

pub(super) fn containers() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src/record/tests/containers")
}

/// As scipy, h5py and nptdms write them (`make.py` beside them): the bits of every value.
#[test]
fn files_of_matlab_hdf5_and_tdms_are_the_same_record() {
    for name in ["v5.mat", "v5-plain.mat", "v7.3.mat", "record.h5", "record.tdms"] {
        let record = read_record(&containers().join(name), name, &Reading::default())
            .unwrap_or_else(|found| panic!("{name}: {found:#?}"));
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        let wanted = |k: usize, scale: f64| rows().iter().map(|row| (row[k] * scale).to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&record.time), wanted(0, 1.0), "{name}");
        assert_eq!(bits(&record.drive), wanted(1, 1.0), "{name}");
        assert_eq!(bits(&record.displacement), wanted(2, 1e-6), "{name}");
    }
    // Other names are named as in a text.
    let reading = Reading::new(&["drive=displacement_um*1 V/um,displacement=drive_V*1 um/V".to_owned()], None).unwrap();
    let swapped = read_record(&containers().join("v5.mat"), "v5.mat", &reading).unwrap();
    assert_eq!(swapped.drive[7].to_bits(), rows()[7][2].to_bits());
}

#[test]
fn the_form_of_hdf5_2_is_named() {
    let found = read(&std::fs::read(containers().join("hdf5-2.0.h5")).unwrap(), &[], None).unwrap_err();
    assert!(found[0].code == "E0503" && found[0].message.contains("libver=('earliest', 'v114')"), "{found:?}");
}

/// Bytes changed and files cut short: an answer that names the file's kind and what to do, or a record.
#[test]
fn damaged_files_of_matlab_hdf5_and_tdms_are_answered() {
    let folder = std::env::temp_dir().join(format!("specgen-containers-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut refused = 0;
    for name in ["v5.mat", "v5-plain.mat", "v7.3.mat", "record.h5", "record.tdms"] {
        let good = std::fs::read(containers().join(name)).unwrap();
        for _ in 0..60 {
            let mut bytes = good.clone();
            for _ in 0..1 + random.next_u32() % 4 {
                let at = 20 + random.next_u32() as usize % (bytes.len() - 20);
                match random.next_u32() % 3 {
                    0 => bytes[at] = random.next_u32() as u8,
                    1 => bytes[at] = 0xff,
                    _ => bytes.truncate(at.max(24)),
                }
                if bytes.len() < 40 {
                    break;
                }
            }
            let path = folder.join(name);
            std::fs::write(&path, &bytes).unwrap();
            if let Err(found) = read_record(&path, name, &Reading::default()) {
                refused += 1;
                assert!(!found.is_empty() && found.iter().all(|one| !one.help.is_empty()), "{found:?}");
            }
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(refused > 50, "{refused}");
}

/// A butterfly loop, and a gauge in the column of the drive, are called what they are.
#[test]
fn loops_that_no_table_holds_are_named() {
    // Wherever it turns, and with a gauge of either sign.
    for (turn, gain) in [(30.0, 0.1), (15.0, 0.1), (45.0, 0.1), (20.0, -0.1)] {
        let butterfly = file("time_s,drive_V,displacement_um", |[t, u, _]| {
            format!("{t},{u},{}", gain * (u - turn).abs() + 1e-3 * u)
        });
        let found = read(butterfly.as_bytes(), &[], None).unwrap_err();
        assert!(found[0].code == "E0514" && found[0].message.contains("butterfly"), "{found:?}");
    }
}

/// Rows cost their numbers, not their text; a line without end is not waited for.
#[test]
fn endless_lines_and_files_are_cut_short() {
    let endless = std::io::repeat(b'1');
    let found = of_source(Source::whole(endless), &Reading::default(), Findings::new("r.csv")).unwrap_err();
    assert!(found[0].message.contains("longer than 64 KiB"), "{found:?}");
    let found = of_source(Source::whole(std::io::repeat(0)), &Reading::default(), Findings::new("r.csv")).unwrap_err();
    assert_eq!(found[0].code, "E0503");
}

/// Bytes changed, cut and repeated in files of every kind: any answer is right, as long as there is one.
#[test]
fn damaged_files_are_answered() {
    use rand_chacha::rand_core::{Rng, SeedableRng};
    let files = [
        file(&format!("{LABVIEW}\nX_Value\tdrive_V\tdisplacement_um"), |row| row.map(comma).join("\t")),
        file("Zeit [ms];Drive (mV);Position [nm]\ns;V;m", |row| row.map(comma).join(";")),
        file("# time_s drive_V displacement_um", |[t, u, y]| format!("{t} {u} {y}")),
        file("", |row| row.map(comma).join(",")),
    ];
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut below = |n: usize| (random.next_u64() % n as u64) as usize;
    let mut refused = 0;
    for round in 0..150 {
        let mut bytes = files[round % files.len()].clone().into_bytes();
        for _ in 0..=below(12) {
            let reach = if below(2) == 0 { 300 } else { bytes.len() };
            let place = below(reach).min(bytes.len() - 1);
            match below(4) {
                0 => bytes[place] = below(256) as u8,
                1 => bytes[place] = b"0123456789.,;-e\t\n#\"_"[below(20)],
                2 => bytes.truncate(place.max(1)),
                _ => bytes.extend_from_within(place..(place + 40).min(bytes.len())),
            }
        }
        let columns: &[&str] = if round % 3 == 0 { &["drive_V=2", "sample=1"] } else { &[] };
        if let Err(found) = read(&bytes, columns, (round % 2 == 0).then_some(1e3)) {
            refused += 1;
            let is_whole = |d: &Diagnostic| !d.message.is_empty() && !d.help.is_empty();
            assert!(!found.is_empty() && found.iter().all(is_whole), "{found:?}");
        }
    }
    assert!(refused > 50, "{refused}");
}
