//! The parsed file against the key table: which sections and keys there are, and their values.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::findings::Findings;
use super::keys::{self, Key, Kind, MAX_TABLES, Presence, SECTIONS, Section};
use super::names::{Meaning, called, child_name, elsewhere, known_names, lookup};
use super::value::ValueReader;
use super::{messages, suggestion, text};
use crate::diagnostic::codes;
use crate::keys::fields::{Field, Fields};

/// Reads every value of `root`; errors go to `findings`.
pub(super) fn read(source: &str, root: &DeTable<'_>, findings: &mut Findings) -> Fields {
    let mut reader = Reader { source, root, fields: Fields::of(source), findings, seen: BTreeSet::new() };
    if let Some(section) = keys::section("") {
        reader.table(section, "", root, None);
    }
    reader.missing_sections();
    reader.fields
}

struct Reader<'a> {
    source: &'a str,
    root: &'a DeTable<'a>,
    fields: Fields,
    findings: &'a mut Findings,
    /// Sections in the file, also under a misspelt name.
    seen: BTreeSet<&'static str>,
}

impl Reader<'_> {
    /// Reads one table of `section`, with the key path `path` and its header at `header`.
    fn table(&mut self, section: &'static Section, path: &str, table: &DeTable<'_>, header: Option<Range<usize>>) {
        self.seen.insert(section.name);
        let mut found: BTreeMap<&'static str, Range<usize>> = BTreeMap::new();
        // A section may contain only sections and no key: its place is then its first name.
        let header = header
            .or_else(|| table.iter().map(|(name, _)| text::clamp(self.source, name.span())).min_by_key(|s| s.start));
        let header = header.unwrap_or(0..0);
        if !path.is_empty() {
            self.fields.insert_table(path.to_owned(), header.clone());
        }
        for (name, value) in table {
            match self.meaning(section, path, table, name) {
                Some(Meaning::Key(key)) if self.is_rate_of_time(path, key, name, value) => {
                    found.insert(key.name, text::clamp(self.source, name.span()));
                }
                Some(Meaning::Key(key)) => {
                    found.insert(key.name, text::clamp(self.source, name.span()));
                    self.value(path, key, value);
                }
                Some(Meaning::Section(inner)) if matches!(inner.kind, Kind::Repeated(..)) => {
                    self.tables(inner, name, value)
                }
                Some(Meaning::Section(inner)) => self.section(inner, name, value),
                None => {}
            }
        }
        let form = self.form(section, path, &found);
        for key in section.keys.iter().filter(|key| !found.contains_key(key.name)) {
            self.absent(section, path, key, form, &header);
        }
    }

    /// The first form that has all keys in `found`; two forms are a finding.
    fn form(
        &mut self,
        section: &'static Section,
        path: &str,
        found: &BTreeMap<&'static str, Range<usize>>,
    ) -> Option<&'static str> {
        let forms = section.forms();
        let given: Vec<&Key> = section
            .keys
            .iter()
            .filter(|key| !key.presence.forms().is_empty() && found.contains_key(key.name))
            .collect();
        let fits = |form: &&&str| given.iter().all(|key| key.presence.forms().contains(form));
        let fitting = forms.iter().find(fits).copied();
        let apart = |a: &Key, b: &Key| !a.presence.forms().iter().any(|form| b.presence.forms().contains(form));
        let mut pairs = given.iter().flat_map(|first| given.iter().map(move |second| (first, second)));
        if fitting.is_none()
            && let Some((first, second)) = pairs.find(|(first, second)| apart(first, second))
        {
            let names = |key: &Key| {
                let own = key.presence.forms().first();
                let keys = section.keys.iter().filter(|key| key.presence.forms().iter().any(|form| Some(form) == own));
                keys.map(|key| key.name).collect::<Vec<_>>().join(", ")
            };
            self.findings.add(
                codes::ALTERNATIVES,
                &keys::join(path, second.name),
                found.get(second.name).cloned().unwrap_or(0..0),
                format!("`{}` and `{}` are alternatives; give only one", second.name, first.name),
                format!("give all keys of one form: {}; or {}", names(first), names(second)),
            );
        }
        // Without one, missing keys of either form are not reported.
        fitting
    }

    /// Reads the tables of a repeated section.
    fn tables(
        &mut self,
        section: &'static Section,
        name: &Spanned<toml::de::DeString<'_>>,
        value: &Spanned<DeValue<'_>>,
    ) {
        self.seen.insert(section.name);
        let name_span = text::clamp(self.source, name.span());
        let DeValue::Array(array) = value.get_ref() else {
            self.not_repeated(section, section.name, name_span, value.get_ref());
            return;
        };
        self.fields.insert_count(section.name, array.len());
        for (i, element) in array.iter().enumerate().take(MAX_TABLES) {
            let path = format!("{}[{i}]", section.name);
            let span = text::clamp(self.source, element.span());
            // The span of a table with its own header is only the header; the span of an inline table includes its
            // keys.
            match element.get_ref() {
                DeValue::Table(table) => self.table(section, &path, table, Some(span)),
                other => self.not_repeated(section, &path, span, other),
            }
        }
    }

    fn not_repeated(&mut self, section: &Section, path: &str, span: Range<usize>, value: &DeValue<'_>) {
        self.findings.add(
            codes::WRONG_TYPE,
            path,
            span,
            format!("`{path}` is {}, expected sections {}", messages::kind_of(value), section.header()),
            format!("write each as a section of its own, with double brackets:\n{}", section.template().trim_end()),
        );
    }

    /// The meaning of `name`. A misspelt name counts as the known name, if that is not there itself.
    fn meaning(
        &mut self,
        section: &'static Section,
        path: &str,
        table: &DeTable<'_>,
        name: &Spanned<toml::de::DeString<'_>>,
    ) -> Option<Meaning> {
        let written = name.get_ref().as_ref();
        if let Some(exact) = lookup(section, written) {
            return Some(exact);
        }
        let is_table = table.get(written).is_some_and(|value| holds_keys(value.get_ref()));
        let candidates = |wants_table: bool| {
            let sections = SECTIONS.iter().filter(move |_| wants_table).filter_map(|s| child_name(section, s));
            let keys = section.keys.iter().filter(move |_| !wants_table).map(|key| key.name);
            sections.chain(keys)
        };
        let named = called(section, written, is_table);
        let meant = named.or_else(|| text::nearest(written, candidates(is_table)));
        let free = meant.filter(|meant| !table.contains_key(*meant));
        self.unknown(section, path, name, is_table, (free, named.filter(|_| free.is_none())));
        free.and_then(|meant| lookup(section, meant))
    }

    /// Whether a time was given as a rate under its own name, as in `rate = "20 kHz"`: the fix is then the whole line.
    fn is_rate_of_time(
        &mut self,
        table: &str,
        key: &'static Key,
        name: &Spanned<toml::de::DeString<'_>>,
        value: &Spanned<DeValue<'_>>,
    ) -> bool {
        let written = name.get_ref().as_ref();
        let DeValue::String(text) = value.get_ref() else { return false };
        let Some(time) = suggestion::time_of_rate(key, text).filter(|_| written != key.name) else { return false };
        let line = format!("{} = \"{time}\"", key.name);
        let place = name.span().start..value.span().end;
        self.findings.instead(&keys::join(table, &text::shorten(written)), place, &line);
        true
    }

    fn unknown(
        &mut self,
        section: &Section,
        table: &str,
        name: &Spanned<toml::de::DeString<'_>>,
        is_table: bool,
        (meant, taken): (Option<&str>, Option<&str>),
    ) {
        let written = name.get_ref().as_ref();
        let path = keys::join(table, &text::shorten(written));
        let (code, what) = if is_table { (codes::UNKNOWN_SECTION, "section") } else { (codes::UNKNOWN_KEY, "key") };
        let place = if section.name.is_empty() { String::new() } else { format!(" in {}", section.header()) };
        let help = match (meant, elsewhere(section, written)) {
            (Some(meant), _) => format!("did you mean `{meant}`?"),
            (None, _) if let Some(taken) = taken => format!("remove it; `{taken}` already sets this"),
            (None, Some(path)) if is_table => format!("did you mean `{path}`?"),
            (None, Some(path)) if path.starts_with('[') => format!("there is a section {path}: does it belong there?"),
            (None, Some(path)) if !path.ends_with(written) => format!("did you mean `{path}`, in its own section?"),
            (None, Some(path)) => format!("`{path}` exists: did it slip out of its section?"),
            (None, None) => format!("remove it; {}", known_names(section, is_table)),
        };
        let span = text::clamp(self.source, name.span());
        self.findings.add(code, &path, span, format!("unknown {what} {}{place}", text::quote(written)), help);
        self.findings.replace_by(&path, meant.map(str::to_owned));
    }

    fn section(
        &mut self,
        section: &'static Section,
        name: &Spanned<toml::de::DeString<'_>>,
        value: &Spanned<DeValue<'_>>,
    ) {
        let span = text::clamp(self.source, name.span());
        if let DeValue::Table(table) = value.get_ref() {
            self.table(section, section.name, table, Some(span));
            return;
        }
        self.seen.insert(section.name);
        let is = messages::kind_of(value.get_ref());
        self.findings.add(
            codes::WRONG_TYPE,
            section.name,
            span,
            format!("`{}` is {is}, expected the section [{}]", section.name, section.name),
            format!("write it as a section of its own:\n{}", section.template().trim_end()),
        );
    }

    fn value(&mut self, table: &str, key: &'static Key, value: &Spanned<DeValue<'_>>) {
        let path = keys::join(table, key.name);
        let mut reader =
            ValueReader { source: self.source, key, path: &path, spec: self.root, findings: self.findings };
        if let Some(field) = reader.read(value) {
            self.fields.insert(path, field);
        }
    }

    /// A missing key: its default is used, or there is a finding.
    fn absent(
        &mut self,
        section: &'static Section,
        table: &str,
        key: &'static Key,
        form: Option<&'static str>,
        header: &Range<usize>,
    ) {
        let path = keys::join(table, key.name);
        match key.presence {
            Presence::Form(of) if form.is_none_or(|form| !of.contains(&form)) => {}
            Presence::Required | Presence::Form(_) => {
                let place = if section.name.is_empty() {
                    "at the start of the file, before the first section".to_owned()
                } else {
                    format!("in {}", section.header())
                };
                self.findings.add(
                    codes::MISSING_KEY,
                    &path,
                    header.clone(),
                    format!("`{path}` is missing"),
                    format!("write, {place}: {}. {}", key.line(), key.doc),
                );
            }
            Presence::Default(literal) => self.default(path, key, literal, header),
            Presence::Optional | Presence::InsteadOf(_) | Presence::Rule(_) => {}
        }
    }

    fn default(&mut self, path: String, key: &'static Key, literal: &str, header: &Range<usize>) {
        // A default is read as if it were in the file; a test reads every default of the key table.
        let Ok(value) = DeValue::parse(literal) else {
            return;
        };
        let mut reader = ValueReader { source: literal, key, path: &path, spec: self.root, findings: self.findings };
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
                self.findings.add(
                    codes::MISSING_SECTION,
                    section.name,
                    end..end,
                    format!("section [{}] is missing", section.name),
                    format!("{} Write:\n{}", section.doc, section.template().trim_end()),
                );
            } else if section.kind == Kind::Plain && self.outer_is_there(section) {
                // Defaults are placed at the start of the file.
                for key in section.keys {
                    self.absent(section, section.name, key, None, &(0..0));
                }
            }
        }
    }

    /// Whether the section that contains `section` is in the file, or optional.
    fn outer_is_there(&self, section: &Section) -> bool {
        let outer = section.name.rsplit_once('.').and_then(|(outer, _)| keys::section(outer));
        outer.is_none_or(|outer| outer.kind == Kind::Plain || self.seen.contains(outer.name))
    }
}

/// A table, or tables with double brackets.
fn holds_keys(value: &DeValue<'_>) -> bool {
    match value {
        DeValue::Table(_) => true,
        DeValue::Array(array) => !array.is_empty() && array.iter().all(|element| element.get_ref().is_table()),
        _ => false,
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
                    assert!(!literal.contains('\n'), "{literal}");
                    let value = DeValue::parse(literal).expect(literal);
                    let mut findings = Findings::default();
                    let path = section.path(key.name);
                    let spec = &DeTable::default();
                    let mut reader = ValueReader { source: literal, key, path: &path, spec, findings: &mut findings };
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
