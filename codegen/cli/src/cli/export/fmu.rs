//! `specgen export fmu`: the controller as an FMI 2.0 co-simulation unit, with its sources.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io::{self, Cursor, Write};
use std::path::PathBuf;

use clap::Args;
use host_sim::controller::{Controller, Supervised, TickController};
use host_sim::word::WordKind;
use rawzip::ZipArchiveWriter;
use serde::Serialize;
use specgen_compiler::compile::Compiled;
use specgen_compiler::workspace;
use specgen_language::interrupt::Scratch;
use specgen_toolchain::host::{build_library, build_unit};

use crate::cli::file::{claim, write_folder};
use crate::cli::sim::environment;
use crate::cli::spec;
use crate::cli::ui::{Failure, Outcome, Ui};

/// Where FMI 2.0 looks for the library of this host.
const PLATFORM: &str = match (cfg!(target_os = "windows"), cfg!(target_os = "macos")) {
    (true, _) => "win64",
    (_, true) => "darwin64",
    _ => "linux64",
};
const UNIT: &str = include_str!("fmu.c");
const BUILD: &str = include_str!("fmu.sh");

/// Arguments of `export fmu`.
#[derive(Args, Debug)]
#[command(after_help = crate::cli::examples::EXPORT_FMU)]
pub(super) struct Arguments {
    /// The spec file.
    spec: PathBuf,
    /// Folder for the unit, which is called after the platform.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let compiled = spec::compiled(&arguments.spec, ui)?;
    let _claimed = claim(&arguments.output)?;
    let scratch = Scratch::new().map_err(environment)?;
    let sources = scratch.path().join("sources");
    let rust = sources.join("rust");
    workspace::write_scratch(&rust, &compiled.files)?;
    ui.progress("building the emitted controller for this host");
    let target = scratch.path().join("target");
    let library = build_library(&rust, &target)?;
    let machine = Supervised::new(Controller::load(&library).map_err(environment)?).map_err(environment)?;
    super::fits(&machine)?;

    let unit = Unit::of(&compiled, &machine);
    let own: [(&str, String); 4] = [
        ("controller.h", super::header(&machine)),
        ("fmu.h", unit.header()),
        ("fmu.c", UNIT.to_owned()),
        ("build.sh", BUILD.replace("{IDENTIFIER}", &unit.identifier)),
    ];
    for (name, text) in &own {
        fs::write(sources.join(name), text).map_err(environment)?;
    }
    let binary = build_unit(&sources, &rust, &target, &unit.identifier)?;
    let mut files: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    files.insert("modelDescription.xml".to_owned(), unit.description().into_bytes());
    let extension = std::env::consts::DLL_SUFFIX;
    files
        .insert(format!("binaries/{PLATFORM}/{}{extension}", unit.identifier), fs::read(&binary).map_err(environment)?);
    for (name, text) in own {
        files.insert(format!("sources/{name}"), text.into_bytes());
    }
    for (name, text) in &compiled.files {
        files.insert(format!("sources/rust/{name}"), text.clone().into_bytes());
    }
    let name = format!("{}.fmu", unit.identifier);
    write_folder(&arguments.output, &[(name.clone(), zipped(&files).map_err(environment)?)])?;
    ui.result(&Exported { file: arguments.output.join(name).display().to_string(), variables: unit.variables.len() });
    Ok(())
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
struct Exported {
    file: String,
    variables: usize,
}

impl Outcome for Exported {
    fn text(&self) -> String {
        format!("wrote {}, FMI 2.0 co-simulation, {} variables\n", self.file, self.variables)
    }
}

/// A word of the tick.
struct Variable {
    name: String,
    /// In the words of FMI.
    causality: &'static str,
    kind: WordKind,
    /// Of an input or a setting, as it stands in XML.
    start: Option<String>,
}

/// What is said of the unit.
struct Unit<'a> {
    compiled: &'a Compiled,
    /// Name of the platform as an identifier of C.
    identifier: String,
    period: f64,
    /// By value reference: inputs, outputs, settings.
    variables: Vec<Variable>,
}

