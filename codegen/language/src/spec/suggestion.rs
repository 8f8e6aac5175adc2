//! What a quantity of a wrong or doubtful unit was probably meant to be, with its number.

use toml::de::DeTable;

use super::keys::{Item, Key, Range, Shape};
use super::text;
use crate::quantity::{self, Dimension, Quantity};

/// A help, and the value that it offers, if that is certain.
pub(super) struct Suggestion {
    pub(super) help: String,
    pub(super) value: Option<String>,
}

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;

/// Moments of inertia, and the masses that they belong to.
const MASSES: &[(&str, &str)] = &[
    ("platform.inertia", "platform.mass"),
    ("leg.fixed_inertia", "leg.fixed_mass"),
    ("leg.extensible_inertia", "leg.extensible_mass"),
];

/// What a quantity has to be.
struct Target {
    dimension: Dimension,
    range: Range,
    unit: &'static str,
}

impl Target {
    fn of(item: Item) -> Option<Self> {
        let Item::Quantity { dimension, range, unit } = item else { return None };
        Some(Self { dimension, range, unit })
    }

    /// A value in SI units as text in the unit of the key, if it is in range.
    fn text(&self, value: f64) -> Option<String> {
        let scale = quantity::unit_value(self.unit)?.value;
        self.range.contains(value).then(|| format!("{} {}", text::digits(value / scale), self.unit))
    }

    /// The meanings of `found` that the key accepts.
    fn readings(&self, found: &str) -> Vec<String> {
        let all = quantity::readings(found, self.dimension).into_iter();
        all.filter(|(_, value)| self.range.contains(*value)).map(|(text, _)| text).collect()
    }
}

/// A help that offers those meanings of a quantity that the key accepts, if there are any.
pub(super) fn choice(key: &Key, path: &str, all: &[String]) -> Option<Suggestion> {
    let wanted = key.item(path).and_then(Target::of)?;
    let accepted = |text: &&String| !wanted.readings(text).is_empty();
    match all.iter().filter(accepted).collect::<Vec<_>>().as_slice() {
        [] => None,
        [only] => Some(Suggestion { help: did_you_mean(only), value: Some((*only).to_owned()) }),
        several => Some(Suggestion { help: format!("write {}, as you mean it", any_of(several)), value: None }),
    }
}

pub(super) fn did_you_mean(text: &str) -> String {
    format!("did you mean \"{}\"? Upper and lower case matter", text::shorten(text))
}

/// The first few of these texts: "a, b or c".
pub(super) fn any_of<T: AsRef<str>>(texts: &[T]) -> String {
    let shown: Vec<String> = texts.iter().take(4).map(|text| text::shorten(text.as_ref())).collect();
    text::alternatives(&shown.iter().map(String::as_str).collect::<Vec<_>>())
}

/// The meaning of a quantity that measures something else than `item`; `spec` has the other values of the file.
pub(super) fn of_other(
    key: &Key,
    item: Item,
    path: &str,
    found: &str,
    is: &Quantity,
    spec: &DeTable<'_>,
) -> Option<Suggestion> {
    if let Some(time) = time_of_rate(key, found) {
        let help = format!("{} is a {} of \"{time}\"", text::shorten(found), key.name);
        return Some(Suggestion { help, value: Some(time) });
    }
    let wanted = Target::of(item)?;
    let by_angle = || Suggestion { help: by_angle(key, path, found, is, &wanted), value: None };
    let meant = of_capitals(&wanted, found).or_else(|| converted(&wanted, path, is, spec));
    Some(meant.unwrap_or_else(by_angle))
}

/// "2.2 Nm" for nanometres.
fn of_capitals(wanted: &Target, found: &str) -> Option<Suggestion> {
    let readings = wanted.readings(found);
    let [only] = readings.as_slice() else { return None };
    Some(Suggestion { help: did_you_mean(only), value: Some(only.clone()) })
}

/// The same quantity as a data sheet gives it otherwise: a weight, a compliance, a radius of gyration, a noise density.
fn converted(wanted: &Target, path: &str, is: &Quantity, spec: &DeTable<'_>) -> Option<Suggestion> {
    let offer = |why: &str, value: f64| {
        let value = wanted.text(value)?;
        Some(Suggestion { help: format!("{why}: write \"{value}\""), value: Some(value) })
    };
    let per_gravity = |power| is.dimension.times(Dimension::ACCELERATION, power) == Some(wanted.dimension);
    if per_gravity(-1) {
        return offer("1 kg weighs 9.80665 N", is.value / GRAVITY);
    }
    if per_gravity(1) {
        return offer("1 kg weighs 9.80665 N", is.value * GRAVITY);
    }
    let is_time = [Dimension::TIME, Dimension::FREQUENCY].contains(&wanted.dimension);
    if !is_time && Dimension::NONE.times(is.dimension, -1) == Some(wanted.dimension) {
        return offer("this is the reciprocal", 1.0 / is.value);
    }
    if is.dimension == Dimension::LENGTH && wanted.dimension == Dimension::INERTIA {
        return gyration(wanted, path, is.value, spec);
    }
    if is.dimension.is_density_of(wanted.dimension) && path.contains("noise") {
        return Some(density(wanted, is.value, spec));
    }
    None
}

