//! Names in a table: their meaning, and where else they exist.

use super::keys::{Key, SECTIONS, Section};

/// Meaning of a name in a table.
pub(super) enum Meaning {
    Key(&'static Key),
    Section(&'static Section),
}

/// The key or section that `name` is within `section`.
pub(super) fn lookup(section: &'static Section, name: &str) -> Option<Meaning> {
    if let Some(key) = section.keys.iter().find(|key| key.name == name) {
        return Some(Meaning::Key(key));
    }
    SECTIONS.iter().find(|inner| child_name(section, inner) == Some(name)).map(Meaning::Section)
}

/// "budget" for `target.budget` within `target`; `None` if `inner` is not directly in `outer`.
pub(super) fn child_name(outer: &Section, inner: &'static Section) -> Option<&'static str> {
    let name = match outer.name {
        "" => inner.name,
        prefix => inner.name.strip_prefix(prefix)?.strip_prefix('.')?,
    };
    (!name.is_empty() && !name.contains('.')).then_some(name)
}

/// The key, or the section within `outer`, that is also called `name`: by the symbol of the paper or a common name.
pub(super) fn called(outer: &'static Section, name: &str, is_table: bool) -> Option<&'static str> {
    if is_table {
        return SECTIONS.iter().filter(|inner| inner.is_called(name)).find_map(|inner| child_name(outer, inner));
    }
    outer.keys.iter().find(|key| key.is_called(name)).map(|key| key.name)
}

/// A key or section of this name elsewhere; then one that is also called so.
pub(super) fn elsewhere(section: &Section, name: &str) -> Option<String> {
    let others = || SECTIONS.iter().filter(|other| other.name != section.name);
    let exact = others().find_map(|other| {
        if other.name.rsplit('.').next() == Some(name) {
            return Some(format!("[{}]", other.name));
        }
        other.keys.iter().find(|key| key.name == name).map(|key| other.path(key.name))
    });
    let called =
        || others().find_map(|other| other.keys.iter().find(|key| key.is_called(name)).map(|key| other.path(key.name)));
    exact.or_else(called)
}

pub(super) fn known_names(section: &Section, sections: bool) -> String {
    let names: Vec<&str> = if sections {
        SECTIONS.iter().map(|s| s.name).filter(|name| !name.is_empty()).collect()
    } else {
        section.keys.iter().map(|key| key.name).collect()
    };
    let what = if sections { "the sections are" } else { "the keys here are" };
    format!("{what} {}", names.join(", "))
}