impl<'a> Unit<'a> {
    fn of(compiled: &'a Compiled, machine: &Supervised) -> Self {
        let controller = machine.controller();
        let about = controller.description();
        let mut variables = Vec::new();
        let mut add = |name: String, causality, word: Option<u64>| {
            let kind = WordKind::of(&name);
            let start = word.map(|word| match kind {
                WordKind::Integer => (word as u32).cast_signed().to_string(),
                WordKind::Real => format!("{:?}", about.scalar.decode(word)),
            });
            variables.push(Variable { name, causality, kind, start });
        };
        machine.input_names().into_iter().for_each(|name| add(name, "input", Some(0)));
        machine.output_names().into_iter().for_each(|name| add(name, "output", None));
        // Outputs may have the names of settings.
        let settings = about.config_names.iter().zip(controller.default_config());
        settings.for_each(|(name, word)| add(format!("settings.{name}"), "parameter", Some(word)));
        let first = if compiled.ir.name.starts_with(|c: char| c.is_ascii_digit()) { "_" } else { "" };
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let identifier = format!("{first}{}", compiled.ir.name.chars().map(plain).collect::<String>());
        Self { compiled, identifier, period: compiled.model.timing.period, variables }
    }

    fn guid(&self) -> String {
        format!("{{{}-{}}}", self.compiled.ir.digest, env!("CARGO_PKG_VERSION"))
    }

    /// `fmu.h`.
    fn header(&self) -> String {
        let kind = |variable: &Variable| if variable.kind == WordKind::Real { 'r' } else { 'i' };
        format!(
            "/* Written by `specgen export fmu`. */\n#define FMU_GUID \"{}\"\n#define FMU_PERIOD {:e}\n/* By value reference: r real, i \
             whole. */\nstatic const char FMU_KINDS[] = \"{}\";\n",
            self.guid(),
            self.period,
            self.variables.iter().map(kind).collect::<String>()
        )
    }

    /// `modelDescription.xml`.
    fn description(&self) -> String {
        let (version, period) = (env!("CARGO_PKG_VERSION"), self.period);
        let name = escaped(&self.compiled.ir.name);
        let mut text = format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription fmiVersion=\"2.0\" modelName=\"{name}\" guid=\"{}\" \
             description=\"Supervised controller of {name}: words of a tick, in m, rad, N, V, s\" version=\"{version}\" \
             generationTool=\"specgen {version}\" variableNamingConvention=\"structured\">\n\
             <CoSimulation modelIdentifier=\"{}\" canHandleVariableCommunicationStepSize=\"true\" \
             canNotUseMemoryManagementFunctions=\"false\" canGetAndSetFMUstate=\"true\"/>\n\
             <LogCategories><Category name=\"logStatusError\"/></LogCategories>\n\
             <DefaultExperiment startTime=\"0\" stopTime=\"1\" stepSize=\"{period:e}\"/>\n<ModelVariables>\n",
            self.guid(),
            self.identifier,
        );
        let mut outputs = String::new();
        for (reference, variable) in self.variables.iter().enumerate() {
            let Variable { name, causality, kind, start } = variable;
            let (variability, initial) = match *causality {
                "output" => ("discrete", " initial=\"calculated\""),
                "parameter" => ("tunable", " initial=\"exact\""),
                _ => ("discrete", ""),
            };
            let kind = if *kind == WordKind::Real { "Real" } else { "Integer" };
            let start = start.as_ref().map_or_else(String::new, |start| format!(" start=\"{start}\""));
            // Writing to a String cannot fail, here and below.
            let _ = writeln!(
                text,
                "<ScalarVariable name=\"{}\" valueReference=\"{reference}\" causality=\"{causality}\" \
                 variability=\"{variability}\"{initial}><{kind}{start}/></ScalarVariable>",
                escaped(name),
            );
            if *causality == "output" {
                let _ = writeln!(outputs, "<Unknown index=\"{}\"/>", reference + 1);
            }
        }
        let _ = write!(
            text,
            "</ModelVariables>\n<ModelStructure>\n<Outputs>\n{outputs}</Outputs>\n<InitialUnknowns>\n{outputs}</InitialUnknowns>\n\
             </ModelStructure>\n</fmiModelDescription>\n"
        );
        text
    }
}

/// As text within XML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}