/// The moment of inertia of a radius of gyration, m.
fn gyration(wanted: &Target, path: &str, radius: f64, spec: &DeTable<'_>) -> Option<Suggestion> {
    let (_, of) =
        MASSES.iter().find(|(inertia, _)| path.strip_prefix(inertia).is_some_and(|rest| !rest.starts_with('_')))?;
    let rule = "inertia = mass × radius of gyration²";
    let mass = given(spec, of, Dimension::MASS);
    let value = mass.and_then(|mass| wanted.text(mass * radius * radius));
    let help = match &value {
        Some(value) => format!("{rule}; with `{of}`: \"{value}\""),
        None => format!("{rule}; write a moment of inertia in the form \"<number> {}\"", wanted.unit),
    };
    Some(Suggestion { help, value })
}

/// The rms value of a noise density, up to half the control rate.
fn density(wanted: &Target, density: f64, spec: &DeTable<'_>) -> Suggestion {
    let rule = "rms = density × √bandwidth";
    let band = given(spec, "timing.period", Dimension::TIME).filter(|period| *period > 0.0).map(|period| 0.5 / period);
    let offered = band.and_then(|band| Some((band, wanted.text(density * libm::sqrt(band))?)));
    let help = match offered {
        Some((band, value)) => {
            format!("{rule}; up to half the control rate, {} Hz: \"{value}\"", text::number(band))
        }
        None => format!("{rule}; write an rms value in the form \"<number> {}\"", wanted.unit),
    };
    // The bandwidth is an assumption.
    Suggestion { help, value: None }
}

/// The quantity at `path` of the file, SI, if it is valid.
fn given(spec: &DeTable<'_>, path: &str, dimension: Dimension) -> Option<f64> {
    let (section, key) = path.split_once('.')?;
    let text = spec.get(section)?.get_ref().as_table()?.get(key)?.get_ref().as_str()?;
    quantity::parse_as(text, dimension).ok().filter(|found| found.dimension == dimension).map(|found| found.value)
}

/// The time that corresponds to a rate, if the key takes a time: the period of "20 kHz" is "50 us". For a lag, the rate
/// is its corner frequency.
pub(super) fn time_of_rate(key: &Key, found: &str) -> Option<String> {
    let Shape::One(item @ Item::Quantity { dimension: Dimension::TIME, .. }) = key.shape else { return None };
    let rate = quantity::parse(found).ok().filter(|rate| rate.dimension == Dimension::FREQUENCY)?;
    let turn = match key.name {
        "period" => 1.0,
        "lag" => std::f64::consts::TAU,
        _ => return None,
    };
    Target::of(item)?.text(1.0 / (turn * rate.value))
}

/// A help for a quantity that may differ by an angle; otherwise the form of the key.
fn by_angle(key: &Key, path: &str, found: &str, is: &Quantity, wanted: &Target) -> String {
    let what = wanted.dimension.describe();
    let form = || format!("write {what} in the form {}", key.form(path));
    if is.dimension.without_angle() != wanted.dimension.without_angle() {
        return form();
    }
    let own = with_angle(found, is, wanted);
    if let Some((own, other)) = own.as_ref().zip(hertz_for_rate(is, wanted)) {
        return format!("the unit contains an angle: write \"{own}\", or \"{other}\" if that was intended");
    }
    let hint = if is.dimension == Dimension::FREQUENCY && wanted.dimension == Dimension::ANGULAR_RATE {
        "1 Hz is 2 pi rad/s"
    } else if is.dimension == is.dimension.without_angle() {
        "the unit needs an angle"
    } else {
        "the unit contains an angle"
    };
    format!("{hint}; {}", own.map_or_else(form, |own| format!("write {what} as \"{own}\"")))
}

/// The value in the key's unit, if the two differ only by an angle: 20 Hz is 40 pi rad/s, 5 N m is 5 N m/rad.
fn with_angle(found: &str, is: &Quantity, wanted: &Target) -> Option<String> {
    let in_hertz = found.to_lowercase().contains("hz");
    let is_rate = is.dimension == Dimension::ANGULAR_RATE;
    let turns = |a, b| is.dimension == a && wanted.dimension == b && in_hertz != is_rate;
    if turns(Dimension::FREQUENCY, Dimension::ANGULAR_RATE) {
        let inside = wanted.range.contains(std::f64::consts::TAU * is.value);
        return inside.then(|| format!("{} pi rad/s", text::digits(2.0 * is.value)));
    }
    if turns(Dimension::ANGULAR_RATE, Dimension::FREQUENCY) {
        let turns = is.value / std::f64::consts::TAU;
        return wanted.range.contains(turns).then(|| format!("{} Hz", text::digits(turns)));
    }
    wanted.text(is.value)
}

/// The same number in Hz, for a frequency written in rad/s: the likelier mistake.
fn hertz_for_rate(is: &Quantity, wanted: &Target) -> Option<String> {
    let mistaken = is.dimension == Dimension::ANGULAR_RATE && wanted.dimension == Dimension::FREQUENCY;
    (mistaken && wanted.range.contains(is.value)).then(|| format!("{} Hz", text::digits(is.value)))
}
