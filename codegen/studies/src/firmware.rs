//! Builds a workspace for one target, checks it, and compares it with its budget.

pub mod flash;
pub mod size;
mod text;
pub(crate) mod time;

use std::io::{Read, Seek};
use std::path::{Path, PathBuf};

use host_sim::controller::TickController;
use host_sim::trace::Trace;
use serde::Serialize;

use crate::verify::{self, Measurement};
use specgen_compiler::assumed::Assumptions;
use specgen_compiler::compile::Compilation;
use specgen_compiler::{emit, spec_file, workspace};
use specgen_language::diagnostic::{Diagnostic, Severity, codes};
use specgen_language::files;
use specgen_language::model::{self, BOARDS, Mcu};
use specgen_language::outcome::{Failure, Refusal};
use specgen_language::output::unread_file;
use specgen_language::ui::Ui;
use specgen_toolchain::budget::{self, ImageUsage, group};
use specgen_toolchain::checks::{self, Rules, TickChecks};
use specgen_toolchain::size::{Size, size as measure_size};
use specgen_toolchain::stack::Reserve;
use specgen_toolchain::targets::{Kind, Target};
use specgen_toolchain::{self as target, Image, TargetError};

/// What to build of a spec.
#[derive(Debug)]
pub struct Options {
    /// Name of the target; default: the target of the spec's part.
    pub target: Option<String>,
    /// The output folder.
    pub output: Option<PathBuf>,
    /// Target folder of cargo for microcontrollers.
    pub target_dir: Option<PathBuf>,
    /// Build with lock-step.
    pub lockstep: bool,
    /// Skip the emulator.
    pub no_measure: bool,
    /// Accept a board whose controller rests on unmeasured values.
    pub assumed_ok: bool,
    /// Refuse a spec with warnings.
    pub deny_warnings: bool,
}

/// The build for a target.
#[derive(Debug, Serialize)]
struct BuildResult {
    name: String,
    digest: String,
    target: &'static str,
    board: String,
    output: String,
    artifact: String,
    /// `rustc --version` of the cross compiler.
    compiler: Option<String>,
    size: Option<Size>,
    checks: Option<TickChecks>,
    measurement: Option<Measurement>,
    used: Option<ImageUsage>,
    /// Stack of a board's whole program.
    stack: Option<Reserve>,
    /// Unmeasured values that the controller rests on.
    assumed: Assumptions,
    /// Deviations from the spec, and skipped steps.
    notes: Vec<String>,
    /// Exceeded budgets and violations: the image must not be flashed.
    failures: Vec<String>,
    /// Bits of the controller's scalar.
    #[serde(skip)]
    bits: u32,
    /// Part and budget from the spec.
    #[serde(skip)]
    limits: model::Target,
}

/// Builds a spec for one target, checks the image and compares it with the budget.
///
/// # Errors
/// The spec is refused, the folder cannot be written, a build fails, or the image must not be used.
pub fn run(spec: &Path, options: &Options, ui: &mut Ui) -> Result<(), Failure> {
    let made = make(spec, options, Purpose::Machine, ui)?;
    ui.judged(&made, refusal(&made))
}

/// Magic number of ELF files.
const ELF: [u8; 4] = [0x7f, b'E', b'L', b'F'];

/// The file if it is an ELF image; `None` if it is something else, which can only be a spec.
fn read_image(path: &Path) -> Result<Option<Vec<u8>>, Failure> {
    // The compiler reports unreadable specs, and accepts pipes.
    let Ok(mut file) = files::open_file(path) else { return Ok(None) };
    let mut first = Vec::new();
    let begun = file.by_ref().take(ELF.len() as u64).read_to_end(&mut first).and_then(|_| file.rewind());
    if begun.is_err() || first != ELF {
        return Ok(None);
    }
    files::content(file, files::MAX_BYTES).map(Some).map_err(|unread| unread_file(path, &unread))
}

/// Why an image must not be used, if so.
fn refusal(made: &BuildResult) -> Option<String> {
    let list: String = made.failures.iter().map(|failure| format!("\n  {failure}")).collect();
    (!list.is_empty()).then(|| format!("{} for {} is refused:{list}", made.target, made.board))
}

/// Purpose of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    /// To run; on a board this means a real machine.
    Machine,
    /// To be flashed to a board.
    Board,
}

impl Purpose {
    /// Refuses a target that does not suit the command.
    fn takes(self, target: Target) -> Result<(), Failure> {
        if self == Self::Board && !matches!(target.kind, Kind::Board(_)) {
            return Err(flash::not_a_board(target.name));
        }
        Ok(())
    }
}

