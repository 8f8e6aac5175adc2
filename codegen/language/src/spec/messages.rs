//! The wording of findings about one value.

use toml::de::DeValue;

use super::keys::{Item, Key, Range};
use super::{suggestion, text};
use crate::diagnostic::{Code, codes};
use crate::quantity::{self, Problem};

/// "a number", "a text" and so on, with article.
pub(super) fn kind_of(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a text",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a section",
    }
}

/// What replaces `placeholder`.
pub(super) fn wanted(key: &Key, path: &str, placeholder: &str) -> String {
    if placeholder == "<unit>" {
        return units_of(key, path).unwrap_or_else(|| "a unit".to_owned());
    }
    match key.item(path) {
        Some(item @ (Item::Quantity { .. } | Item::Number(_))) => format!("a number of your own: {}", range_of(item)),
        Some(item @ Item::Integer(..)) => format!("a whole number: {}", range_of(item)),
        Some(item @ (Item::Choice(_) | Item::Flag)) => range_of(item),
        Some(Item::Name) => "a name: a letter, then letters, digits, - and _".to_owned(),
        Some(Item::Reason) => "your reason, in words".to_owned(),
        Some(Item::Columns) => "a description of columns, such as drive_V=2".to_owned(),
        Some(Item::File) | None if placeholder == "<file>" => "the name of your file, relative to the spec".to_owned(),
        Some(Item::File) | None => "your own text".to_owned(),
    }
}

/// Help for a file that was not named relative to the spec.
pub(super) fn beside_the_spec(found: &str) -> String {
    let name = found.rsplit(['/', '\\', ':']).next().unwrap_or_default().trim();
    let name = if name.is_empty() { "<file>" } else { name };
    format!("put the file beside the spec and name it \"{}\"", text::shorten(name))
}

/// "1 mm to 10000 mm" in the unit of the item.
pub(super) fn range_of(item: Item) -> String {
    match item {
        Item::Integer(min, max) if min == max => format!("{min}"),
        Item::Integer(min, max) => format!("{min} to {max}"),
        Item::Number(range) => bounds(range, 1.0, ""),
        Item::Quantity { range, unit, .. } => {
            let scale = quantity::unit_value(unit).map_or(1.0, |one| one.value);
            bounds(range, scale, unit)
        }
        Item::Choice(words) => text::alternatives(words),
        Item::Flag => "true or false".to_owned(),
        Item::File => "a file".to_owned(),
        Item::Name => "a name".to_owned(),
        Item::Reason => "a reason in words".to_owned(),
        Item::Columns => "a description of columns".to_owned(),
    }
}

fn bounds(range: Range, scale: f64, unit: &str) -> String {
    let space = if unit.is_empty() { "" } else { " " };
    let low = format!("{}{space}{unit}", text::number(range.min / scale));
    let high = format!("{}{space}{unit}", text::number(range.max / scale));
    match (range.min_included, range.max_included) {
        (true, true) => format!("{low} to {high}"),
        (false, true) => format!("more than {low} and at most {high}"),
        (true, false) => format!("at least {low} and less than {high}"),
        (false, false) => format!("more than {low} and less than {high}"),
    }
}

pub(super) fn range_help(key: &Key, path: &str) -> String {
    let range = key.item(path).map_or_else(String::new, |item| format!(": {}", range_of(item)));
    format!("give a value in range{range}. {}", key.doc)
}

/// The usual units of the item that `path` names, for a help: "kg or g".
pub(super) fn units_of(key: &Key, path: &str) -> Option<String> {
    let Some(Item::Quantity { dimension, unit, .. }) = key.item(path) else { return None };
    let mut units: Vec<&str> = quantity::common_units(dimension).collect();
    if !units.contains(&unit) {
        units.insert(0, unit);
    }
    match units.as_slice() {
        [only] => Some((*only).to_owned()),
        [first @ .., last] => Some(format!("{} or {last}", first.join(", "))),
        [] => None,
    }
}

