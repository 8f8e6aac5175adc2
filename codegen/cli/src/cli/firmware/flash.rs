//! `specgen flash`: builds and checks an image, then lets probe-rs write it.

use std::io::{BufRead, IsTerminal, Write};
use std::process::{Command, Stdio};

use clap::Args;
use serde::Serialize;

use super::{Common, Purpose, make, read_image, refusal, text};
use crate::cli::named::InputFile;
use specgen_language::diagnostic::codes;
use specgen_language::model::{self, BOARDS, Mcu};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::shell;
use specgen_language::ui::Ui;
use specgen_toolchain::budget;
use specgen_toolchain::checks::{self, Rules, TickChecks};
use specgen_toolchain::find_program;
use specgen_toolchain::size::{Size, size};
use specgen_toolchain::targets::{Kind, Target};

/// The program that talks to the debug probe.
const PROBE_RS: &str = "probe-rs";
/// How to get it.
const INSTALL: &str = "cargo install probe-rs-tools --locked";

/// Arguments of `flash`.
#[derive(Args, Debug)]
#[command(after_help = crate::cli::examples::FLASH)]
pub struct Arguments {
    /// A spec, which is built first, or an ELF image that `specgen build` made.
    #[arg(value_name = "SPEC|ELF")]
    file: InputFile,
    #[command(flatten)]
    common: Common,
    /// The amplifiers are off: do not ask.
    #[arg(long)]
    yes: bool,
    /// Which debug probe, as `probe-rs list` names it, if several are connected.
    #[arg(long, value_name = "VID:PID:SERIAL")]
    probe: Option<String>,
    /// Clock of the probe, kHz: a slower one for a long cable.
    #[arg(long, value_name = "KHZ", value_parser = clap::value_parser!(u32).range(1..))]
    speed: Option<u32>,
    /// Hold the part in reset until the probe has it: for a program that hangs, or resets the part over and over.
    #[arg(long)]
    connect_under_reset: bool,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let ready = match read_image(&arguments.file)? {
        Some(elf) => of_image(arguments, &elf, ui)?,
        None => of_spec(arguments, ui)?,
    };
    let Ready { image, mcu } = ready;
    let image = shell::no_option(image);
    let part = mcu.part();
    let Some(chip) = part.chip else {
        return Err(not_a_board(part.board));
    };
    let speed = arguments.speed.map(|speed| speed.to_string());
    let mut probe: Vec<&str> = arguments.probe.iter().flat_map(|probe| ["--probe", probe.as_str()]).collect();
    probe.extend(speed.iter().flat_map(|speed| ["--speed", speed.as_str()]));
    probe.extend(arguments.connect_under_reset.then_some("--connect-under-reset"));
    let download = [&["download", "--chip", chip, "--verify"], &probe[..], &[image.as_str()]].concat();
    let reset = [&["reset", "--chip", chip], &probe[..]].concat();
    let shown = |words: &[&str]| words.iter().fold(shell::line(PROBE_RS), |line, word| line.word(word));
    let commands = format!("  {}\n  {}", shown(&download), shown(&reset));
    let Some(program) = find_program(PROBE_RS) else {
        return Err(Failure::Environment(format!(
            "{PROBE_RS} is not installed (looked for on PATH), so nothing was flashed; {image} is checked. \
             Install it with: {INSTALL}\nthen, with the amplifiers off, run this again, or by hand:\n{commands}"
        )));
    };
    if !arguments.yes {
        confirm(ui, part.board)?;
    }
    for (what, words) in [("writing", download), ("restarting", reset)] {
        ui.progress(&format!("{what}: {}", shown(&words)));
        // Its progress is for the eyes; on standard output stands our result alone.
        let output = Command::new(&program).args(&words).stdin(Stdio::null()).stdout(std::io::stderr()).status();
        match output {
            Ok(status) if status.success() => {}
            Ok(status) => {
                return Err(Failure::Environment(format!(
                    "{PROBE_RS} failed ({status}) at {what} {image}; the flash may hold part of an image: keep the amplifiers \
                     off, check cable and power of the board, and run again:\n{commands}"
                )));
            }
            Err(error) => {
                return Err(Failure::Environment(format!("{} cannot be run: {error}", program.display())));
            }
        }
    }
    ui.result(&Flashed { flashed: image, board: part.board, chip });
    Ok(())
}

