//! The unit of the supervised controller.

use host_sim::controller::{Controller, Supervised, TickController};
use host_sim::word::WordKind;
use specgen_compiler::compile::Compilation;
use specgen_compiler::workspace;
use specgen_language::interrupt::Scratch;
use specgen_toolchain::host::{build_loadable, build_unit};

use super::{PackedUnit, Unit, Variable};
use crate::export::{fits, header};
use specgen_language::outcome::{Failure, environment};
use specgen_language::ui::{ControllerForm, Ui};

const MODEL: &str = include_str!("controller_model.h");

pub(super) fn built(compiled: &Compilation, ui: &Ui) -> Result<PackedUnit, Failure> {
    let scratch = Scratch::new().map_err(environment)?;
    let sources = scratch.path().join("sources");
    let rust = sources.join("rust");
    let files = compiled.files();
    workspace::write_scratch(&rust, &files)?;
    ui.runs(ControllerForm::Emitted);
    ui.progress("building the emitted controller for this host");
    let target = scratch.path().join("target");
    let library = build_loadable(&rust, &target)?;
    let machine = Supervised::new(Controller::load(&library).map_err(environment)?);
    fits(&machine)?;
    let unit = unit(compiled, &machine);
    let own = [("controller.h", header(&machine)), ("model.h", MODEL.to_owned()), ("fmu.h", unit.header(""))];
    let own = unit.write_sources(&sources, own, ("host", "libcontroller_host.a", ""))?;
    let binary = build_unit(&sources, &rust.join("host"), &target, &unit.identifier)?;
    let rust = files.into_iter().map(|(name, text)| (format!("rust/{name}"), text));
    unit.packed(&binary, own.into_iter().chain(rust))
}

fn unit<'a>(compiled: &'a Compilation, machine: &Supervised) -> Unit<'a> {
    let controller = machine.controller();
    let about = controller.description();
    let mut variables = Vec::new();
    let mut add = |name: String, kind: WordKind, causality, start| {
        variables.push(Variable { name, causality, kind, start });
    };
    machine.input_names().into_iter().for_each(|name| add(name.clone(), WordKind::of(&name), "input", 0));
    machine.output_names().into_iter().for_each(|name| add(name.clone(), WordKind::of(&name), "output", 0));
    // The prefix avoids clashes with names of outputs.
    let settings = about.config_names.iter().zip(controller.default_config());
    settings.for_each(|(name, word)| add(format!("settings.{name}"), WordKind::of(name), "parameter", word));
    Unit::new(compiled, "", "Supervised controller of", about.scalar, true, variables)
}
