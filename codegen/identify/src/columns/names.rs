//! Names of columns: a quantity and a unit, such as `drive_V`, `Drive [mV]` or `displacement (µm)`.

mod quantities;

pub(crate) use quantities::{COORDINATES, QUANTITIES, RATES};
use quantities::{KINDS, WORDS};

/// A quantity that a column may hold.
#[derive(Debug)]
pub(crate) struct Quantity {
    /// Name in records of this project, with its unit.
    pub(crate) name: &'static str,
    /// Other names, in lower case letters and digits.
    also: &'static [&'static str],
    units: &'static [Unit],
    /// What follows a unit: nothing, or one of [`PER_TIME`].
    per_time: &'static [&'static str],
}

impl Quantity {
    const fn new(name: &'static str, also: &'static [&'static str], units: &'static [Unit]) -> Self {
        Self { name, also, units, per_time: &[""] }
    }

    /// A rate (1), or an acceleration (2).
    const fn rate(order: usize, name: &'static str, also: &'static [&'static str], units: &'static [Unit]) -> Self {
        Self { name, also, units, per_time: PER_TIME[order - 1] }
    }
}

/// Name of a unit, and its number in one unit of [`Quantity::name`].
type Unit = (&'static str, f64);

/// How a number of a column becomes one of its quantity: it is divided by `per`, then scaled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Conversion {
    /// Number of the column's units in one unit of the quantity.
    pub(crate) per: f64,
    /// Factor, then offset in units of the quantity; none for a column that only has another unit.
    pub(crate) scale: Option<[f64; 2]>,
}

impl Conversion {
    /// From a unit of which `per` are one of the quantity's.
    pub(crate) const fn unit(per: f64) -> Self {
        Self { per, scale: None }
    }

    /// The same to a unit of which one is `per` of the quantity's.
    pub(crate) fn per(self, per: f64) -> Self {
        Self { per: self.per * per, scale: self.scale.map(|[factor, offset]| [factor, offset / per]) }
    }

    /// The value in units of the quantity.
    pub(crate) fn apply(self, value: f64) -> f64 {
        let value = value / self.per;
        self.scale.map_or(value, |[factor, offset]| value * factor + offset)
    }
}

/// Every quantity that a column may hold.
pub(crate) fn all() -> impl Iterator<Item = &'static Quantity> {
    QUANTITIES.iter().chain(&COORDINATES).chain(&RATES)
}

/// Names of a column with sample numbers.
const SAMPLE: [&str; 5] = ["sample", "samples", "index", "samplenumber", "n"];
/// LabVIEW's name for time in s.
const X_VALUE: &str = "xvalue";

/// The quantity of a column such as `time_s`.
pub(crate) fn quantity(name: &str) -> Option<&'static Quantity> {
    all().find(|quantity| quantity.name == name)
}

/// Quality of a match between header and quantity, the best first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Fit {
    Exact,
    OtherUnit,
    OtherName,
}

impl Quantity {
    /// How well `header` names this quantity, and its units in one of ours; `None` if it does not, or has no unit.
    pub(crate) fn fits(&self, header: &str) -> Option<(Fit, f64)> {
        if header.eq_ignore_ascii_case(self.name) {
            return Some((Fit::Exact, 1.0));
        }
        // `-displacement (um)` has the other sign.
        if header.starts_with(MINUS) {
            return None;
        }
        if self.name == "time_s" && plain(header) == X_VALUE {
            return Some((Fit::OtherName, 1.0));
        }
        let (name, per) = self.divided(header)?;
        match name.as_str() {
            name if name == plain(self.plain()) => Some((Fit::OtherUnit, per)),
            name if self.also.contains(&name) && !ends_with_word(header) => Some((Fit::OtherName, per)),
            _ => None,
        }
    }

    /// Number of `text`, a unit, in one of our units.
    pub(crate) fn per(&self, text: &str) -> Option<f64> {
        self.per_time.iter().find_map(|ending| per(self.units, &unit(text.trim().strip_suffix(ending)?)))
    }

