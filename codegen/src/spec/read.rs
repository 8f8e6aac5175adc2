//! The parsed file against the key table: which sections and keys there are, and their values.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::fields::{Field, Fields};
use super::findings::Findings;
use super::keys::{self, Key, Presence, SECTIONS, Section};
use super::names::{Meaning, child_name, elsewhere, known_names, lookup};
use super::value::ValueReader;
use super::{messages, text};
use crate::diagnostic::codes;

/// Reads every value of `root`; what is wrong goes to `findings`.
pub(super) fn read(source: &str, root: &DeTable<'_>, findings: &mut Findings) -> Fields {
    let mut reader = Reader { source, fields: Fields::default(), findings, seen: BTreeSet::new() };
    reader.table("", root, None);
    reader.missing_sections();
    reader.fields
}

struct Reader<'a> {
    source: &'a str,
    fields: Fields,
    findings: &'a mut Findings,
    /// Sections that stand in the file, also under a misspelt name.
    seen: BTreeSet<&'static str>,
}

impl Reader<'_> {
    /// Reads the table of `section_name`, whose header stands at `header`.
    fn table(&mut self, section_name: &'static str, table: &DeTable<'_>, header: Option<Range<usize>>) {
        let Some(section) = keys::section(section_name) else {
            return;
        };
        self.seen.insert(section.name);
        let mut found: BTreeMap<&'static str, ()> = BTreeMap::new();
        // A section may hold sections only and no key of its own: its place is then the first name in it.
        let header = header
            .or_else(|| table.iter().map(|(name, _)| text::clamp(self.source, name.span())).min_by_key(|s| s.start));
        let header = header.unwrap_or(0..0);
        for (name, value) in table {
            match self.meaning(section, table, name) {
                Some(Meaning::Key(key)) => {
                    found.insert(key.name, ());
                    self.value(section, key, value);
                }
                Some(Meaning::Section(inner)) => self.section(inner, name, value),
                None => {}
            }
        }
        for key in section.keys.iter().filter(|key| !found.contains_key(key.name)) {
            self.absent(section, key, &header);
        }
    }

    /// What `name` stands for; a slip of a known name counts as that name if it is not there itself.
    fn meaning(
        &mut self,
        section: &'static Section,
        table: &DeTable<'_>,
        name: &Spanned<toml::de::DeString<'_>>,
    ) -> Option<Meaning> {
        let written = name.get_ref().as_ref();
        if let Some(exact) = lookup(section, written) {
            return Some(exact);
        }
        let is_table = table.get(written).is_some_and(|value| value.get_ref().is_table());
        let candidates = |wants_table: bool| {
            let sections = SECTIONS.iter().filter(move |_| wants_table).filter_map(|s| child_name(section, s));
            let keys = section.keys.iter().filter(move |_| !wants_table).map(|key| key.name);
            sections.chain(keys)
        };
        let meant = text::nearest(written, candidates(is_table)).filter(|meant| !table.contains_key(*meant));
        self.unknown(section, name, is_table, meant);
        meant.and_then(|meant| lookup(section, meant))
    }

    fn unknown(
        &mut self,
        section: &Section,
        name: &Spanned<toml::de::DeString<'_>>,
        is_table: bool,
        meant: Option<&str>,
    ) {
        let written = name.get_ref().as_ref();
        let path = section.path(&text::shorten(written));
        let (code, what) = if is_table { (codes::UNKNOWN_SECTION, "section") } else { (codes::UNKNOWN_KEY, "key") };
        let place = if section.name.is_empty() { String::new() } else { format!(" in [{}]", section.name) };
        let help = match (meant, elsewhere(section, written)) {
            (Some(meant), _) => format!("did you mean `{meant}`?"),
            (None, Some(path)) if is_table => format!("did you mean `{path}`?"),
            (None, Some(path)) => format!("`{path}` exists: did it slip out of its section?"),
            (None, None) => format!("take it out; {}", known_names(section, is_table)),
        };
        let span = text::clamp(self.source, name.span());
        self.findings.error(code, &path, span, format!("unknown {what} {}{place}", text::quote(written)), help);
    }

    fn section(
        &mut self,
        section: &'static Section,
        name: &Spanned<toml::de::DeString<'_>>,
        value: &Spanned<DeValue<'_>>,
    ) {
        let span = text::clamp(self.source, name.span());
        if let DeValue::Table(table) = value.get_ref() {
            self.table(section.name, table, Some(span));
            return;
        }
        self.seen.insert(section.name);
        let is = messages::kind_of(value.get_ref());
        self.findings.error(
            codes::WRONG_TYPE,
            section.name,
            span,
            format!("`{}` is {is}, expected the section [{}]", section.name, section.name),
            format!("write it as a section of its own:\n{}", section.example(true).trim_end()),
        );
    }

    fn value(&mut self, section: &Section, key: &'static Key, value: &Spanned<DeValue<'_>>) {
        let path = section.path(key.name);
        let mut reader = ValueReader { source: self.source, key, path: &path, findings: self.findings };
        if let Some(field) = reader.read(value) {
            self.fields.insert(path, field);
        }
    }

    /// A key that is not in its section: a default takes its place, or a finding.
    fn absent(&mut self, section: &'static Section, key: &'static Key, header: &Range<usize>) {
        match key.presence {
            Presence::Required => {
                let path = section.path(key.name);
                let place = if section.name.is_empty() {
                    "at the start of the file, before the first section".to_owned()
                } else {
                    format!("in [{}]", section.name)
                };
                self.findings.error(
                    codes::MISSING_KEY,
                    &path,
                    header.clone(),
                    format!("`{path}` is missing"),
                    format!("write, {place}: {} = {}. {}", key.name, key.example, key.doc),
                );
            }
            Presence::Default(literal) => self.default(section, key, literal, header),
            Presence::Optional | Presence::InsteadOf(_) => {}
        }
    }

    fn default(&mut self, section: &'static Section, key: &'static Key, literal: &str, header: &Range<usize>) {
        // A default is read as if it stood in the file; a test reads every default of the key table.
        let Ok(value) = DeValue::parse(literal) else {
            return;
        };
        let path = section.path(key.name);
        let mut reader = ValueReader { source: literal, key, path: &path, findings: self.findings };
        if let Some(field) = reader.read(&value) {
            let items = field.items.iter().map(|_| header.clone()).collect();
            self.fields.insert(path, Field { span: header.clone(), items, given: false, ..field });
        }
    }

    fn missing_sections(&mut self) {
        let end = self.source.trim_end().len();
        for section in SECTIONS {
            if self.seen.contains(section.name) {
                continue;
            }
            if section.is_required() {
                self.findings.error(
                    codes::MISSING_SECTION,
                    section.name,
                    end..end,
                    format!("section [{}] is missing", section.name),
                    format!("{} Write:\n{}", section.doc, section.example(true).trim_end()),
                );
            } else if !section.optional {
                // The place of its defaults is the start of the file.
                for key in section.keys {
                    self.absent(section, key, &(0..0));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_default_and_example_of_the_key_table_is_right() {
        for section in SECTIONS {
            for key in section.keys {
                let default = match key.presence {
                    Presence::Default(literal) => Some(literal),
                    _ => None,
                };
                for literal in default.into_iter().chain([key.example]) {
                    let value = DeValue::parse(literal).expect(literal);
                    let mut findings = Findings::default();
                    let path = section.path(key.name);
                    let mut reader = ValueReader { source: literal, key, path: &path, findings: &mut findings };
                    assert!(reader.read(&value).is_some(), "{path} = {literal}: {:?}", findings.all());
                }
            }
        }
    }

    #[test]
    fn alternatives_of_the_key_table_name_each_other() {
        for section in SECTIONS {
            for key in section.keys {
                if let Presence::InsteadOf(other) = key.presence {
                    let back = section.keys.iter().find(|k| k.name == other).map(|k| k.presence);
                    assert_eq!(back, Some(Presence::InsteadOf(key.name)));
                }
            }
        }
    }
}