/// Meanings of a quantity with a comma: a decimal comma, or commas between thousands.
fn without_commas(found: &str) -> String {
    let parts: Vec<&str> = found.split(',').collect();
    let is_group = |part: &&str| {
        let digits = part.trim_end().bytes().take_while(u8::is_ascii_digit).count();
        digits == 3
    };
    let decimals = [found.replace(',', "."), found.replace('.', "").replace(',', ".")];
    let decimals = decimals.into_iter().filter(|_| parts.len() == 2).find(|text| quantity::parse(text).is_ok());
    let thousands =
        Some(found.replace(',', "")).filter(|text| parts.iter().skip(1).all(is_group) && quantity::parse(text).is_ok());
    let written = |text: &str| format!("\"{}\"", text::shorten(text));
    match (decimals, thousands) {
        (Some(one), Some(other)) => {
            let (first, second) = (written(&one), written(&other));
            format!("write {first} if the comma is a decimal comma, {second} if it separates thousands")
        }
        (Some(one), None) => format!("write the decimals after a point: {}", written(&one)),
        (None, Some(one)) => format!("write no commas between thousands: {}", written(&one)),
        (None, None) => "write the decimals after a point and no commas between thousands".to_owned(),
    }
}

/// Code, message and help for a text that is not a quantity.
pub(super) fn bad_quantity(key: &Key, path: &str, found: &str, problem: &Problem) -> (Code, String, String) {
    let form = key.form(path);
    let such_as = format!("write a number and a unit, in the form {form}");
    let is = format!("`{path}` is \"{}\"", text::shorten(found));
    match problem {
        Problem::TooLong => {
            (codes::BAD_QUANTITY, format!("{is}: longer than {} characters", quantity::MAX_LENGTH), such_as)
        }
        Problem::NoNumber => (codes::BAD_QUANTITY, format!("{is}: a quantity starts with a number"), such_as),
        Problem::Comma => (codes::BAD_QUANTITY, format!("{is}: a comma in a number"), without_commas(found)),
        Problem::UnknownUnit(unit, meant) => {
            let units = units_of(key, path).map_or_else(String::new, |units| format!(", such as {units}"));
            let help = match meant.as_slice() {
                [] => format!("write a unit as in {form}{units}; upper and lower case matter"),
                [only] => suggestion::did_you_mean(only),
                several => format!("did you mean {}?", suggestion::any_of(several)),
            };
            (codes::UNKNOWN_UNIT, format!("{is}: unknown unit {}", text::quote(unit)), help)
        }
        Problem::AmbiguousUnit(all) => {
            let message = format!("{is}: this can be read as {}", suggestion::any_of(all));
            (codes::UNKNOWN_UNIT, message, suggestion::choice(key, path, all).map_or(such_as, |meant| meant.help))
        }
        Problem::AmbiguousQuotient(all) => {
            let message = format!("{is}: the product after the slash is ambiguous");
            let group = || "group it, as in \"N/(m s)\", or write the numerator first, as in \"N s/m\"".to_owned();
            (codes::BAD_QUANTITY, message, suggestion::choice(key, path, all).map_or_else(group, |meant| meant.help))
        }
        Problem::BadPower => (
            codes::BAD_QUANTITY,
            format!("{is}: the power of a unit is a whole number from -9 to 9"),
            format!("write the power as in \"mm^2\" or \"s^-1\"; the form here is {form}"),
        ),
        Problem::Unexpected(character) => {
            (codes::BAD_QUANTITY, format!("{is}: {character} does not belong there"), such_as)
        }
        Problem::NotFinite => (codes::NOT_FINITE, format!("{is}, which is not a finite number"), such_as),
        Problem::Overflow => (codes::NOT_FINITE, format!("{is}: too large for a double"), such_as),
        Problem::Underflow => (
            codes::NOT_FINITE,
            format!("{is}: too small for a double, yet not zero"),
            "write 0, or a value that a double can hold".to_owned(),
        ),
    }
}