    /// The same for a name such as `drive_mV`; `None` if that is another quantity, or has no unit of it.
    pub(crate) fn per_of(&self, name: &str) -> Option<f64> {
        self.divided(name).filter(|(quantity, _)| *quantity == plain(self.plain())).map(|(_, per)| per)
    }

    /// The name in a header, and its units in one of ours; none if it has no unit of this quantity.
    pub(crate) fn divided(&self, header: &str) -> Option<(String, f64)> {
        self.per_time.iter().find_map(|ending| {
            // `vx_mm/s`, or `vx (mm/s)`.
            let bare = header.trim().strip_suffix(ending);
            let (name, unit) = parts(bare.unwrap_or(header));
            let unit = unit?;
            let unit = if bare.is_some() { &unit } else { unit.strip_suffix(ending)? };
            Some((name, per(self.units, unit)?))
        })
    }

    /// Its name without the unit.
    pub(crate) fn plain(&self) -> &'static str {
        self.name.rsplit_once('_').map_or(self.name, |(plain, _)| plain)
    }

    /// Whether `header` names this quantity without a unit.
    pub(crate) fn is_named(&self, header: &str) -> bool {
        let name = plain(header);
        name == plain(self.plain()) || self.also.contains(&name.as_str())
    }

    /// Whether `header` has a word for this quantity (1), for another one (-1), or neither (0).
    pub(crate) fn resemblance(&self, header: &str) -> i32 {
        let name = header.to_lowercase();
        let words: Vec<&str> = name.split(|c: char| !c.is_alphabetic()).collect();
        let has = |word: &&str| match word.len() {
            ..4 => words.contains(word),
            _ => name.contains(*word),
        };
        let of = WORDS.iter().find(|(_, all)| all.iter().any(has)).map(|(plain, _)| *plain);
        match of {
            Some(plain) if plain == self.plain() => 1,
            Some("drive") if self.plain() == "monitor" || self.unit() == "V" => 1,
            Some("displacement") if self.unit() == "um" => 1,
            Some(_) => -1,
            None => 0,
        }
    }

    /// Its unit.
    pub(crate) fn unit(&self) -> &'static str {
        self.name.rsplit_once('_').map_or("", |(_, unit)| unit)
    }

    /// Its names with the units that are accepted.
    pub(crate) fn all_names(&self) -> String {
        let name = |(unit, _): &Unit| format!("`{}_{unit}{}`", self.plain(), self.per_time[0]);
        self.units.iter().map(name).collect::<Vec<_>>().join(", ")
    }
}

fn per(units: &[Unit], unit: &str) -> Option<f64> {
    units.iter().find(|(name, _)| name.to_ascii_lowercase() == unit).map(|(_, per)| *per)
}

/// Number of the header's units in one of `denominator`, such as 1000 for `CH2 (mV)` and `V`.
///
/// # Errors
/// The header's unit, if it is of another kind, or not known and another text.
pub(crate) fn per_denominator(header: &str, denominator: &str) -> Result<f64, String> {
    let (Some(own), denominator) = (parts(header).1, unit(denominator)) else { return Ok(1.0) };
    match (kind(&own), kind(&denominator)) {
        _ if denominator.is_empty() || own == denominator => Ok(1.0),
        (Some((a, own)), Some((b, other))) if a == b => Ok(own / other),
        // `count` and `counts`.
        (None, None) if own.trim_end_matches('s') == denominator.trim_end_matches('s') => Ok(1.0),
        _ if own_unit(header).is_some() || has_unknown_unit(header) => Err(own),
        _ => Ok(1.0),
    }
}

/// The kind of a unit, named by its first unit, and its number in one of that.
fn kind(unit: &str) -> Option<(&'static str, f64)> {
    KINDS.into_iter().find_map(|kind| per(kind, unit).map(|per| (kind[0].0, per)))
}

/// Endings of names that mean something else more often than a unit, such as `V_in`.
const AMBIGUOUS: [&str; 6] = ["s", "m", "in", "d", "h", "min"];
/// Those that mean something else behind other names of a quantity, too, such as `position_in`.
const WORD_UNITS: [&str; 4] = ["in", "d", "h", "min"];

