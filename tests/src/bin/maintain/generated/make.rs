//! Contents of the committed generated files.

use super::{Files, help, trace};
use host_sim::forc::ReversalExperiment;
use host_sim::noise::Gauge;
use host_sim::plant::{LegParameters, LegPlant};
use specgen_compiler::compile::{Compilation, compile, compile_source};
use specgen_compiler::{emit, findings, settings, workspace};
use specgen_language::outcome::Refusal;
use specgen_language::{SpecSource, spec};
use std::path::Path;

/// Seed of the gauge noise in the committed records.
const SEED: u64 = 1;
/// Reversal curves of the reference record.
const REFERENCE_CURVES: u32 = 32;
/// Reversal curves of the records of six different legs.
const LEG_CURVES: u32 = 8;
/// Gains of the six legs relative to the reference leg's.
const LEG_GAINS: [f64; 6] = [0.95, 1.03, 0.98, 1.05, 1.0, 0.97];
/// Specs whose emitted crate is committed as a golden: small ones, one per scalar.
const GOLDENS: [&str; 2] = ["small-grid", "six-records"];

/// Reversal-curve records of simulated legs: the reference leg's is what `specgen forc` writes.
pub fn records(_: &Path) -> Result<Files, String> {
    let reference = LegParameters::reference();
    let mut files = Files::new();
    files.insert("reference-forc.csv".to_owned(), record(&reference, REFERENCE_CURVES, 0));
    for (leg, gain) in (1u64..).zip(LEG_GAINS) {
        let mut parameters = reference.clone();
        parameters.gain_um_per_v *= gain;
        files.insert(format!("leg{leg}.csv"), record(&parameters, LEG_CURVES, leg));
    }
    Ok(files)
}

fn record(parameters: &LegParameters, curves: u32, stream: u64) -> String {
    let mut leg = LegPlant::new(parameters);
    let mut gauge = Gauge::new(&parameters.noise, SEED, stream);
    ReversalExperiment::reference(curves).run(&mut leg, &mut gauge).to_csv()
}

/// The JSON Schema of specs.
pub fn schema(_: &Path) -> Result<Files, String> {
    Ok(Files::from([("platform.schema.json".to_owned(), spec::json_schema())]))
}

/// References printed from the key table, the registry of findings, the table of settings and the help of the commands.
pub fn pages(root: &Path) -> Result<Files, String> {
    Ok(Files::from([
        ("commands.md".to_owned(), help::markdown(root)?),
        ("traceability.md".to_owned(), trace::markdown(root)?),
        ("spec-reference.md".to_owned(), spec::reference_markdown()),
        ("diagnostics.md".to_owned(), findings::reference_markdown()),
        ("settings.md".to_owned(), settings(root)?),
        ("dependencies.md".to_owned(), dependencies(root)?),
    ]))
}

/// Third-party packages as a table.
fn dependencies(root: &Path) -> Result<String, String> {
    let path = root.join("tests/dependencies.txt");
    let list = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let rows: Vec<&str> = list.lines().filter(|line| line.starts_with('|')).collect();
    Ok(format!(
        "# Dependencies\n\nThird-party packages that the manifests name. `cargo xtask test` checks that the list is complete, and the \
         licences and lock files of all packages.\n\n| package | what for | where |\n|---|---|---|\n{}\n",
        rows.join("\n")
    ))
}

/// The ranges of settings, of a platform and of six legs.
fn settings(root: &Path) -> Result<String, String> {
    let of = |spec: &str| compiled(&root.join("specs").join(spec));
    Ok(settings::markdown(&of("reference.toml")?.ir, &of("legs.toml")?.ir))
}

/// The controller of the reference spec.
pub fn reference_controller(root: &Path) -> Result<Files, String> {
    Ok(emit::emit(&compiled(&root.join("specs/reference.toml"))?.ir))
}

/// The reference with a correction, a trigger output and an input line, for the tests of the code shared by boards: the files that differ
/// from [`reference_controller`], and a root that includes the others from there.
pub fn controller_with_passes(root: &Path) -> Result<Files, String> {
    let path = root.join("specs/reference.toml");
    let mut source = SpecSource::read(&path).map_err(|finding| finding.message)?;
    source.text = source.text.replacen("[control]\n", "[control]\ncorrection = \"2 um\"\n", 1);
    for (name, kind) in [("motion", "motion"), ("start", "input")] {
        source.text += &format!("\n[[trigger]]\nname = \"{name}\"\nkind = \"{kind}\"\n");
    }
    let emitted = |compiled: Result<Compilation, Refusal>| compiled.map(|compiled| emit::emit(&compiled.ir));
    let reference = emitted(compile(&path)).map_err(|refused| said(&path, &refused))?;
    let mut files = Files::new();
    let mut shared = Vec::new();
    for (path, text) in emitted(compile_source(source)).map_err(|refused| said(&path, &refused))? {
        let Some(name) = path.strip_prefix("src/") else { continue };
        // The second line of an emitted file contains the spec.
        let body = |text: &str| text.splitn(3, '\n').nth(2).map(str::to_owned);
        let same = reference.get(&path).is_some_and(|reference| body(reference) == body(&text));
        if same && name != "lib.rs" {
            shared.extend(name.strip_suffix(".rs").map(str::to_owned));
        } else {
            files.insert(name.to_owned(), text);
        }
    }
    if let Some(library) = files.get_mut("lib.rs") {
        for module in shared {
            for declared in [format!("\nmod {module};"), format!("\npub mod {module};")] {
                let of_reference = format!("\n#[path = \"../../../../../controller/src/{module}.rs\"]{declared}");
                *library = library.replace(&declared, &of_reference);
            }
        }
    }
    Ok(files)
}

/// IR and emitted crate of small specs.
pub fn goldens(root: &Path) -> Result<Files, String> {
    let mut files = Files::new();
    for name in GOLDENS {
        let compiled = compiled(&root.join(format!("specs/features/{name}.toml")))?;
        files.insert(format!("{name}/ir.json"), workspace::ir_text(&compiled.ir));
        for (path, text) in emit::emit(&compiled.ir) {
            // Cargo would treat a manifest here as a package of this repository.
            let path = path.replace("Cargo.toml", "Cargo.toml.golden");
            files.insert(format!("{name}/{path}"), text);
        }
    }
    Ok(files)
}

fn compiled(path: &Path) -> Result<Compilation, String> {
    compile(path).map_err(|refused| said(path, &refused))
}

fn said(path: &Path, refused: &Refusal) -> String {
    let first = refused.findings.first().map(|finding| finding.message.clone());
    format!("{} is refused: {}", path.display(), first.unwrap_or_default())
}
