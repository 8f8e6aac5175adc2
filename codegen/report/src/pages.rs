//! HTML page about a spec, or about a run of its machine.

mod beside;
mod paper;
mod recorded;
mod simulated;
mod words;

use std::path::{Path, PathBuf};

use host_sim::controller::{Controller, TickController};
use serde::Serialize;

use crate::budget::FINE_BITS;
use crate::evidence::{self, Bits};
use crate::page::{self, Head};
use crate::section::{Part, Section};
use crate::{first, tracking};
use specgen_compiler::compile::{self, Compilation};
use specgen_compiler::{precision, workspace};
use specgen_language::diagnostic::{Diagnostic, Severity};
use specgen_language::interrupt::Scratch;
use specgen_language::outcome::{Failure, Outcome, Refusal, environment};
use specgen_language::output::{check_place, write_file};
use specgen_language::shell;
use specgen_language::spec::{self, SpecSource};
use specgen_language::ui::{ControllerForm, Ui};
use specgen_studies::controllers::at_run_time;
use specgen_studies::details;
use specgen_studies::verdict::{Answer, Verdict};
use specgen_studies::verify::{self, Measurement};
use specgen_toolchain as target;

/// Seed of machine, noise and bit strings.
const SEED: u64 = 1;

/// Options of a page.
#[derive(Debug)]
pub struct Options {
    /// The spec file.
    pub spec: PathBuf,
    /// Output file.
    pub output: Option<PathBuf>,
    /// Add a second page with the paper's figures.
    pub paper: bool,
    /// Generations of the genetic algorithm.
    pub generations: u32,
    /// A record of a run, shown instead of the spec alone.
    pub record: Option<PathBuf>,
    /// Skip the emulated microcontroller.
    pub no_target: bool,
}

#[derive(Serialize)]
struct Page {
    file: String,
    digest: String,
    bytes: usize,
    sections: Vec<&'static str>,
    figures: usize,
    /// The first sentence of the page.
    verdict: Option<String>,
    /// The page of the paper's figures.
    paper: Option<Box<Page>>,
}

impl Outcome for Page {
    fn text(&self) -> String {
        let (sections, figures) = (self.sections.len(), self.figures);
        let verdict = self.verdict.as_ref().map_or_else(String::new, |verdict| format!("{verdict}\n"));
        let paper = self.paper.as_ref().map_or_else(String::new, |paper| paper.text());
        format!(
            "{verdict}wrote {}: {sections} sections, {figures} figures, {} kB\n{paper}",
            self.file,
            self.bytes / 1000
        )
    }
}

/// The emitted controller, with results of its build and exercise.
struct Build {
    controller: Controller,
    measured: Result<Measurement, String>,
    ticks: usize,
    trace: String,
    state: u64,
}

/// Writes the page and shows the verdict.
///
/// # Errors
/// The spec is refused or not ready, a run fails, or a file cannot be written.
pub fn run(options: &Options, ui: &mut Ui) -> Result<(), Failure> {
    let mut compiled = match compile::compile(&options.spec) {
        Ok(compiled) => compiled,
        Err(refused) => return self::refused(options, refused, ui),
    };
    // The page reports unmet requirements first among its findings.
    compiled.findings.splice(0..0, compiled.unmet_requirements());
    ui.findings(Some(&compiled.source), &compiled.findings);
    let output = place(options, &compiled.ir.name);
    check_place(&output)?;
    let paper = options.paper.then(|| paper_path(&output));
    paper.as_deref().map_or(Ok(()), check_place)?;
    if let Some(record) = &options.record {
        return of_record(options, record, &output, &compiled, ui);
    }
    let mut built = build(&compiled, options.no_target, ui)?;
    let name = file_name(&options.spec);
    let command = command_line(options, &name).to_string();
    let mut fine = fine(&compiled)?;
    let simulated = simulated::of(&compiled, [&mut built.controller, &mut fine], &name, ui)?;

    let measured = built.measured.as_ref().map_err(String::as_str);
    let mut verdict = Verdict::of(&compiled, built.measured.as_ref().err().map_or("", String::as_str));
    if let Ok(measurement) = measured {
        verdict.measured(&compiled, measurement);
    }
    simulated.judged.into_iter().for_each(|figure| verdict.push(figure));
    let mode = tracking::mode_of(&built.controller);
    let first = first::of(&compiled, &verdict, measured, simulated.errors, mode);
    let mut behind = evidence_of(&compiled, &built, &name)?;
    behind.insert(0, evidence::tracking(&verdict, &command));
    let mut sections = simulated.sections;
    for section in sections.iter_mut().filter(|section| section.command.is_empty()) {
        section.command.clone_from(&command);
    }
    let board = compiled.model.target.mcu.part().board;
    let title = format!("report for {board}");
    let mut head = head(&compiled.source.display_name, &compiled.ir.digest, &title, command);
    let of_numbers = format!("f{}", compiled.ir.scalar.bits());
    head.versions = [concat!("specgen ", env!("CARGO_PKG_VERSION")), &of_numbers, board].join(" · ");
    head.other = paper.as_deref().map(|path| [file_name(path), "Comparison with the paper".to_owned()]);
    let mut page = write(&output, &head, &first, &sections, &behind)?;
    page.verdict = Some(crate::verdict::Sentence::of(&verdict).verdict);
    if let Some(path) = paper {
        let sections = paper::sections(&compiled, &mut built.controller, options.generations, &name, ui)?;
        head.title = "comparison with the paper".to_owned();
        head.other = Some([file_name(&output), "Report".to_owned()]);
        page.paper = Some(Box::new(write(&path, &head, &[], &sections, &[])?));
    }
    ui.judged(&page, (verdict.answer == Answer::NotReady).then(|| verdict.headline()))
}

