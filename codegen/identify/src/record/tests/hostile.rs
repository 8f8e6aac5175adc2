//! Files that are cut off, or made to exhaust memory or time: a finding, soon.

use std::io::Write as _;
use std::time::{Duration, Instant};

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};

use super::files::{file, read_as};
use super::mat_file::{column, element, sized};
use super::*;
use crate::memory;

/// Time for any file here, with other tests beside it.
const SOON: Duration = Duration::from_secs(20);

fn refusal(bytes: &[u8], max_size: u64) -> Diagnostic {
    let begun = Instant::now();
    let found = read_as(bytes, &Reading::default().with_max_size(max_size)).unwrap_err();
    assert!(begun.elapsed() < SOON, "{:?}", begun.elapsed());
    found.into_iter().find(|one| one.code.starts_with('E')).unwrap()
}

fn mat(elements: &[u8]) -> Vec<u8> {
    let mut header = b"MATLAB 5.0 MAT-file".to_vec();
    header.resize(126, b' ');
    [&header[..], b"IM", elements].concat()
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::default());
    packed.write_all(bytes).unwrap();
    let packed = packed.finish().unwrap();
    [&15_u32.to_le_bytes()[..], &(packed.len() as u32).to_le_bytes(), &packed].concat()
}

/// Packed, these files have less than 1 MB.
#[test]
fn parts_of_mat_files_are_counted_before_they_take_memory() {
    const MB: usize = 1_000_000;
    let array = |class, size: &[u8], name: &[u8], data: &[u8]| sized(class, &element(5, size), &element(1, name), data);
    let [none, one] = [[0; 8], [1, 0, 0, 0, 1, 0, 0, 0]];
    let fields = |width: u32, names: &[u8]| [element(5, &width.to_le_bytes()), element(1, names)].concat();
    let inner = array(2, &one, b"", &[fields(1, &[b'a'; 10_000]), [14, 0, 0, 0, 0, 0, 0, 0].repeat(10_000)].concat());
    let hostile = [
        ("names of fields", array(2, &none, b"s", &fields(1, &vec![b'a'; 40 * MB]))),
        ("structs in a struct", array(2, &one, b"s", &[fields(1, &[b'a'; 600]), inner.repeat(600)].concat())),
        ("numbers", array(6, &one, b"x", &element(1, &vec![1; 40 * MB]))),
        ("dimensions", sized(6, &element(1, &vec![1; 40 * MB]), &element(1, b"x"), &[])),
        ("length of names", array(2, &one, b"s", &element(1, &vec![1; 40 * MB]))),
        ("name", array(6, &one, &vec![0xff; 40 * MB], &[])),
        ("text", array(4, &one, b"t", &element(1, &vec![0xff; 40 * MB]))),
    ];
    for (name, variable) in hostile {
        let (unpacked, packed) = (variable.len(), mat(&zlib(&variable)));
        drop(variable);
        assert!(packed.len() < MB && unpacked >= 40 * MB, "{name}: {} of {unpacked} bytes", packed.len());
        let (found, peak) = memory::peak(|| read_as(&packed, &Reading::default()));
        assert!(found.is_err() && peak < 4 * unpacked + 64 * MB, "{name}: {peak} bytes of memory for {unpacked}");
    }
}

