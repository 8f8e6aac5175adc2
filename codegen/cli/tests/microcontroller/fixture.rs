//! A dummy of an emitted workspace: the smallest controller that fulfils the interface, with placeholders for test code.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use specgen::target::Tools;

/// Words of the fixture's interface.
pub const INPUT_WORDS: usize = 12;
pub const OUTPUT_WORDS: usize = 7;

/// An emitted workspace in a temporary folder.
pub struct Workspace {
    folder: tempfile::TempDir,
}

impl Workspace {
    /// `items` is placed beside `step`; `extra` is an expression of type `f64` over `input: &TickInput` that is
    /// added to output 0.
    pub fn new(tools: &Tools, items: &str, extra: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        put(root, "runtime/Cargo.toml", &manifest("specgen-runtime", ""));
        put(root, "runtime/src/lib.rs", "#![no_std]\n");
        put(root, "controller/Cargo.toml", &manifest("controller", "specgen-runtime = { path = \"../runtime\" }\n"));
        put(root, "controller/src/lib.rs", &CONTROLLER.replace("@ITEMS@", items).replace("@EXTRA@", extra));
        put(root, "host/Cargo.toml", HOST_MANIFEST);
        put(root, "host/src/lib.rs", HOST);
        let repository = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap();
        copy(&repository.join("firmware/qemu"), &root.join("qemu"));
        copy(&repository.join("firmware/link"), &root.join("link"));
        // The repository's stages measure parts that the dummy lacks.
        put(root, "qemu/src/stages.rs", STAGES);
        put(root, "qemu/src/machine.rs", MACHINE);
        put(root, "qemu/src/counted.rs", "//! The supervised tick, which the stand-in has not.\n");
        // The committed lock file has the real controller; only its path packages are replaced.
        let status = Command::new(&tools.toolchain.cargo)
            .env("RUSTC", &tools.toolchain.rustc)
            .env_remove("LD_LIBRARY_PATH")
            .args(["update", "--workspace", "--offline", "--quiet"])
            .current_dir(root.join("qemu"))
            .status()
            .unwrap();
        assert!(status.success(), "cargo update: {status}");
        Self { folder }
    }

    pub fn dir(&self) -> &Path {
        self.folder.path()
    }
}

/// Where images are built: kept between runs and shared by all tests, so that `core` is compiled once.
pub fn target_dir() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("images")
}

/// The result of the fixture's `step`, computed by the test: six EWMA filters. Returns the output
/// words and the digest of each tick.
pub fn expected(config: &[u64], inputs: &[Vec<u64>]) -> (Vec<Vec<u64>>, Vec<u64>) {
    let (gain, weight) = (f64::from_bits(config[0]), f64::from_bits(config[1]));
    let mut level = [0.0_f64; 6];
    let mut digests = Vec::new();
    let mut outputs = Vec::new();
    for (tick, row) in inputs.iter().enumerate() {
        let mut words = Vec::new();
        for leg in 0..6 {
            let (setpoint, displacement) = (f64::from_bits(row[leg]), f64::from_bits(row[leg + 6]));
            level[leg] = weight * displacement + (1.0 - weight) * level[leg];
            words.push((setpoint / gain - level[leg]).to_bits());
        }
        words.push(tick as u64 + 1);
        outputs.push(words);
        digests.push(level.iter().fold(tick as u64 + 1, |digest, l| digest.rotate_left(7) ^ l.to_bits()));
    }
    (outputs, digests)
}

fn put(root: &Path, name: &str, text: &str) {
    let path = root.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        if entry.file_name() == "target" {
            continue;
        }
        let to = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), &to).unwrap();
        }
    }
}

fn manifest(name: &str, dependencies: &str) -> String {
    format!(
        "[package]\nname = \"{name}\"\nversion = \"0.1.0\"\nedition = \"2024\"\n\n[features]\nstages = []\n\n[dependencies]\n{dependencies}"
    )
}

const STAGES: &str = r#"
use crate::instructions::InstructionCounter;
use crate::stats::Stage;
use controller::{Config, State, TickInput};
pub struct Stages { counts: [Stage; 2] }
impl Stages {
    pub const fn new() -> Self { Self { counts: [Stage::new("step"), Stage::new("setpoint")] } }
    pub fn add_step(&mut self, instructions: u32) { self.counts[0].add(instructions); }
    #[allow(unsafe_code)]
    pub fn measure(&mut self, counter: &mut InstructionCounter, _: &Config, _: &State, input: &TickInput) {
        let mut sums = [0.0; 6];
        let arguments = [(&raw const input.setpoint) as usize, (&raw mut sums) as usize, 0, 0];
        // SAFETY: a C function of two references.
        self.counts[1].add(unsafe { counter.measure_call(add_one as *const (), arguments) });
    }
    pub fn all(&self) -> &[Stage] { &self.counts }
}
extern "C" fn add_one(setpoint: &[f64; 6], sums: &mut [f64; 6]) { *sums = setpoint.map(|x| x + 1.0); }
"#;

