//! Files that are cut off, or made to exhaust memory or time: a finding, soon.

use std::io::Write as _;
use std::time::{Duration, Instant};

use flate2::Compression;
use flate2::write::{GzEncoder, ZlibEncoder};

use super::files::{file, read_as};
use super::mat_file::column;
use super::*;

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
    for (bytes, size) in [(mat(&packed.concat()), 2), (gzip.finish().unwrap(), 3)] {
        assert!(bytes.len() < 1_000_000);
        let found = refusal(&bytes, 1_000_000);
        assert!(found.code == "E0502" && found.message.contains(&format!("{size}MB")), "{found:?}");
        assert!(found.help.contains(&format!("`--max-size {size}MB`")), "{found:?}");
        let named = Reading::default().with_max_size(size * 1_000_000);
        assert!(read_as(&bytes, &named).map_or_else(|found| found.iter().all(|one| one.code != "E0502"), |_| true));
    }
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
    let mut wide = hdf5_pure::FileBuilder::new();
    for k in 0..11_000 {
        wide.create_dataset(&format!("c{k}")).with_f64_data(&[1.0, 2.0]);
    }
    let found = refusal(&wide.finish().unwrap(), 1 << 31);
    assert!(found.message.contains("more than 10000 arrays"), "{found:?}");
    let names: Vec<String> = (0..1_000_000).map(|k| format!("c{k}")).collect();
    assert!(!refusal(format!("{}\n1\n", names.join(",")).as_bytes(), 1 << 31).help.is_empty());
}

/// Wherever a file ends: a record only if it is the whole one.
#[test]
fn files_that_end_at_any_byte_are_never_half_a_record() {
    for name in ["v5.mat", "v5-plain.mat", "v7.3.mat", "record.h5", "record.tdms"] {
        let whole = std::fs::read(files::containers().join(name)).unwrap();
        let record = read_as(&whole, &Reading::default()).unwrap();
        let step = if std::env::var_os("SPECGEN_FULL").is_some() { 1 } else { 7 };
        for end in (20..whole.len()).step_by(step) {
            if let Ok(part) = read_as(&whole[..end], &Reading::default()) {
                assert!(part.time == record.time && part.displacement == record.displacement, "{name}: {end} bytes");
            }
        }
    }
}
