//! The JSON Schema (draft-07) of a spec, printed from the key table.
//!
//! For editors: names, kinds, enums and the form of quantities. [`super::load`] checks dimensions, ranges of quantities
//! and conditions on several keys.

use serde_json::{Map, Value, json};

use super::keys::{Item, Key, Kind, MAX_NAME, Presence, SECTIONS, Section, Shape};
use super::messages::range_of;

/// A sign, a number, and a unit that starts with a letter, a degree sign, a mark of feet or inches, or a bracket.
const QUANTITY_PATTERN: &str = concat!(
    r"^\s*[+\-\u2212]?([0-9]+\.?[0-9]*|\.[0-9]+)",
    r"([eE][+\-\u2212]?[0-9]+|(\s*[xX*\u00d7\u00b7\u22c5]\s*10)?(\^|\*\*)[+\-\u2212]?[0-9]+",
    r"|(\s*[xX*\u00d7\u00b7\u22c5]\s*10)?[\u207a\u207b]?[\u2070\u00b9\u00b2\u00b3\u2074-\u2079]+)?",
    r#"\s*[A-Za-z\u00b0\u00b5\u03bc\u03c0('"\u2032\u2033][^,]*$"#,
);

/// The schema as pretty-printed JSON with a final newline; `specs/platform.schema.json` is this text.
#[must_use]
pub fn json_schema() -> String {
    let mut root = table("");
    let mut schema = Map::new();
    schema.insert("$schema".into(), json!("http://json-schema.org/draft-07/schema#"));
    schema.insert("title".into(), json!("specgen platform spec"));
    schema.append(&mut root);
    // Only strings, numbers, arrays and maps with string keys: serialising them cannot fail.
    let text = serde_json::to_string_pretty(&Value::Object(schema)).unwrap_or_default();
    text + "\n"
}

/// The object schema of a section, the sections within it included.
fn table(name: &str) -> Map<String, Value> {
    let mut object = Map::new();
    let Some(section) = super::keys::section(name) else {
        return object;
    };
    let mut properties = Map::new();
    let mut required: Vec<&str> = Vec::new();
    for key in section.keys {
        properties.insert(key.name.into(), key_schema(key));
        if key.presence == Presence::Required {
            required.push(key.name);
        }
    }
    for inner in SECTIONS.iter().filter(|inner| parent(inner) == Some(name)) {
        let last = inner.name.rsplit('.').next().unwrap_or(inner.name);
        let object = Value::Object(table(inner.name));
        let one_or_many = match inner.kind {
            Kind::Repeated(least, most) => {
                json!({"type": "array", "items": object, "minItems": least, "maxItems": most})
            }
            Kind::Plain | Kind::Optional => object,
        };
        properties.insert(last.into(), one_or_many);
        if inner.is_required() {
            required.push(last);
        }
    }
    object.insert("description".into(), json!(section.doc));
    object.insert("type".into(), json!("object"));
    object.insert("additionalProperties".into(), json!(false));
    object.insert("properties".into(), Value::Object(properties));
    if !required.is_empty() {
        object.insert("required".into(), json!(required));
    }
    if !section.forms().is_empty() {
        object.insert("oneOf".into(), Value::Array(forms(section)));
    }
    let exclusive = exclusive_pairs(section);
    if !exclusive.is_empty() {
        object.insert("allOf".into(), Value::Array(exclusive));
    }
    object
}

/// The section that contains `section`; `None` for the root itself.
fn parent(section: &Section) -> Option<&'static str> {
    match section.name.rsplit_once('.') {
        Some((outer, _)) => Some(outer),
        None => (!section.name.is_empty()).then_some(""),
    }
}

/// Pairs of keys that exclude each other, each pair once.
fn exclusive_pairs(section: &Section) -> Vec<Value> {
    section
        .keys
        .iter()
        .filter_map(|key| match key.presence {
            Presence::InsteadOf(other) if key.name < other => Some(json!({"not": {"required": [key.name, other]}})),
            _ => None,
        })
        .collect()
}

/// For each form: all of its keys, and none of another form.
fn forms(section: &Section) -> Vec<Value> {
    let names = |wanted: &dyn Fn(Presence) -> bool| -> Vec<&str> {
        section.keys.iter().filter(|key| wanted(key.presence)).map(|key| key.name).collect()
    };
    let one_form = |form: &'static str| {
        let own = names(&|presence| presence.forms().contains(&form));
        let other = names(&|presence| !presence.forms().is_empty() && !presence.forms().contains(&form));
        let none: Vec<Value> = other.iter().map(|name| json!({"required": [name]})).collect();
        json!({"required": own, "not": {"anyOf": none}})
    };
    section.forms().into_iter().map(one_form).collect()
}