/// The stand-in has no supervisor.
const MACHINE: &str = r#"
use crate::instructions::{InstructionCounter, SelfTest};
use crate::semihosting::{Exit, File};
use controller::Config;
pub fn replay(_: &mut InstructionCounter, _: SelfTest, _: &Config, _: &File) -> Result<(), Exit> { Err(Exit::Fault) }
"#;

const HOST_MANIFEST: &str = r#"
[package]
name = "controller-host"
version = "0.1.0"
edition = "2024"
[workspace]
[lib]
crate-type = ["cdylib"]
[dependencies]
controller = { path = "../controller" }
[profile.release]
panic = "abort"
lto = "fat"
codegen-units = 1
"#;

const HOST: &str = r#"
#![no_std]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" { fn specgen_panic_path_remains() -> !; }
    unsafe { specgen_panic_path_remains() }
}
#[unsafe(no_mangle)]
pub unsafe extern "C" fn specgen_step(c: *const controller::Config, s: *mut controller::State, i: *const u64, o: *mut u64) {
    let input = controller::TickInput::from_words(unsafe { &*i.cast() });
    let state = unsafe { &mut *s };
    let words = controller::output_words(&controller::step(unsafe { &*c }, state, &input), state);
    unsafe { o.cast::<[u64; controller::OUTPUT_WORDS]>().write(words) }
}
"#;

const CONTROLLER: &str = r#"
#![no_std]
pub const CONFIG_WORDS: usize = 2;
pub const INPUT_WORDS: usize = 12;
pub const OUTPUT_WORDS: usize = 7;
pub mod integrity { pub fn intact() -> bool { true } }
pub struct Config { gain: f64, weight: f64 }
pub struct ConfigError { pub word: usize }
impl Config {
    pub fn from_words(w: &[u64; CONFIG_WORDS]) -> Result<Self, ConfigError> {
        let config = Self { gain: f64::from_bits(w[0]), weight: f64::from_bits(w[1]) };
        if !(config.gain > 0.0) { return Err(ConfigError { word: 0 }); }
        if !(config.weight > 0.0) { return Err(ConfigError { word: 1 }); }
        Ok(config)
    }
}
pub struct TickInput { pub setpoint: [f64; 6], pub displacement: [f64; 6] }
impl TickInput {
    pub fn from_words(w: &[u64; INPUT_WORDS]) -> Self {
        let mut input = Self { setpoint: [0.0; 6], displacement: [0.0; 6] };
        for leg in 0..6 {
            input.setpoint[leg] = f64::from_bits(w[leg]);
            input.displacement[leg] = f64::from_bits(w[leg + 6]);
        }
        input
    }
}
pub struct TickOutput { voltage: [f64; 6], status: u64 }
pub fn output_words(output: &TickOutput, _state: &State) -> [u64; OUTPUT_WORDS] {
    let mut words = [0; OUTPUT_WORDS];
    for leg in 0..6 { words[leg] = output.voltage[leg].to_bits(); }
    words[6] = output.status;
    words
}
pub struct State { level: [f64; 6], count: u64 }
pub fn state_at_reset() -> State { State { level: [0.0; 6], count: 0 } }
impl State {
    pub fn digest(&self) -> u64 {
        self.level.iter().fold(self.count, |digest, l| digest.rotate_left(7) ^ l.to_bits())
    }
}
@ITEMS@
fn extra(input: &TickInput) -> f64 { let _ = input; @EXTRA@ }
pub fn step(config: &Config, state: &mut State, input: &TickInput) -> TickOutput {
    let mut voltage = [0.0; 6];
    for leg in 0..6 {
        state.level[leg] = config.weight * input.displacement[leg] + (1.0 - config.weight) * state.level[leg];
        voltage[leg] = input.setpoint[leg] / config.gain - state.level[leg];
    }
    voltage[0] += extra(input);
    state.count += 1;
    TickOutput { voltage, status: state.count }
}
"#;