#[derive(Serialize)]
struct Flashed {
    flashed: String,
    board: &'static str,
    chip: &'static str,
}

impl Outcome for Flashed {
    fn text(&self) -> String {
        format!("flashed {} to {} ({}), verified and restarted\n", self.flashed, self.board, self.chip)
    }
}

/// An image at hand, looked at before it is flashed.
#[derive(Serialize)]
struct Examined {
    image: String,
    failures: Vec<String>,
    #[serde(skip)]
    size: Size,
    #[serde(skip)]
    checks: TickChecks,
}

impl Outcome for Examined {
    fn text(&self) -> String {
        text::sections(&self.size) + &text::checked(&self.checks)
    }
}

/// An image that passed every check.
struct Ready {
    image: String,
    mcu: Mcu,
}

fn of_spec(arguments: &Arguments, ui: &mut Ui) -> Result<Ready, Failure> {
    let made = make(&arguments.file, &arguments.common, Purpose::Board, ui)?;
    let result = ui.shown(&made);
    if let Some(message) = refusal(&made) {
        return Err(Failure::Judged { message: format!("{message}\nnothing was flashed"), result });
    }
    match Target::named(made.target).map(|target| target.kind) {
        Some(Kind::Board(mcu)) => Ok(Ready { image: made.artifact, mcu }),
        _ => Err(not_a_board(&made.board)),
    }
}

/// The same checks for an image at hand, which says what board it is for.
fn of_image(arguments: &Arguments, elf: &[u8], ui: &mut Ui) -> Result<Ready, Failure> {
    let image = arguments.file.display().to_string();
    let size = size(elf)?;
    let mcu = board_of(&image, size.target, arguments.common.target.as_deref())?;
    let part = mcu.part();
    let checked = checks::check(elf, None, Rules { single: !part.double, whole_image: false })?;
    let limits = model::Target { mcu, budget: model::Budget::NONE };
    let used = budget::ImageUsage {
        flash: size.flash(),
        ram: checked.stack.map(|stack| size.ram() + stack),
        ram_least: size.ram(),
        stack: checked.stack,
        ..budget::ImageUsage::default()
    };
    let mut failures: Vec<String> = checked.faults.iter().map(|fault| fault.text.clone()).collect();
    failures.extend(budget::over(&limits, &used));
    if size.identity.is_none() {
        failures
            .push("it holds no identity of a controller: was it made by specgen, and does it check itself?".to_owned());
    }
    if !size.assumed.is_empty() && !arguments.common.assumed_ok {
        failures.push(format!(
            "{}: it rests on what nobody measured ({}): measure it, take its entries out of `assumed` in the spec and build again; or \
             accept it with --assumed-ok",
            codes::ASSUMED_ON_BOARD.id,
            size.assumed.join(", ")
        ));
    }
    let examined = Examined { image, failures, size, checks: checked };
    let result = ui.shown(&examined);
    let Examined { image, failures, .. } = examined;
    if failures.is_empty() {
        return Ok(Ready { image, mcu });
    }
    let list: String = failures.iter().map(|failure| format!("\n  {failure}")).collect();
    let message = format!("{image} is refused for {}:{list}\nnothing was flashed", part.board);
    Err(Failure::Judged { message, result })
}

/// The part of the board that an image is built for, unless `--target` names another one.
fn board_of(image: &str, target: Option<&str>, named: Option<&str>) -> Result<Mcu, Failure> {
    let Some(target) = target else {
        return Err(Failure::Usage(format!(
            "nothing was flashed: {image} does not say which board it is for; build it anew with specgen build SPEC --target NAME"
        )));
    };
    match Target::named(target).map(|target| target.kind) {
        _ if named.is_some_and(|named| named != target) => Err(Failure::Usage(format!(
            "nothing was flashed: {image} is for {target}, not for {0}: leave --target out, or make an image for {0} with \
             specgen build SPEC --target {0}",
            named.unwrap_or_default()
        ))),
        Some(Kind::Board(mcu)) => Ok(mcu),
        _ => Err(not_a_board(target)),
    }
}

pub(super) fn not_a_board(name: &str) -> Failure {
    let boards = BOARDS.map(|board| format!("--target {}", board.folder)).join(" or ");
    Failure::Usage(format!("nothing was flashed: {name} is no board with a debug probe; name one by {boards}"))
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
