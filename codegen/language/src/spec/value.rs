//! Checks one TOML value against its key.

mod number;

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::findings::Findings;
use super::keys::{self, Item, Key, MAX_NAME, Shape};
use super::{messages, text};
use crate::diagnostic::codes;
use crate::keys::fields::{Field, KeyValue};

/// A value with its place: the file's own, or the parsed text of a default.
pub(super) struct ValueReader<'a> {
    pub(super) source: &'a str,
    pub(super) key: &'static Key,
    pub(super) path: &'a str,
    /// The other values, for helps.
    pub(super) spec: &'a DeTable<'a>,
    pub(super) findings: &'a mut Findings,
}

/// A single valid value.
enum Scalar {
    Number(f64),
    Integer(i64),
    Flag(bool),
    Choice(&'static str),
    Name(String),
}

impl Scalar {
    fn number(&self) -> Option<f64> {
        if let Self::Number(number) = self { Some(*number) } else { None }
    }

    fn word(&self) -> Option<String> {
        if let Self::Choice(word) = self { Some((*word).to_owned()) } else { None }
    }
}

impl ValueReader<'_> {
    /// The value in the form that its key requires; `None` if there is a finding.
    pub(super) fn read(&mut self, value: &Spanned<DeValue<'_>>) -> Option<Field> {
        let span = text::clamp(self.source, value.span());
        let (parsed, items) = match self.key.shape {
            Shape::One(item) => {
                let parsed = match self.scalar(item, self.path, value)? {
                    Scalar::Number(number) => KeyValue::Numbers(vec![number]),
                    Scalar::Integer(integer) => KeyValue::Integer(integer),
                    Scalar::Flag(flag) => KeyValue::Flag(flag),
                    Scalar::Choice(word) => KeyValue::Choice(word),
                    Scalar::Name(name) => KeyValue::Name(name),
                };
                (parsed, Vec::new())
            }
            Shape::List(items) => {
                let (numbers, spans) = self.numbers(self.path, items, value)?;
                (KeyValue::Numbers(numbers), spans)
            }
            Shape::Leading(least, items) => {
                let (found, spans) = self.items(self.path, items, least, value)?;
                let words: Vec<String> = found.iter().filter_map(Scalar::word).collect();
                let numbers = found.iter().filter_map(Scalar::number).collect();
                (if words.is_empty() { KeyValue::Numbers(numbers) } else { KeyValue::Texts(words) }, spans)
            }
            Shape::Rows(count, items) => self.rows(count, items, value)?,
            Shape::Records => self.texts("a file name", value)?,
            Shape::Reasons => self.texts("a text", value)?,
            Shape::Paths => self.texts("the path of a key in quotes", value)?,
        };
        Some(Field { parsed, span, items, given: true })
    }

    /// An array of `items`, all of them numbers: the numbers and their places.
    fn numbers(
        &mut self,
        path: &str,
        items: &'static [Item],
        value: &Spanned<DeValue<'_>>,
    ) -> Option<(Vec<f64>, Vec<Range<usize>>)> {
        let (found, spans) = self.items(path, items, items.len(), value)?;
        Some((found.iter().filter_map(Scalar::number).collect(), spans))
    }

    /// An array of `items`; those after the first `least` are optional: values and places.
    fn items(
        &mut self,
        path: &str,
        items: &'static [Item],
        least: usize,
        value: &Spanned<DeValue<'_>>,
    ) -> Option<(Vec<Scalar>, Vec<Range<usize>>)> {
        let wanted = if least == items.len() { items.len().to_string() } else { format!("{least} to {}", items.len()) };
        let DeValue::Array(array) = value.get_ref() else {
            return self.wrong_type(path, value, &format!("an array of {wanted} values"), None);
        };
        let mut found = Vec::new();
        let mut spans = Vec::new();
        for (i, (item, element)) in items.iter().zip(array.iter()).enumerate() {
            spans.push(text::clamp(self.source, element.span()));
            found.extend(self.scalar(*item, &format!("{path}[{i}]"), element));
        }
        if !(least..=items.len()).contains(&array.len()) {
            self.wrong_count(path, value, array.len(), "value", &wanted);
            return None;
        }
        (found.len() == array.len()).then_some((found, spans))
    }

