//! The main command: turns a spec into a workspace, builds and checks it, and measures it if the tools are installed.
use std::path::{Path, PathBuf};

use host_sim::controller::TickController;
use serde::Serialize;

use crate::details;
use crate::firmware::{self, check_tick_time};
use crate::verdict::{Answer, Verdict};
use crate::verify::{self, Inspection, Measurement};
use specgen_compiler::compile::Compilation;
use specgen_compiler::{spec_file, workspace};
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::ui::{ControllerForm, Ui};
use specgen_language::{model, shell};
use specgen_toolchain as target;
use specgen_toolchain::budget::{self, group};

/// What to write and build.
#[derive(Debug)]
pub struct Options {
    /// The spec file.
    pub spec: PathBuf,
    /// The output folder.
    pub output: Option<PathBuf>,
    /// Write the source only.
    pub no_build: bool,
    /// Include the crates of a board.
    pub board: bool,
    /// Install missing tools first.
    pub setup: bool,
    /// Show all findings and measurements.
    pub details: bool,
    /// Fail if a tool for the microcontroller is missing.
    pub require_target: bool,
    /// Refuse a spec with warnings.
    pub deny_warnings: bool,
}

#[derive(Debug, Serialize)]
struct Summary {
    name: String,
    digest: String,
    output: String,
    files: usize,
    tables: usize,
    table_bytes: usize,
    host_library: Option<String>,
    measurement: Option<Measurement>,
    /// Static figures of the image, if it could not be run.
    image: Option<Inspection>,
    /// What was skipped, why, and how to install what is missing.
    missing: Option<String>,
    over_budget: Vec<String>,
    verdict: Verdict,
    #[serde(skip)]
    details: bool,
    /// Bits of the controller's scalar.
    #[serde(skip)]
    bits: u32,
    /// Cells per axis of its tables.
    #[serde(skip)]
    grid: usize,
    /// Results of identification and the stability check, if they are to be shown: finding the best lead of each trajectory takes a second.
    #[serde(skip)]
    found: String,
    /// Part and budget from the spec.
    #[serde(skip)]
    limits: model::Target,
}

/// Writes the workspace, builds and measures it as requested, and shows the verdict.
///
/// # Errors
/// The spec is refused or not ready, the folder cannot be written, a build fails, or a budget is exceeded.
pub fn run(options: &Options, ui: &mut Ui) -> Result<(), Failure> {
    let spec = &options.spec;
    let set_up = if options.setup { target::provision::provision(&mut |step| ui.progress(step)).err() } else { None };
    if let Some(error) = &set_up {
        ui.progress(&format!("{error}; continuing without it"));
    }
    let compiled = spec_file::quietly(spec, ui)?;
    spec_file::accept(&compiled, &compiled.findings, options.deny_warnings)?;
    if options.details {
        ui.findings(Some(&compiled.source), &compiled.findings);
    } else {
        ui.findings_in_brief(&compiled.source, &compiled.findings);
    }
    ui.findings(Some(&compiled.source), &compiled.unmet_requirements());
    let output = options
        .output
        .as_deref()
        .map_or_else(|| PathBuf::from(format!("{}-controller", compiled.ir.name)), Path::to_owned);
    let with_board = || workspace::files_with(&compiled.ir, &specgen_compiler::emit::emit(&compiled.ir), &["board"]);
    let files = if options.board { with_board() } else { compiled.files() };
    let _hold = workspace::write(&output, &files)?;
    ui.progress(&format!("wrote {} files to {}", files.len(), output.display()));

    let mut summary = Summary::of(&compiled, &output, files.len(), options.details);
    // The workspace is complete, whatever fails below.
    let built = if options.no_build {
        summary.missing = Some("not built: --no-build".to_owned());
        summary.verdict.unmeasured = Some("time, memory, bits: --no-build".to_owned());
        Ok(())
    } else {
        build(&compiled, &output, &mut summary, ui)
    };
    let refused = match built {
        Ok(()) => None,
        Err(Failure::Tool { message, is_missing: true }) => {
            // Set-up reports more about the same tool: what it tried.
            let undone = summary.undone();
            let missing = format!("skipped: {undone}: {}", set_up.map_or(message, |error| error.to_string()));
            summary.verdict.unmeasured = Some(undone.to_owned());
            summary.missing = Some(missing.clone());
            if !options.require_target {
                ui.progress(&missing);
            }
            options.require_target.then_some(missing)
        }
        Err(Failure::Tool { message, .. }) => Some(message),
        Err(failure) => return Err(failure),
    };
    summary.over_budget = over_budget(&compiled, &summary);
    summary.over_budget.extend(check_tick_time(&compiled, summary.measurement.as_ref(), ui));
    match (&summary.measurement, &summary.image) {
        (Some(measurement), _) => summary.verdict.measured(&compiled, measurement),
        (None, Some(image)) => summary.verdict.inspected(&compiled, image),
        (None, None) => {}
    }
    summary.verdict.next = next(spec, &output, &summary, compiled.model.target.mcu);
    match (summary.fault(), refused) {
        (None, Some(message)) => Err(Failure::Incomplete { message, result: ui.shown(&summary) }),
        (failed, _) => ui.judged(&summary, failed),
    }
}

