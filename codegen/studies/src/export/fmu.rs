//! Exports controller and simulated machine as FMI 2.0 co-simulation units, with their sources.

mod controller;
mod plant;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use host_sim::word::{Scalar, WordKind};
use serde::Serialize;
use specgen_compiler::compile::Compilation;
use specgen_compiler::spec_file;

use specgen_language::arrays::zipped;
use specgen_language::outcome::{Failure, Outcome, environment};
use specgen_language::output::{claim, write_folder, write_scratch};
use specgen_language::ui::Ui;

/// Folder of this host's library in FMI 2.0.
const PLATFORM: &str = match (cfg!(target_os = "windows"), cfg!(target_os = "macos")) {
    (true, _) => "win64",
    (_, true) => "darwin64",
    _ => "linux64",
};
const UNIT: &str = include_str!("fmu/unit.c");
const BUILD: &str = include_str!("fmu/build.sh");

/// Writes FMI 2.0 co-simulation units of the supervised controller and of the simulated machine, with their sources.
///
/// # Errors
/// The spec is refused, a unit cannot be built, or a file cannot be written.
pub fn run(spec: &Path, output: &Path, with_plant: bool, ui: &mut Ui) -> Result<(), Failure> {
    let compiled = spec_file::compiled(spec, ui)?;
    let _claimed = claim(output)?;
    let mut built = vec![controller::built(&compiled, ui)?];
    if with_plant {
        built.push(plant::built(&compiled, ui)?);
    }
    let shown = |built: &PackedUnit| Export {
        file: output.join(&built.name).display().to_string(),
        variables: built.variables,
        bytes: built.bytes.len(),
    };
    let exported = built.iter().map(shown).collect();
    let files: Vec<_> = built.into_iter().map(|built| (built.name, built.bytes)).collect();
    write_folder(output, &files)?;
    ui.result(&ExportList { units: exported });
    Ok(())
}

/// A packed unit.
struct PackedUnit {
    name: String,
    bytes: Vec<u8>,
    variables: usize,
}

/// Result of an export.
#[derive(Serialize)]
struct ExportList {
    units: Vec<Export>,
}

#[derive(Serialize)]
struct Export {
    file: String,
    variables: usize,
    bytes: usize,
}

impl Outcome for ExportList {
    fn text(&self) -> String {
        let line = |unit: &Export| {
            let megabytes = unit.bytes as f64 / 1e6;
            format!("wrote {}, FMI 2.0 co-simulation, {} variables, {megabytes:.1} MB\n", unit.file, unit.variables)
        };
        self.units.iter().map(line).collect()
    }
}

/// A variable: one word of a tick.
struct Variable {
    name: String,
    /// As FMI names it.
    causality: &'static str,
    kind: WordKind,
    /// Its initial word.
    start: u64,
}

/// Properties of a unit.
struct Unit<'a> {
    compiled: &'a Compilation,
    /// C identifier: name of the platform and kind of unit.
    identifier: String,
    /// What it is: the text before the name of the platform.
    what: &'static str,
    scalar: Scalar,
    /// Whether settings may change at run time.
    tunable: bool,
    /// In the order of value references: inputs, outputs, settings.
    variables: Vec<Variable>,
}

impl<'a> Unit<'a> {
    fn new(
        compiled: &'a Compilation,
        suffix: &str,
        what: &'static str,
        scalar: Scalar,
        tunable: bool,
        variables: Vec<Variable>,
    ) -> Self {
        let first = if compiled.ir.name.starts_with(|c: char| c.is_ascii_digit()) { "_" } else { "" };
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let identifier = format!("{first}{}{suffix}", compiled.ir.name.chars().map(plain).collect::<String>());
        Self { compiled, identifier, what, scalar, tunable, variables }
    }

    fn guid(&self) -> String {
        let kind = if self.tunable { "" } else { "-plant" };
        format!("{{{}-{}{kind}}}", self.compiled.ir.digest, env!("CARGO_PKG_VERSION"))
    }

    /// `fmu.h`, followed by `more`.
    fn header(&self, more: &str) -> String {
        let count = |causality| self.variables.iter().filter(|variable| variable.causality == causality).count();
        let kind = |variable: &Variable| if variable.kind == WordKind::Real { 'r' } else { 'i' };
        let starts: Vec<String> = self.variables.iter().map(|variable| format!("{}u", variable.start)).collect();
        let starts: Vec<String> = starts.chunks(6).map(|line| format!("    {}", line.join(", "))).collect();
        let (guid, period, tunable) = (self.guid(), self.compiled.model.timing.period, i32::from(self.tunable));
        let (inputs, outputs, settings) = (count("input"), count("output"), count("parameter"));
        let (kinds, starts) = (self.variables.iter().map(kind).collect::<String>(), starts.join(",\n"));
        format!(
            "/* Written by `specgen export fmu`. */\n#ifndef FMU_H\n#define FMU_H\n\n#include <stdint.h>\n\n#define FMU_GUID \"{guid}\"\n\
             #define FMU_PERIOD {period:e}\n#define FMU_TUNABLE {tunable}\nenum {{ FMU_INPUTS = {inputs}, FMU_OUTPUTS = {outputs}, FMU_SETTINGS = {settings} }};\n\
             /* By value reference: r real, i integer; initial words. */\n\
             static const char FMU_KINDS[] = \"{kinds}\";\nstatic const uint64_t FMU_STARTS[] = {{\n{starts}\n}};\n{more}\n#endif\n"
        )
    }

