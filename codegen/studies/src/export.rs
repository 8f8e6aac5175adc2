//! Exports the controller to other programs: as a C library, a Python module or an FMU.

pub mod fmu;

use std::alloc::Layout;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use host_sim::controller::{ABI_VERSION, Controller, Supervised, TickController};
use host_sim::word::WordKind;
use serde::Serialize;
use specgen_compiler::{spec_file, workspace};
use specgen_language::interrupt::Scratch;
use specgen_runtime::supervisor::{self, Request};
use specgen_toolchain::host::build_loadable;

use specgen_language::outcome::{Failure, Outcome, environment};
use specgen_language::output::{claim, write_folder};
use specgen_language::ui::{ControllerForm, Ui};

/// Requests to the supervisor, by name.
const REQUESTS: [(&str, u32); 7] = [
    ("NONE", Request::None as u32),
    ("ARM", Request::Arm as u32),
    ("RUN", Request::Run as u32),
    ("HOLD", Request::Hold as u32),
    ("RAMP_DOWN", Request::RampDown as u32),
    ("ACKNOWLEDGE", Request::Acknowledge as u32),
    ("DRIVE", Request::Drive as u32),
];
/// Event bits of the supervisor.
const EVENTS: [(&str, u32); 7] = [
    ("MISSED_TICK", supervisor::MISSED_TICK),
    ("LINK_LOST", supervisor::LINK_LOST),
    ("INTEGRITY", supervisor::INTEGRITY),
    ("CONVERTER", supervisor::CONVERTER),
    ("STOP", supervisor::STOP),
    ("AMPLIFIER", supervisor::AMPLIFIER),
    ("STALLED", supervisor::STALLED),
];
/// Alignment of the words in the caller's memory, bytes.
const ALIGNMENT: usize = 8;
const TICK: &str = include_str!("export/tick.c");
const EXAMPLE: &str = include_str!("export/example.c");
const HEADER: &str = include_str!("export/controller.h");
const PYTHON: &str = include_str!("export/controller.py");
/// The command that compiles the C example.
const COMPILE: &str = "cc -std=c11 -Wall example.c tick.c -L. -lcontroller -Wl,-rpath,'$ORIGIN' -o example";

/// Writes a C header, the library for this host, and two sources that use them.
///
/// # Errors
/// The spec is refused, the library cannot be built, or a file cannot be written.
pub fn c(spec: &Path, output: &Path, ui: &mut Ui) -> Result<(), Failure> {
    export(spec, output, ui, |machine| {
        fits(machine)?;
        let [tick, example] = [TICK, EXAMPLE].map(str::to_owned);
        Ok((vec![("controller.h", header(machine)), ("tick.c", tick), ("example.c", example)], COMPILE))
    })
}

/// Writes the library for this host, and a Python module that steps it.
///
/// # Errors
/// As [`c`].
pub fn python(spec: &Path, output: &Path, ui: &mut Ui) -> Result<(), Failure> {
    export(spec, output, ui, |machine| Ok((vec![("controller.py", module(machine))], "python3 -i controller.py")))
}