/// Page of a run of the machine.
fn of_record(
    options: &Options,
    record: &Path,
    output: &Path,
    compiled: &Compilation,
    ui: &mut Ui,
) -> Result<(), Failure> {
    let run = recorded::read(record, compiled, ui)?;
    let (first, mut sections) = crate::record::page(compiled, &run);
    let command =
        command_line(options, &file_name(&options.spec)).words("--record").path(file_name(record)).to_string();
    for section in &mut sections {
        section.command.clone_from(&command);
    }
    let mut head = head(&compiled.source.display_name, &compiled.ir.digest, "run", command);
    head.versions = format!("specgen {} · {}", env!("CARGO_PKG_VERSION"), file_name(record));
    let page = write(output, &head, &first, &sections, &[])?;
    ui.result(&page);
    Ok(())
}

/// Page of a refused spec.
fn refused(options: &Options, refused: Refusal, ui: &mut Ui) -> Result<(), Failure> {
    let Some(source) = &refused.source else { return Err(refused.into()) };
    let (model, _) = spec::load_as_far(source);
    let name = options.spec.file_stem().map_or_else(|| "spec".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let output = place(options, &name);
    check_place(&output)?;
    let first = first::refused(source, &refused.findings, model.as_ref(), accepted(source, &refused.findings));
    let digest = target::sha256(source.text.as_bytes());
    let mut head =
        head(&source.display_name, &digest, "refused", command_line(options, &file_name(&options.spec)).into());
    head.versions = format!("specgen {}", env!("CARGO_PKG_VERSION"));
    head.refused = true;
    let lines = specgen_language::diagnostic::render(&refused.findings, source, false);
    let text = Section::new("text", "Findings as text", "").lines(&lines);
    let page = write(&output, &head, &first, &[], &[text])?;
    ui.findings(refused.source.as_ref(), &refused.findings);
    ui.progress(page.text().trim_end());
    Err(Failure::Gate(format!("{} is refused; see {}", source.display_name, output.display())))
}

/// Whether replacing the first error's text reduces the number of errors by one.
fn accepted(source: &SpecSource, findings: &[Diagnostic]) -> bool {
    use specgen_language::diagnostic::Place;
    let errors = |findings: &[Diagnostic]| findings.iter().filter(|one| one.severity == Severity::Error).count();
    let Some(first) = findings.iter().find(|one| one.severity == Severity::Error) else { return false };
    let (Some(replacement), Place::Spec(span)) = (&first.replacement, &first.place) else { return false };
    let (Some(before), Some(after)) = (source.text.get(..span.start), source.text.get(span.end..)) else {
        return false;
    };
    let text = format!("{before}{replacement}{after}");
    match compile::compile_source(SpecSource { text, ..source.clone() }) {
        Ok(_) => true,
        Err(refused) => {
            errors(&refused.findings) < errors(findings)
                && refused.findings.iter().all(|one| one.code != first.code || one.key != first.key)
        }
    }
}

fn head(file: &str, digest: &str, title: &str, command: String) -> Head {
    Head {
        file: file_name(Path::new(file)),
        title: title.to_owned(),
        digest: digest.to_owned(),
        versions: String::new(),
        command,
        refused: false,
        other: None,
    }
}

fn write(
    output: &Path,
    head: &Head,
    first: &[Part],
    sections: &[Section],
    evidence: &[Section],
) -> Result<Page, Failure> {
    let html = page::html(head, first, sections, evidence);
    write_file(output, html.as_bytes())?;
    Ok(Page {
        file: output.display().to_string(),
        digest: head.digest.clone(),
        bytes: html.len(),
        sections: sections.iter().map(|section| section.id).collect(),
        figures: page::figures(first, sections),
        verdict: None,
        paper: None,
    })
}

/// Sections without simulation, collapsed at the end.
fn evidence_of(compiled: &Compilation, built: &Build, name: &str) -> Result<Vec<Section>, Failure> {
    let check = shell::on("specgen check", name, "");
    let main = shell::on("specgen", name, "-o DIR");
    let measured = built.measured.as_ref().map_err(String::as_str);
    let rounding = precision::of(&compiled.model, &compiled.ir)
        .map_err(|findings| Refusal { source: Some(compiled.source.clone()), findings })?;
    let bits = Bits { ticks: built.ticks, trace: built.trace.clone(), state: built.state, measured };
    let mut sections = vec![evidence::findings(compiled, &check)];
    if let Some(design) = &compiled.design {
        let modes = Section::new("modes", "Modes", &check).table(evidence::modes(design));
        sections.push(modes.text(
            "Sampled closed loop with the platform's modes, lags of amplifiers and gauges, notch and active damping, over the declared gain_ratio.",
        ));
    }
    sections.extend([
        evidence::rounding(&rounding, compiled.ir.scalar, &check),
        evidence::budget(&compiled.model.target, measured, &main),
        evidence::digests(compiled, &bits, &main),
        Section::new("text", "Output of check --details", &check).lines(details::of(compiled).trim_end()),
    ]);
    Ok(sections)
}

/// The controller of the spec with the finest drive converter, for the error budget.
fn fine(compiled: &Compilation) -> Result<Controller, Failure> {
    let lost = |why: String| {
        Failure::Environment(format!(
            "the spec with dac.bits = {FINE_BITS} does not compile: {why}; report this as a specgen bug and attach the spec"
        ))
    };
    let mut document: toml_edit::DocumentMut =
        compiled.source.text.parse().map_err(|error: toml_edit::TomlError| lost(error.to_string()))?;
    // The spec compiled, so `dac` is a table.
    document["dac"]["bits"] = toml_edit::value(FINE_BITS);
    let source = SpecSource { text: document.to_string(), ..compiled.source.clone() };
    let fine = compile::compile_source(source).map_err(|refused| {
        lost(refused.findings.into_iter().map(|finding| finding.message).collect::<Vec<_>>().join("; "))
    })?;
    specgen_run_time::controller(&fine.ir).map_err(environment)
}

fn place(options: &Options, name: &str) -> PathBuf {
    options.output.as_deref().map_or_else(|| PathBuf::from(format!("{name}-report.html")), Path::to_owned)
}

/// File of the page with the paper's figures.
fn paper_path(output: &Path) -> PathBuf {
    let stem = output.file_stem().map_or_else(|| "report".to_owned(), |stem| stem.to_string_lossy().into_owned());
    output.with_file_name(format!("{stem}-paper.html"))
}

/// The command line with only the spec's file name: its folder is private to the user.
fn command_line(options: &Options, name: &str) -> shell::Line {
    let mut given = Vec::new();
    if options.paper {
        given.push("--paper".to_owned());
    }
    if options.generations != 10 {
        given.push(format!("--generations {}", options.generations));
    }
    if options.no_target {
        given.push("--no-target".to_owned());
    }
    shell::line("specgen report").path(name).words(&given.join(" "))
}

fn file_name(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// Builds host library and image and runs the exercise on both; without a target, uses the compiled spec and builds nothing.
fn build(compiled: &Compilation, no_target: bool, ui: &Ui) -> Result<Build, Failure> {
    let scratch = Scratch::new().map_err(environment)?;
    let folder = scratch.path().join("controller");
    let cache = scratch.path().join("target");
    let mut controller = if no_target {
        at_run_time(compiled, ui)?
    } else {
        workspace::write_scratch(&folder, &compiled.files())?;
        ui.runs(ControllerForm::Emitted);
        ui.progress("building the emitted controller for this host");
        Controller::load(&target::host::build_loadable(&folder, &cache)?).map_err(environment)?
    };
    let host = verify::exercise(&mut controller, &compiled.model, &compiled.ir, verify::TICKS).map_err(environment)?;
    let measured = if no_target {
        Err("skipped by --no-target".to_owned())
    } else {
        let mcu = compiled.model.target.mcu;
        ui.progress(&format!("building and measuring for {}", mcu.part().board));
        let measured = target::available()
            .and_then(|_| target::build_image(&folder, mcu, &cache))
            .and_then(|image| verify::measure(&image, &controller.default_config(), &host))
            .and_then(|mut measurement| {
                verify::time_board(&compiled.model, mcu, None, [&folder, &cache], &host, &mut measurement)?;
                Ok(measurement)
            });
        match measured {
            Ok(measurement) => Ok(measurement),
            Err(error) if error.is_of_a_tool() => Err(error.to_string()),
            Err(error) => return Err(error.into()),
        }
    };
    let state = host.rows().last().and_then(|row| row.last().copied()).unwrap_or_default();
    Ok(Build { controller, measured, ticks: host.len(), trace: target::sha256(&host.to_bytes()), state })
}