    /// Writes `own` and the common sources into a folder, with package, archive and libraries of the build. Returns all of them.
    fn write_sources(
        &self,
        folder: &Path,
        own: impl IntoIterator<Item = (&'static str, String)>,
        (package, archive, libraries): (&str, &str, &str),
    ) -> Result<Vec<(String, String)>, Failure> {
        let build = BUILD.replace("{IDENTIFIER}", &self.identifier).replace("{PACKAGE}", package);
        let build = build.replace("{ARCHIVE}", archive).replace("{LIBRARIES}", libraries);
        let common = [("fmu.c", UNIT.to_owned()), ("build.sh", build)];
        let files: Vec<_> = own.into_iter().chain(common).map(|(name, text)| (name.to_owned(), text)).collect();
        for (name, text) in &files {
            write_scratch(&folder.join(name), text.as_bytes())?;
        }
        Ok(files)
    }

    /// The unit with its library and its sources.
    fn packed(
        &self,
        library: &Path,
        sources: impl IntoIterator<Item = (String, String)>,
    ) -> Result<PackedUnit, Failure> {
        let mut files = BTreeMap::from([("modelDescription.xml".to_owned(), self.description().into_bytes())]);
        let place = format!("binaries/{PLATFORM}/{}{}", self.identifier, std::env::consts::DLL_SUFFIX);
        files.insert(place, fs::read(library).map_err(environment)?);
        files.extend(sources.into_iter().map(|(name, text)| (format!("sources/{name}"), text.into_bytes())));
        let bytes = zipped(files.iter().map(|(name, file)| (name.as_str(), file.as_slice()))).map_err(environment)?;
        Ok(PackedUnit { name: format!("{}.fmu", self.identifier), bytes, variables: self.variables.len() })
    }

    /// `modelDescription.xml`.
    fn description(&self) -> String {
        let (version, period) = (env!("CARGO_PKG_VERSION"), self.compiled.model.timing.period);
        let name = escaped(&self.compiled.ir.name);
        let (guid, what, identifier) = (self.guid(), &self.what, &self.identifier);
        let mut text = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"2.0\" modelName=\"{name}\" guid=\"{guid}\" \
             description=\"{what} {name}: words of a tick, in m, rad, N, V, s\" version=\"{version}\" \
             generationTool=\"specgen {version}\" variableNamingConvention=\"structured\">\n\
             <CoSimulation modelIdentifier=\"{identifier}\" canHandleVariableCommunicationStepSize=\"true\" \
             canNotUseMemoryManagementFunctions=\"false\" canGetAndSetFMUstate=\"true\"/>\n\
             <LogCategories><Category name=\"logStatusError\"/></LogCategories>\n\
             <DefaultExperiment startTime=\"0\" stopTime=\"1\" stepSize=\"{period:e}\"/>\n<ModelVariables>\n"
        );
        // Outputs are discrete and none depends on an input of the same step, so units in a ring form no algebraic loop.
        // Before the first step, the outputs of a machine depend on its fixed settings.
        let of_start = |(reference, variable): (usize, &Variable)| {
            (variable.causality == "parameter" && !self.tunable).then(|| (reference + 1).to_string())
        };
        let settings: Vec<String> = self.variables.iter().enumerate().filter_map(of_start).collect();
        let (mut outputs, mut first) = (String::new(), String::new());
        for (reference, variable) in self.variables.iter().enumerate() {
            let Variable { name, causality, kind, start } = variable;
            let (variability, initial) = match *causality {
                "output" => ("discrete", " initial=\"calculated\""),
                "parameter" if self.tunable => ("tunable", " initial=\"exact\""),
                "parameter" => ("fixed", " initial=\"exact\""),
                _ => ("discrete", ""),
            };
            let start = match (*causality, kind) {
                ("output", _) => String::new(),
                (_, WordKind::Integer) => format!(" start=\"{}\"", (*start as u32).cast_signed()),
                (_, WordKind::Real) => format!(" start=\"{:?}\"", self.scalar.decode(*start)),
            };
            let kind = if *kind == WordKind::Real { "Real" } else { "Integer" };
            text += &format!(
                "<ScalarVariable name=\"{}\" valueReference=\"{reference}\" causality=\"{causality}\" \
                 variability=\"{variability}\"{initial}><{kind}{start}/></ScalarVariable>\n",
                escaped(name)
            );
            if *causality == "output" {
                let index = reference + 1;
                outputs += &format!("<Unknown index=\"{index}\" dependencies=\"\"/>\n");
                first += &format!("<Unknown index=\"{index}\" dependencies=\"{}\"/>\n", settings.join(" "));
            }
        }
        text += &format!(
            "</ModelVariables>\n<ModelStructure>\n<Outputs>\n{outputs}</Outputs>\n<InitialUnknowns>\n{first}</InitialUnknowns>\n\
             </ModelStructure>\n</fmiModelDescription>\n"
        );
        text
    }
}

/// Escaped for XML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