/// The schema of an array of `items`; those after the first `least` are optional.
fn array_schema(items: &[Item], least: usize) -> Map<String, Value> {
    let mut array = Map::new();
    array.insert("type".into(), json!("array"));
    array.insert("items".into(), Value::Array(items.iter().map(|i| Value::Object(item_schema(*i))).collect()));
    array.insert("minItems".into(), json!(least));
    array.insert("maxItems".into(), json!(items.len()));
    array
}

fn key_schema(key: &Key) -> Value {
    let mut schema = match key.shape {
        Shape::One(item) => item_schema(item),
        Shape::List(items) => array_schema(items, items.len()),
        Shape::Leading(least, items) => array_schema(items, least),
        Shape::Rows(count, items) => {
            let mut array = Map::new();
            array.insert("type".into(), json!("array"));
            array.insert("items".into(), Value::Object(array_schema(items, items.len())));
            array.insert("minItems".into(), json!(count));
            array.insert("maxItems".into(), json!(count));
            array
        }
        Shape::Reasons => {
            let mut array = Map::new();
            array.insert("type".into(), json!("array"));
            array.insert("items".into(), json!({"type": "string", "pattern": r"^[a-z_0-9.\[\]]+:.*\S"}));
            array
        }
        Shape::Paths => {
            let mut array = Map::new();
            array.insert("type".into(), json!("array"));
            array.insert("items".into(), json!({"type": "string", "pattern": r"^[a-z_0-9.\[\]]+$"}));
            array.insert("uniqueItems".into(), json!(true));
            array
        }
        Shape::Records => {
            let file = Value::Object(item_schema(Item::File));
            // A required list may be empty: there are no records yet.
            let counts: &[usize] = if key.presence == Presence::Required { &[0, 1, 6] } else { &[1, 6] };
            let lists: Vec<Value> = counts.iter().map(|count| json!({"minItems": count, "maxItems": count})).collect();
            let mut array = Map::new();
            array.insert("type".into(), json!("array"));
            array.insert("items".into(), file);
            array.insert("oneOf".into(), json!(lists));
            array
        }
    };
    schema.insert("description".into(), json!(describe(key)));
    if let Some(example) = toml_to_json(key.example) {
        schema.insert("examples".into(), json!([example]));
    }
    if let Presence::Default(literal) = key.presence
        && let Some(default) = toml_to_json(literal)
    {
        schema.insert("default".into(), default);
    }
    Value::Object(schema)
}

fn describe(key: &Key) -> String {
    let symbol = if key.symbol.is_empty() { String::new() } else { format!(" {}.", key.symbol) };
    let range = match key.shape {
        Shape::One(item @ (Item::Quantity { .. } | Item::Number(_) | Item::Integer(..))) => {
            format!(" Range: {}.", range_of(item))
        }
        _ => String::new(),
    };
    format!("{}{symbol}{range}", key.doc)
}

fn item_schema(item: Item) -> Map<String, Value> {
    let value = match item {
        Item::Quantity { .. } => json!({"type": "string", "pattern": QUANTITY_PATTERN}),
        Item::Number(range) => {
            let low = if range.min_included { "minimum" } else { "exclusiveMinimum" };
            let high = if range.max_included { "maximum" } else { "exclusiveMaximum" };
            json!({"type": "number", low: range.min, high: range.max})
        }
        Item::Integer(min, max) if min == max => json!({"const": min}),
        Item::Integer(min, max) => json!({"type": "integer", "minimum": min, "maximum": max}),
        Item::Choice(words) => json!({"type": "string", "enum": words}),
        Item::Flag => json!({"type": "boolean"}),
        Item::File => json!({"type": "string", "pattern": r"^[^/\\][^\\]*$"}),
        Item::Columns => json!({"type": "string", "pattern": "="}),
        Item::Reason => json!({"type": "string", "pattern": r"\S\s+\S"}),
        Item::Name => {
            json!({"type": "string", "pattern": "^[A-Za-z][A-Za-z0-9_-]*$", "maxLength": MAX_NAME})
        }
    };
    match value {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

/// The literals of the key table: numbers, texts and arrays of them, which TOML and JSON write alike.
fn toml_to_json(literal: &str) -> Option<Value> {
    serde_json::from_str(literal).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_literal_of_the_key_table_is_json_too() {
        for key in SECTIONS.iter().flat_map(|section| section.keys) {
            assert!(toml_to_json(key.example).is_some(), "{}", key.name);
            if let Presence::Default(literal) = key.presence {
                assert!(toml_to_json(literal).is_some(), "{}", key.name);
            }
        }
    }
}