/// Refuses a board whose controller rests on unmeasured values, unless accepted.
fn accept_assumptions(target: Target, compiled: &Compilation, options: &Options) -> Result<(), Failure> {
    let is_real = matches!(target.kind, Kind::Board(_));
    if !is_real || options.assumed_ok || compiled.assumptions.is_empty() {
        return Ok(());
    }
    let findings = vec![compiled.assumptions.refusal(&compiled.model)];
    Err(Refusal { source: Some(compiled.source.clone()), findings }.into())
}

/// Compiles, writes, builds, checks and measures. An unsuitable target is refused before anything is written.
fn make(spec: &Path, options: &Options, purpose: Purpose, ui: &mut Ui) -> Result<BuildResult, Failure> {
    let compiled = spec_file::quietly(spec, ui)?;
    spec_file::accept(&compiled, &compiled.findings, options.deny_warnings)?;
    ui.findings(Some(&compiled.source), &compiled.findings);
    let declared = compiled.model.target.mcu;
    // clap accepts only known names.
    let target = options.target.as_deref().and_then(Target::named).unwrap_or_else(|| Target::of(declared));
    purpose.takes(target)?;
    if let Kind::Board(mcu) = target.kind
        && let Some(finding) = wrong_part(&compiled, mcu, target)
    {
        return Err(Refusal { source: Some(compiled.source), findings: vec![finding] }.into());
    }
    accept_assumptions(target, &compiled, options)?;
    if options.lockstep && !matches!(target.kind, Kind::Board(_)) {
        let boards = BOARDS.map(|board| board.folder).join(", ");
        let message = format!("--lockstep applies only to the targets {boards}, not to {}", target.name);
        return Err(Failure::Usage(message));
    }
    // Report missing tools before writing anything.
    if matches!(target.kind, Kind::Emulated | Kind::Board(_)) {
        target::toolchain::find()?;
    }
    let output = options
        .output
        .as_deref()
        .map_or_else(|| PathBuf::from(format!("{}-controller", compiled.ir.name)), Path::to_owned);
    let files = workspace::files_with(&compiled.ir, &emit::emit(&compiled.ir), &[target.name]);
    let _hold = workspace::write(&output, &files)?;
    ui.progress(&format!("wrote {} files to {}", files.len(), output.display()));
    let target_dir = options.target_dir.as_deref().map_or_else(|| output.join("target"), Path::to_owned);
    let folders = Folders { output: &output, target: &target_dir };
    build(&compiled, target, &folders, options, ui)
}

/// An image for another core than the spec's would compute other bits, or use software floating point.
fn wrong_part(compiled: &Compilation, mcu: Mcu, target: Target) -> Option<Diagnostic> {
    let (declared, part) = (compiled.model.target.mcu.part(), mcu.part());
    if (declared.core, declared.double) == (part.core, part.double) {
        return None;
    }
    let scalar = if part.double { "" } else { ", and in [controller]: scalar = \"f32\"" };
    Some(Diagnostic::at(
        &compiled.model.spans,
        &["target.mcu", "target"],
        codes::WRONG_PART,
        format!(
            "the spec is for {} ({}), but target {} has the {} with {} ({})",
            declared.name, declared.core, target.name, part.board, part.name, part.core
        ),
        format!(
            "write, in [target]: mcu = \"{}\"{scalar}; or build with --target {}",
            part.name,
            Target::of(compiled.model.target.mcu).name
        ),
    ))
}

#[derive(Clone, Copy)]
struct Folders<'a> {
    output: &'a Path,
    target: &'a Path,
}

