//! The units that a quantity may be written in.

use super::decimal::Decimal;
use super::dimension::Dimension;

/// A factor of a unit other than a power of ten, to 60 digits: ASCII digits · 10^exponent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Constant {
    digits: &'static str,
    exponent: i64,
}

impl Constant {
    /// The constant as a decimal.
    #[must_use]
    pub fn decimal(self) -> Decimal {
        Decimal::new(self.digits, self.exponent)
    }
}

/// One unit name with its prefix resolved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// What it measures.
    pub dimension: Dimension,
    /// Power of ten of its factor to SI.
    pub power_of_ten: i32,
    /// The rest of its factor to SI, if that is not 1.
    pub constant: Option<Constant>,
}

/// The prefixes that a unit takes.
#[derive(Clone, Copy, PartialEq)]
enum Prefixes {
    None,
    Si,
    Memory,
}

struct Entry {
    names: &'static [&'static str],
    dimension: Dimension,
    power_of_ten: i32,
    constant: Option<Constant>,
    prefixes: Prefixes,
}

const fn entry(names: &'static [&'static str], dimension: Dimension, power_of_ten: i32) -> Entry {
    Entry { names, dimension, power_of_ten, constant: None, prefixes: Prefixes::Si }
}

const fn scaled(names: &'static [&'static str], dimension: Dimension, digits: &'static str, exponent: i64) -> Entry {
    Entry { names, dimension, power_of_ten: 0, constant: Some(Constant { digits, exponent }), prefixes: Prefixes::None }
}

const UNITS: &[Entry] = &[
    entry(&["m"], Dimension::LENGTH, 0),
    entry(&["g"], Dimension::MASS, -3),
    entry(&["s"], Dimension::TIME, 0),
    entry(&["V"], Dimension::VOLTAGE, 0),
    entry(&["N"], Dimension::FORCE, 0),
    entry(&["A"], Dimension::CURRENT, 0),
    entry(&["F"], Dimension::CAPACITANCE, 0),
    entry(&["Hz"], Dimension::FREQUENCY, 0),
    entry(&["rad"], Dimension::ANGLE, 0),
    entry(&["Pa"], Dimension::new([-1, 1, -2, 0, 0, 0]), 0),
    entry(&["J"], Dimension::new([2, 1, -2, 0, 0, 0]), 0),
    entry(&["W"], Dimension::new([2, 1, -3, 0, 0, 0]), 0),
    Entry { names: &["B"], dimension: Dimension::MEMORY, power_of_ten: 0, constant: None, prefixes: Prefixes::Memory },
    scaled(&["min"], Dimension::TIME, "60", 0),
    scaled(&["pi", "π"], Dimension::NONE, "314159265358979323846264338327950288419716939937510582097494", -59),
    scaled(&["deg", "°"], Dimension::ANGLE, "174532925199432957692369076848861271344287188854172545609719", -61),
    scaled(&["arcmin"], Dimension::ANGLE, "290888208665721596153948461414768785573811981423620909349532", -63),
    scaled(&["arcsec"], Dimension::ANGLE, "484813681109535993589914102357947975956353302372701515582553", -65),
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

const BINARY_PREFIXES: &[(&str, Constant)] = &[
    ("Ki", Constant { digits: "1024", exponent: 0 }),
    ("Mi", Constant { digits: "1048576", exponent: 0 }),
    ("Gi", Constant { digits: "1073741824", exponent: 0 }),
];

/// Other words for a unit, and the unit.
const ALIASES: &[(&str, &str)] = &[
    ("sec", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("msec", "ms"),
    ("usec", "us"),
    ("micron", "um"),
    ("microns", "um"),
    ("meter", "m"),
    ("metre", "m"),
    ("volt", "V"),
    ("volts", "V"),
    ("newton", "N"),
    ("hertz", "Hz"),
    ("rads", "rad"),
    ("radian", "rad"),
    ("radians", "rad"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("gram", "g"),
    ("byte", "B"),
    ("bytes", "B"),
    ("kb", "kB"),
    ("mb", "MB"),
];

/// Every prefix with an SI unit that engineers use here, for suggestions.
const COMMON: &[&str] = &[
    "m", "mm", "um", "nm", "g", "kg", "mg", "s", "ms", "us", "ns", "V", "mV", "kV", "N", "mN", "kN", "Hz", "kHz",
    "MHz", "rad", "mrad", "urad", "nrad", "deg", "B", "kB", "MB", "KiB", "MiB",
];

/// The unit called `name`, with its prefix resolved.
#[must_use]
pub fn find(name: &str) -> Option<Unit> {
    let bare = |e: &Entry| Unit { dimension: e.dimension, power_of_ten: e.power_of_ten, constant: e.constant };
    if let Some(found) = UNITS.iter().find(|e| e.names.contains(&name)) {
        return Some(bare(found));
    }
    for e in UNITS.iter().filter(|e| e.prefixes != Prefixes::None) {
        for unit_name in e.names {
            let Some(prefix) = name.strip_suffix(unit_name) else {
                continue;
            };
            if e.prefixes == Prefixes::Memory
                && let Some((_, constant)) = BINARY_PREFIXES.iter().find(|(p, _)| *p == prefix)
            {
                return Some(Unit { constant: Some(*constant), ..bare(e) });
            }
            if let Some((_, power)) = SI_PREFIXES.iter().find(|(p, _)| *p == prefix) {
                // A fraction of a byte has no meaning.
                if e.prefixes == Prefixes::Memory && *power < 3 {
                    continue;
                }
                return Some(Unit { power_of_ten: e.power_of_ten + power, ..bare(e) });
            }
        }
    }
    None
}

/// The unit that was probably meant by an unknown one.
#[must_use]
pub fn suggest(name: &str) -> Option<&'static str> {
    let lower = name.to_lowercase();
    ALIASES
        .iter()
        .find(|(alias, _)| *alias == lower)
        .map(|(_, unit)| *unit)
        .or_else(|| COMMON.iter().find(|unit| unit.to_lowercase() == lower).copied())
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn suggestions_are_units() {
        for (_, unit) in ALIASES {
            assert!(find(unit).is_some(), "{unit}");
        }
        for unit in COMMON {
            assert!(find(unit).is_some(), "{unit}");
        }
    }

    #[test]
    fn bytes_take_no_small_prefix() {
        assert!(find("mB").is_none());
        assert_eq!(find("KiB").and_then(|u| u.constant).map(|c| c.decimal().to_f64()), Some(1024.0));
        assert_eq!(find("kB").map(|u| u.power_of_ten), Some(3));
    }
}
