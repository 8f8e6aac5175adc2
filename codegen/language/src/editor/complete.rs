//! What may be typed at a place of a spec.

use std::path::Path;

use crate::spec::keys::{Item, Key, Presence, SECTIONS, Section, Shape};
use crate::spec::quantity;
use serde_json::{Value, json};

use super::Spot;

/// What an editor draws beside an offer.
#[derive(Clone, Copy)]
enum Kind {
    Property = 10,
    Unit = 11,
    Value = 12,
    File = 17,
    Choice = 20,
    Section = 22,
}

/// The offers, as the Language Server Protocol has them; `folder` is that of the spec.
pub fn at(text: &str, spot: &Spot, folder: &Path) -> Vec<Value> {
    if spot.is_header || spot.before.trim_start().starts_with('[') && !spot.in_value {
        return sections(&spot.before);
    }
    if spot.in_value {
        return spot.key.map_or_else(Vec::new, |key| values(key, &spot.before, folder));
    }
    spot.section.map_or_else(Vec::new, |section| names(text, spot, section))
}

fn item(label: &str, kind: Kind, insert: &str, detail: &str) -> Value {
    json!({ "label": label, "kind": kind as u8, "insertText": insert, "detail": detail })
}

fn sections(before: &str) -> Vec<Value> {
    let typed = before.chars().filter(|letter| *letter == '[').count();
    let known = SECTIONS.iter().filter(|section| !section.name.is_empty());
    let offered = known.map(|section| {
        let header = section.header();
        // Brackets that are there are not typed again.
        item(section.name, Kind::Section, header.get(typed..).unwrap_or(section.name), section.doc)
    });
    offered.collect()
}

/// Keys of the section, each with a placeholder for its value. The ones that must be there come first.
fn names(text: &str, spot: &Spot, section: &'static Section) -> Vec<Value> {
    let absent = section.keys.iter().enumerate().filter(|(_, key)| !spot.has(text, key.name));
    let offered = absent.map(|(place, key)| {
        let optional = key.presence != Presence::Required;
        let mut offered = item(key.name, Kind::Property, &key.line(), key.doc);
        offered["sortText"] = format!("{}{place:03}", u8::from(optional)).into();
        offered
    });
    offered.collect()
}

fn values(key: &Key, before: &str, folder: &Path) -> Vec<Value> {
    let quoted = before.matches('"').count() % 2 == 1;
    let text = |word: &str| if quoted { word.to_owned() } else { format!("\"{word}\"") };
    let first = match key.shape {
        Shape::One(item) => item,
        Shape::List(items) | Shape::Leading(_, items) | Shape::Rows(_, items) => match items {
            // The last items of a list of six are angles.
            [.., last] if before.matches(',').count() >= 3 => *last,
            [first, ..] => *first,
            [] => return Vec::new(),
        },
        Shape::Records => Item::File,
        Shape::Reasons => return Vec::new(),
        Shape::Paths => return paths(text),
    };
    match first {
        Item::Quantity { dimension, .. } if quoted => {
            quantity::offered_units(dimension).map(|unit| item(unit, Kind::Unit, unit, "unit")).collect()
        }
        Item::Choice(words) => words.iter().map(|word| item(word, Kind::Choice, &text(word), "")).collect(),
        Item::Flag => ["true", "false"].map(|word| item(word, Kind::Value, word, "")).to_vec(),
        Item::File => files(folder).iter().map(|name| item(name, Kind::File, &text(name), "")).collect(),
        _ if quoted => Vec::new(),
        _ => vec![item(&key.template(), Kind::Value, &key.template(), "the form of a value")],
    }
}

/// Every key by its path, as `write` puts it.
fn paths(write: impl Fn(&str) -> String) -> Vec<Value> {
    let sections = SECTIONS.iter().filter(|section| !section.name.is_empty());
    let keys = sections.flat_map(|section| section.keys.iter().map(move |key| (section.path(key.name), key.doc)));
    keys.map(|(path, doc)| item(&path, Kind::Property, &write(&path), doc)).collect()
}

/// CSV files beside the spec and one folder below.
fn files(folder: &Path) -> Vec<String> {
    let names = |folder: &Path| -> Vec<(String, bool)> {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        entries.map(|entry| (entry.file_name().to_string_lossy().into_owned(), entry.path().is_dir())).collect()
    };
    let mut found = Vec::new();
    for (name, is_folder) in names(folder) {
        if is_folder {
            found.extend(names(&folder.join(&name)).into_iter().map(|(below, _)| format!("{name}/{below}")));
        } else {
            found.push(name);
        }
    }
    found.retain(|name| name.ends_with(".csv"));
    found.sort();
    found
}