fn build(
    compiled: &Compilation,
    target: Target,
    folders: &Folders<'_>,
    options: &Options,
    ui: &mut Ui,
) -> Result<BuildResult, Failure> {
    let Folders { output, target: target_dir } = *folders;
    let measure = !options.no_measure;
    let declared = compiled.model.target.mcu;
    let mut made = BuildResult {
        name: compiled.ir.name.clone(),
        digest: compiled.ir.digest.clone(),
        target: target.name,
        board: String::new(),
        output: output.display().to_string(),
        artifact: String::new(),
        compiler: None,
        size: None,
        checks: None,
        measurement: None,
        used: None,
        stack: None,
        assumed: compiled.assumptions.clone(),
        notes: Vec::new(),
        failures: Vec::new(),
        bits: compiled.ir.scalar.bits(),
        limits: compiled.model.target.clone(),
    };
    match target.kind {
        Kind::Host => {
            ui.progress("building the host library");
            made.board = "this machine".to_owned();
            made.artifact = target::host::build_library(output, &output.join("target"))?.display().to_string();
        }
        Kind::Program => {
            ui.progress(&format!("building {} for this machine", target.name));
            made.board = "this machine".to_owned();
            made.artifact = target::host::build_program(output, target.name, target_dir)?.display().to_string();
        }
        Kind::Emulated => {
            made.board = declared.part().emulated.to_owned();
            let toolchain = target::toolchain::find()?;
            ui.progress(&format!("building for {}", made.board));
            let image = target::build::build_image_with(&toolchain, output, declared, target_dir)?;
            examine(&mut made, &image, true, output)?;
            if measure {
                let measured = emulate(compiled, folders, Some(&image), &mut made.notes, ui)?;
                made.measurement = measured.map(|(measurement, _)| measurement);
            }
        }
        Kind::Board(mcu) => {
            made.board = mcu.part().board.to_owned();
            let toolchain = target::toolchain::find()?;
            ui.progress(&format!("building for {}", made.board));
            let image =
                target::build::build_folder(&toolchain, output, target.name, mcu, target_dir, options.lockstep)?;
            examine(&mut made, &image, false, output)?;
            made.stack = Reserve::of(&image.elf)?;
            if mcu != declared {
                made.notes.push(format!(
                    "the spec declares {}; built for {} with the same core, whose memory is the limit if no budget is declared",
                    declared.part().name,
                    mcu.part().name
                ));
            }
            made.notes.extend(unknown_filter(&compiled.model).map(str::to_owned));
            if measure && let Some((mut measurement, host)) = emulate(compiled, folders, None, &mut made.notes, ui)? {
                ui.progress(&format!("estimating a tick of {}", made.board));
                let folders = [output, target_dir];
                verify::time_board(&compiled.model, mcu, Some(&image.elf), folders, &host, &mut measurement)?;
                made.measurement = Some(measurement);
            } else {
                let why = if measure { "see the note above" } else { "--no-measure" };
                made.notes.push(format!("the time of a tick was not estimated: {why}"));
            }
            made.failures.extend(check_tick_time(compiled, made.measurement.as_ref(), ui));
            let missed = compiled.unmet_requirements();
            made.failures.extend(missed.iter().map(|one| format!("{}: {}; {}", one.code, one.message, one.help)));
            ui.findings(Some(&compiled.source), &missed);
            if !compiled.assumptions.is_empty() {
                made.notes.push(format!("it rests on {}", compiled.assumptions.summary()));
            }
        }
    }
    check_budget(&mut made, compiled, target);
    Ok(made)
}

/// Reports findings about the time of a tick. Returns why the controller must not be used, if it is too long.
pub(crate) fn check_tick_time(
    compiled: &Compilation,
    measurement: Option<&Measurement>,
    ui: &mut Ui,
) -> Option<String> {
    let finding = time::finding(compiled, measurement?.time.as_ref()?)?;
    let failure = format!("{}: {}; {}", finding.code, finding.message, finding.help);
    let fails = finding.severity == Severity::Error;
    ui.findings(Some(&compiled.source), &[finding]);
    fails.then_some(failure)
}

/// A note if the board's converter has a filter that the spec does not model.
fn unknown_filter(model: &model::Model) -> Option<&'static str> {
    (model.sensor.lag == 0.0).then_some(
        "the AD7606 of this board filters its inputs, but the spec has no `sensor.lag`: write, in [sensor]: lag = \"15 us\" or more, \
         so that stability and margins include it",
    )
}

/// Size and checks of an image; copies the image to a permanent name.
fn examine(made: &mut BuildResult, image: &Image, whole_image: bool, output: &Path) -> Result<(), Failure> {
    let folder = output.join("target");
    std::fs::create_dir_all(&folder).map_err(|error| TargetError::io("creating", &folder, error))?;
    let kept = folder.join(format!("{}.elf", made.target));
    target::host::write_whole(&kept, &image.elf)?;
    made.artifact = kept.display().to_string();
    made.compiler = Some(image.compiler.clone());
    let rules = Rules { single: !image.mcu.part().double, whole_image };
    made.size = Some(measure_size(&image.elf)?);
    made.checks = Some(checks::check(&image.elf, None, rules)?);
    Ok(())
}

