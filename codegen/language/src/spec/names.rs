//! Names in a table: what they stand for, and where else they exist.

use super::keys::{Key, SECTIONS, Section};

/// What a name in a table stands for.
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

/// "budget" for `target.budget` within `target`, `None` if `inner` does not stand directly in `outer`.
pub(super) fn child_name(outer: &Section, inner: &'static Section) -> Option<&'static str> {
    let name = match outer.name {
        "" => inner.name,
        prefix => inner.name.strip_prefix(prefix)?.strip_prefix('.')?,
    };
    (!name.is_empty() && !name.contains('.')).then_some(name)
}

/// A key or section of this name in another place.
pub(super) fn elsewhere(section: &Section, name: &str) -> Option<String> {
    SECTIONS.iter().filter(|other| other.name != section.name).find_map(|other| {
        if other.name.rsplit('.').next() == Some(name) {
            return Some(format!("[{}]", other.name));
        }
        other.keys.iter().find(|key| key.name == name).map(|key| other.path(key.name))
    })
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
