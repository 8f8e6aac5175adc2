//! The unit of the simulated machine: the plant of `specgen sim` with all its sources.

use std::collections::BTreeMap;

use crate::machine;
use host_sim::plant::LegParameters;
use host_sim::word::{Scalar, WordKind};
use plant_unit::{Description, Kind, SETTINGS, Settings};
use specgen_compiler::compile::Compilation;
use specgen_compiler::workspace::parts::{files, text};
use specgen_language::interrupt::Scratch;
use specgen_toolchain::host::build_unit;
use toml_edit::{Array, DocumentMut};

use super::{PackedUnit, Unit, Variable};
use specgen_language::outcome::{Failure, environment};
use specgen_language::output::write_scratch;
use specgen_language::ui::Ui;

const MODEL: &str = include_str!("plant_model.h");
const MANIFEST: &str = include_str!("../../../../../Cargo.toml");
const LOCK: &str = "Cargo.lock";
/// The crate to build, and its folder.
const PACKAGE: (&str, &str) = ("plant-unit", "unit");
/// Members of the workspace of sources.
const MEMBERS: [&str; 3] = [PACKAGE.1, "host-sim", "firmware/runtime"];

pub(super) fn built(compiled: &Compilation, ui: &Ui) -> Result<PackedUnit, Failure> {
    let description = description(compiled);
    let text = serde_json::to_string(&description).map_err(environment)?;
    let unit = unit(compiled, &description);
    let rust = rust(compiled)?;
    let scratch = Scratch::new().map_err(environment)?;
    let sources = scratch.path().join("sources");
    for (name, text) in &rust {
        write_scratch(&sources.join("rust").join(name), text.as_bytes())?;
    }
    let own =
        [("model.h", MODEL.to_owned()), ("fmu.h", unit.header(&format!("#define FMU_PLANT {}\n", literal(&text))))];
    let build = ("unit", "libplant_unit.a", "-lm -lpthread -ldl");
    let own = unit.write_sources(&sources, own, build)?;
    ui.progress("building the simulated machine for this host: this takes a minute the first time, and cargo may download packages");
    let binary =
        build_unit(&sources, &sources.join("rust").join(PACKAGE.1), &scratch.path().join("target"), &unit.identifier)?;
    let rust = rust.into_iter().map(|(name, text)| (format!("rust/{name}"), text));
    unit.packed(&binary, own.into_iter().chain(rust))
}

/// Parameters of the machine of `specgen sim`.
fn description(compiled: &Compilation) -> Description {
    let (model, leg) = (&compiled.model, LegParameters::reference());
    let period = model.timing.period;
    match &model.task_space {
        Some(task) => {
            let specimen = machine::specimen(model, task, &leg, None);
            let calibration = task.calibration.clone();
            let [leg, ..] = specimen.legs;
            Description { period, leg, kind: Kind::Platform { nominal: Box::new(specimen.nominal), calibration } }
        }
        None => {
            let voltages = [model.actuator.voltage[0], model.rest_voltage()];
            Description { period, leg: machine::leg(model, &leg), kind: Kind::Legs { voltages } }
        }
    }
}

fn unit<'a>(compiled: &'a Compilation, description: &Description) -> Unit<'a> {
    let mut variables = Vec::new();
    let mut add = |name: String, causality, kind, start| variables.push(Variable { name, causality, kind, start });
    for stem in description.inputs() {
        let start = if *stem == "voltage" { description.rest_voltage() } else { 0.0 };
        (0..6).for_each(|k| add(format!("{stem}[{k}]"), "input", WordKind::Real, start.to_bits()));
    }
    for stem in description.outputs() {
        (0..6).for_each(|k| add(format!("{stem}[{k}]"), "output", WordKind::Real, 0));
    }
    for ((name, is_real), word) in SETTINGS.iter().zip(Settings::default().words()) {
        let kind = if *is_real { WordKind::Real } else { WordKind::Integer };
        add(format!("settings.{name}"), "parameter", kind, word);
    }
    Unit::new(compiled, "_plant", "Simulated machine of", Scalar::F64, false, variables)
}

/// A workspace of the plant's crates, with specgen's own dependency versions and flags.
fn rust(compiled: &Compilation) -> Result<BTreeMap<String, String>, Failure> {
    let ours =
        files("host-sim").iter().chain(files("unit")).map(|(name, text)| ((*name).to_owned(), (*text).to_owned()));
    let mut files: BTreeMap<String, String> = ours.collect();
    if let Some(manifest) = files.get_mut("unit/Cargo.toml") {
        // The runtime is a sibling of the simulator here, not its parent.
        *manifest = manifest.replace("path = \"..\"", "path = \"../host-sim\"");
    }
    let runtime = compiled.files().into_iter().filter(|(name, _)| name.starts_with("runtime/"));
    files.extend(runtime.map(|(name, text)| (format!("firmware/{name}"), text)));
    let mut manifest: DocumentMut = MANIFEST.parse().map_err(environment)?;
    if let Some(workspace) = manifest["workspace"].as_table_mut() {
        workspace.insert("members", toml_edit::value(MEMBERS.into_iter().collect::<Array>()));
        ["exclude", "default-members"].iter().for_each(|key| drop(workspace.remove(key)));
    }
    let lock = pruned(text(LOCK), PACKAGE.0);
    if let Some(profiles) = manifest["profile"].as_table_mut() {
        profiles.retain(|name, _| name == "release");
        if let Some(packages) = profiles["release"]["package"].as_table_mut() {
            packages.retain(|name, _| name == "*" || lock.contains(&format!("\nname = \"{name}\"\n")));
        }
    }
    files.insert("Cargo.toml".to_owned(), manifest.to_string());
    files.insert("Cargo.lock".to_owned(), lock);
    Ok(files)
}