/// Builds host library and image, and runs the exercise on both.
fn build(compiled: &Compilation, output: &Path, summary: &mut Summary, ui: &Ui) -> Result<(), Failure> {
    let target_dir = output.join("target");
    ui.runs(ControllerForm::Emitted);
    ui.progress("building the host library");
    let library = target::host::build_loadable(output, &target_dir)?;
    summary.host_library = Some(library.display().to_string());
    ui.progress(&format!("host library: {}", library.display()));
    let (controller, host) = verify::exercised(&library, compiled)?;

    let toolchain = target::toolchain::find()?;
    let mcu = compiled.model.target.mcu;
    ui.progress(&format!("building and measuring for {}", mcu.part().emulated));
    let image = target::build::build_image_with(&toolchain, output, mcu, &target_dir)?;
    match verify::measure(&image, &controller.default_config(), &host) {
        Ok(mut measurement) => {
            verify::time_board(&compiled.model, mcu, None, [output, &target_dir], &host, &mut measurement)?;
            summary.measurement = Some(measurement);
        }
        Err(error) => {
            summary.image = Some(verify::inspect(&image)?);
            return Err(error.into());
        }
    }
    Ok(())
}

impl Summary {
    fn of(compiled: &Compilation, output: &Path, files: usize, details: bool) -> Self {
        let hysteresis = &compiled.ir.hysteresis;
        let nodes: usize = hysteresis.tables.iter().map(Vec::len).sum();
        Self {
            name: compiled.ir.name.clone(),
            digest: compiled.ir.digest.clone(),
            output: output.display().to_string(),
            files,
            tables: if hysteresis.has_plays() { 0 } else { hysteresis.tables.len() },
            table_bytes: nodes * compiled.ir.scalar.bits() as usize / 8,
            host_library: None,
            measurement: None,
            image: None,
            missing: None,
            over_budget: Vec::new(),
            verdict: Verdict::of(compiled, ""),
            details,
            bits: compiled.ir.scalar.bits(),
            grid: hysteresis.grid,
            found: if details { details::of(compiled) } else { String::new() },
            limits: compiled.model.target.clone(),
        }
    }

    /// What a missing tool makes impossible.
    fn undone(&self) -> &'static str {
        match (&self.host_library, &self.image) {
            (None, _) => "building",
            (_, None) => "the image for the microcontroller (time, memory, bits)",
            (_, Some(_)) => "running the image (time, RAM, bits)",
        }
    }

    /// Why the result must not be used, if so.
    fn fault(&self) -> Option<String> {
        if let Some(difference) = self.measurement.as_ref().and_then(|m| m.first_difference.as_ref()) {
            return Some(format!(
                "host and emulated machine compute different bits: {difference}; report this as a specgen bug and attach the spec"
            ));
        }
        if !self.over_budget.is_empty() {
            return Some(format!("over budget: {}", self.over_budget.join("; ")));
        }
        (self.verdict.answer == Answer::NotReady).then(|| self.verdict.headline())
    }
}

impl Outcome for Summary {
    fn text(&self) -> String {
        let mut verdict = self.verdict.text();
        if self.details {
            verdict.push('\n');
            verdict += &self.details();
        }
        verdict
    }
}