    fn rows(
        &mut self,
        count: usize,
        items: &'static [Item],
        value: &Spanned<DeValue<'_>>,
    ) -> Option<(KeyValue, Vec<Range<usize>>)> {
        let DeValue::Array(array) = value.get_ref() else {
            return self.wrong_type(self.path, value, &format!("an array of {count} arrays"), None);
        };
        let mut numbers = Vec::new();
        let mut spans = Vec::new();
        for (i, element) in array.iter().enumerate().take(count) {
            spans.push(text::clamp(self.source, element.span()));
            if let Some((row, _)) = self.numbers(&format!("{}[{i}]", self.path), items, element) {
                numbers.extend(row);
            }
        }
        if array.len() != count {
            self.wrong_count(self.path, value, array.len(), "row", &count.to_string());
            return None;
        }
        (numbers.len() == count * items.len()).then_some((KeyValue::Numbers(numbers), spans))
    }

    fn wrong_count(&mut self, path: &str, value: &Spanned<DeValue<'_>>, found: usize, what: &str, wanted: &str) {
        self.findings.add(
            codes::WRONG_COUNT,
            path,
            text::clamp(self.source, value.span()),
            format!("`{path}` has {found} {what}{}, expected {wanted}", if found == 1 { "" } else { "s" }),
            format!("write {wanted} {what}s: {}", self.key.line()),
        );
    }

    fn texts(&mut self, what: &str, value: &Spanned<DeValue<'_>>) -> Option<(KeyValue, Vec<Range<usize>>)> {
        let DeValue::Array(array) = value.get_ref() else {
            return self.wrong_type(self.path, value, &format!("an array, each value {what}"), None);
        };
        let mut texts = Vec::new();
        let mut spans = Vec::new();
        for (i, element) in array.iter().enumerate() {
            spans.push(text::clamp(self.source, element.span()));
            let path = format!("{}[{i}]", self.path);
            self.filled_in(&path, element)?;
            match element.get_ref() {
                DeValue::String(file) => texts.push(file.to_string()),
                _ => return self.wrong_type(&path, element, what, None),
            }
        }
        Some((KeyValue::Texts(texts), spans))
    }

    /// Reports a placeholder that was not replaced; `None` if `value` is one.
    fn filled_in(&mut self, path: &str, value: &Spanned<DeValue<'_>>) -> Option<()> {
        let DeValue::String(found) = value.get_ref() else { return Some(()) };
        let Some(placeholder) = keys::placeholder(found) else { return Some(()) };
        let span = text::clamp(self.source, value.span());
        let start = found.find(placeholder).unwrap_or(0);
        self.findings.add(
            codes::PLACEHOLDER,
            path,
            self.inside(&span, found, &(start..start + placeholder.len())),
            format!("`{path}` is a placeholder, {}", text::shorten(found)),
            format!("replace {placeholder} by {}. {}", messages::wanted(self.key, path, placeholder), self.key.doc),
        );
        None
    }