/// The lock file reduced to the dependencies of `root`, in cargo's format.
fn pruned(lock: &str, root: &str) -> String {
    let mut blocks = lock.split("[[package]]\n");
    let head = blocks.next().unwrap_or_default();
    let packages: Vec<&str> = blocks.collect();
    let field = |block: &str, key: &str| {
        let line = block.lines().find_map(|line| line.strip_prefix(key));
        line.map(|value| value.trim_matches('"').to_owned()).unwrap_or_default()
    };
    let named = |block: &str| (field(block, "name = "), field(block, "version = "));
    let mut kept = vec![false; packages.len()];
    let mut open = vec![root.to_owned()];
    while let Some(wanted) = open.pop() {
        // `name`, or `name version` if there are several versions.
        let mut words = wanted.split(' ');
        let (name, version) = (words.next().unwrap_or_default(), words.next());
        for (block, kept) in packages.iter().zip(&mut kept) {
            let (own, of) = named(block);
            if own == name && version.is_none_or(|version| version == of) && !*kept {
                *kept = true;
                open.extend(dependencies(block).map(str::to_owned));
            }
        }
    }
    let left = || packages.iter().zip(&kept).filter(|(_, kept)| **kept).map(|(block, _)| *block);
    let mut text = head.to_owned();
    for block in left() {
        let mut block = block.trim_end().to_owned();
        for dependency in dependencies(&block.clone()) {
            let name = dependency.split(' ').next().unwrap_or_default();
            if left().filter(|block| named(block).0 == name).count() == 1 {
                block = block.replace(&format!(" \"{dependency}\",\n"), &format!(" \"{name}\",\n"));
            }
        }
        text += &format!("[[package]]\n{block}\n\n");
    }
    text.truncate(text.trim_end().len());
    text + "\n"
}

/// The `dependencies` of a package in a lock file.
fn dependencies(block: &str) -> impl Iterator<Item = &str> {
    block.lines().filter_map(|line| line.strip_prefix(" \"")?.strip_suffix("\","))
}

/// A C string literal, in lines short enough for every compiler.
fn literal(text: &str) -> String {
    let escaped: Vec<String> = text
        .as_bytes()
        .chunks(100)
        .map(|chunk| {
            let byte = |byte: &u8| match byte {
                b'"' => "\\\"".to_owned(),
                b'\\' => "\\\\".to_owned(),
                // Three digits, so that a following digit is not part of the escape. `?` could start a trigraph.
                0..=31 | b'?' | 127.. => format!("\\{byte:03o}"),
                byte => char::from(*byte).to_string(),
            };
            format!("    \"{}\"", chunk.iter().map(byte).collect::<String>())
        })
        .collect();
    format!("\\\n{}", escaped.join(" \\\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_file_is_pruned_in_the_format_of_cargo() {
        let lock = "version = 4\n\n[[package]]\nname = \"a\"\nversion = \"1.0.0\"\ndependencies = [\n \"b 2.0.0\",\n]\n\n\
                    [[package]]\nname = \"b\"\nversion = \"1.0.0\"\n\n[[package]]\nname = \"b\"\nversion = \"2.0.0\"\n\n\
                    [[package]]\nname = \"c\"\nversion = \"1.0.0\"\ndependencies = [\n \"a\",\n \"b 1.0.0\",\n]\n";
        let wanted = "version = 4\n\n[[package]]\nname = \"a\"\nversion = \"1.0.0\"\ndependencies = [\n \"b\",\n]\n\n\
                      [[package]]\nname = \"b\"\nversion = \"2.0.0\"\n";
        assert_eq!(pruned(lock, "a"), wanted);
        assert_eq!(pruned(lock, "c"), lock);
        let ours = pruned(text(LOCK), PACKAGE.0);
        assert!(ours.contains("\nname = \"host-sim\"\n") && !ours.contains("\nname = \"clap\"\n"), "{ours}");
    }

    #[test]
    fn a_c_literal_has_the_value_of_its_text() {
        assert_eq!(literal("a\"b\\\n1?é"), "\\\n    \"a\\\"b\\\\\\0121\\077\\303\\251\"");
        assert_eq!(literal(&"x".repeat(101)), format!("\\\n    \"{}\" \\\n    \"x\"", "x".repeat(100)));
    }
}
