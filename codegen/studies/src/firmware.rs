//! A workspace with one target, built, checked, and held against its budget.

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

/// What is built of a spec.
#[derive(Debug)]
pub struct Options {
    /// Name of the target; that of the spec's part if there is none.
    pub target: Option<String>,
    /// The output folder.
    pub output: Option<PathBuf>,
    /// Where cargo builds for microcontrollers.
    pub target_dir: Option<PathBuf>,
    /// With lock-step.
    pub lockstep: bool,
    /// Without the emulator.
    pub no_measure: bool,
    /// A board may rest on what nobody measured.
    pub assumed_ok: bool,
    /// Refuse a spec with warnings.
    pub deny_warnings: bool,
}

/// What was built for a target.
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
    /// Of a board's whole program.
    stack: Option<Reserve>,
    /// What the controller rests on that nobody measured.
    assumed: Assumptions,
    /// What differs from what the spec says, or was left out.
    notes: Vec<String>,
    /// What is over budget or must not be: nothing is flashed then.
    failures: Vec<String>,
    /// Of the controller's scalar.
    #[serde(skip)]
    bits: u32,
    /// Part and budget of the spec.
    #[serde(skip)]
    limits: model::Target,
}

/// Builds a spec for one target, checks the image and holds it against the budget.
///
/// # Errors
/// The spec is refused, the folder cannot be written, a build fails, or the image must not be used.
pub fn run(spec: &Path, options: &Options, ui: &mut Ui) -> Result<(), Failure> {
    let made = make(spec, options, Purpose::Machine, ui)?;
    ui.judged(&made, refusal(&made))
}

/// What every ELF file begins with.
const ELF: [u8; 4] = [0x7f, b'E', b'L', b'F'];

/// The file if it is an ELF image; none if it is something else, which can only be a spec.
fn read_image(path: &Path) -> Result<Option<Vec<u8>>, Failure> {
    // The compiler has the words for a spec that cannot be read, and reads one that comes through a pipe.
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

/// What an image is built for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    /// For a machine: a board's is a real one.
    Machine,
    /// For a board, that is written to it.
    Board,
}

impl Purpose {
    /// Refuses a target that the command has no use for.
    fn takes(self, target: Target) -> Result<(), Failure> {
        if self == Self::Board && !matches!(target.kind, Kind::Board(_)) {
            return Err(flash::not_a_board(target.name));
        }
        Ok(())
    }
}

/// Refuses a board whose controller would rest on what nobody measured, unless that is accepted.
fn accept_assumptions(target: Target, compiled: &Compilation, options: &Options) -> Result<(), Failure> {
    let is_real = matches!(target.kind, Kind::Board(_));
    if !is_real || options.assumed_ok || compiled.assumptions.is_empty() {
        return Ok(());
    }
    let findings = vec![compiled.assumptions.refusal(&compiled.model)];
    Err(Refusal { source: Some(compiled.source.clone()), findings }.into())
}

/// Compiles, writes, builds, checks, measures. What does not do for the purpose is refused before anything is written.
fn make(spec: &Path, options: &Options, purpose: Purpose, ui: &mut Ui) -> Result<BuildResult, Failure> {
    let compiled = spec_file::quietly(spec, ui)?;
    spec_file::accept(&compiled, &compiled.findings, options.deny_warnings)?;
    ui.findings(Some(&compiled.source), &compiled.findings);
    let declared = compiled.model.target.mcu;
    // clap lets only known names through.
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
        let message = format!("--lockstep is for the targets {boards}; {} has it in any case or never", target.name);
        return Err(Failure::Usage(message));
    }
    // What is missing is said before anything is written.
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

/// An image for another core than the spec's would compute other bits, or in software.
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
            "the spec is for {} ({}), but target {} is the {} with {} ({})",
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
                    "the spec declares {}; built for {} of the same core, whose memory is the limit where no budget is declared",
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
                let why = if measure { "see above" } else { "--no-measure" };
                made.notes.push(format!("the time of a tick was not estimated: {why}"));
            }
            made.failures.extend(late(compiled, made.measurement.as_ref(), ui));
            let missed = compiled.missed();
            made.failures.extend(missed.iter().map(|one| format!("{}: {}; {}", one.code, one.message, one.help)));
            ui.findings(Some(&compiled.source), &missed);
            if !compiled.assumptions.is_empty() {
                made.notes.push(format!("it rests on {}", compiled.assumptions.summary()));
            }
        }
    }
    hold_against_budget(&mut made, compiled, target);
    Ok(made)
}

/// Says what is to be said about the time of a tick; why the controller must not be used, if it is too long.
pub(crate) fn late(compiled: &Compilation, measurement: Option<&Measurement>, ui: &mut Ui) -> Option<String> {
    let finding = time::finding(compiled, measurement?.time.as_ref()?)?;
    let failure = format!("{}: {}; {}", finding.code, finding.message, finding.help);
    let fails = finding.severity == Severity::Error;
    ui.findings(Some(&compiled.source), &[finding]);
    fails.then_some(failure)
}

/// The boards' converter has a filter that a spec may not know of.
fn unknown_filter(model: &model::Model) -> Option<&'static str> {
    (model.sensor.lag == 0.0).then_some(
        "the AD7606 of this board filters its inputs, and the spec has no `sensor.lag`: write, in [sensor]: lag = \"15 us\" or more, \
         so that stability and margins contain it",
    )
}

/// Size and checks of an image, and the image under a name that stays.
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

/// The exercise on the host and on the emulated machine of the same core, if there is an emulator.
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

/// Fills in what fails: budget, checks, bits.
fn hold_against_budget(made: &mut BuildResult, compiled: &Compilation, target: Target) {
    let measured = made.measurement.as_ref();
    let used = match (target.kind, &made.size, &made.checks) {
        // The image is the one that was measured.
        (Kind::Emulated, _, _) if measured.is_some() => measured.map(|m| m.used.clone()),
        (_, Some(size), Some(checks)) => Some(ImageUsage {
            flash: size.flash(),
            flash_by: size.owners.iter().map(|owner| (owner.name.clone(), owner.flash())).collect(),
            // State and settings of the image that is replayed are on its stack, and known only in a run.
            ram: checks.stack.filter(|_| target.kind != Kind::Emulated).map(|stack| size.ram() + stack),
            ram_least: size.ram() + checks.stack.unwrap_or(0),
            ram_by: size
                .variables
                .iter()
                .cloned()
                .chain([("stack of a tick".to_owned(), checks.stack.unwrap_or(0))])
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
        made.failures.push(format!(
            "the program's stack takes {} bytes ({}), its memory map gives it {}: make State and settings smaller \
             (hysteresis.memory), or the STACK of memory.x larger",
            group(stack.needed()),
            if stack.startup > stack.running { "initialisation" } else { "tick and interrupts on top of each other" },
            group(stack.reserved)
        ));
    }
    let faults = made.checks.iter().chain(measured.map(|m| &m.checks)).flat_map(|checks| &checks.faults);
    for text in faults.map(|fault| &fault.text) {
        if !made.failures.contains(text) {
            made.failures.push(text.clone());
        }
    }
    if let Some(difference) = measured.and_then(|m| m.first_difference.as_ref()) {
        made.failures.push(format!("the emulated machine computes other bits than the host: {difference}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use specgen_compiler::compile::compile_source;
    use specgen_language::SpecSource;

    #[test]
    fn who_has_an_ad7606_is_told_of_its_filter_until_the_spec_has_it() {
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
