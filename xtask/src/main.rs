//! Developer commands: see [`USAGE`].

mod binaries;
mod board;
mod book;
mod builds;
mod changelog;
mod fresh;
mod fuzz;
mod generated;
mod judged;
mod mutants;
mod packages;
mod progress;
mod release;
mod results;
mod run;
mod setup;
mod skips;
mod steps;
mod wheel;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

const USAGE: &str = "usage: cargo xtask COMMAND

  setup   installs what the tests need: a cross compiler for Cortex-M and QEMU
  test    setup, then formatting, every test at its short length, freshness of generated files, lock files and licences; with the
          variable CI set, lints, too
  test --full
          every test at full length, board images, faults, documentation, known defects of packages; writes tests/results.txt
  mutants [MINUTES | K/N | all]: code changed one operator at a time, to see whether a test notices: sample after sample for so
          long, one sample, or all; writes tests/results.txt
  board   SPEC [--target stm32h743|stm32f4] [--cycles | --faults [NAME]], or --tested [--faults]: a board's image on an emulated board, from boot to a
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
        ["setup"] => steps::setup(),
        ["test"] => steps::test(&root()),
        ["test", "--full"] => steps::full(&root()),
        ["mutants", ref more @ ..] => {
            mutants::Sample::of(more).map_or_else(misused, |sample| steps::mutants(&root(), &sample))
        }
        ["wheel"] => wheel::command(&root()),
        ["bless"] => steps::bless(&root()),
        ["book"] => book::command(&root()),
        ["changelog", version] => match changelog::release(&root(), version) {
            Ok(()) => ExitCode::SUCCESS,
            Err(text) => {
                eprintln!("{text}");
                ExitCode::FAILURE
            }
        },
        ["release", ref arguments @ ..] => release::command(&root(), arguments).unwrap_or_else(misused),
        ["fresh", "--help" | "-h"] => {
            println!("{}", fresh::usage());
            ExitCode::SUCCESS
        }
        ["fresh", ref arguments @ ..] => fresh::fresh(&root(), arguments),
        ["board", ref arguments @ ..] => board::command(&root(), arguments).unwrap_or_else(misused),
        ["fuzz", ref arguments @ ..] => fuzz::command(&root(), arguments).unwrap_or_else(misused),
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

/// The repository: this crate stands directly below it.
fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_owned()
}
