//! Builds and checks an image, then lets probe-rs write it.

use std::io::{BufRead, IsTerminal, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use serde::Serialize;

use super::{Options, Purpose, make, read_image, refusal, text};
use specgen_language::diagnostic::codes;
use specgen_language::model::{self, BOARDS, Mcu};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::shell;
use specgen_language::ui::Ui;
use specgen_toolchain::checks::{self, Rules, TickChecks};
use specgen_toolchain::size::{Size, size};
use specgen_toolchain::targets::{Kind, Target};
use specgen_toolchain::{budget, find_program};

/// The program that talks to the debug probe.
const PROBE_RS: &str = "probe-rs";
/// How to get it.
const INSTALL: &str = "cargo install probe-rs-tools --locked";

/// Builds and checks an image, then lets probe-rs write it, with the options of `probe`; asks before, unless `yes`.
///
/// # Errors
/// The image must not be used, or probe-rs is missing or fails.
pub fn run(file: &Path, options: &Options, probe: &[&str], yes: bool, ui: &mut Ui) -> Result<(), Failure> {
    let ready = match read_image(file)? {
        Some(elf) => of_image(file, &elf, options, ui)?,
        None => of_spec(file, options, ui)?,
    };
    let Ready { image, mcu } = ready;
    let image = shell::no_option(image);
    let part = mcu.part();
    let Some(chip) = part.chip else {
        return Err(not_a_board(part.board));
    };
    let download = [&["download", "--chip", chip, "--verify"], probe, &[image.as_str()]].concat();
    let reset = [&["reset", "--chip", chip], probe].concat();
    let shown = |words: &[&str]| words.iter().fold(shell::line(PROBE_RS), |line, word| line.word(word));
    let commands = format!("  {}\n  {}", shown(&download), shown(&reset));
    let Some(program) = find_program(PROBE_RS) else {
        return Err(Failure::Environment(format!(
            "{PROBE_RS} is not installed (looked for on PATH), so nothing was flashed; {image} is checked. \
             Install it with: {INSTALL}\nthen, with the amplifiers off, run this again, or by hand:\n{commands}"
        )));
    };
    if !yes {
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

fn of_spec(file: &Path, options: &Options, ui: &mut Ui) -> Result<Ready, Failure> {
    let made = make(file, options, Purpose::Board, ui)?;
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
fn of_image(file: &Path, elf: &[u8], options: &Options, ui: &mut Ui) -> Result<Ready, Failure> {
    let image = file.display().to_string();
    let size = size(elf)?;
    let mcu = board_of(&image, size.target, options.target.as_deref())?;
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
    if !size.assumed.is_empty() && !options.assumed_ok {
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