    fn scalar(&mut self, item: Item, path: &str, value: &Spanned<DeValue<'_>>) -> Option<Scalar> {
        self.filled_in(path, value)?;
        match item {
            Item::Quantity { .. } => self.quantity(item, path, value).map(Scalar::Number),
            Item::Number(range) => {
                let number = self.plain_number(path, value)?;
                // With all its digits if a rounded one would be in range.
                let short = text::number(number);
                let misleads = short.parse().is_ok_and(|short| range.contains(short));
                let shown = if misleads { number.to_string() } else { short };
                self.in_range(range.contains(number), item, path, value, &shown)?;
                Some(Scalar::Number(number))
            }
            Item::Integer(min, max) => {
                let integer = self.integer(path, value)?;
                self.in_range((min..=max).contains(&integer), item, path, value, &integer.to_string())?;
                Some(Scalar::Integer(integer))
            }
            Item::Choice(words) => {
                let DeValue::String(found) = value.get_ref() else {
                    return self.wrong_type(path, value, &format!("one of {}", text::alternatives(words)), None);
                };
                let known = words.iter().find(|word| **word == found.as_ref());
                if known.is_none() {
                    let meant = text::nearest(found, words.iter().copied());
                    let did_you_mean = meant.map_or_else(String::new, |word| format!("did you mean \"{word}\"? "));
                    self.findings.add(
                        codes::UNKNOWN_CHOICE,
                        path,
                        text::clamp(self.source, value.span()),
                        format!("`{path}` is \"{}\", expected {}", text::shorten(found), text::alternatives(words)),
                        format!("{did_you_mean}write {}. {}", text::alternatives(words), self.key.doc),
                    );
                    self.findings.replace_by(path, meant.map(|word| format!("\"{word}\"")));
                }
                known.map(|word| Scalar::Choice(word))
            }
            Item::Flag => match value.get_ref() {
                DeValue::Boolean(flag) => Some(Scalar::Flag(*flag)),
                _ => self.wrong_type(path, value, "true or false", None),
            },
            Item::File => self.file(path, value).map(Scalar::Name),
            Item::Name => self.name(path, value).map(Scalar::Name),
            Item::Columns => match value.get_ref() {
                DeValue::String(found) if found.contains('=') => Some(Scalar::Name(found.to_string())),
                _ => self.wrong_type(path, value, "a description of columns, such as \"drive_V=2\"", None),
            },
            Item::Reason => match value.get_ref() {
                DeValue::String(found) if found.split_whitespace().count() > 1 => Some(Scalar::Name(found.to_string())),
                _ => self.wrong_type(path, value, "a reason in words, in quotes", None),
            },
        }
    }

    fn name(&mut self, path: &str, value: &Spanned<DeValue<'_>>) -> Option<String> {
        let DeValue::String(found) = value.get_ref() else {
            return self.wrong_type(path, value, "a name in quotes", None);
        };
        let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
        let good = found.starts_with(|c: char| c.is_ascii_alphabetic()) && found.chars().all(allowed);
        if good && found.len() <= MAX_NAME {
            return Some(found.to_string());
        }
        let fixed: String = found.chars().map(|c| if allowed(c) { c } else { '-' }).take(MAX_NAME).collect();
        let fixed = fixed.trim_start_matches(|c: char| !c.is_ascii_alphabetic());
        let such_as = if fixed.is_empty() { "<name>" } else { fixed };
        self.findings.add(
            codes::BAD_NAME,
            path,
            text::clamp(self.source, value.span()),
            format!("`{path}` is \"{}\", which is not a name", text::shorten(found)),
            format!(
                "use a letter, then letters, digits, - and _, at most {MAX_NAME} characters, such as \"{such_as}\""
            ),
        );
        None
    }

    fn file(&mut self, path: &str, value: &Spanned<DeValue<'_>>) -> Option<String> {
        let DeValue::String(found) = value.get_ref() else {
            return self.wrong_type(path, value, "a file name", None);
        };
        if text::is_relative_path(found) {
            return Some(found.to_string());
        }
        self.findings.add(
            codes::RECORD_PATH,
            path,
            text::clamp(self.source, value.span()),
            format!("\"{}\" is not a path relative to the spec", text::shorten(found)),
            messages::beside_the_spec(found),
        );
        None
    }

    fn in_range(
        &mut self,
        inside: bool,
        item: Item,
        path: &str,
        value: &Spanned<DeValue<'_>>,
        shown: &str,
    ) -> Option<()> {
        if !inside {
            self.findings.add(
                codes::OUT_OF_RANGE,
                path,
                text::clamp(self.source, value.span()),
                format!("`{path}` is {shown}, expected {}", messages::range_of(item)),
                messages::range_help(self.key, path),
            );
        }
        inside.then_some(())
    }

    fn wrong_type<T>(
        &mut self,
        path: &str,
        value: &Spanned<DeValue<'_>>,
        expected: &str,
        fix: Option<String>,
    ) -> Option<T> {
        let units = messages::units_of(self.key, path);
        let help = fix.unwrap_or_else(|| match units {
            Some(units) => format!("write the number with its unit, {units}, in quotes: {}", self.key.line()),
            None => format!("write {}", self.key.line()),
        });
        self.findings.add(
            codes::WRONG_TYPE,
            path,
            text::clamp(self.source, value.span()),
            format!("`{path}` is {}, expected {expected}", messages::kind_of(value.get_ref())),
            help,
        );
        None
    }
}
