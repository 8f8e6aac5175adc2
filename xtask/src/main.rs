//! Developer commands: see [`USAGE`].

mod binaries;
mod builds;
mod changelog;
mod fuzz;
mod judged;
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

  setup   installs what the tests need: a cross compiler for Cortex-M and QEMU
  test    setup, then formatting, every test at its short length, freshness of generated files, lock files and licences; with the
          variable CI set, lints, too
  test --full
          every test at full length, board images, faults, documentation, known defects of packages; writes tests/results.txt
  mutants [MINUTES | K/N | all]: code changed one operator at a time, to see whether a test notices: sample after sample for so
          long, one sample, or all; writes tests/results.txt
  board   SPEC [--target BOARD] [--cycles | --faults [NAME]], or --tested [--faults]: a board's image on an emulated board, from boot to a
          record that replays; with times by a model of the core, or with faults, or one fault alone
  fuzz    [SECONDS [TARGET]]: what comes from outside, under a fuzzer guided by coverage, 300 s each target; writes
          tests/results.txt; `fuzz keep` keeps what it found
  wheel   the Python package: builds it into target/wheel/dist, and tries it in a fresh environment
  bless   writes the generated files that are committed anew
  book    the documentation as HTML, with the generated pages, into target/book
  changelog VERSION: puts the fragments in changelog/ into CHANGELOG.md, as a release
  release VERSION [-o DIR]: sources, the command for Linux with glibc and static, the wheel, the book, and their digests, into target/dist
  fresh   the two commands of the README in minimal Debian roots; `cargo xtask fresh --help`

With SPECGEN_ALLOW_MISSING=1, what needs a tool that cannot be installed is skipped, and said so.";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["test"] => steps::test(&root()),
        ["test", "--full"] => steps::full(&root()),
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

/// SHA-256 in hex.
fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}