impl Summary {
    /// All findings and measurements.
    fn details(&self) -> String {
        let mut out = String::new();
        let budget = &self.limits.budget;
        out += &format!("{} → {} (f{}, digest {})\n", self.name, self.output, self.bits, &self.digest[..16]);
        out.push_str(&self.found);
        let (tables, plural, grid) = (self.tables, if self.tables == 1 { "" } else { "s" }, self.grid);
        let bytes = group(self.table_bytes as u64);
        if tables > 0 {
            out += &format!("  tables: {tables} Everett table{plural} of N = {grid}, {bytes} bytes\n");
        }
        if let Some(library) = &self.host_library {
            out += &format!("  host library: {library} (links only without a panic path)\n");
        }
        let of = |budget: Option<u64>| budget.map_or(String::new(), |b| format!(" of {}", group(b)));
        let bound = |bytes: Option<u64>| {
            bytes.map_or("unbounded".to_owned(), |bytes| format!("at most {}{} bytes", group(bytes), of(budget.stack)))
        };
        let flash = |out: &mut String, [all, code, constants, tick]: [u64; 4]| {
            let (used, limit, code_bytes) = (group(all), of(budget.flash), group(code));
            let (constant_bytes, reached) = (group(constants), group(tick));
            *out += &format!(
                "    flash         {used}{limit} bytes: {code_bytes} code, {constant_bytes} constants; the tick reaches {reached} bytes of code\n"
            );
        };
        if let Some(i) = &self.image {
            out += &format!("  {} ({}), not run:\n", i.machine, i.compiler);
            flash(&mut out, [i.flash, i.code, i.constants, i.tick_code]);
            out.push_str(
                "    RAM           not measured: the sizes of State and settings are known only at run time\n",
            );
            out += &format!("    tick stack    {} (static)\n", bound(i.stack_bound));
        }
        if let Some(m) = &self.measurement {
            out += &format!("  {} ({}):\n", m.machine, m.compiler);
            flash(&mut out, [m.flash, m.code, m.constants, m.tick_code]);
            let ram = m.used.ram.map_or_else(
                || "unknown: the tick's stack is unbounded".to_owned(),
                |ram| format!("{}{} bytes including the tick's stack", group(ram), of(budget.ram)),
            );
            out += &format!("    RAM           {ram}, of which State {}\n", group(m.state));
            let (bound, measured) = (bound(m.stack_bound), group(m.stack_painted));
            out += &format!("    tick stack    {bound} (static), {measured} measured\n");
            for stage in &m.stages {
                let budget = if stage.name == "step" { of(budget.instructions) } else { String::new() };
                let (name, mean, least) = (&stage.name, group(stage.mean.round() as u64), group(stage.min));
                let (most, calls) = (group(stage.max), group(stage.calls));
                out += &format!("    {name:<13} {mean}{budget} instructions mean, {least} to {most} ({calls} calls)\n");
            }
            if let Some(estimate) = &m.time {
                out += &format!("  {}:\n{}\n", estimate.board, firmware::time::text(estimate).trim_end());
            }
            match &m.first_difference {
                None => {
                    out += &format!("    host and {} agree in every bit over {} ticks\n", m.machine, group(m.ticks));
                }
                Some(difference) => {
                    out += &format!("    host and {} DIFFER: {difference}\n", m.machine);
                }
            }
        }
        if let Some(missing) = &self.missing {
            out += &format!("  {missing}\n");
        }
        out
    }
}

/// Suggested next commands.
fn next(spec: &Path, output: &Path, summary: &Summary, mcu: model::Mcu) -> Vec<String> {
    if !summary.over_budget.is_empty() {
        return vec![shell::on("specgen size", spec, "")];
    }
    if summary.measurement.is_none() {
        let set_up = if summary.host_library.is_some() { "--setup" } else { "" };
        return vec![shell::line("specgen").path(spec).words("-o").path(output).words(set_up).into()];
    }
    let flash = mcu.part().chip.is_some().then_some("specgen flash");
    ["specgen sim", "specgen report"].into_iter().chain(flash).map(|command| shell::on(command, spec, "")).collect()
}

/// Messages for every exceeded limit of `[target.budget]` or the part, and for every violation in the image.
fn over_budget(compiled: &Compilation, summary: &Summary) -> Vec<String> {
    let Some(image) = summary.measurement.as_deref().or(summary.image.as_ref()) else { return Vec::new() };
    let mut over = budget::over(&compiled.model.target, &image.used);
    over.extend(image.checks.faults.iter().map(|fault| fault.text.clone()));
    over
}