/// Runs the exercise on the host and on the emulated machine with the same core, if there is an emulator.
fn emulate(
    compiled: &Compilation,
    folders: &Folders<'_>,
    image: Option<&Image>,
    notes: &mut Vec<String>,
    ui: &Ui,
) -> Result<Option<(Measurement, Trace)>, Failure> {
    let tools = match target::available() {
        Ok(tools) => tools,
        Err(error) if error.is_of_a_tool() => {
            notes.push(format!("instructions not counted: {error}"));
            return Ok(None);
        }
        Err(error) => return Err(error.into()),
    };
    let mcu = compiled.model.target.mcu;
    let Folders { output, target: target_dir } = *folders;
    ui.progress(&format!("counting instructions on {}", mcu.part().emulated));
    let library = match target::host::build_loadable(output, &output.join("target")) {
        Err(error @ TargetError::Static) => {
            notes.push(format!("instructions not counted: {error}"));
            return Ok(None);
        }
        built => built?,
    };
    let (controller, host) = verify::exercised(&library, compiled)?;
    let built;
    let image = match image {
        Some(image) => image,
        None => {
            built = target::build::build_image_with(&tools.toolchain, output, mcu, target_dir)?;
            &built
        }
    };
    let measurement = verify::measure(image, &controller.default_config(), &host)?;
    Ok(Some((measurement, host)))
}

/// Adds failures of budget, checks and bits.
fn check_budget(made: &mut BuildResult, compiled: &Compilation, target: Target) {
    let measured = made.measurement.as_ref();
    let used = match (target.kind, &made.size, &made.checks) {
        // Use the figures of the measured image.
        (Kind::Emulated, _, _) if measured.is_some() => measured.map(|m| m.used.clone()),
        (_, Some(size), Some(checks)) => Some(ImageUsage {
            flash: size.flash(),
            flash_by: size.owners.iter().map(|owner| (owner.name.clone(), owner.flash())).collect(),
            // The replay image keeps State and settings on its stack, so their sizes are known only at run time.
            ram: checks.stack.filter(|_| target.kind != Kind::Emulated).map(|stack| size.ram() + stack),
            ram_least: size.ram() + checks.stack.unwrap_or(0),
            ram_by: size
                .variables
                .iter()
                .cloned()
                .chain([("tick stack".to_owned(), checks.stack.unwrap_or(0))])
                .collect(),
            stack: checks.stack,
            stack_by: checks.path.clone(),
            instructions: measured.and_then(|m| m.used.instructions),
            instructions_by: measured.map(|m| m.used.instructions_by.clone()).unwrap_or_default(),
        }),
        _ => None,
    };
    if let Some(used) = &used {
        let mut limits = compiled.model.target.clone();
        if let Kind::Board(mcu) = target.kind {
            limits.mcu = mcu;
        }
        made.failures.extend(budget::over(&limits, used));
    }
    made.used = used;
    if let Some(stack) = made.stack.as_ref().filter(|stack| stack.needed() > stack.reserved) {
        let needed = group(stack.needed());
        let when = if stack.startup > stack.running { "initialisation" } else { "tick and nested interrupts" };
        let reserved = group(stack.reserved);
        made.failures.push(format!(
            "the program's stack needs {needed} bytes ({when}), but its memory map reserves {reserved}: make State and settings smaller \
             (hysteresis.memory), or STACK in memory.x larger"
        ));
    }
    let faults = made.checks.iter().chain(measured.map(|m| &m.checks)).flat_map(|checks| &checks.faults);
    for text in faults.map(|fault| &fault.text) {
        if !made.failures.contains(text) {
            made.failures.push(text.clone());
        }
    }
    if let Some(difference) = measured.and_then(|m| m.first_difference.as_ref()) {
        made.failures.push(format!("host and emulated machine compute different bits: {difference}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use specgen_compiler::compile::compile_source;
    use specgen_language::SpecSource;

    #[test]
    fn the_filter_of_an_ad7606_is_noted_unless_the_spec_models_it() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../specs/reference.toml");
        let plain = SpecSource::read(&path).unwrap();
        let mut filtered = plain.clone();
        filtered.text = plain.text.replacen("[sensor]\n", "[sensor]\nlag = \"15 us\"\n", 1);
        assert_ne!(plain.text, filtered.text);
        let note = |source| unknown_filter(&compile_source(source).unwrap().model);
        assert!(note(plain).is_some_and(|note| note.contains("write, in [sensor]: lag = \"15 us\"")));
        assert_eq!(note(filtered), None);
    }
}
