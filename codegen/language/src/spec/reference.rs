//! The reference of the spec language, printed from the key table: the page *Keys of a spec* of the book.

use std::fmt::Write as _;

use super::keys::{Key, Kind, Presence, SECTIONS, Shape};
use super::messages::range_of;
use crate::quantity;

const HEAD: &str = "\
<!-- Generated from the sections in codegen/language/src/model/; do not edit. -->

# Keys of a spec

A spec is one TOML file. A value with a dimension is a text with number and unit: `\"1.195 kg\"`, `\"3.26e7 g mm^2\"`,
`\"0.012 pi rad\"`, `\"40 V/ms\"`, `\"12 N m/rad\"`.

UNITS

A space, `*`, `·` or, between letters, `-` multiplies; `/` divides by the one unit that follows (group several:
`N/(m s)`); `^2`, `**2`, `²` and `2` directly behind a unit are powers; `×10^7` is `e7`.
Words (`inch`, `micrometer`), units without a blank (`kgcm²`, `Nm`) and other capital letters (`KHZ`) are taken if only one
reading has the dimension of the key, as in `lb/in` for a stiffness; otherwise the finding shows the readings.
Radians count as a unit: a rotational stiffness is in N m/rad, a bandwidth in rad/s and not in Hz.
A conversion to SI rounds once, to the nearest double: `\"150 mm\"` is 0.15, `\"1 in\"` is 0.0254.
Noise is an rms value. For a density such as `nm/√Hz` the finding shows the rms value up to half the control rate, and for a
radius of gyration the moment of inertia.

The column *example* shows the form of a value with its unit; any other unit of the same dimension will do. Ranges are those of a single
value; [Findings](diagnostics.md) lists what is checked across values, and a finding names the keys that it is about.
File names are relative to the spec and use forward slashes.
";

/// The reference as Markdown.
#[must_use]
pub fn reference_markdown() -> String {
    let mut text = HEAD.replace("UNITS", &quantity::units_markdown());
    for section in SECTIONS {
        let title = if section.name.is_empty() { "Before the first section".to_owned() } else { section.header() };
        let optional = if section.kind == Kind::Optional {
            " Optional; if it is there, it has every key without a default."
        } else {
            ""
        };
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "\n## {title}\n\n{}{optional}\n\n| key | example | range | if left out | meaning |\n| --- | --- | --- | --- | --- |\n",
            section.doc
        );
        for key in section.keys {
            let (name, form, range, absence, symbol) = (&key.name, form(key), range(key), absence(key), symbol(key));
            let (doc, aliases) = (key.doc, aliases(key));
            let _ = writeln!(text, "| `{name}` | {form} | {range} | {absence} | {symbol}{doc}{aliases} |");
        }
    }
    text
}

/// One key as Markdown, for an editor: path, symbol, meaning, example, range, and default.
#[must_use]
pub fn key_markdown(path: &str, key: &Key) -> String {
    let symbol = if key.symbol.is_empty() { String::new() } else { format!(", {} in the paper", key.symbol) };
    let (doc, aliases, form, range, absence) = (key.doc, aliases(key), form(key), range(key), absence(key));
    format!("`{path}`{symbol}\n\n{doc}{aliases}\n\n- example: {form}\n- range: {range}\n- if left out: {absence}\n")
}

fn form(key: &Key) -> String {
    match key.shape {
        Shape::One(_) | Shape::Records | Shape::Reasons | Shape::Paths => format!("`{}`", key.example),
        Shape::List(items) if items.len() > 3 => {
            format!("{} values, `{}`", items.len(), key.example)
        }
        Shape::List(_) | Shape::Leading(..) => format!("`{}`", key.example),
        Shape::Rows(count, items) => format!("{count} rows of {} values, `{}`", items.len(), key.example),
    }
}

fn range(key: &Key) -> String {
    match key.shape {
        Shape::One(item) => range_of(item),
        Shape::List(items) | Shape::Rows(_, items) => {
            let mut ranges: Vec<String> = items.iter().map(|item| range_of(*item)).collect();
            ranges.dedup();
            format!("each {}", ranges.join(", then "))
        }
        Shape::Leading(least, items) => {
            let mut ranges: Vec<String> = items.iter().map(|item| range_of(*item)).collect();
            ranges.dedup();
            let each = if ranges.len() == 1 { "each " } else { "" };
            format!("{least} to {} values: {each}{}", items.len(), ranges.join(", then "))
        }
        Shape::Records => "1 or 6 files".to_owned(),
        Shape::Reasons => "texts `KEY: REASON`".to_owned(),
        Shape::Paths => "paths of keys".to_owned(),
    }
}

fn absence(key: &Key) -> String {
    match key.presence {
        Presence::Required => "error".to_owned(),
        Presence::Default(literal) => format!("`{literal}`"),
        Presence::Optional => "no check".to_owned(),
        Presence::InsteadOf(other) => format!("see `{other}`"),
        Presence::Form(forms) => format!("error, unless in another form than {}", forms.join(" or ")),
        Presence::Rule(rule) => rule.to_owned(),
    }
}

/// Its other names, as a sentence.
fn aliases(key: &Key) -> String {
    if key.aliases.is_empty() { String::new() } else { format!(" Elsewhere: {}.", key.aliases.join(", ")) }
}

fn symbol(key: &Key) -> String {
    if key.symbol.is_empty() { String::new() } else { format!("{}: ", key.symbol) }
}
