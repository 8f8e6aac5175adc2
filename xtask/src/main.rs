//! Developer commands: see [`USAGE`].

mod binaries;
mod builds;
mod changelog;
mod fuzz;
mod mutants;
mod packages;
mod progress;
mod release;
mod results;
mod skips;
mod steps;
mod wheel;

use std::process::ExitCode;

use sha2::{Digest as _, Sha256};
use xtask::{root, run, setup};

const USAGE: &str = "usage: cargo xtask COMMAND

  setup   installs the tools that the tests need: a cross compiler for Cortex-M, and QEMU
  test    runs setup, then checks formatting, all tests in short form, generated files, lock files and licences
  test --full
          runs all tests at full length, board images, faults, lints and documentation, and checks packages for known defects;
          writes tests/results.txt
  test --checks
          runs only the part of the full run that is neither its tests nor its board images
  mutants [MINUTES | K/N | all]: mutation tests, as samples for a given time, one sample, or all; writes tests/results.txt
  board   SPEC [--target BOARD] [--cycles | --commission | --faults [NAME]], or --tested [--faults]: runs a board's image on an
          emulated board, from boot to a record that replays; with times by a model of the core, a part of a commissioning, or faults
  fuzz    [SECONDS [TARGET]]: coverage-guided fuzzing of all external inputs, 300 s per target; writes tests/results.txt;
          `fuzz keep` updates the corpus
  wheel   builds the Python package into target/wheel/dist, and tests it in a new environment
  bless   updates the generated files that are committed
  book    builds the documentation as HTML, with the generated pages, into target/book
  changelog VERSION: merges the fragments in changelog/ into CHANGELOG.md, as a release
  release VERSION [-o DIR]: builds sources, Linux binaries (glibc, static), wheel, book and digests into target/dist
  fresh   runs the two commands of the README in minimal Debian systems; see `cargo xtask fresh --help`

With SPECGEN_ALLOW_MISSING=1, steps that need a tool that cannot be installed are skipped and reported.";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["test"] => steps::test(&root()),
        ["test", "--full"] => steps::full(&root()),
        ["test", "--checks"] => steps::checks(&root()),
        ["mutants", ref more @ ..] => {
            mutants::Sample::of(more).map_or_else(misused, |sample| steps::mutants(&root(), &sample))
        }
        ["wheel"] => wheel::command(&root()),
        ["bless"] => steps::bless(&root()),
        ["changelog", version] => match changelog::release(&root(), version) {
            Ok(()) => ExitCode::SUCCESS,
            Err(text) => {
                eprintln!("{text}");
                ExitCode::FAILURE
            }
        },
        ["release", ref arguments @ ..] => release::command(&root(), arguments).unwrap_or_else(misused),
        ["fuzz", ref arguments @ ..] => fuzz::command(&root(), arguments).unwrap_or_else(misused),
        ["setup"] | ["book"] | ["fresh" | "board", ..] => steps::maintain(&root(), &words),
        ["help" | "--help" | "-h"] => {
            println!("{USAGE}");
            ExitCode::SUCCESS
        }
        _ => misused(),
    }
}

fn misused() -> ExitCode {
    eprintln!("{USAGE}");
    ExitCode::from(2)
}

/// SHA-256 in hexadecimal.
fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