/// Whether a header ends with one of [`WORD_UNITS`] and nothing marks that as a unit.
fn ends_with_word(header: &str) -> bool {
    let header = header.trim().to_lowercase();
    let word = header.rsplit(['_', ' ']).next().unwrap_or_default();
    !is_unit_marked(&header) && !header.contains(" in ") && WORD_UNITS.contains(&word)
}

/// Whether brackets, a slash or a comma separate the unit of a header.
fn is_unit_marked(header: &str) -> bool {
    header.trim().ends_with([')', ']']) || header.contains(['/', ','])
}

/// The unit of a header as it is written in a name such as `drive_mV`; none if it is not known, or only a letter behind a
/// blank or `_`.
pub(crate) fn own_unit(header: &str) -> Option<&'static str> {
    let own = parts(header).1?;
    if !is_unit_marked(header) && AMBIGUOUS.contains(&own.as_str()) {
        return None;
    }
    KINDS.into_iter().flatten().map(|(name, _)| *name).find(|name| name.to_ascii_lowercase() == own)
}

/// Whether a header ends with what may be a unit, but none that is known, such as `Field (Oe)` or `position_counts`.
pub(crate) fn has_unknown_unit(header: &str) -> bool {
    let is_short = |text: &str| (1..=UNKNOWN).contains(&text.chars().count()) && !text.contains([',', ':']);
    let is_word = |text: &str| FOREIGN.contains(&text);
    let is_unknown = |text: &str| kind(text).is_none() && text.parse::<f64>().is_err();
    match unit_in_brackets(header).filter(|text| !is_remark(text)) {
        Some(text) => is_unknown(&text) && (is_short(&text) || text.contains('/') || is_word(&text)),
        None => parts(header).1.is_some_and(|text| is_word(&text)),
    }
}

/// Whether a text in brackets says which one of several signals a column has, such as `raw` or `ch1`.
fn is_remark(text: &str) -> bool {
    let channel = text.trim_end_matches(|c: char| c.is_ascii_digit());
    REMARKS.contains(&text) || channel.len() < text.len() && CHANNELS.contains(&channel)
}

/// `name` with a unit that is stated beside it, if that is not the one of the name.
pub(crate) fn with_unit(name: &str, stated: &str) -> String {
    let own = parts(name).1.filter(|_| own_unit(name).is_some() || has_unit(name));
    let is_stated = is_unit(stated) || has_unknown_unit(&format!("x [{stated}]"));
    if is_stated && own.is_none_or(|own| kind(&own).is_some() && own != unit(stated)) {
        format!("{name} [{}]", stated.trim())
    } else {
        name.to_owned()
    }
}

/// The unit in brackets at the end of a header, such as `um/s` of `vx (um/s)`.
pub(crate) fn unit_in_brackets(header: &str) -> Option<String> {
    let inner = |open: char, close: char| Some(header.trim().strip_suffix(close)?.rsplit_once(open)?.1);
    inner('(', ')').or_else(|| inner('[', ']')).map(unit)
}

/// Whether a header names sample numbers.
pub(crate) fn is_sample_number(header: &str) -> bool {
    !header.starts_with('(') && SAMPLE.contains(&plain(header).as_str())
}

/// Whether a header names a quantity or a coordinate with its unit.
pub(crate) fn has_unit(header: &str) -> bool {
    QUANTITIES.iter().chain(&COORDINATES).any(|quantity| quantity.fits(header).is_some())
}

/// Whether two headers name one quantity in one unit, or are none of a quantity and differ only in size and signs.
pub(crate) fn are_alike(one: &str, other: &str) -> bool {
    let known = |header: &str| {
        let mut all = QUANTITIES.iter().chain(&COORDINATES);
        all.find_map(|quantity| quantity.fits(header).map(|(_, per)| (quantity.name, per)))
    };
    match (known(one), known(other)) {
        (None, None) => plain(one) == plain(other),
        (one, other) => one == other,
    }
}

/// Whether a header names any quantity of a record.
pub(crate) fn is_known(header: &str) -> bool {
    is_sample_number(header) || QUANTITIES.iter().any(|quantity| quantity.fits(header).is_some())
}

