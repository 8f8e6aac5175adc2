//! `specgen flash`: builds and checks an image, then lets probe-rs write it.

use std::io::{BufRead, IsTerminal, Write};
use std::path::PathBuf;
use std::process::Command;

use clap::Args;
use serde_json::json;

use super::{Common, make, refusal, text};
use crate::cli::ui::{Failure, Ui};
use crate::target::find_program;
use crate::target::targets::{Kind, Target};

/// The program that talks to the debug probe.
const PROBE_RS: &str = "probe-rs";
/// How to get it.
const INSTALL: &str = "cargo install probe-rs-tools --locked";

/// Arguments of `flash`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The spec file.
    spec: PathBuf,
    #[command(flatten)]
    common: Common,
    /// The amplifiers are off: do not ask.
    #[arg(long)]
    yes: bool,
    /// Which debug probe, as `probe-rs list` names it, if several are connected.
    #[arg(long, value_name = "VID:PID:SERIAL")]
    probe: Option<String>,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let (compiled, made) = make(&arguments.spec, &arguments.common, ui)?;
    if !ui.is_json() {
        ui.out(&text::of(&compiled, &made));
    }
    if !made.failures.is_empty() {
        let message = format!("{}\nnothing was flashed", refusal(&made));
        return Err(Failure::Judged { message, result: json!(made) });
    }
    let chip = match Target::named(made.target).map(|target| target.kind) {
        Some(Kind::Board(mcu)) => mcu.part().chip,
        _ => None,
    };
    let Some(chip) = chip else {
        return Err(Failure::Usage(format!(
            "{} is no board that could be flashed: name one by --target stm32h743 or stm32f4, or in the spec's target.mcu",
            made.board
        )));
    };
    let mut words = vec!["download", "--chip", chip, "--verify"];
    if let Some(probe) = &arguments.probe {
        words.extend(["--probe", probe]);
    }
    words.push(&made.artifact);
    let command = format!("{PROBE_RS} {}", words.join(" "));
    let reset = format!("{PROBE_RS} reset --chip {chip}");
    let Some(program) = find_program(PROBE_RS) else {
        return Err(Failure::Environment(format!(
            "{PROBE_RS} is not installed (looked for on PATH), so nothing was flashed. The image is built and checked; \
             install {PROBE_RS} with: {INSTALL}\nand with the amplifiers off run:\n  {command}\n  {reset}"
        )));
    };
    if !arguments.yes {
        confirm(ui, &made.board)?;
    }
    for (what, words) in [("writing", words), ("restarting", vec!["reset", "--chip", chip])] {
        ui.progress(&format!("{what}: {PROBE_RS} {}", words.join(" ")));
        let status = Command::new(&program).args(&words).status();
        match status {
            Ok(status) if status.success() => {}
            Ok(status) => {
                return Err(Failure::Environment(format!(
                    "{PROBE_RS} failed ({status}) at {what}; the flash may hold half an image: keep the amplifiers off, check \
                     cable and power of the board, and run again:\n  {command}\n  {reset}"
                )));
            }
            Err(error) => {
                return Err(Failure::Environment(format!("{} cannot be run: {error}", program.display())));
            }
        }
    }
    ui.result(
        &format!("flashed {} to {} ({chip}), verified and restarted\n", made.artifact, made.board),
        json!({ "flashed": made.artifact, "board": made.board, "chip": chip }),
    );
    Ok(())
}

/// A controller that starts with its amplifiers on could move the platform.
fn confirm(ui: &Ui, board: &str) -> Result<(), Failure> {
    if ui.is_json() || !std::io::stdin().is_terminal() {
        return Err(Failure::Usage(
            "nothing was flashed: switch the amplifiers off, then say so by --yes (nobody is there to be asked)"
                .to_owned(),
        ));
    }
    let mut prompt = std::io::stderr();
    let _ = write!(prompt, "Are the amplifiers of {board} switched off? [y/N] ");
    let _ = prompt.flush();
    let mut answer = String::new();
    let read = std::io::stdin().lock().read_line(&mut answer);
    if read.is_ok() && matches!(answer.trim(), "y" | "Y" | "yes") {
        Ok(())
    } else {
        Err(Failure::Usage("nothing was flashed: switch the amplifiers off and run again".to_owned()))
    }
}
