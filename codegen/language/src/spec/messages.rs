//! The wording of findings about one value.

use toml::de::DeValue;

use super::keys::{Item, Key, Range, Shape};
use super::text;
use crate::diagnostic::{Code, codes};
use crate::quantity::{self, Dimension, Problem};

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

/// The form of the key, or of the one item that `path` names ("gains.integral\[3\]"), with a placeholder for the value.
pub(super) fn template_of(key: &Key, path: &str) -> String {
    let is_item = path.ends_with(']');
    item_of(key, path)
        .filter(|_| is_item || matches!(key.shape, Shape::One(_)))
        .map_or_else(|| key.template(), Item::template)
}

/// What replaces `placeholder`.
pub(super) fn wanted(key: &Key, path: &str, placeholder: &str) -> String {
    if placeholder == "<unit>" {
        return units_of(key, path).unwrap_or_else(|| "a unit".to_owned());
    }
    match item_of(key, path) {
        Some(item @ (Item::Quantity { .. } | Item::Number(_))) => format!("a number of your own: {}", range_of(item)),
        Some(item @ Item::Integer(..)) => format!("a whole number: {}", range_of(item)),
        Some(item @ (Item::Choice(_) | Item::Flag)) => range_of(item),
        Some(Item::Name) => "a name: a letter, then letters, digits, - and _".to_owned(),
        Some(Item::Reason) => "your reason, in words".to_owned(),
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

/// The item that `path` names.
fn item_of(key: &Key, path: &str) -> Option<Item> {
    match key.shape {
        Shape::One(item) => Some(item),
        Shape::List(items) | Shape::Rows(_, items) | Shape::Leading(_, items) => {
            let index = path.rsplit_once('[').and_then(|(_, rest)| rest.trim_end_matches(']').parse::<usize>().ok());
            items.get(index.unwrap_or(0)).copied()
        }
        Shape::Records | Shape::Reasons | Shape::Paths => None,
    }
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
    let range = item_of(key, path).map_or_else(String::new, |item| format!(": {}", range_of(item)));
    format!("give a value in range{range}. {}", key.doc)
}

/// The usual units of the item that `path` names, for a help: "kg or g".
pub(super) fn units_of(key: &Key, path: &str) -> Option<String> {
    let Some(Item::Quantity { dimension, unit, .. }) = item_of(key, path) else { return None };
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

/// The time that corresponds to a rate, if the key takes a time: the period of "20 kHz" is "50 us". For a lag, the rate
/// is its corner frequency.
pub(super) fn time_of_rate(key: &Key, found: &str) -> Option<String> {
    let Shape::One(Item::Quantity { dimension: Dimension::TIME, unit, range }) = key.shape else { return None };
    let rate = quantity::parse(found).ok().filter(|rate| rate.dimension == Dimension::FREQUENCY)?;
    let turn = match key.name {
        "period" => 1.0,
        "lag" => std::f64::consts::TAU,
        _ => return None,
    };
    let time = 1.0 / (turn * rate.value);
    let scale = quantity::unit_value(unit).map_or(1.0, |one| one.value);
    range.contains(time).then(|| format!("{} {unit}", text::digits(time / scale)))
}

/// Message and help for a unit that measures something else.
pub(super) fn wrong_dimension(
    key: &Key,
    path: &str,
    found: &str,
    is: Dimension,
    wanted: Dimension,
) -> (String, String) {
    let message =
        format!("`{path}` is \"{}\": this is {}, expected {}", text::shorten(found), is.describe(), wanted.describe());
    if let Some(time) = time_of_rate(key, found) {
        return (message, format!("{found} is a {} of \"{time}\"", key.name));
    }
    let own =
        if is.without_angle() == wanted.without_angle() { with_angle(key, path, found, is, wanted) } else { None };
    if let Some((own, other)) = own.as_ref().zip(hertz_for_rate(key, path, found, is, wanted)) {
        let help = format!("the unit contains an angle: write \"{own}\", or \"{other}\" if that was intended");
        return (message, help);
    }
    let written = own.map_or_else(|| format!("in the form {}", template_of(key, path)), |own| format!("as \"{own}\""));
    let hint = if is == Dimension::FREQUENCY && wanted == Dimension::ANGULAR_RATE {
        "1 Hz is 2 pi rad/s; "
    } else if is.without_angle() != wanted.without_angle() {
        ""
    } else if is == is.without_angle() {
        "the unit needs an angle; "
    } else {
        "the unit contains an angle; "
    };
    (message, format!("{hint}write {} {written}", wanted.describe()))
}

/// The value in the key's unit, if the two differ only by an angle: 20 Hz is 40 pi rad/s, 5 N m is 5 N m/rad.
fn with_angle(key: &Key, path: &str, found: &str, is: Dimension, wanted: Dimension) -> Option<String> {
    let Some(Item::Quantity { unit, range, .. }) = item_of(key, path) else { return None };
    let value = quantity::parse(found).ok()?.value;
    let turns = |a, b| is == a && wanted == b && found.contains("Hz") != (is == Dimension::ANGULAR_RATE);
    let (value, text) = if turns(Dimension::FREQUENCY, Dimension::ANGULAR_RATE) {
        (std::f64::consts::TAU * value, format!("{} pi rad/s", text::digits(2.0 * value)))
    } else if turns(Dimension::ANGULAR_RATE, Dimension::FREQUENCY) {
        let turns = value / std::f64::consts::TAU;
        (turns, format!("{} Hz", text::digits(turns)))
    } else {
        (value, format!("{} {unit}", text::digits(value / quantity::unit_value(unit)?.value)))
    };
    range.contains(value).then_some(text)
}

/// The same number in Hz, for a frequency written in rad/s: the likelier mistake.
fn hertz_for_rate(key: &Key, path: &str, found: &str, is: Dimension, wanted: Dimension) -> Option<String> {
    let Some(Item::Quantity { range, .. }) = item_of(key, path) else { return None };
    let value = quantity::parse(found).ok()?.value;
    let meant = is == Dimension::ANGULAR_RATE && wanted == Dimension::FREQUENCY && range.contains(value);
    meant.then(|| format!("{} Hz", text::digits(value)))
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
            format!(
                "write {} if the comma is a decimal comma, {} if it separates thousands",
                written(&one),
                written(&other)
            )
        }
        (Some(one), None) => format!("write the decimals after a point: {}", written(&one)),
        (None, Some(one)) => format!("write no commas between thousands: {}", written(&one)),
        (None, None) => "write the decimals after a point and no commas between thousands".to_owned(),
    }
}

/// Code, message and help for a text that is not a quantity.
pub(super) fn bad_quantity(key: &Key, path: &str, found: &str, problem: &Problem) -> (Code, String, String) {
    let form = template_of(key, path);
    let such_as = format!("write a number and a unit, in the form {form}");
    let is = format!("`{path}` is \"{}\"", text::shorten(found));
    match problem {
        Problem::TooLong => {
            (codes::BAD_QUANTITY, format!("{is}: longer than {} characters", quantity::MAX_LENGTH), such_as)
        }
        Problem::NoNumber => (codes::BAD_QUANTITY, format!("{is}: a quantity starts with a number"), such_as),
        Problem::Comma => (codes::BAD_QUANTITY, format!("{is}: a comma in a number"), without_commas(found)),
        Problem::UnknownUnit(unit, meant) => (
            codes::UNKNOWN_UNIT,
            format!("{is}: unknown unit {}", text::quote(unit)),
            meant.map_or_else(
                || {
                    let units = units_of(key, path).map_or_else(String::new, |units| format!(", such as {units}"));
                    format!("write a unit as in {form}{units}; upper and lower case matter")
                },
                |m| format!("did you mean \"{m}\"? Upper and lower case matter"),
            ),
        ),
        Problem::AmbiguousQuotient => (
            codes::BAD_QUANTITY,
            format!("{is}: the product after the slash is ambiguous"),
            "group it, as in \"N/(m s)\", or write the numerator first, as in \"N s/m\"".to_owned(),
        ),
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
