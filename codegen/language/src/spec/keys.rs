//! The key table: every section and key of a spec, to look things up in. A key that is not here does not exist.

pub use crate::keys::*;
pub use crate::model::SECTIONS;

/// The section called `name`.
#[must_use]
pub fn section(name: &str) -> Option<&'static Section> {
    SECTIONS.iter().find(|section| section.name == name)
}

/// The key at `path` (`geometry.height`, `gauge[2].point`).
#[must_use]
pub fn key(path: &str) -> Option<&'static Key> {
    let (section_name, key_name) = path.rsplit_once('.').unwrap_or(("", path));
    let section_name = section_name.split('[').next().unwrap_or(section_name);
    section(section_name)?.keys.iter().find(|key| key.name == key_name)
}