/// Files of each kind with three columns of doubles, or of bytes, which are counted as doubles.
#[test]
fn good_files_take_no_more_memory_than_is_documented() {
    const ROWS: usize = 400_000;
    let drive = |row: usize| (row % 200).abs_diff(100) as u8;
    let doubles = |name: &str| -> Vec<f64> {
        (0..ROWS).map(|row| if name == "time_s" { row as f64 * 1e-3 } else { f64::from(drive(row)) * 0.1 }).collect()
    };
    let names = ["time_s", "drive_V", "displacement_um"];
    let plain: Vec<Vec<u8>> = names.iter().map(|name| column(name, &doubles(name))).collect();
    let [mut hdf5, mut chunked] = [hdf5_pure::FileBuilder::new(), hdf5_pure::FileBuilder::new()];
    for name in names {
        hdf5.create_dataset(name).with_f64_data(&doubles(name));
        chunked.create_dataset(name).with_f64_data(&doubles(name)).with_chunks(&[10_000]).with_deflate(6);
    }
    let arrays = specgen_language::arrays::Table {
        columns: names.map(|name| (name.to_owned(), specgen_language::arrays::Column::Numbers(doubles(name)))).into(),
        comment: String::new(),
    };
    let bytes: Vec<u8> = (0..ROWS).map(drive).collect();
    let of_bytes = |name: &str| {
        sized(
            6,
            &element(5, &[ROWS as u32, 1].map(u32::to_le_bytes).concat()),
            &element(1, name.as_bytes()),
            &element(2, &bytes),
        )
    };
    let files = [
        ("MAT", mat(&plain.concat())),
        ("MAT, packed", mat(&plain.iter().flat_map(|column| zlib(column)).collect::<Vec<_>>())),
        ("MAT of bytes", mat(&[plain[0].clone(), of_bytes(names[1]), of_bytes(names[2])].concat())),
        ("HDF5", hdf5.finish().unwrap()),
        ("HDF5, packed", chunked.finish().unwrap()),
        ("NumPy", specgen_language::arrays::Form::Npz.file(&arrays).unwrap()),
    ];
    for (name, file) in files {
        // What becomes of the columns is another matter.
        let read = || {
            let mut findings = Findings::new("r");
            let source = Source::of_bytes(file.clone(), &Reading::default(), &mut findings)?;
            signals::columns_of(source, &wanted(true), &Reading::default(), &mut findings)
        };
        let (signals, peak) = memory::peak(read);
        assert_eq!(signals.unwrap().lines.len(), ROWS, "{name}");
        assert!(peak < 4 * 24 * ROWS, "{name}: {peak} bytes of memory");
    }
}

/// The name of a group is with each of its datasets.
#[test]
fn long_names_are_left_out() {
    let mut builder = hdf5_pure::FileBuilder::new();
    let mut group = builder.create_group(&"g".repeat(60_000));
    for k in 0..4_000 {
        group.create_dataset(&format!("c{k}")).with_f64_data(&[1.0, 2.0]);
    }
    builder.add_group(group.finish());
    let file = builder.finish().unwrap();
    let (found, peak) = memory::peak(|| read_as(&file, &Reading::default()));
    let found = found.unwrap_err();
    assert!(found[0].message.contains("a name of more than 256 bytes") && found[0].message.len() < 1000, "{found:?}");
    assert!(peak < 4 * file.len() + 64_000_000, "{peak} bytes of memory for a file of {}", file.len());
    let name = "n".repeat(300);
    let npz = specgen_language::arrays::zipped([("a.npy", &b""[..]), (&name, &b""[..])]).unwrap();
    let found = refusal(&npz, 1 << 31);
    assert!(found.message.contains("a name of more than 256 bytes"), "{found:?}");
}

/// Each chunk of a dataset has an entry in a list.
#[test]
fn chunks_of_one_number_are_counted() {
    let mut chunks = hdf5_pure::FileBuilder::new();
    chunks.create_dataset("time_s").with_f64_data(&vec![1.0; 400_000]).with_chunks(&[1]);
    let file = chunks.finish().unwrap();
    let size = file.len();
    let reading = Reading::default().with_max_size(20_000_000);
    let (found, peak) = memory::peak(|| read_as(&file, &reading));
    assert!(peak < 4 * 20_000_000, "{peak} bytes of memory for a file of {size}");
    assert_eq!(found.unwrap_err()[0].code, "E0502");
}

/// The message names the size, and the option that it names is enough.
#[test]
fn bombs_are_refused_with_the_size_that_reads_them() {
    let columns = |rows: usize| {
        let of = |k: usize, name: &str| {
            let values: Vec<f64> = (0..rows).map(|row| (row * 3 + k) as f64 * 1e-3).collect();
            column(name, &values)
        };
        ["time_s", "drive_V", "displacement_um"].iter().enumerate().map(|(k, name)| zlib(&of(k, name))).collect()
    };
    let packed: Vec<Vec<u8>> = columns(60_000);
    let text = file("time_s,drive_V,displacement_um", |[t, u, y]| format!("{t},{u},{y}{}", " ".repeat(9000)));
    let mut gzip = GzEncoder::new(Vec::new(), Compression::default());
    gzip.write_all(text.as_bytes()).unwrap();
    for bytes in [mat(&packed.concat()), gzip.finish().unwrap()] {
        assert!(bytes.len() < 1_000_000);
        let found = refusal(&bytes, 1_000_000);
        let (_, shown) = found.help.split_once("`--max-size ").unwrap();
        let (shown, _) = shown.split_once('`').unwrap();
        let is_shown = found.message.contains(&format!("is {shown} in memory, more than 1MB"));
        assert!(found.code == "E0502" && is_shown, "{found:?}");
        let named = Reading::default().with_max_size(crate::size(shown).unwrap());
        assert!(read_as(&bytes, &named).map_or_else(|found| found.iter().all(|one| one.code != "E0502"), |_| true));
    }
    // Numbers may take more than their text.
    let mut gzip = GzEncoder::new(Vec::new(), Compression::default());
    gzip.write_all(b"0,0,0\n".repeat(100_000).as_slice()).unwrap();
    let found = refusal(&gzip.finish().unwrap(), 1_000_000);
    assert!(found.code == "E0502" && found.message.contains("3.2MB in memory"), "{found:?}");
    // Far beyond: counting it would take as long as it pleases.
    let found = refusal(&mat(&zlib(&vec![0; 100_000_000])), 1_000_000);
    assert!(found.code == "E0502" && !found.help.contains("--max-size"), "{found:?}");
}

