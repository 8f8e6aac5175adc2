//! The controller's check of itself: it accepts what was compiled, and no single flipped bit in identity, tables, trajectories or
//! settings.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use specgen::ir::{Path as Course, RateModel, Scalar};
use specgen_tests::Emitted;

/// Prints whether it is intact, and whether its settings are those of `Config::new()`.
const PROBE: &str = "fn main() {
    let settings = controller::Config::new().to_words();
    let same = controller::integrity::SETTINGS == settings && controller::integrity::config().to_words() == settings;
    println!(\"{} {}\", controller::integrity::intact(), same);
}
";
const MANIFEST: &str = "[package]
name = \"probe\"
version = \"0.1.0\"
edition = \"2024\"
[workspace]
[dependencies]
controller = { path = \"../controller\" }
[profile.release]
panic = \"abort\"
";

static RUN: std::sync::Mutex<()> = std::sync::Mutex::new(());

/// A program with the emitted controller in it.
fn probe(emitted: &Emitted) -> PathBuf {
    let folder = emitted.dir().join("probe");
    fs::create_dir_all(folder.join("src")).unwrap();
    fs::write(folder.join("src/main.rs"), PROBE).unwrap();
    fs::write(folder.join("Cargo.toml"), MANIFEST).unwrap();
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--release", "--quiet", "--offline"]).current_dir(&folder);
    // Those of the outer cargo.
    for name in ["CARGO_TARGET_DIR", "CARGO_ENCODED_RUSTFLAGS", "RUSTFLAGS"] {
        cargo.env_remove(name);
    }
    let _one = RUN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    assert!(cargo.status().unwrap().success());
    folder.join("target/release/probe")
}

fn ask(program: &Path) -> String {
    let output = Command::new(program).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

/// Where these bytes lie in the program: once.
fn find(program: &[u8], what: &str, bytes: &[u8]) -> std::ops::Range<usize> {
    let places: Vec<usize> = (0..program.len()).filter(|at| program[*at..].starts_with(bytes)).collect();
    let [place] = places[..] else { panic!("{what}: {} times in the program", places.len()) };
    place..place + bytes.len()
}

/// What the check speaks for, as bytes of memory: name and content.
fn regions(emitted: &Emitted) -> Vec<(&'static str, Vec<u8>)> {
    let ir = &emitted.compiled.ir;
    let reals = |values: &[f64]| -> Vec<u8> {
        match ir.scalar {
            Scalar::F64 => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
            Scalar::F32 => values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect(),
        }
    };
    let mut regions = vec![("identity", ir.integrity.identity.clone().into_bytes())];
    regions.extend(ir.hysteresis.tables.iter().map(|table| ("Everett table", reals(table))));
    if let Some(RateModel::DynamicPreisach { tables, .. }) = &ir.hysteresis.rate {
        regions.extend(tables.iter().map(|table| ("table of the rate", reals(table))));
    }
    if let Some(RateModel::Creep { gains, .. }) = &ir.hysteresis.rate {
        regions.push(("creep", reals(gains)));
    }
    for trajectory in ir.task_space.iter().flat_map(|task| &task.setpoints.trajectories) {
        match &trajectory.path {
            Course::Segments { segments, .. } => {
                let sine = segments.iter().flat_map(|part| &part.axes).map(|axis| axis.sine).find(|s| s[1] != 0.0);
                regions.extend(sine.map(|sine| ("piece of a trajectory", reals(&sine))));
            }
            Course::Table { rows, .. } => regions.push(("row of a trajectory", reals(&rows[1].pose))),
        }
    }
    regions.push(("settings", ir.integrity.settings.iter().flat_map(|word| word.to_le_bytes()).collect()));
    regions
}

/// Flips bits of every region, one at a time: none is believed.
fn no_flipped_bit_is_believed(name: &str, spec: &str, edits: &[(&str, &str)], flips: usize) {
    let emitted = Emitted::new(name, spec, edits);
    let program = probe(&emitted);
    {
        let _one = RUN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        assert_eq!(ask(&program), "true true", "{name}");
    }
    let good = fs::read(&program).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut tried = 0;
    for (what, bytes) in regions(&emitted) {
        let place = find(&good, what, &bytes);
        for flip in 0..flips {
            // First and last bit, then any.
            let bit = match flip {
                0 => 0,
                1 => 8 * bytes.len() - 1,
                _ => (random.next_u64() % (8 * bytes.len() as u64)) as usize,
            };
            let mut spoilt = good.clone();
            spoilt[place.start + bit / 8] ^= 1 << (bit % 8);
            // While one test writes a program, no other starts one: it would inherit the open file, and what is open for
            // writing cannot be run.
            let _one = RUN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            let copy = program.with_file_name(format!("spoilt-{tried}"));
            fs::write(&copy, &spoilt).unwrap();
            fs::set_permissions(&copy, fs::Permissions::from_mode(0o755)).unwrap();
            let answer = ask(&copy);
            assert!(answer.starts_with("false"), "{name}, {what}, bit {bit}: {answer}");
            fs::remove_file(&copy).unwrap();
            tried += 1;
        }
    }
    println!("{name}: {tried} flipped bits, each found");
}

#[test]
#[ignore = "long: a program built from nothing; that constants and settings have their checksum is in the short run"]
fn no_flipped_bit_of_a_platform_is_believed() {
    no_flipped_bit_is_believed("integrity-platform", "reference.toml", &[], specgen_tests::length(5, 40));
}

#[test]
#[ignore = "long: another controller, built from nothing"]
fn no_flipped_bit_of_legs_with_creep_in_f32_is_believed() {
    let creep = "memory  = 64\nrate = \"creep\"\ncreep_times = [\"2 s\", \"50 ms\", \"4 ms\"]\ncreep_weights = [0.03, 0.05, 0.08]";
    let edits = [("memory  = 64", creep), ("scalar   = \"f64\"", "scalar   = \"f32\"")];
    no_flipped_bit_is_believed("integrity-legs", "legs.toml", &edits, 40);
}

#[test]
fn another_spec_or_another_setting_has_another_checksum() {
    let crc =
        |edits: &[(&str, &str)]| specgen_tests::compile_edited("integrity-crc", "legs.toml", edits, &[]).ir.integrity;
    let (plain, again) = (crc(&[]), crc(&[]));
    assert_eq!(plain, again);
    let other = crc(&[("\"40 V/ms\"", "\"41 V/ms\"")]);
    assert_ne!(plain.settings, other.settings);
    assert_ne!(plain.crc, other.crc);
}
