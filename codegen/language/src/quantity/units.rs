//! The units that a quantity may be written in, by symbol; [`super::names`] reads their other spellings.

use std::fmt::Write as _;
use std::sync::LazyLock;

use super::decimal::Decimal;
use super::dimension::Dimension;

/// A factor of a unit other than a power of ten, exact or to 60 digits: ASCII digits · 10^exponent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Constant {
    digits: &'static str,
    exponent: i64,
}

impl Constant {
    /// The constant as a decimal.
    pub fn decimal(self) -> Decimal {
        Decimal::new(self.digits, self.exponent)
    }
}

const fn constant(digits: &'static str, exponent: i64) -> Option<Constant> {
    Some(Constant { digits, exponent })
}

/// One unit with its prefix resolved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// What it measures.
    pub dimension: Dimension,
    /// Power of ten of its factor to SI.
    pub power_of_ten: i32,
    /// The rest of its factor to SI, if that is not 1.
    pub constant: Option<Constant>,
    /// A divisor of its factor to SI, if it has one.
    pub over: Option<Constant>,
}

/// The prefixes that a unit takes.
#[derive(Clone, Copy, PartialEq)]
enum Prefixes {
    None,
    Si,
    Micro,
    Memory,
}

struct Entry {
    names: &'static [&'static str],
    unit: Unit,
    prefixes: Prefixes,
    /// Its value in SI units, for the reference; empty if the unit belongs to SI.
    is: &'static str,
}

const fn si(names: &'static [&'static str], dimension: Dimension, power_of_ten: i32) -> Entry {
    let unit = Unit { dimension, power_of_ten, constant: None, over: None };
    Entry { names, unit, prefixes: Prefixes::Si, is: "" }
}

const fn other(
    names: &'static [&'static str],
    dimension: Dimension,
    factor: Option<Constant>,
    is: &'static str,
) -> Entry {
    let unit = Unit { dimension, power_of_ten: 0, constant: factor, over: None };
    Entry { names, unit, prefixes: Prefixes::None, is }
}

const fn with(prefixes: Prefixes, entry: Entry) -> Entry {
    Entry { prefixes, ..entry }
}

/// 1/s
pub(super) const HERTZ: Unit = Unit { dimension: Dimension::FREQUENCY, power_of_ten: 0, constant: None, over: None };
/// The unit under a noise density.
pub(super) const ROOT_HERTZ: Unit = Unit { dimension: Dimension::ROOT_HERTZ, ..HERTZ };

const PI: Option<Constant> = constant("314159265358979323846264338327950288419716939937510582097494", -59);
const DEGREE: Option<Constant> = constant("174532925199432957692369076848861271344287188854172545609719", -61);
const ARCMIN: Option<Constant> = constant("290888208665721596153948461414768785573811981423620909349532", -63);
const ARCSEC: Option<Constant> = constant("484813681109535993589914102357947975956353302372701515582553", -65);
const POUND_FORCE: Option<Constant> = constant("44482216152605", -13);

/// lbf s²/ft.
const SLUG: Entry = Entry {
    names: &["slug"],
    unit: Unit { dimension: Dimension::MASS, power_of_ten: 0, constant: POUND_FORCE, over: constant("3048", -4) },
    prefixes: Prefixes::None,
    is: "4.4482216152605/0.3048 kg",
};

