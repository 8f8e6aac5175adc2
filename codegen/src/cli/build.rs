//! The main job: spec to a workspace, built and measured where the tools are there.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use host_sim::controller::{Controller, TickController};
use serde::Serialize;
use serde_json::json;

use super::check::describe;
use super::ui::{Failure, Ui};
use crate::budget::{self, group};
use crate::compile::{self, Compiled};
use crate::target::{self, TargetError};
use crate::verify::{self, Measurement};
use crate::workspace;

/// Ticks of the exercise that is run on host and emulated machine.
pub(super) const TICKS: u32 = 20_000;

/// Arguments of the main job.
#[derive(Args, Debug)]
pub struct Arguments {
    /// The spec file.
    #[arg(required = true)]
    spec: Option<PathBuf>,
    /// Output folder; `<name>-controller` if not given. Must be new, empty, or an unchanged earlier output.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Write the source only.
    #[arg(long)]
    no_build: bool,
    /// First install what is missing for building and measuring (cross compiler, emulator).
    #[arg(long, conflicts_with = "no_build")]
    setup: bool,
}

/// What was made.
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
    /// Why there is no library or no measurement.
    missing: Option<String>,
    over_budget: Vec<String>,
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let Some(spec) = &arguments.spec else {
        // clap demands it unless there is a subcommand.
        return Err(Failure::Usage("name a spec file".to_owned()));
    };
    if arguments.setup {
        target::provision::provision(&mut |step| ui.progress(step))?;
    }
    let compiled = compile::compile(spec)?;
    ui.findings(Some(&compiled.source), &compiled.findings);
    let output = arguments.output.clone().unwrap_or_else(|| PathBuf::from(format!("{}-controller", compiled.ir.name)));
    workspace::write(&output, &compiled.files)?;
    ui.progress(&format!("wrote {} files to {}", compiled.files.len(), output.display()));

    let mut summary = Summary::of(&compiled, &output);
    if arguments.no_build {
        summary.missing = Some("not built: --no-build".to_owned());
    } else {
        match build(&compiled, &output, &mut summary, ui) {
            Ok(()) => {}
            // What was written is whole; what is missing is said, with the command that installs it.
            Err(Failure::Target(error @ TargetError::MissingTool { .. })) => summary.missing = Some(error.to_string()),
            Err(failure) => return Err(failure),
        }
    }
    summary.over_budget = over_budget(&compiled, &summary);
    let text = summary.text(&compiled);
    let Some(message) = summary.verdict() else {
        ui.result(&text, json!(summary));
        return Ok(());
    };
    if !ui.is_json() {
        ui.out(&text);
    }
    Err(Failure::Judged { message, result: json!(summary) })
}

/// Host library, image, and the exercise on both.
fn build(compiled: &Compiled, output: &Path, summary: &mut Summary, ui: &Ui) -> Result<(), Failure> {
    let target_dir = output.join("target");
    ui.progress("building the host library");
    let library = target::host::build_library(output, &target_dir)?;
    summary.host_library = Some(library.display().to_string());
    let sim = |error: host_sim::controller::ControllerError| Failure::Environment(error.to_string());
    let mut controller = Controller::load(&library).map_err(sim)?;
    let host = verify::exercise(&mut controller, &compiled.model, &compiled.ir, TICKS)
        .map_err(|error| Failure::Environment(error.to_string()))?;

    target::available()?;
    let mcu = compiled.model.target.mcu;
    ui.progress(&format!("building and measuring for {}", mcu.machine()));
    let image = target::build_image(output, mcu, &target_dir)?;
    summary.measurement = Some(verify::measure(&image, &controller.default_config(), &host)?);
    Ok(())
}

impl Summary {
    fn of(compiled: &Compiled, output: &Path) -> Self {
        let hysteresis = &compiled.ir.hysteresis;
        let nodes: usize = hysteresis.tables.iter().map(Vec::len).sum();
        Self {
            name: compiled.ir.name.clone(),
            digest: compiled.ir.digest.clone(),
            output: output.display().to_string(),
            files: compiled.files.len(),
            tables: hysteresis.tables.len(),
            table_bytes: nodes * compiled.ir.scalar.bits() as usize / 8,
            host_library: None,
            measurement: None,
            missing: None,
            over_budget: Vec::new(),
        }
    }

    /// Why what was made must not be used, if so.
    fn verdict(&self) -> Option<String> {
        if let Some(difference) = self.measurement.as_ref().and_then(|m| m.first_difference.as_ref()) {
            return Some(format!(
                "the emulated machine computes other bits than the host: {difference}; report this as a defect of specgen with the spec"
            ));
        }
        (!self.over_budget.is_empty()).then(|| format!("over budget: {}", self.over_budget.join("; ")))
    }

    fn text(&self, compiled: &Compiled) -> String {
        let mut out = String::new();
        let target = &compiled.model.target;
        // Writing to a String cannot fail.
        let _ = writeln!(
            out,
            "{} → {} (f{}, digest {})",
            self.name,
            self.output,
            compiled.ir.scalar.bits(),
            &self.digest[..16]
        );
        out.push_str(&describe(compiled));
        let _ = writeln!(
            out,
            "  tables: {} Everett table{} of N = {}, {} bytes",
            self.tables,
            if self.tables == 1 { "" } else { "s" },
            compiled.ir.hysteresis.grid,
            group(self.table_bytes as u64)
        );
        if let Some(library) = &self.host_library {
            let _ = writeln!(out, "  host library: {library} (links only without a panic path)");
        }
        if let Some(m) = &self.measurement {
            let of = |budget: Option<u64>| budget.map_or(String::new(), |b| format!(" of {}", group(b)));
            let _ = writeln!(out, "  {} ({}):", m.machine, m.compiler);
            let _ = writeln!(
                out,
                "    flash         {}{} bytes: {} code, {} constants; a tick reaches {} bytes of code",
                group(m.flash),
                of(target.flash),
                group(m.code),
                group(m.constants),
                group(m.tick_code)
            );
            let _ = writeln!(
                out,
                "    RAM           {}{} bytes, of which State {}",
                group(m.ram),
                of(target.ram),
                group(m.state)
            );
            let bound = m
                .stack_bound
                .map_or("unbounded".to_owned(), |bytes| format!("{}{} bytes", group(bytes), of(target.stack)));
            let _ = writeln!(out, "    stack a tick  {bound} at most (static), {} seen", group(m.stack_painted));
            for stage in &m.stages {
                let budget = if stage.name == "step" { of(target.instructions) } else { String::new() };
                let _ = writeln!(
                    out,
                    "    {:<13} {}{budget} instructions mean, {} to {} ({} calls)",
                    stage.name,
                    group(stage.mean.round() as u64),
                    group(stage.min),
                    group(stage.max),
                    group(stage.calls)
                );
            }
            match &m.first_difference {
                None => {
                    let _ =
                        writeln!(out, "    host and {} agree in every bit over {} ticks", m.machine, group(m.ticks));
                }
                Some(difference) => {
                    let _ = writeln!(out, "    host and {} DIFFER: {difference}", m.machine);
                }
            }
        }
        if let Some(missing) = &self.missing {
            let _ = writeln!(out, "  {missing}");
        }
        out
    }
}

/// What exceeds the spec's `[target.budget]` or the part, and what the image must not do, in words.
fn over_budget(compiled: &Compiled, summary: &Summary) -> Vec<String> {
    let Some(m) = &summary.measurement else { return Vec::new() };
    let mut over = budget::over(&compiled.model.target, &m.used);
    over.extend(m.checks.faults.iter().map(|fault| fault.text.clone()));
    over
}
