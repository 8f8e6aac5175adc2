//! Controller and simulated machine as FMI 2.0 co-simulation units, with their sources.

mod controller;
mod plant;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io::{self, Cursor, Write};
use std::path::Path;

use host_sim::word::{Scalar, WordKind};
use rawzip::ZipArchiveWriter;
use serde::Serialize;
use specgen_compiler::compile::Compilation;
use specgen_compiler::spec_file;

use specgen_language::outcome::{Failure, Outcome, environment};
use specgen_language::output::{claim, write_folder, write_scratch};
use specgen_language::ui::Ui;

/// Where FMI 2.0 looks for the library of this host.
const PLATFORM: &str = match (cfg!(target_os = "windows"), cfg!(target_os = "macos")) {
    (true, _) => "win64",
    (_, true) => "darwin64",
    _ => "linux64",
};
const UNIT: &str = include_str!("fmu/unit.c");
const BUILD: &str = include_str!("fmu/build.sh");

/// FMI 2.0 co-simulation units of the controller under its supervisor, and of the simulated machine, with their sources.
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
    let shown = |built: &Built| Exported {
        file: output.join(&built.name).display().to_string(),
        variables: built.variables,
        bytes: built.bytes.len(),
    };
    let exported = built.iter().map(shown).collect();
    let files: Vec<_> = built.into_iter().map(|built| (built.name, built.bytes)).collect();
    write_folder(output, &files)?;
    ui.result(&AllExported { units: exported });
    Ok(())
}

/// A unit, ready to be written.
struct Built {
    name: String,
    bytes: Vec<u8>,
    variables: usize,
}

/// In the order of the names, without times: the same files give the same bytes.
fn zipped(files: &BTreeMap<String, Vec<u8>>) -> io::Result<Vec<u8>> {
    let mut out = Cursor::new(Vec::new());
    let mut archive = ZipArchiveWriter::new(&mut out);
    for (name, bytes) in files {
        let (mut entry, config) = archive.new_file(name).start().map_err(io::Error::other)?;
        let mut writer = config.wrap(&mut entry);
        writer.write_all(bytes)?;
        let (_, written) = writer.finish().map_err(io::Error::other)?;
        entry.finish(written).map_err(io::Error::other)?;
    }
    archive.finish().map_err(io::Error::other)?;
    Ok(out.into_inner())
}

/// What was written.
#[derive(Serialize)]
struct AllExported {
    units: Vec<Exported>,
}

#[derive(Serialize)]
struct Exported {
    file: String,
    variables: usize,
    bytes: usize,
}

impl Outcome for AllExported {
    fn text(&self) -> String {
        let line = |unit: &Exported| {
            let megabytes = unit.bytes as f64 / 1e6;
            format!("wrote {}, FMI 2.0 co-simulation, {} variables, {megabytes:.1} MB\n", unit.file, unit.variables)
        };
        self.units.iter().map(line).collect()
    }
}

/// A word of the tick.
struct Variable {
    name: String,
    /// In the words of FMI.
    causality: &'static str,
    kind: WordKind,
    /// Its word before anything is set.
    start: u64,
}

