//! The specs of the paper's experiments, embedded in the binary, so that they work without the repository.

use std::fs;
use std::io;
use std::path::Path;

use specgen_compiler::workspace::parts::text as text_of;
use specgen_language::spec::SpecSource;

/// Six legs with their own gauges, section 3 of the paper.
pub const LEGS: &str = include_str!("../../../../specs/legs.toml");
/// The platform, section 4.
pub const PLATFORM: &str = include_str!("../../../../specs/reference.toml");
/// The record that both use.
const RECORD: &str = "records/reference-forc.csv";

/// `text` as a spec in `folder`; writes its record there.
///
/// # Errors
/// If the record cannot be written.
pub fn source(name: &str, text: &str, folder: &Path) -> io::Result<SpecSource> {
    let record = folder.join(RECORD);
    let made = record.parent().map_or(Ok(()), fs::create_dir_all);
    made.and_then(|()| fs::write(&record, text_of(&format!("specs/{RECORD}"))))
        .map_err(|error| io::Error::new(error.kind(), format!("could not write `{}`: {error}", record.display())))?;
    Ok(SpecSource { display_name: format!("specs/{name}.toml"), text: text.to_owned(), dir: folder.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use specgen_compiler::compile;

    #[test]
    fn the_embedded_specs_compile_away_from_the_repository() {
        let folder = tempfile::tempdir().unwrap();
        for (name, text, platform) in [("legs", LEGS, false), ("reference", PLATFORM, true)] {
            let compiled = compile::compile_source(source(name, text, folder.path()).unwrap()).unwrap();
            assert_eq!((compiled.ir.name.as_str(), compiled.design.is_some()), (name, platform));
        }
    }
}