/// File name of the library.
fn library_name() -> String {
    format!("{}controller{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX)
}

/// Builds the library of a spec and writes it together with `texts` that use it. These come with the first command to run.
fn export(
    spec: &Path,
    output: &Path,
    ui: &mut Ui,
    texts: impl FnOnce(&Supervised) -> Result<(Vec<(&'static str, String)>, &'static str), Failure>,
) -> Result<(), Failure> {
    let compiled = spec_file::compiled(spec, ui)?;
    let _claimed = claim(output)?;
    let scratch = Scratch::new().map_err(environment)?;
    let folder = scratch.path().join("controller");
    workspace::write_scratch(&folder, &compiled.files())?;
    ui.runs(ControllerForm::Emitted);
    ui.progress("building the emitted controller for this host");
    let library = build_loadable(&folder, &scratch.path().join("target"))?;
    let bytes = fs::read(&library).map_err(environment)?;
    let machine = Supervised::new(Controller::load(&library).map_err(environment)?);
    let (texts, next) = texts(&machine)?;
    let mut files: Vec<(String, Vec<u8>)> =
        texts.into_iter().map(|(name, text)| (name.to_owned(), text.into_bytes())).collect();
    files.push((library_name(), bytes));
    write_folder(output, &files)?;
    let names = files.iter().map(|(name, _)| name.clone()).collect();
    ui.result(&Export { folder: output.display().to_string(), files: names, next });
    Ok(())
}

/// `controller.py`.
fn module(machine: &Supervised) -> String {
    let about = machine.controller().description();
    let (inputs, outputs) = (machine.input_names(), machine.output_names());
    let list = |names: &[String]| {
        let quoted: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
        format!("[{}]", quoted.join(", "))
    };
    let more = [&inputs[about.input_names.len()..], &outputs[about.output_names.len()..]].map(list);
    let names = about.config_names.iter().chain(&inputs).chain(&outputs);
    let whole: BTreeSet<&str> = names
        .filter(|name| WordKind::of(name) == WordKind::Integer)
        .filter_map(|name| name.split('[').next())
        .collect();
    let whole: Vec<String> = whole.into_iter().map(str::to_owned).collect();
    PYTHON
        .replace("@library@", &library_name())
        .replace("@digest@", &about.digest)
        .replace("@abi@", &ABI_VERSION.to_string())
        .replace("@supervised@", &format!("({})", more.join(", ")))
        .replace("@whole@", &list(&whole))
}

/// Checks that the memory of a C header is sufficiently aligned for the controller.
fn fits(machine: &Supervised) -> Result<(), Failure> {
    match machine.controller().layouts().iter().find(|layout| layout.align() > ALIGNMENT) {
        None => Ok(()),
        Some(layout) => Err(Failure::Environment(format!(
            "the controller's memory needs an alignment of {} bytes, but the C header provides {ALIGNMENT}",
            layout.align()
        ))),
    }
}

/// An export.
#[derive(Serialize)]
struct Export {
    folder: String,
    files: Vec<String>,
    /// The first command to run.
    #[serde(skip)]
    next: &'static str,
}

impl Outcome for Export {
    fn text(&self) -> String {
        format!("wrote {} to {}\n  {}\n", self.files.join(", "), self.folder, self.next)
    }
}

/// `controller.h`.
fn header(machine: &Supervised) -> String {
    let controller = machine.controller();
    let about = controller.description();
    let [state, config, whole] = controller.layouts();
    let (real, bits) = if about.scalar.bits() == 32 { ("float", "uint32_t") } else { ("double", "uint64_t") };
    let mut text = String::new();
    for (what, names) in
        [("CONFIG", about.config_names.clone()), ("INPUT", machine.input_names()), ("OUTPUT", machine.output_names())]
    {
        text += "enum {\n";
        let mut gauges = None;
        for (place, name) in names.iter().enumerate() {
            text += &format!("    SPECGEN_{what}_{} = {place},\n", identifier(name));
            if what == "INPUT" && (name == "gauge[0]" || name == "displacement[0]") {
                gauges = Some(place);
            }
        }
        if let Some(place) = gauges {
            text += &format!("    SPECGEN_INPUT_GAUGES = {place},\n");
        }
        let own = if what == "CONFIG" { names.len() } else { names.len() - 2 };
        text += &format!("    SPECGEN_{what}_WORDS = {own}{}\n", if what == "CONFIG" { "" } else { "," });
        if what != "CONFIG" {
            text += &format!("    SPECGEN_MACHINE_{what}_WORDS = {}\n", names.len());
        }
        text += "};\n\n";
    }
    for (what, values) in [("REQUEST", &REQUESTS[..]), ("EVENT", &EVENTS[..])] {
        let lines: Vec<String> =
            values.iter().map(|(name, value)| format!("    SPECGEN_{what}_{name} = {value}")).collect();
        text += &format!("enum {{\n{}\n}};\n\n", lines.join(",\n"));
    }
    let texts =
        [("@name@", &about.name), ("@digest@", &about.digest), ("@version@", &about.version), ("@words@", &text)];
    let header = texts.iter().fold(HEADER.to_owned(), |header, (place, text)| header.replace(place, text));
    let header = header.replace("@abi@", &ABI_VERSION.to_string()).replace("@real@", real).replace("@bits@", bits);
    let sizes = [("@config@", config), ("@state@", state), ("@whole@", whole)];
    sizes.iter().fold(header, |header, (place, layout)| header.replace(place, &words(*layout).to_string()))
}

/// Number of 64-bit words that hold it.
fn words(layout: Layout) -> usize {
    layout.size().div_ceil(ALIGNMENT)
}

/// `gauge[3]` as `GAUGE_3`.
fn identifier(name: &str) -> String {
    name.replace('[', "_").replace(']', "").to_ascii_uppercase()
}