/// What is said of a unit.
struct Unit<'a> {
    compiled: &'a Compilation,
    /// Name of the platform, and what kind of unit it is, as an identifier of C.
    identifier: String,
    /// What it is, before the name of the platform.
    what: &'static str,
    scalar: Scalar,
    /// Whether settings may change while it runs.
    tunable: bool,
    /// By value reference: inputs, outputs, settings.
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

    /// `fmu.h`, with what else is to be in it.
    fn header(&self, more: &str) -> String {
        let count = |causality| self.variables.iter().filter(|variable| variable.causality == causality).count();
        let kind = |variable: &Variable| if variable.kind == WordKind::Real { 'r' } else { 'i' };
        let starts: Vec<String> = self.variables.iter().map(|variable| format!("{}u", variable.start)).collect();
        let starts: Vec<String> = starts.chunks(6).map(|line| format!("    {}", line.join(", "))).collect();
        format!(
            "/* Written by `specgen export fmu`. */\n#ifndef FMU_H\n#define FMU_H\n\n#include <stdint.h>\n\n#define FMU_GUID \"{}\"\n\
             #define FMU_PERIOD {:e}\n#define FMU_TUNABLE {}\nenum {{ FMU_INPUTS = {}, FMU_OUTPUTS = {}, FMU_SETTINGS = {} }};\n\
             /* By value reference: r real, i whole; words before anything is set. */\n\
             static const char FMU_KINDS[] = \"{}\";\nstatic const uint64_t FMU_STARTS[] = {{\n{}\n}};\n{more}\n#endif\n",
            self.guid(),
            self.compiled.model.timing.period,
            i32::from(self.tunable),
            count("input"),
            count("output"),
            count("parameter"),
            self.variables.iter().map(kind).collect::<String>(),
            starts.join(",\n"),
        )
    }

    /// Writes `own` and what all units have into a folder: package, archive and libraries are those of the build. All of them.
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
    fn packed(&self, library: &Path, sources: impl IntoIterator<Item = (String, String)>) -> Result<Built, Failure> {
        let mut files = BTreeMap::from([("modelDescription.xml".to_owned(), self.description().into_bytes())]);
        let place = format!("binaries/{PLATFORM}/{}{}", self.identifier, std::env::consts::DLL_SUFFIX);
        files.insert(place, fs::read(library).map_err(environment)?);
        files.extend(sources.into_iter().map(|(name, text)| (format!("sources/{name}"), text.into_bytes())));
        let bytes = zipped(&files).map_err(environment)?;
        Ok(Built { name: format!("{}.fmu", self.identifier), bytes, variables: self.variables.len() })
    }

    /// `modelDescription.xml`.
    fn description(&self) -> String {
        let (version, period) = (env!("CARGO_PKG_VERSION"), self.compiled.model.timing.period);
        let name = escaped(&self.compiled.ir.name);
        let mut text = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"2.0\" modelName=\"{name}\" guid=\"{}\" \
             description=\"{} {name}: words of a tick, in m, rad, N, V, s\" version=\"{version}\" \
             generationTool=\"specgen {version}\" variableNamingConvention=\"structured\">\n\
             <CoSimulation modelIdentifier=\"{}\" canHandleVariableCommunicationStepSize=\"true\" \
             canNotUseMemoryManagementFunctions=\"false\" canGetAndSetFMUstate=\"true\"/>\n\
             <LogCategories><Category name=\"logStatusError\"/></LogCategories>\n\
             <DefaultExperiment startTime=\"0\" stopTime=\"1\" stepSize=\"{period:e}\"/>\n<ModelVariables>\n",
            self.guid(),
            self.what,
            self.identifier,
        );
        // Outputs change by steps alone: none depends on an input of the same moment, so that units in a ring are no algebraic loop.
        // Before the first step a machine is what its fixed settings made of it.
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
            // Writing to a String cannot fail, here and below.
            let _ = writeln!(
                text,
                "<ScalarVariable name=\"{}\" valueReference=\"{reference}\" causality=\"{causality}\" \
                 variability=\"{variability}\"{initial}><{kind}{start}/></ScalarVariable>",
                escaped(name),
            );
            if *causality == "output" {
                let index = reference + 1;
                let _ = writeln!(outputs, "<Unknown index=\"{index}\" dependencies=\"\"/>");
                let _ = writeln!(first, "<Unknown index=\"{index}\" dependencies=\"{}\"/>", settings.join(" "));
            }
        }
        let _ = write!(
            text,
            "</ModelVariables>\n<ModelStructure>\n<Outputs>\n{outputs}</Outputs>\n<InitialUnknowns>\n{first}</InitialUnknowns>\n\
             </ModelStructure>\n</fmiModelDescription>\n"
        );
        text
    }
}

/// As text within XML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