/// Whether a field of a line below the names is a unit, or one per s or s².
pub(crate) fn is_unit(field: &str) -> bool {
    let unit = field.trim_matches(['[', ']', '(', ')']).trim();
    let is_known = |unit: &str| QUANTITIES.iter().chain(&COORDINATES).any(|quantity| quantity.per(unit).is_some());
    let mut endings = PER_TIME.iter().flat_map(|endings| *endings);
    is_known(unit) || endings.any(|ending| unit.strip_suffix(ending).is_some_and(is_known))
}

/// Whether a header ends with a unit per s or s² in brackets.
pub(crate) fn is_rate(header: &str) -> bool {
    let is_known = |unit: &str| PER_TIME.iter().flat_map(|endings| *endings).any(|ending| unit.ends_with(ending));
    unit_in_brackets(header).is_some_and(|unit| is_known(&unit) && is_unit(&unit))
}

/// What follows the unit of a rate, and that of an acceleration.
pub(crate) const PER_TIME: [&[&str]; 2] = [&["/s"], &["/s2", "/s^2", "/s²", "/s/s"]];

/// Lower case letters and digits of a name.
pub(crate) fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The quantity of a header, and its unit in lower case with `u` for µ; none if it has no unit.
fn parts(header: &str) -> (String, Option<String>) {
    let header = header.trim();
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let Some((name, inner)) = header.strip_suffix(close).and_then(|rest| rest.rsplit_once(open)) {
            return (plain(name), Some(unit(inner)));
        }
    }
    match header.rsplit_once(['_', '/', ',', ' ']) {
        // `Time in ms`.
        Some((name, inner)) => (plain(name.strip_suffix(" in").unwrap_or(name)), Some(unit(inner))),
        None => (plain(header), None),
    }
}

/// Units that are not those with a small letter.
const MEGA: [&str; 4] = ["MN", "Mm", "Ms", "Mrad"];
/// Most letters of a unit that is not known; longer texts in brackets are remarks, unless they are one of the next words.
const UNKNOWN: usize = 4;
/// Units of no quantity here, in or without brackets.
const FOREIGN: [&str; 15] = [
    "counts", "count", "ticks", "steps", "digits", "digit", "code", "codes", "lsb", "percent", "%", "ft", "rpm",
    "mdeg", "oe",
];
/// Remarks in brackets that are as short as units.
const REMARKS: [&str; 9] = ["act", "raw", "avg", "mean", "set", "cmd", "ref", "ist", "soll"];
/// Letters of channels, before a number.
const CHANNELS: [&str; 5] = ["ch", "ai", "ao", "adc", "dac"];
/// Minus signs: of programs, of typesetting, and what some make of it.
pub(crate) const MINUS: [char; 3] = ['-', '\u{2212}', '\u{2013}'];

