//! Developer commands that use the product's crates. `cargo xtask` runs them; `cargo xtask help` describes them.

mod board;
mod book;
mod fresh;
mod generated;

use std::path::Path;
use std::process::ExitCode;

use specgen_toolchain::provision;
use xtask::root;
use xtask::run::{Outcome, Report, SKIPPED};
use xtask::setup;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let root = root();
    match words[..] {
        ["setup"] => {
            let mut report = Report::new(1);
            report.step("cross compiler and QEMU", microcontroller);
            report.finish()
        }
        ["board", ref arguments @ ..] => board::command(&root, arguments).unwrap_or_else(misused),
        ["book"] => book::command(&root),
        ["fresh", "--help" | "-h"] => {
            println!("{}", fresh::usage());
            ExitCode::SUCCESS
        }
        ["fresh", ref arguments @ ..] => fresh::fresh(&root, arguments),
        ["step", ref words @ ..] => step(&root, words).map_or_else(misused, ended),
        _ => misused(),
    }
}

/// Runs a step of another command; none if there is no such step.
fn step(root: &Path, words: &[&str]) -> Option<Outcome> {
    Some(match *words {
        ["setup"] => microcontroller(),
        ["check"] => generated::check(root),
        ["bless"] => generated::bless(root),
        ["boards"] => board::long(root),
        ["book", folder] => book::build(root, Path::new(folder)),
        _ => return None,
    })
}

/// The exit code for the outcome of a step.
fn ended(outcome: Outcome) -> ExitCode {
    match outcome {
        Outcome::Passed => ExitCode::SUCCESS,
        Outcome::Skipped(why) => {
            println!("skipped: {why}");
            ExitCode::from(SKIPPED)
        }
        Outcome::Failed(why) => {
            println!("failed: {why}");
            ExitCode::FAILURE
        }
    }
}

/// Installs the cross compiler and QEMU if needed.
fn microcontroller() -> Outcome {
    match provision::provision(&mut |line| println!("{line}")) {
        Ok(_) => Outcome::Passed,
        Err(error) => setup::missing(format!("{error}")),
    }
}

fn misused() -> ExitCode {
    eprintln!("usage: cargo xtask COMMAND; see `cargo xtask help`");
    ExitCode::from(2)
}

#[cfg(test)]
mod tests {
    /// `xtask` does not depend on the product's crates.
    #[test]
    fn names_that_two_programs_know_are_the_same() {
        assert_eq!(xtask::setup::TRIPLE, specgen_toolchain::TRIPLE);
        assert_eq!(xtask::setup::REQUIRE_TOOLS, specgen_toolchain::REQUIRE_TOOLS);
    }
}
