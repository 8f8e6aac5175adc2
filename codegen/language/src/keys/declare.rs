//! The macros and functions of a declaration.

pub(crate) use super::fields::{Fields, Value};
pub(crate) use super::{Item, Key, Kind, MAX_TABLES, Presence, Range, Section, Shape, join};
pub(crate) use crate::quantity::Dimension;

/// Declares a section once: its rows in the key table, the struct of the model that it fills, and how it is read.
///
/// ```text
/// section! {
///     /// Meaning of the section: the text of the reference, and of the struct.
///     "path.of.section" ["other names"], Plain => Struct {
///         /// Meaning of the key: the text of the reference, and of the field.
///         key: Type = shape, Required, "symbol of the paper, or nothing" ["other names"], "an example as in a spec";
///         /// A key without a field: it is used by a field below.
///         key = shape, Default(as in a spec), "", an example;
///     }
///     and |fields, table| {
///         /// A field that several keys decide about.
///         field: Type = how it is read;
///     }
/// }
/// ```
macro_rules! section {
    (
        #[doc = $doc:literal]
        $(#[doc = $more:literal])*
        $section:literal $([$($other:literal),*])?, $kind:expr => $struct:ident {$(
            #[doc = $text:literal]
            $key:ident $(: $type:ty)? = $shape:expr, $presence:ident $(($with:tt))?, $symbol:literal $([$($alias:literal),*])?, $example:tt;
        )*}
        $(and |$fields:ident, $table:ident| {$(
            $(#[doc = $field_doc:literal])+
            $field:ident: $field_type:ty = $read:expr;
        )*})?
    ) => {
        #[doc = $doc]
        $(#[doc = $more])*
        // `[control]` is a section of a spec and not a link.
        #[allow(rustdoc::broken_intra_doc_links)]
        #[derive(Debug, Clone, PartialEq)]
        pub struct $struct {
            $($(#[doc = $text] pub $key: $type,)?)*
            $($($(#[doc = $field_doc])+ pub $field: $field_type,)*)?
        }

        impl $struct {
            pub(crate) const SECTION: Section = Section {
                name: $section,
                kind: { use Kind::*; $kind },
                aliases: &[$($($other),*)?],
                doc: $doc.trim_ascii_start(),
                keys: &[$(Key {
                    name: stringify!($key),
                    shape: $shape,
                    presence: section!(@presence $presence $($with)?),
                    doc: $text.trim_ascii_start(),
                    symbol: $symbol,
                    aliases: &[$($($alias),*)?],
                    example: section!(@toml $example),
                }),*],
            };

            /// From the table at `table`; none if a value is missing, for which there is a finding.
            pub(crate) fn read(fields: &Fields, table: &str) -> Option<Self> {
                $(let ($fields, $table) = (fields, table);)?
                Some(Self {
                    $($($key: <$type as Value>::read(fields, &join(table, stringify!($key)))?,)?)*
                    $($($field: $read,)*)?
                })
            }
        }
    };
    (@presence Default $literal:tt) => { Presence::Default(section!(@toml $literal)) };
    (@presence $presence:ident $($with:tt)?) => { Presence::$presence $(($with))? };
    (@toml true) => { "true" };
    (@toml false) => { "false" };
    (@toml $text:ident) => { $text };
    // On one line: a longer value must be a constant, because `stringify` would break it.
    (@toml $literal:tt) => { stringify!($literal) };
}

/// Declares an enumeration together with its words in a spec.
macro_rules! choice {
    ($(#[$attribute:meta])+ $enum:ident {$($(#[$of_variant:meta])+ $variant:ident = $word:literal,)+}) => {
        $(#[$attribute])+
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $enum {
            $($(#[$of_variant])+ $variant,)+
        }

        impl $enum {
            pub(crate) const WORDS: &[&str] = &[$($word),+];

            /// Its word in a spec.
            pub const fn word(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)+
                }
            }
        }

        impl Value for $enum {
            fn read(fields: &Fields, path: &str) -> Option<Self> {
                match fields.choice(path)? {
                    $($word => Some(Self::$variant),)+
                    _ => None,
                }
            }
        }
    };
}

pub(crate) use choice;
pub(crate) use section;

pub(crate) const fn one(dimension: Dimension, range: Range, unit: &'static str) -> Shape {
    Shape::One(item(dimension, range, unit))
}

pub(crate) const fn item(dimension: Dimension, range: Range, unit: &'static str) -> Item {
    Item::Quantity { dimension, range, unit }
}

pub(crate) const fn list(items: &'static [Item]) -> Shape {
    Shape::List(items)
}

pub(crate) const fn number(range: Range) -> Shape {
    Shape::One(Item::Number(range))
}

pub(crate) const fn integer(min: i64, max: i64) -> Shape {
    Shape::One(Item::Integer(min, max))
}

pub(crate) const fn one_of(words: &'static [&'static str]) -> Shape {
    Shape::One(Item::Choice(words))
}

/// x, y, z with one dimension, then the three rotations with another.
pub(crate) const fn six(along: Item, about: Item) -> [Item; 6] {
    [along, along, along, about, about, about]
}

pub(crate) const FLAG: Shape = Shape::One(Item::Flag);
pub(crate) const NAME: Shape = Shape::One(Item::Name);
pub(crate) const REASON: Shape = Shape::One(Item::Reason);
pub(crate) const CENTER: Item = item(Dimension::LENGTH, Range::closed(-10.0, 10.0), "mm");
pub(crate) const VOLTS: Item = item(Dimension::VOLTAGE, Range::closed(-1e4, 1e4), "V");
pub(crate) const RATIO: Item = Item::Number(Range::above(0.0, 10.0));
/// The place of a point.
pub(crate) const POINT: Shape = list(&[CENTER; 3]);