fn unit(given: &str) -> String {
    // `Â` is the first half of a UTF-8 µ that was read as Latin-1.
    let text = given.trim().trim_end_matches('.').replace('Â', "").to_lowercase().replace(['µ', 'μ'], "u");
    match text.as_str() {
        // Mega, not milli.
        "mn" | "mm" | "ms" | "mrad" if MEGA.contains(&given.trim()) => given.trim().to_owned(),
        "volt" | "volts" => "v".to_owned(),
        "sec" | "secs" | "second" | "seconds" => "s".to_owned(),
        "msec" | "millisec" | "millisecond" | "milliseconds" => "ms".to_owned(),
        "usec" | "microsec" | "microsecond" | "microseconds" => "us".to_owned(),
        "nsec" | "nanosec" | "nanosecond" | "nanoseconds" => "ns".to_owned(),
        "psec" | "picosec" | "picosecond" | "picoseconds" => "ps".to_owned(),
        "minute" | "minutes" => "min".to_owned(),
        "hr" | "hrs" | "hour" | "hours" => "h".to_owned(),
        "day" | "days" => "d".to_owned(),
        "millivolt" | "millivolts" => "mv".to_owned(),
        "micron" | "microns" | "micrometer" | "micrometers" | "micrometre" | "micrometres" => "um".to_owned(),
        "nanometer" | "nanometers" | "nanometre" | "nanometres" => "nm".to_owned(),
        "millimeter" | "millimeters" | "millimetre" | "millimetres" => "mm".to_owned(),
        "å" => "angstrom".to_owned(),
        "inch" | "inches" => "in".to_owned(),
        "thou" | "mils" => "mil".to_owned(),
        "newton" | "newtons" => "n".to_owned(),
        "°" | "degree" | "degrees" => "deg".to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_is_a_quantity_in_a_unit() {
        for (header, name, expected) in [
            ("time_s", "time_s", Some((Fit::Exact, 1.0))),
            ("TIME_S", "time_s", Some((Fit::Exact, 1.0))),
            ("Time (ms)", "time_s", Some((Fit::OtherUnit, 1e3))),
            ("t/s", "time_s", Some((Fit::OtherName, 1.0))),
            ("Time,ms", "time_s", Some((Fit::OtherUnit, 1e3))),
            ("X_Value", "time_s", Some((Fit::OtherName, 1.0))),
            ("Zeit [s]", "time_s", Some((Fit::OtherName, 1.0))),
            ("Drive_mV", "drive_V", Some((Fit::OtherUnit, 1e3))),
            ("drive", "drive_V", None),
            ("drive_A", "drive_V", None),
            ("displacement_µm", "displacement_um", Some((Fit::OtherUnit, 1.0))),
            ("displacement [μm]", "displacement_um", Some((Fit::OtherUnit, 1.0))),
            ("displacement_Âµm", "displacement_um", Some((Fit::OtherUnit, 1.0))),
            ("Position nm", "displacement_um", Some((Fit::OtherName, 1e3))),
            ("monitor_V", "drive_V", None),
            ("force_kN", "force_N", Some((Fit::OtherUnit, 1e-3))),
            ("Zeit in ms", "time_s", Some((Fit::OtherName, 1e3))),
            ("Time (sec.)", "time_s", Some((Fit::OtherUnit, 1.0))),
            ("Time [min]", "time_s", Some((Fit::OtherUnit, 1.0 / 60.0))),
            ("displacement [Å]", "displacement_um", Some((Fit::OtherUnit, 1e4))),
            ("Position (mil)", "displacement_um", Some((Fit::OtherName, 1.0 / 25.4))),
            ("force_MN", "force_N", None),
            ("position_in", "displacement_um", None),
            ("Position in", "displacement_um", None),
            ("t_min", "time_s", None),
            ("displacement_in", "displacement_um", Some((Fit::OtherUnit, 1.0 / 25_400.0))),
            ("Position [in]", "displacement_um", Some((Fit::OtherName, 1.0 / 25_400.0))),
            ("Zeit in h", "time_s", Some((Fit::OtherName, 1.0 / 3600.0))),
            ("FORCE_mN", "force_N", Some((Fit::OtherUnit, 1e3))),
            ("t_ps", "time_s", Some((Fit::OtherName, 1e12))),
            ("Time [microsecond]", "time_s", Some((Fit::OtherUnit, 1e6))),
            ("-displacement (um)", "displacement_um", None),
            ("displacement_um [nm]", "displacement_um", None),
        ] {
            assert_eq!(quantity(name).unwrap().fits(header), expected, "{header}");
        }
        assert_eq!(per_denominator("CH2 (mV)", "V"), Ok(1e3));
        assert_eq!(per_denominator("CH2", "V"), Ok(1.0));
        assert_eq!(per_denominator("CH2 [um]", "V"), Err("um".to_owned()));
        assert_eq!(per_denominator("CH2 (bar)", "V"), Err("bar".to_owned()));
        assert_eq!(per_denominator("CH2 (bar)", "bar"), Ok(1.0));
        assert_eq!(per_denominator("CH2 (Filtered)", "V"), Ok(1.0));
        assert!(per_denominator("CH2 (mrad)", "rad").is_ok_and(|per| (per - 1e3).abs() < 1e-9));
        assert_eq!(per_denominator("CH2 (V)", "count"), Err("v".to_owned()));
        for (header, denominator) in [("enc_counts", "count"), ("Encoder (ticks)", "tick"), ("enc_count", "counts")] {
            assert_eq!(per_denominator(header, denominator), Ok(1.0), "{header}");
        }
        assert_eq!(per_denominator("enc_counts", "tick"), Err("counts".to_owned()));
        assert!(are_alike("Time (s)", "time_s") && are_alike("U 1", "u1"));
        for other in ["time_ms", "drive_V", "U"] {
            assert!(!are_alike("Time (s)", other) && !are_alike("y", other), "{other}");
        }
        assert_eq!(per_denominator("V_in", "V"), Ok(1.0));
        for (header, expected) in [
            ("Field (Oe)", true),
            ("vx (mm/s)", true),
            ("position_counts", true),
            ("Position (counts)", true),
            ("Position [mV]", false),
            ("Voltage (Filtered)", false),
            ("Voltage_0", false),
            ("CH (1)", false),
            ("Position (act)", false),
            ("Position [raw]", false),
            ("Position (Ist)", false),
            ("Gauge (CH1)", false),
            ("Gauge (AI0)", false),
            ("Gauge (ch)", true),
            ("Area (mm2)", true),
        ] {
            assert_eq!(has_unknown_unit(header), expected, "{header}");
        }
        for (name, stated, expected) in [
            ("theta_x_urad", "mrad", "theta_x_urad [mrad]"),
            ("theta_x_urad", "urad", "theta_x_urad"),
            ("drive_V", "counts", "drive_V [counts]"),
            ("drive_V", "Sequence", "drive_V"),
            ("displacement_um", "um/s", "displacement_um [um/s]"),
            ("vx", "um/s", "vx [um/s]"),
            ("CH1", "0", "CH1"),
        ] {
            assert_eq!(with_unit(name, stated), expected, "{name}, {stated}");
        }
        for (header, unit) in [
            ("CH2 (mV)", Some("mV")),
            ("Pos,nm", Some("nm")),
            ("CH2 [ V ]", Some("V")),
            ("U_mV", Some("mV")),
            ("t [s]", Some("s")),
            ("V_in", None),
            ("Voltage_0", None),
            ("Gauge (MN)", None),
        ] {
            assert_eq!(own_unit(header), unit, "{header}");
        }
        for (header, at, expected) in [
            ("x (um)", 0, Some((Fit::OtherUnit, 1.0))),
            ("X_MM", 0, Some((Fit::OtherUnit, 1e-3))),
            ("rx [mrad]", 3, Some((Fit::OtherName, 1e-3))),
            ("theta_z_rad", 5, Some((Fit::OtherUnit, 1e-6))),
            ("theta_x", 3, None),
            ("rx", 3, None),
        ] {
            assert_eq!(COORDINATES[at].fits(header), expected, "{header}");
            assert_eq!(COORDINATES[at].is_named(header), expected.is_none(), "{header}");
        }
        for (header, at, per) in [
            ("vx [mm/s]", 0, 1e-3),
            ("Xdot, m/s", 0, 1e-6),
            ("wz (rad/s)", 5, 1e-6),
            ("az_um/s^2", 8, 1.0),
            ("alpha_x_mrad/s/s", 9, 1e-3),
        ] {
            assert_eq!(RATES[at].fits(header).map(|(_, per)| per), Some(per), "{header}");
            assert_eq!(RATES.iter().filter(|rate| rate.fits(header).is_some()).count(), 1, "{header}");
        }
        let (_, per) = COORDINATES[4].fits("Ry deg").unwrap();
        assert!((Conversion::unit(per).apply(180.0) * 1e-6 - core::f64::consts::PI).abs() < 1e-12, "{per}");
        assert!(is_unit("[µm]") && is_unit("Volts") && !is_unit("1") && is_sample_number("Sample"));
        assert_eq!(quantity("drive_V").unwrap().all_names(), "`drive_V`, `drive_mV`, `drive_uV`, `drive_kV`");
        assert_eq!(quantity("monitor_V").unwrap().all_names(), "`monitor_V`, `monitor_mV`, `monitor_uV`, `monitor_kV`");
    }
}
