//! Names of units as engineers write them: words, capital letters, several units without a blank between them.

use super::units::{self, Unit};

/// How sure a reading of a name is; a doubtful one counts only if there is no better one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Trust {
    /// The symbol.
    Symbol,
    /// A word, units without a blank, or a pound that is a force.
    Spelling,
    /// The same but for capital letters.
    Capitals,
    /// Offered, never taken.
    Guess,
}

/// One meaning of a name: a product of units with their symbols.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reading {
    pub(super) trust: Trust,
    pub(super) units: Vec<(String, Unit)>,
}

impl Reading {
    /// Of a text of symbols with blanks between them; `None` if one of them is not a symbol.
    fn of(trust: Trust, symbols: &str) -> Option<Self> {
        let units = symbols.split(' ').map(|symbol| Some((symbol.to_owned(), units::find(symbol)?)));
        Some(Self { trust, units: units.collect::<Option<_>>()? })
    }
}

/// Longest name that is taken apart.
const LONGEST: usize = 12;

/// Words in small letters, and what they may mean.
const WORDS: &[(&str, &[&str])] = &[
    ("meter", &["m"]),
    ("metre", &["m"]),
    ("micron", &["um"]),
    ("\u{b5}", &["um"]),
    ("\u{3bc}", &["um"]),
    ("gram", &["g"]),
    ("gm", &["g"]),
    ("kilo", &["kg"]),
    ("sec", &["s"]),
    ("second", &["s"]),
    ("msec", &["ms"]),
    ("usec", &["us"]),
    ("\u{b5}sec", &["us"]),
    ("minute", &["min"]),
    ("min", &["min"]),
    ("volt", &["V"]),
    ("ampere", &["A"]),
    ("amp", &["A"]),
    ("newton", &["N"]),
    ("farad", &["F"]),
    ("watt", &["W"]),
    ("hertz", &["Hz"]),
    ("rad", &["rad"]),
    ("radian", &["rad"]),
    ("deg", &["deg"]),
    ("degree", &["deg"]),
    ("asec", &["arcsec"]),
    ("amin", &["arcmin"]),
    ("byte", &["B"]),
    ("inch", &["in"]),
    ("inches", &["in"]),
    ("foot", &["ft"]),
    ("feet", &["ft"]),
    ("mil", &["mil"]),
    ("lb", &["lb", "lbf"]),
    ("lbm", &["lb"]),
    ("oz", &["oz", "ozf"]),
    ("pound", &["lb", "lbf"]),
    ("ounce", &["oz", "ozf"]),
    ("lbf", &["lbf"]),
    ("ozf", &["ozf"]),
    ("kgf", &["kgf"]),
    ("kp", &["kgf"]),
    ("rthz", &["√Hz"]),
    ("sqrthz", &["√Hz"]),
    ("roothz", &["√Hz"]),
    // Marks of inches and feet, and of parts of a degree.
    ("\"", &["in", "arcsec"]),
    ("″", &["in", "arcsec"]),
    ("''", &["in", "arcsec"]),
    ("'", &["ft", "arcmin"]),
    ("′", &["ft", "arcmin"]),
];

/// Words of prefixes.
const PREFIXES: &[(&str, &str)] =
    &[("nano", "n"), ("micro", "u"), ("milli", "m"), ("centi", "c"), ("kilo", "k"), ("mega", "M"), ("giga", "G")];

/// Offered, but not taken: bits or bytes, 1000 or 1024.
const GUESSES: &[(&str, &[&str])] = &[("kb", &["kB", "KiB"]), ("mb", &["MB", "MiB"]), ("gb", &["GB", "GiB"])];

/// A mass that is a force in "lb/in".
const FORCES: &[(&str, &str)] = &[("lb", "lbf"), ("oz", "ozf")];