/// Inch, pound and pound-force are exact by the agreement of 1959 and standard gravity, 9.80665 m/s².
const UNITS: &[Entry] = &[
    si(&["m"], Dimension::LENGTH, 0),
    si(&["g"], Dimension::MASS, -3),
    si(&["s"], Dimension::TIME, 0),
    si(&["V"], Dimension::VOLTAGE, 0),
    si(&["N"], Dimension::FORCE, 0),
    si(&["A"], Dimension::CURRENT, 0),
    si(&["F"], Dimension::CAPACITANCE, 0),
    si(&["Hz"], Dimension::FREQUENCY, 0),
    si(&["rad"], Dimension::ANGLE, 0),
    si(&["Pa"], Dimension::new([-1, 1, -2, 0, 0, 0]), 0),
    si(&["J"], Dimension::new([2, 1, -2, 0, 0, 0]), 0),
    si(&["W"], Dimension::new([2, 1, -3, 0, 0, 0]), 0),
    with(Prefixes::Si, other(&["deg", "°"], Dimension::ANGLE, DEGREE, "pi/180 rad")),
    with(Prefixes::Memory, other(&["B"], Dimension::MEMORY, None, "")),
    other(&["√Hz"], Dimension::ROOT_HERTZ, None, ""),
    other(&["min"], Dimension::TIME, constant("60", 0), "60 s"),
    other(&["pi", "π"], Dimension::NONE, PI, ""),
    other(&["arcmin"], Dimension::ANGLE, ARCMIN, "1/60 deg"),
    other(&["arcsec"], Dimension::ANGLE, ARCSEC, "1/3600 deg"),
    with(Prefixes::Micro, other(&["in"], Dimension::LENGTH, constant("254", -4), "25.4 mm")),
    other(&["ft"], Dimension::LENGTH, constant("3048", -4), "304.8 mm"),
    other(&["mil", "thou"], Dimension::LENGTH, constant("254", -7), "25.4 um"),
    other(&["lb"], Dimension::MASS, constant("45359237", -8), "0.45359237 kg"),
    other(&["oz"], Dimension::MASS, constant("28349523125", -12), "28.349523125 g"),
    SLUG,
    other(&["lbf"], Dimension::FORCE, POUND_FORCE, "4.4482216152605 N"),
    other(&["ozf"], Dimension::FORCE, constant("27801385095378125", -17), "0.27801385095378125 N"),
    other(&["kgf"], Dimension::FORCE, constant("980665", -5), "9.80665 N"),
    other(&["gf"], Dimension::FORCE, constant("980665", -8), "9.80665 mN"),
];

/// Micro is accepted as ASCII u, micro sign U+00B5 and Greek mu U+03BC.
const SI_PREFIXES: &[(&str, i32)] = &[
    ("f", -15),
    ("p", -12),
    ("n", -9),
    ("u", -6),
    ("\u{b5}", -6),
    ("\u{3bc}", -6),
    ("m", -3),
    ("c", -2),
    ("d", -1),
    ("k", 3),
    ("M", 6),
    ("G", 9),
    ("T", 12),
];

const BINARY_PREFIXES: &[(&str, Option<Constant>)] =
    &[("Ki", constant("1024", 0)), ("Mi", constant("1048576", 0)), ("Gi", constant("1073741824", 0))];

/// A unit with or without prefix.
struct Symbol {
    prefix: &'static str,
    text: String,
    /// In small letters.
    lower: String,
    unit: Unit,
}

impl Symbol {
    fn new(prefix: &'static str, name: &str, unit: Unit) -> Self {
        let text = format!("{prefix}{name}");
        Self { prefix, lower: text.to_lowercase(), text, unit }
    }
}

/// Every unit that can be written, each text once.
static SYMBOLS: LazyLock<Vec<Symbol>> = LazyLock::new(|| {
    let mut symbols = Vec::new();
    for entry in UNITS {
        for name in entry.names {
            symbols.push(Symbol::new("", name, entry.unit));
            for (prefix, power) in SI_PREFIXES.iter().filter(|(_, power)| entry.takes(*power)) {
                let unit = Unit { power_of_ten: entry.unit.power_of_ten + power, ..entry.unit };
                symbols.push(Symbol::new(prefix, name, unit));
            }
            for (prefix, constant) in BINARY_PREFIXES.iter().filter(|_| entry.prefixes == Prefixes::Memory) {
                symbols.push(Symbol::new(prefix, name, Unit { constant: *constant, ..entry.unit }));
            }
        }
    }
    symbols
});

impl Entry {
    /// Whether it takes the SI prefix of this power of ten.
    fn takes(&self, power: i32) -> bool {
        match self.prefixes {
            Prefixes::None => false,
            Prefixes::Si => true,
            Prefixes::Micro => power == -6,
            // A fraction of a byte has no meaning.
            Prefixes::Memory => power >= 3,
        }
    }
}

/// The unit with the symbol `name`, with its prefix resolved.
pub fn find(name: &str) -> Option<Unit> {
    SYMBOLS.iter().find(|symbol| symbol.text == name).map(|symbol| symbol.unit)
}

