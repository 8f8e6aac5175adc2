//! Builds and checks an image, then flashes it with probe-rs.

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
/// The command that installs it.
const INSTALL: &str = "cargo install probe-rs-tools --locked";

/// Builds and checks an image, then flashes it with probe-rs and the options of `probe`; asks for confirmation unless `yes`.
///
/// # Errors
/// The image must not be used, or probe-rs is missing or fails.
pub fn run(file: &Path, options: &Options, probe: &[&str], yes: bool, ui: &mut Ui) -> Result<(), Failure> {
    let ready = match read_image(file)? {
        Some(elf) => of_image(file, &elf, options, ui)?,
        None => of_spec(file, options, ui)?,
    };
    let CheckedImage { image, mcu } = ready;
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
            "{PROBE_RS} is not installed (searched on PATH), so nothing was flashed; {image} passed its checks. \
             Install it with: {INSTALL}\nthen, with the amplifiers off, run this command again, or run:\n{commands}"
        )));
    };
    if !yes {
        confirm(ui, part.board)?;
    }
    for (what, words) in [("writing", download), ("restarting", reset)] {
        ui.progress(&format!("{what}: {}", shown(&words)));
        // Its progress goes to standard error; standard output carries only our result.
        let output = Command::new(&program).args(&words).stdin(Stdio::null()).stdout(std::io::stderr()).status();
        match output {
            Ok(status) if status.success() => {}
            Ok(status) => {
                return Err(Failure::Environment(format!(
                    "{PROBE_RS} failed ({status}) at {what} {image}; the flash may hold a partial image: keep the amplifiers \
                     off, check the board's cable and power, and run again:\n{commands}"
                )));
            }
            Err(error) => {
                return Err(Failure::Environment(format!("{} cannot be run: {error}", program.display())));
            }
        }
    }
    ui.result(&FlashReport { flashed: image, board: part.board, chip });
    Ok(())
}

#[derive(Serialize)]
struct FlashReport {
    flashed: String,
    board: &'static str,
    chip: &'static str,
}

impl Outcome for FlashReport {
    fn text(&self) -> String {
        format!("flashed {} to {} ({}), verified and restarted\n", self.flashed, self.board, self.chip)
    }
}

/// An existing image, checked before it is flashed.
#[derive(Serialize)]
struct ImageReport {
    image: String,
    failures: Vec<String>,
    #[serde(skip)]
    size: Size,
    #[serde(skip)]
    checks: TickChecks,
}

impl Outcome for ImageReport {
    fn text(&self) -> String {
        text::sections(&self.size) + &text::checked(&self.checks)
    }
}

/// An image that passed every check.
struct CheckedImage {
    image: String,
    mcu: Mcu,
}

fn of_spec(file: &Path, options: &Options, ui: &mut Ui) -> Result<CheckedImage, Failure> {
    let made = make(file, options, Purpose::Board, ui)?;
    let result = ui.shown(&made);
    if let Some(message) = refusal(&made) {
        return Err(Failure::Judged { message: format!("{message}\nnothing was flashed"), result });
    }
    match Target::named(made.target).map(|target| target.kind) {
        Some(Kind::Board(mcu)) => Ok(CheckedImage { image: made.artifact, mcu }),
        _ => Err(not_a_board(&made.board)),
    }
}

/// The same checks for an existing image, which names its board.
fn of_image(file: &Path, elf: &[u8], options: &Options, ui: &mut Ui) -> Result<CheckedImage, Failure> {
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
        failures.push("it has no specgen identity line, so it is not a specgen controller image".to_owned());
    }
    if !size.assumed.is_empty() && !options.assumed_ok {
        failures.push(format!(
            "{}: it rests on unmeasured values ({}): measure them, remove them from `assumed` in the spec and build again, or \
             accept them with --assumed-ok",
            codes::ASSUMED_ON_BOARD.id,
            size.assumed.join(", ")
        ));
    }
    let examined = ImageReport { image, failures, size, checks: checked };
    let result = ui.shown(&examined);
    let ImageReport { image, failures, .. } = examined;
    if failures.is_empty() {
        return Ok(CheckedImage { image, mcu });
    }
    let list: String = failures.iter().map(|failure| format!("\n  {failure}")).collect();
    let message = format!("{image} is refused for {}:{list}\nnothing was flashed", part.board);
    Err(Failure::Judged { message, result })
}

/// The part of the image's board, or of the one in `--target`.
fn board_of(image: &str, target: Option<&str>, named: Option<&str>) -> Result<Mcu, Failure> {
    let Some(target) = target else {
        return Err(Failure::Usage(format!(
            "nothing was flashed: {image} does not name its board; rebuild it with specgen build SPEC --target NAME"
        )));
    };
    match Target::named(target).map(|target| target.kind) {
        _ if named.is_some_and(|named| named != target) => Err(Failure::Usage(format!(
            "nothing was flashed: {image} is for {target}, not for {0}: omit --target, or build an image for {0} with \
             specgen build SPEC --target {0}",
            named.unwrap_or_default()
        ))),
        Some(Kind::Board(mcu)) => Ok(mcu),
        _ => Err(not_a_board(target)),
    }
}

pub(super) fn not_a_board(name: &str) -> Failure {
    let boards = BOARDS.map(|board| format!("--target {}", board.folder)).join(" or ");
    Failure::Usage(format!("nothing was flashed: {name} is not a board with a debug probe; choose one with {boards}"))
}

/// Asks that the amplifiers be off: a controller that starts with its amplifiers on could move the platform.
fn confirm(ui: &Ui, board: &str) -> Result<(), Failure> {
    if ui.is_json() || !std::io::stdin().is_terminal() {
        return Err(Failure::Usage(
            "nothing was flashed: switch the amplifiers off, then confirm with --yes (there is no terminal to ask on)"
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