/// Every meaning of `name`, the surest first; none if it is not a unit.
pub(super) fn readings(name: &str) -> Vec<Reading> {
    let lower = name.to_lowercase();
    if let Some(symbol) = Reading::of(Trust::Symbol, name) {
        let force = force_of(name).and_then(|force| Reading::of(Trust::Spelling, force));
        return std::iter::once(symbol).chain(force).collect();
    }
    if let Some((_, guesses)) = GUESSES.iter().find(|(word, _)| *word == lower) {
        return guesses.iter().filter_map(|one| Reading::of(Trust::Guess, one)).collect();
    }
    let mut found = words(&lower);
    // "lbs" is no pound times second.
    let is_plural = !found.is_empty() && lower.ends_with('s');
    if name.len() <= LONGEST && !is_plural {
        split(name, Trust::Spelling, &symbols, &mut found);
        let is_letter = name.chars().count() == 1 && lower != "v";
        let trust = if is_letter { Trust::Guess } else { Trust::Capitals };
        let whole = units::regardless_of_case(name).into_iter();
        found.extend(whole.map(|unit| Reading { trust, units: vec![unit] }));
        split(name, Trust::Capitals, &units::regardless_of_case, &mut found);
    }
    found.sort_by_key(|reading| reading.trust);
    let mut known: Vec<Vec<Unit>> = Vec::new();
    found.retain(|reading| {
        let units: Vec<Unit> = reading.units.iter().map(|(_, unit)| *unit).collect();
        let is_new = !known.contains(&units);
        known.push(units);
        is_new
    });
    found
}

/// The meanings of a word, in the singular or plural, with or without the word of a prefix.
fn words(name: &str) -> Vec<Reading> {
    let forms = [Some(name), name.strip_suffix('s')];
    let mut found = Vec::new();
    for word in forms.into_iter().flatten() {
        let known = |word: &str| WORDS.iter().find(|(known, _)| *known == word).map(|(_, symbols)| *symbols);
        let plain = known(word).into_iter().flatten().map(|symbol| (*symbol).to_owned());
        let prefixed = PREFIXES.iter().filter_map(|(prefix, short)| {
            let [symbol] = known(word.strip_prefix(prefix)?)? else { return None };
            let found = format!("{short}{symbol}");
            // "milliinch" is no minute.
            (units::find(&found)?.dimension == units::find(symbol)?.dimension).then_some(found)
        });
        found.extend(plain.chain(prefixed).filter_map(|symbol| Reading::of(Trust::Spelling, &symbol)));
    }
    found
}

/// The units with this symbol; a pound may be a force.
fn symbols(name: &str) -> Vec<(String, Unit)> {
    let known = [Some(name), force_of(name)].into_iter().flatten();
    known.filter_map(|one| Some((one.to_owned(), units::find(one)?))).collect()
}

fn force_of(mass: &str) -> Option<&'static str> {
    FORCES.iter().find(|(known, _)| *known == mass).map(|(_, force)| *force)
}

/// Adds the ways to part `name` into two units, or into three that begin with a force or a mass: "Nms". `symbols` gives
/// the units that a part may be. No dimension occurs twice: "gmm" is g mm. If capital letters are in doubt, one unit has
/// to be a force or a mass, as in "NM": "MHZ" is no metre times hertz.
fn split(name: &str, trust: Trust, symbols: &dyn Fn(&str) -> Vec<(String, Unit)>, found: &mut Vec<Reading>) {
    let cuts: Vec<usize> = name.char_indices().map(|(at, _)| at).skip(1).collect();
    let mut add = |parts: &[&str]| {
        let mut products = vec![Vec::new()];
        for part in parts {
            let units = symbols(part);
            let longer = |product: &Vec<(String, Unit)>| {
                let fits =
                    |(_, unit): &&(String, Unit)| product.iter().all(|(_, other)| other.dimension != unit.dimension);
                let each =
                    units.iter().filter(fits).map(|unit| [product.as_slice(), std::slice::from_ref(unit)].concat());
                each.collect::<Vec<_>>()
            };
            products = products.iter().flat_map(longer).collect();
        }
        let has_mass = |units: &Vec<(String, Unit)>| units.iter().any(|(_, unit)| unit.dimension.contains_mass());
        products.retain(|units| trust < Trust::Capitals || has_mass(units));
        found.extend(products.into_iter().map(|units| Reading { trust, units }));
    };
    for (index, cut) in cuts.iter().enumerate() {
        add(&[&name[..*cut], &name[*cut..]]);
        let begins = symbols(&name[..*cut]).iter().any(|(_, unit)| unit.dimension.contains_mass());
        for next in cuts[index + 1..].iter().filter(|_| begins) {
            add(&[&name[..*cut], &name[*cut..*next], &name[*next..]]);
        }
    }
}