/// Symbols that are `name` but for capital letters, with their units; each unit once.
pub(super) fn regardless_of_case(name: &str) -> Vec<(String, Unit)> {
    let lower = name.to_lowercase();
    let mut found: Vec<&Symbol> = Vec::new();
    for symbol in SYMBOLS.iter().filter(|symbol| symbol.lower == lower) {
        if found.iter().all(|known| known.unit != symbol.unit) {
            found.push(symbol);
        }
    }
    // "Mhz" has its prefix as written; "mhz" and "MHZ" do not.
    let is_mixed = name != lower && name != name.to_uppercase();
    let as_written = |symbol: &&Symbol| !symbol.prefix.is_empty() && name.starts_with(symbol.prefix);
    if is_mixed && found.iter().any(as_written) {
        found.retain(as_written);
    }
    found.into_iter().map(|symbol| (symbol.text.clone(), symbol.unit)).collect()
}

/// The units as a sentence for the reference.
pub fn units_markdown() -> String {
    let names = |takes: fn(&Entry) -> bool| {
        let each = UNITS.iter().filter(move |entry| takes(entry)).map(|entry| {
            let mut text = entry.names.join(" or ");
            if !entry.is.is_empty() {
                // Writing to a String cannot fail.
                let _ = write!(text, " ({})", entry.is);
            }
            text
        });
        each.collect::<Vec<_>>().join(", ")
    };
    format!(
        "Units with the prefixes f p n u (also µ) m c d k M G T are {}. B takes k M G T and Ki Mi Gi. \
         Without prefix there are {}.",
        names(|entry| entry.prefixes == Prefixes::Si),
        names(|entry| matches!(entry.prefixes, Prefixes::None | Prefixes::Micro)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity;

    #[test]
    fn angle_constants_agree_with_pi() {
        for (name, divisor) in [("deg", 180.0), ("arcmin", 10_800.0), ("arcsec", 648_000.0), ("pi", 1.0)] {
            let unit = find(name).expect(name);
            let value = unit.constant.expect(name).decimal().to_f64();
            let expected = std::f64::consts::PI / divisor;
            assert!((value - expected).abs() <= f64::EPSILON * expected, "{name}: {value} and {expected}");
        }
    }

    #[test]
    fn every_unit_is_worth_what_the_reference_says() {
        let mut count = 0;
        // Those with a quotient, such as a degree, have tests of their own.
        for entry in UNITS.iter().filter(|entry| !entry.is.is_empty() && !entry.is.contains('/')) {
            for name in entry.names {
                count += 1;
                assert_eq!(quantity::parse(&format!("1 {name}")), quantity::parse(entry.is), "{name}");
            }
        }
        assert!(count >= 10, "{count} units");
        for (number, expected) in [("1 in", 0.0254), ("1 lb", 0.453_592_37), ("1 lbf", 4.448_221_615_260_5)] {
            assert_eq!(
                quantity::parse(number).map(|found| found.value.to_bits()),
                Ok(f64::to_bits(expected)),
                "{number}"
            );
        }
    }

    #[test]
    fn every_unit_is_on_the_page_of_unknown_units() {
        let page = crate::diagnostic::codes::UNKNOWN_UNIT.page();
        let words: Vec<&str> = page.split(|c: char| c.is_whitespace() || ",;().".contains(c)).collect();
        for name in UNITS.iter().flat_map(|entry| entry.names) {
            assert!(words.contains(name) && units_markdown().contains(name), "{name}");
        }
    }

    #[test]
    fn no_two_units_are_written_alike() {
        for symbol in SYMBOLS.iter() {
            let alike: Vec<Unit> = SYMBOLS.iter().filter(|other| other.text == symbol.text).map(|s| s.unit).collect();
            assert_eq!(alike, [symbol.unit], "{}", symbol.text);
        }
    }

    #[test]
    fn bytes_take_no_small_prefix() {
        assert!(find("mB").is_none());
        assert_eq!(find("KiB").and_then(|u| u.constant).map(|c| c.decimal().to_f64()), Some(1024.0));
        assert_eq!(find("kB").map(|u| u.power_of_ten), Some(3));
    }
}