#[test]
fn a_million_columns_are_refused() {
    let many: Vec<u8> = (0..1_000_000).flat_map(|k| column(&k.to_string(), &[0.0])).collect();
    let found = refusal(&mat(&many), 1 << 31);
    assert!(found.message.contains("more than 10000 arrays"), "{found:?}");
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    let channel = |k: u32| [&text(&format!("/'g'/'{k}'"))[..], &u32::MAX.to_le_bytes(), &[0; 4]].concat();
    let objects: Vec<u8> = 1_000_000_u32.to_le_bytes().into_iter().chain((0..1_000_000).flat_map(channel)).collect();
    let lengths = [(objects.len() as u64).to_le_bytes(); 2].concat();
    let tdms = [b"TDSm", &6_u32.to_le_bytes()[..], &4713_u32.to_le_bytes(), &lengths, &objects].concat();
    let found = refusal(&tdms, 1 << 31);
    assert!(found.message.contains("more than 10000 channels"), "{found:?}");
    let found = refusal("a\n1,2\n".repeat(200_000).as_bytes(), 1 << 31);
    assert!(found.message.contains("more than 10000 tables"), "{found:?}");
    let mut wide = hdf5_pure::FileBuilder::new();
    for k in 0..11_000 {
        wide.create_dataset(&format!("c{k}")).with_f64_data(&[1.0, 2.0]);
    }
    let found = refusal(&wide.finish().unwrap(), 1 << 31);
    assert!(found.message.contains("more than 10000 arrays"), "{found:?}");
    let names: Vec<String> = (0..1_000_000).map(|k| format!("c{k}")).collect();
    assert!(!refusal(format!("{}\n1\n", names.join(",")).as_bytes(), 1 << 31).help.is_empty());
}

/// Where the segments of a TDMS file end.
fn ends_of_segments(file: &[u8]) -> Vec<usize> {
    let mut ends = vec![0];
    while let Some(head) = ends.last().and_then(|at| file.get(*at..)?.get(..28)) {
        let length = u64::from_le_bytes(head[12..20].try_into().unwrap());
        ends.push(ends.last().unwrap() + 28 + length as usize);
    }
    ends
}

/// Wherever a file ends: a record only if it is the whole one. A TDMS file that ends with a segment is whole: the program that
/// wrote it appends segments.
#[test]
fn files_that_end_at_any_byte_are_never_half_a_record() {
    for name in ["v5.mat", "v5-plain.mat", "v7.3.mat", "record.h5", "record.tdms"] {
        let whole = std::fs::read(files::containers().join(name)).unwrap();
        let record = read_as(&whole, &Reading::default()).unwrap();
        let step = if std::env::var_os("SPECGEN_FULL").is_some() { 1 } else { 7 };
        for end in (20..whole.len()).step_by(step) {
            match read_as(&whole[..end], &Reading::default()) {
                Ok(part) if name == "record.tdms" && ends_of_segments(&whole).contains(&end) => {
                    assert!(record.time.starts_with(&part.time) && record.displacement.starts_with(&part.displacement));
                }
                Ok(part) => {
                    let is_whole = part.time == record.time && part.displacement == record.displacement;
                    assert!(is_whole, "{name}: {end} bytes");
                }
                Err(found) => {
                    let mut codes = found.iter().map(|one| one.code).filter(|code| code.starts_with('E')).peekable();
                    // Damaged, without some of its columns, or with few samples.
                    let is_known = |code| matches!(code, "E0503" | "E0504" | "E0509");
                    assert!(codes.peek().is_some() && codes.all(is_known), "{name}: {end} bytes: {found:?}");
                }
            }
        }
    }
}
