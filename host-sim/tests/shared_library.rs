//! Loads real shared libraries, made here, through the controller interface.

// A test helper may fail a test; clippy exempts only functions marked as tests.
#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::{Path, PathBuf};
use std::process::Command;

use host_sim::controller::{Controller, ControllerError, TickController};

/// A controller with a 16-byte aligned state: one input, outputs input × gain and a tick count, config words gain and limit.
const SOURCE: &str = r#"
static TEXT: &str = "name=toy\ndigest=ab\nversion=0.1.0\nscalar_bits=64\nconfig_names=gain,limit\n\
input_names=setpoint[0]\noutput_names=voltage[0],status\n\
state_bytes=32\nstate_align=16\nconfig_bytes=8\nconfig_align=8\nmachine_bytes=48\nmachine_align=16\nmachine_words=6\n";
#[unsafe(no_mangle)] extern "C" fn specgen_abi_version() -> u32 { ABI }
#[unsafe(no_mangle)] unsafe extern "C" fn specgen_describe(s: *mut *const u8, n: *mut usize) { unsafe { *s = TEXT.as_ptr(); *n = TEXT.len() } }
#[unsafe(no_mangle)] unsafe extern "C" fn specgen_config_default(w: *mut u64) { unsafe { *w = 2.0f64.to_bits(); *w.add(1) = 7 } }
#[unsafe(no_mangle)] unsafe extern "C" fn specgen_config_check(w: *const u64) -> i32 { unsafe { if *w.add(1) > 100 { 2 } else { 0 } } }
#[unsafe(no_mangle)] unsafe extern "C" fn specgen_config_load(c: *mut u8, w: *const u64) -> i32 { unsafe { *c.cast::<u64>() = *w }; 0 }
#[unsafe(no_mangle)] unsafe extern "C" fn specgen_state_reset(s: *mut u8) { unsafe { assert!(s as usize % 16 == 0); *s.cast::<u64>() = 0 } }
#[unsafe(no_mangle)] unsafe extern "C" fn specgen_step(c: *const u8, s: *mut u8, i: *const u64, o: *mut u64) { unsafe {
    *s.cast::<u64>() += 1;
    *o = (f64::from_bits(*i) * f64::from_bits(*c.cast::<u64>())).to_bits();
    *o.add(1) = *s.cast::<u64>();
} }
#[unsafe(no_mangle)] unsafe extern "C" fn specgen_state_digest(s: *const u8) -> u64 { unsafe { *s.cast::<u64>() ^ 0xff } }
#[unsafe(no_mangle)] extern "C" fn specgen_machine_reset(_: *mut u8) {}
#[unsafe(no_mangle)] extern "C" fn specgen_machine_step(_: *const u8, _: *mut u8, _: *const u64, _: *mut u64) {}
#[unsafe(no_mangle)] extern "C" fn specgen_machine_digest(_: *const u8) -> u64 { 0 }
#[unsafe(no_mangle)] extern "C" fn specgen_machine_save(_: *const u8, _: *mut u64) {}
#[unsafe(no_mangle)] extern "C" fn specgen_machine_load(_: *mut u8, _: *const u64) -> i32 { 0 }
#[unsafe(no_mangle)] extern "C" fn specgen_words_per_leg(_: *const u64, _: *mut u64) {}
"#;

/// Compiles `source` as a C shared library called `name`, or `None` where no compiler is at hand.
fn library(name: &str, source: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let text = folder.join(format!("{name}.rs"));
    let file = folder.join(format!("lib{name}.so"));
    std::fs::write(&text, source).unwrap();
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let run = Command::new(rustc)
        .args(["--edition", "2024", "--crate-type", "cdylib", "-C", "panic=abort", "-o"])
        .arg(&file)
        .arg(&text)
        .output();
    match run {
        Ok(output) => {
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            Some(file)
        }
        Err(error) => {
            eprintln!("skipped 1: a test: rustc cannot be started ({error})");
            None
        }
    }
}

fn refusal(file: &Path) -> ControllerError {
    match Controller::load(file) {
        Ok(_) => panic!("loaded"),
        Err(error) => error,
    }
}

#[test]
fn a_library_is_described_configured_reset_and_stepped() {
    let Some(file) = library("toy", &SOURCE.replace("ABI", "2")) else {
        return;
    };
    let mut controller = Controller::load(&file).unwrap();
    assert_eq!(controller.description().name, "toy");
    assert_eq!(controller.default_config(), [2.0_f64.to_bits(), 7]);

    let mut output = [0; 2];
    controller.step(&[3.0_f64.to_bits()], &mut output);
    controller.step(&[3.0_f64.to_bits()], &mut output);
    assert_eq!(output, [6.0_f64.to_bits(), 2]);
    assert_eq!(controller.state_digest(), 2 ^ 0xff);

    let mut config = controller.default_config();
    let description = controller.description().clone();
    description.set_config(&mut config, "gain", 0.5).unwrap();
    controller.configure(&config).unwrap();
    controller.step(&[3.0_f64.to_bits()], &mut output);
    assert_eq!(output, [1.5_f64.to_bits(), 3]);
    controller.reset();
    assert_eq!(controller.state_digest(), 0xff);
}

#[test]
fn a_refused_word_is_named_and_the_configuration_in_force_stays() {
    let Some(file) = library("toy_refuses", &SOURCE.replace("ABI", "2")) else {
        return;
    };
    let mut controller = Controller::load(&file).unwrap();
    let error = controller.configure(&[9.0_f64.to_bits(), 101]).unwrap_err();
    assert!(error.to_string().contains("`limit` = 0000000000000065"), "{error}");
    let error = controller.configure(&[0]).unwrap_err();
    assert!(error.to_string().contains("1 configuration words; this controller has 2"), "{error}");
    let mut output = [0; 2];
    controller.step(&[1.0_f64.to_bits()], &mut output);
    assert_eq!(output[0], 2.0_f64.to_bits());
}

#[test]
fn another_interface_version_and_a_missing_function_are_refused() {
    let Some(file) = library("toy_abi", &SOURCE.replace("ABI", "7")) else {
        return;
    };
    assert!(refusal(&file).to_string().contains("interface version 7, expected 2"));
    let source = SOURCE.replace("ABI", "2").replace("specgen_state_digest", "other");
    let Some(file) = library("toy_lacks", &source) else {
        return;
    };
    let text = refusal(&file).to_string();
    assert!(text.contains("specgen_state_digest") && text.contains("libtoy_lacks.so"), "{text}");
}

#[test]
fn a_bad_description_is_refused() {
    let source = SOURCE.replace("ABI", "2").replace("scalar_bits=64", "scalar_bits=80");
    let Some(file) = library("toy_scalar", &source) else {
        return;
    };
    assert!(refusal(&file).to_string().contains("`scalar_bits=80`; expected 32 or 64"));
}
