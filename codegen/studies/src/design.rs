//! Designs active damping with gains and bandwidths that tolerate every structural mode that the spec permits, and writes the result
//! into the spec with a digest of what it was made from.
use std::path::Path;

use serde::Serialize;
use toml_edit::{DocumentMut, Item, Table};

use specgen_compiler::compile;
use specgen_compiler::spec_file;
use specgen_compiler::stability::platform::{Design, describe_damping};
use specgen_language::model::StoredDesign;
use specgen_language::outcome::{Failure, Outcome};
use specgen_language::output::{check_edit, edit_file};
use specgen_language::shell;
use specgen_language::spec::SpecSource;
use specgen_language::ui::Ui;

/// Result of `design`.
#[derive(Serialize)]
struct DesignReport<'a> {
    name: &'a str,
    /// Whether the file changed: a design that belongs to the spec is kept.
    written: bool,
    design: &'a Design,
    #[serde(skip)]
    next: String,
}

/// Designs the law of a spec with `control.active_damping`, and stores it there. Without active damping a stored design is removed,
/// as the rule for gains needs no search.
///
/// # Errors
/// The spec is refused, has no platform, or cannot be written.
pub fn run(spec: &Path, ui: &mut Ui) -> Result<(), Failure> {
    check_edit(spec)?;
    let compiled = spec_file::quietly(spec, ui)?;
    let (Some(design), Some(task)) = (&compiled.design, &compiled.model.task_space) else {
        return Err(Failure::Gate(format!(
            "{}: legs with their own gauges have no active damping; expected a spec with [control]",
            compiled.source.display_name
        )));
    };
    let text = with(&compiled.source.text, design.stored.as_ref()).map_err(Failure::Gate)?;
    let written = if task.active_damping { design.searched } else { task.design.is_some() };
    if written {
        // A text that the compiler would refuse must not be written.
        let edited = SpecSource { text: text.clone(), ..compiled.source.clone() };
        compile::compile_source(edited)?;
        edit_file(spec, text.as_bytes())?;
    }
    let next = shell::on("specgen check", spec, "--details");
    ui.result(&DesignReport { name: &compiled.ir.name, written, design, next });
    Ok(())
}

/// The text of a spec with this design in place of its own.
fn with(text: &str, stored: Option<&StoredDesign>) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|error| format!("{error}"))?;
    if let Some(control) = document.get_mut("control").and_then(Item::as_table_like_mut) {
        control.remove("design");
    }
    if let Some(stored) = stored {
        let section: DocumentMut = stored.text().parse().map_err(|error| format!("{error}"))?;
        let mut table = section["control"]["design"].as_table().cloned().unwrap_or_else(Table::new);
        table.decor_mut().set_prefix("\n# Written by `specgen design`.\n");
        // Behind all other tables.
        table.set_position(Some(isize::MAX));
        document["control"]["design"] = Item::Table(table);
    }
    let written = document.to_string();
    // The editor ends every line with `\n`.
    Ok(if text.contains("\r\n") { written.replace("\r\n", "\n").replace('\n', "\r\n") } else { written })
}

impl Outcome for DesignReport<'_> {
    fn text(&self) -> String {
        let Self { name, written, design, next } = self;
        let Some(damping) = &design.damping else {
            let what = if *written { "removed the stored design" } else { "nothing to store" };
            return format!("{name}: no active damping, {what}: the compiler derives the gains\n  next     {next}\n");
        };
        let what = if *written { "wrote [control.design]" } else { "the stored design belongs to this spec" };
        let mut text = format!(
            "{name}: {what}; stable with any single structural mode from {:.0} Hz on\n{}",
            design.structure_from,
            describe_damping(design, damping)
        );
        text += &format!("  next     {next}\n");
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_design_is_replaced_and_the_rest_of_the_text_stays() {
        let stored = |digest: &str| StoredDesign {
            digest: digest.to_owned(),
            sections: [[0.1, -0.2, 0.3, -1.5, 0.7]; 6],
            notch_damping: [0.5; 6],
            proportional: [1e6; 6],
            integral: [2e9; 6],
            level_bandwidth: 400.0,
            drift_bandwidth: 17.0,
        };
        for text in ["schema = 1\n\n[control]   # its law\nmode = \"p/f\"\n\n[timing]\nperiod = \"100 us\"\n"] {
            for text in [text.to_owned(), text.replace('\n', "\r\n")] {
                let once = with(&text, Some(&stored("d1"))).unwrap();
                assert!(once.starts_with(&text) && once.contains("d1"), "{once}");
                let twice = with(&once, Some(&stored("d2"))).unwrap();
                assert_eq!(twice, once.replace("d1", "d2"));
                assert_eq!(with(&twice, None).unwrap(), text);
            }
        }
    }
}
