//! What a help offers: literals with placeholders, and the same with the placeholders replaced.

use specgen::spec::keys::{Item, Key, Range, placeholder};
use specgen::spec::quantity;

/// The TOML literal behind `mark` in a help.
pub fn literal<'a>(help: &'a str, mark: &str) -> Option<&'a str> {
    let mut ends = help.match_indices(mark).map(|(at, _)| at + mark.len());
    // `bits = ` is the end of `max_bits = `, too.
    let start = ends.find(|end| !help[..end - mark.len()].ends_with(|c: char| c.is_alphanumeric() || c == '_'))?;
    let text = &help[start..];
    let end = match text.as_bytes().first()? {
        b'[' => {
            let mut depth = 0;
            text.find(|c| {
                depth += match c {
                    '[' => 1,
                    ']' => -1,
                    _ => 0,
                };
                depth == 0
            })? + 1
        }
        b'"' => 2 + text[1..].find('"')?,
        b'<' => 1 + text.find('>')?,
        _ => text.find(|c: char| !(c.is_alphanumeric() || "+-._".contains(c))).unwrap_or(text.len()),
    };
    Some(text[..end].trim_end_matches('.'))
}

/// The values of a key's example, as they would stand in a help: quantities in quotes, numbers behind the name. Zero, and a
/// word or a file, are of no machine.
pub fn values(key: &Key) -> Vec<String> {
    let quoted = key.example.split('"').skip(1).step_by(2);
    let quantities = quoted.filter(|text| quantity::parse(text).is_ok_and(|found| found.value != 0.0));
    let quantities: Vec<String> = quantities.map(|text| format!("\"{text}\"")).collect();
    if quantities.is_empty()
        && key.template() != key.example
        && numbers(key.example).iter().any(|number| number.parse::<f64>() != Ok(0.0))
    {
        return vec![format!("{} = {}", key.name, key.example)];
    }
    quantities
}

/// The numbers of a text as they are written.
pub fn numbers(text: &str) -> Vec<&str> {
    let parts = text.split(|c: char| !(c.is_ascii_digit() || "+-.e".contains(c)));
    parts.filter(|part| part.parse::<f64>().is_ok()).collect()
}

/// The text with a good value for each placeholder, for the items of a key in their order.
pub fn filled(text: &str, items: &[Item]) -> String {
    let mut text = text.to_owned();
    let mut at = 0;
    while let Some(found) = placeholder(&text) {
        let item = items.get(at % items.len().max(1)).copied();
        text = text.replacen(found, &value(found, item), 1);
        at += 1;
    }
    text
}

fn value(placeholder: &str, item: Option<Item>) -> String {
    let inside = |range: Range, unit: f64| {
        let tried = [1.0, 0.5, 0.1, 0.75, 1.25, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e9, 1e-3, -0.5];
        let good = tried.iter().find(|number| range.contains(**number * unit));
        good.unwrap_or_else(|| panic!("no number for {range:?}")).to_string()
    };
    match item {
        _ if placeholder == "<unit>" => match item {
            Some(Item::Quantity { unit, .. }) => unit.to_owned(),
            _ => panic!("a unit of {item:?}"),
        },
        Some(Item::Quantity { range, unit, .. }) => inside(range, quantity::unit_value(unit).expect("a unit").value),
        Some(Item::Number(range)) => inside(range, 1.0),
        Some(Item::Integer(min, _)) => min.to_string(),
        Some(Item::Choice(words)) => words[0].to_owned(),
        Some(Item::Flag) => "true".to_owned(),
        // The trajectory of the spec with every key.
        Some(Item::Name) => "circle".to_owned(),
        Some(Item::Reason) => "no stacks are connected".to_owned(),
        Some(Item::Columns) => "drive_V=2".to_owned(),
        Some(Item::File) | None => "a".to_owned(),
    }
}
