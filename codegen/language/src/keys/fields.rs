//! The values that were read, by key path, in SI units.

use std::collections::BTreeMap;
use std::ops::Range;

/// A valid value of a key.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum KeyValue {
    /// A quantity (SI) or a number; one or a list.
    Numbers(Vec<f64>),
    Integer(i64),
    Flag(bool),
    Choice(&'static str),
    Name(String),
    Texts(Vec<String>),
}

/// A value and its place.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Field {
    pub(crate) parsed: KeyValue,
    /// The value, or the section's name if the value is a default.
    pub(crate) span: Range<usize>,
    /// The values of a list.
    pub(crate) items: Vec<Range<usize>>,
    /// Whether it is in the file.
    pub(crate) given: bool,
}

/// All valid values of a spec. A missing or wrong value has its finding already, so a check that needs it is skipped.
#[derive(Debug, Default)]
pub(crate) struct Fields {
    map: BTreeMap<String, Field>,
    /// Tables in the file, by path (`control`, `gauge[2]`), with their places.
    tables: BTreeMap<String, Range<usize>>,
    /// Tables of each repeated section.
    counts: BTreeMap<&'static str, usize>,
    /// The file, for [`Fields::literal`].
    source: String,
}

impl Fields {
    /// No values yet, for the file `source`.
    pub(crate) fn of(source: &str) -> Self {
        Self { source: source.to_owned(), ..Self::default() }
    }

    /// The value `index` of the list at `path` as it is written; `None` if it is a default.
    pub(crate) fn literal(&self, path: &str, index: usize) -> Option<&str> {
        let field = self.get(path).filter(|field| field.given)?;
        self.source.get(field.items.get(index)?.clone())
    }

    pub(crate) fn insert(&mut self, path: String, field: Field) {
        self.map.insert(path, field);
    }

    pub(crate) fn insert_table(&mut self, path: String, span: Range<usize>) {
        self.tables.insert(path, span);
    }

    pub(crate) fn insert_count(&mut self, section: &'static str, count: usize) {
        self.counts.insert(section, count);
    }

    /// The place of the table at `path`, `None` if it is not in the file.
    pub(crate) fn table(&self, path: &str) -> Option<Range<usize>> {
        self.tables.get(path).cloned()
    }

    /// Number of tables of a repeated section.
    pub(crate) fn count(&self, section: &str) -> usize {
        self.counts.get(section).copied().unwrap_or(0)
    }

    pub(crate) fn get(&self, path: &str) -> Option<&Field> {
        self.map.get(path)
    }

    /// Whether the key is in the file with a valid value.
    pub(crate) fn given(&self, path: &str) -> bool {
        self.get(path).is_some_and(|field| field.given)
    }

    pub(crate) fn number(&self, path: &str) -> Option<f64> {
        self.list::<1>(path).map(|[value]| value)
    }

    pub(crate) fn list<const N: usize>(&self, path: &str) -> Option<[f64; N]> {
        self.numbers(path)?.try_into().ok()
    }

    /// All numbers of a list whose length is not fixed.
    pub(crate) fn numbers(&self, path: &str) -> Option<&[f64]> {
        let KeyValue::Numbers(values) = &self.get(path)?.parsed else { return None };
        Some(values)
    }

    /// The rows of a [`super::Shape::Rows`].
    pub(crate) fn rows<const R: usize, const C: usize>(&self, path: &str) -> Option<[[f64; C]; R]> {
        let (rows, []) = self.numbers(path)?.as_chunks::<C>() else { return None };
        rows.try_into().ok()
    }

    pub(crate) fn flag(&self, path: &str) -> Option<bool> {
        let KeyValue::Flag(value) = self.get(path)?.parsed else { return None };
        Some(value)
    }

    pub(crate) fn integer(&self, path: &str) -> Option<i64> {
        let KeyValue::Integer(value) = self.get(path)?.parsed else { return None };
        Some(value)
    }

    /// An integer whose range in the key table fits `T`.
    pub(crate) fn whole<T: TryFrom<i64>>(&self, path: &str) -> Option<T> {
        T::try_from(self.integer(path)?).ok()
    }

    pub(crate) fn choice(&self, path: &str) -> Option<&'static str> {
        let KeyValue::Choice(word) = self.get(path)?.parsed else { return None };
        Some(word)
    }

    pub(crate) fn name(&self, path: &str) -> Option<&str> {
        let KeyValue::Name(text) = &self.get(path)?.parsed else { return None };
        Some(text)
    }

    pub(crate) fn texts(&self, path: &str) -> Option<&[String]> {
        let KeyValue::Texts(texts) = &self.get(path)?.parsed else { return None };
        Some(texts)
    }

    /// The place of the value at `path`; the start of the file if it is not known.
    pub(crate) fn span(&self, path: &str) -> Range<usize> {
        self.get(path).map_or(0..0, |field| field.span.clone())
    }

    /// The place of the value `index` of the list at `path`.
    pub(crate) fn item_span(&self, path: &str, index: usize) -> Range<usize> {
        self.get(path).and_then(|field| field.items.get(index).cloned()).unwrap_or_else(|| self.span(path))
    }

    /// The places of every table and value, and of list items: `actuator.voltage` and `actuator.voltage[1]`.
    pub(crate) fn spans(&self) -> BTreeMap<String, Range<usize>> {
        let mut spans = self.tables.clone();
        for (path, field) in &self.map {
            spans.insert(path.clone(), field.span.clone());
            for (i, item) in field.items.iter().enumerate() {
                spans.insert(format!("{path}[{i}]"), item.clone());
            }
        }
        spans
    }
}

/// What a key fills in the model.
pub(crate) trait Value: Sized {
    /// The value at `path`; none if it is missing, for which there is a finding.
    fn read(fields: &Fields, path: &str) -> Option<Self>;
}

impl Value for f64 {
    fn read(fields: &Fields, path: &str) -> Option<Self> {
        fields.number(path)
    }
}

impl<const N: usize> Value for [f64; N] {
    fn read(fields: &Fields, path: &str) -> Option<Self> {
        fields.list(path)
    }
}

impl<const R: usize, const C: usize> Value for [[f64; C]; R] {
    fn read(fields: &Fields, path: &str) -> Option<Self> {
        fields.rows(path)
    }
}

impl Value for u32 {
    fn read(fields: &Fields, path: &str) -> Option<Self> {
        fields.whole(path)
    }
}

impl Value for usize {
    fn read(fields: &Fields, path: &str) -> Option<Self> {
        fields.whole(path)
    }
}

/// A count, or a quantity of memory in bytes.
impl Value for u64 {
    fn read(fields: &Fields, path: &str) -> Option<Self> {
        fields.whole(path).or_else(|| fields.number(path).map(|bytes| bytes as Self))
    }
}

impl Value for String {
    fn read(fields: &Fields, path: &str) -> Option<Self> {
        fields.name(path).map(str::to_owned)
    }
}

impl Value for Vec<String> {
    fn read(fields: &Fields, path: &str) -> Option<Self> {
        fields.texts(path).map(<[String]>::to_vec)
    }
}

/// An optional value.
impl<T: Value> Value for Option<T> {
    fn read(fields: &Fields, path: &str) -> Option<Self> {
        Some(T::read(fields, path))
    }
}
