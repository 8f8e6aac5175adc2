//! Assigns the columns of a file: by the user's choice, otherwise by their names.

use super::{ColumnSpec, TIME};
use crate::columns::names::{self, Conversion, Fit, Quantity};
use crate::columns::{Column, Format, Head, Shape};
use crate::findings::Findings;
use crate::reading::{ColumnChoice, Reading};
use specgen_language::diagnostic::{Code, codes};

/// Headers within this edit distance of a requested name are suggested.
const NEAR: usize = 4;
/// The drive as commanded, and as measured.
pub(crate) const DRIVE: &str = "drive_V";
pub(crate) const MONITOR: &str = "monitor_V";

/// Places of the requested columns.
pub(super) struct Places {
    /// One for each request; none if the file does not have it.
    pub(super) columns: Vec<Option<Column<'static>>>,
    /// Time between samples, s, if time is computed. The column of times then has sample numbers, or does not exist.
    pub(super) interval: Option<f64>,
}

/// `None` after every problem was reported.
pub(super) fn find(
    header: &Head,
    wanted: &[ColumnSpec],
    (reading, format): (&Reading, &Format),
    findings: &mut Findings,
) -> Option<Places> {
    let search = Search { header, wanted, reading, format };
    let line = Some(header.line);
    let names: Vec<&str> = wanted.iter().map(|w| w.name).collect();
    for unknown in reading.unknown(&names) {
        let message = format!("{} names `{unknown}`, which this kind of file does not have", reading.option());
        findings.add(format.header, line, message, &format!("it has {}", listed(&names)));
    }
    let interval = search.interval(findings);
    let mut columns = Vec::new();
    let mut missing = Vec::new();
    let measured = names.contains(&MONITOR) && matches!(search.place(MONITOR), Ok(Some(_)));
    for w in wanted {
        let counted = w.name == TIME && interval.is_some();
        let found = if counted { search.sample_numbers() } else { search.place(w.name) };
        if matches!(found, Ok(None)) && w.required && !counted && !(w.name == DRIVE && measured) {
            missing.push(w.name);
        }
        let found = found.unwrap_or_else(|(code, message, help)| findings.refuse(code, line, message, &help));
        columns.push(found.map(|column| Column { conversion: column.conversion.per(w.per), ..column }));
    }
    let suggested = search.suggested(&missing, &columns);
    for name in missing {
        let message = format!("column `{name}` is missing; {}", search.present());
        findings.add(format.header, line, message, &search.help(name, suggested.as_deref()));
    }
    let found: Vec<&Column> = columns.iter().flatten().collect();
    let twice = found.iter().enumerate().find_map(|(k, column)| {
        found[..k].iter().find(|other| other.at == column.at).map(|other| (other.name, column.name, column.at + 1))
    });
    if let Some((first, second, at)) = twice {
        let message = format!("column {at} is named for `{first}` and for `{second}`");
        findings.add(
            codes::RECORD_COLUMN_TWICE,
            line,
            message,
            &format!("name another column for one of them in {}", reading.option()),
        );
    }
    if findings.any_error() { None } else { Some(Places { columns, interval }) }
}

/// Code, message and help of a finding about the header.
type Problem = (Code, String, String);

struct Search<'a> {
    header: &'a Head,
    wanted: &'a [ColumnSpec],
    reading: &'a Reading,
    format: &'a Format,
}

impl Search<'_> {
    /// The column of the quantity `name`, if there is one; two are a problem, unless one has just that name.
    fn place(&self, name: &'static str) -> Result<Option<Column<'static>>, Problem> {
        if let Some(choice) = self.reading.column(name) {
            return self.chosen(choice, name).map(Some);
        }
        let Some(quantity) = names::quantity(name) else { return Ok(None) };
        let fits = |(at, header): (usize, &String)| quantity.fits(header).map(|(fit, per)| (fit, at, per));
        let mut found: Vec<_> = self.header.names.iter().enumerate().filter_map(fits).collect();
        found.sort_by_key(|(fit, ..)| *fit);
        match found[..] {
            [(first, a, _), (second, b, _), ..] if first == second || first != Fit::Exact => {
                let message = format!("column `{name}` appears twice, as columns {} and {}", a + 1, b + 1);
                let help = format!("keep one of them, or give `{}`", self.reading.given(&self.entry(name, a)));
                Err((codes::RECORD_COLUMN_TWICE, message, help))
            }
            [(_, at, per), ..] => Ok(Some(Column { at, name, conversion: Conversion::unit(per) })),
            [] if name == TIME => Ok(self.header.clock().map(|at| Column::plain(at, name))),
            [] => Ok(None),
        }
    }

    /// The column that the user chose. Its name may look like a number or like a scale.
    fn chosen(&self, choice: &ColumnChoice, name: &'static str) -> Result<Column<'static>, Problem> {
        self.check_name(choice)?;
        self.check_unit(choice)?;
        let plain = choice.conversion.and_then(|conversion| Some((self.at(&choice.column)?, conversion)));
        if let Some((at, conversion)) = plain {
            return Ok(Column { at, name, conversion });
        }
        let scaled = choice.scaled.as_ref().and_then(|scaled| Some((self.at(&scaled.column)?, scaled)));
        let Some((at, scaled)) = scaled else {
            let message =
                format!("{} names `{}` for `{name}`; {}", self.reading.option(), choice.column, self.present());
            let help = "name a column as the file does, or by its number from 1".to_owned();
            return Err((self.format.header, message, help));
        };
        let header = self.header.names.get(at).map_or("", String::as_str);
        let denominator = scaled.denominator.as_deref().unwrap_or_default();
        let per = names::per_denominator(header, denominator).map_err(|own| {
            let option = self.reading.option();
            let message = format!("{option} scales `{header}` per {denominator}, but its unit is {own}");
            (self.format.header, message, "give the factor per unit of the column".to_owned())
        })?;
        Ok(Column { at, name, conversion: Conversion { per, ..scaled.conversion } })
    }

    /// Refuses a name that several columns have.
    fn check_name(&self, choice: &ColumnChoice) -> Result<(), Problem> {
        let scaled = choice.scaled.as_ref().map(|scaled| scaled.column.as_str());
        for name in [choice.column.as_str()].into_iter().chain(scaled) {
            let [first, second, ..] = self.named(name)[..] else { continue };
            let message = format!("`{name}` is the name of columns {} and {}", first + 1, second + 1);
            let help = format!("name it by its number: write {} in place of `{name}`", first + 1);
            return Err((codes::RECORD_COLUMN_TWICE, message, help));
        }
        Ok(())
    }

    /// The column that the user gives another unit than its header does, and that of the header; none of the two if it is
    /// not known.
    fn other_unit(&self, choice: &ColumnChoice) -> Option<(usize, Option<&'static str>)> {
        let named = choice.conversion.and_then(|conversion| Some((self.at(&choice.column)?, conversion.per)));
        let scaled = choice.scaled.as_ref().filter(|scaled| named.is_none() && scaled.denominator.is_none());
        let (at, given) = named.or_else(|| scaled.and_then(|scaled| Some((self.at(&scaled.column)?, scaled.per))))?;
        let (header, quantity) = (self.header.names.get(at)?, names::quantity(choice.quantity)?);
        let Some(unit) = names::own_unit(header) else {
            let is_known = quantity.divided(header).is_some_and(|(_, per)| per == given);
            let is_other = !is_known && scaled.is_none() && names::has_unknown_unit(header);
            return is_other.then_some((at, None));
        };
        let per = quantity.per(unit);
        // A factor may be per unit of another kind.
        (per != Some(given) && (per.is_some() || scaled.is_none())).then_some((at, Some(unit)))
    }

    fn check_unit(&self, choice: &ColumnChoice) -> Result<(), Problem> {
        let Some((at, unit)) = self.other_unit(choice) else { return Ok(()) };
        let (header, name) = (&self.header.names[at], choice.quantity);
        let shown = unit.unwrap_or("not known, or another one");
        let message = format!("{} names `{header}` for `{name}`, but its unit is {shown}", self.reading.option());
        // Every entry with the unit of its column.
        let with_unit = |choice: &ColumnChoice| {
            self.other_unit(choice).map_or_else(|| choice.text.clone(), |(at, _)| self.entry(choice.quantity, at))
        };
        let all: Vec<String> = self.reading.chosen().map(with_unit).collect();
        let rest = match names::quantity(name).and_then(|quantity| quantity.per(unit?)) {
            None => " with the size of its unit in place of 1".to_owned(),
            Some(_) if self.at(&choice.column).is_none() => format!(", followed by scale and offset in {shown}"),
            Some(_) => String::new(),
        };
        let help = format!("give `{}`{rest}", self.reading.given(&all.join(",")));
        Err((self.format.header, message, help))
    }

    /// The places of the columns with this name: as written, or in other letters, or without a unit, which may come from
    /// another line.
    fn named(&self, column: &str) -> Vec<usize> {
        let is_named: [fn(&str, &str) -> bool; 3] = [
            |header, column| header == column,
            |header, column| header.eq_ignore_ascii_case(column),
            |header, column| header.rsplit_once(" [").is_some_and(|(name, _)| name.eq_ignore_ascii_case(column)),
        ];
        let places = |is: &fn(&str, &str) -> bool| -> Vec<usize> {
            let names = self.header.names.iter().enumerate();
            names.filter(|(_, header)| is(header, column)).map(|(at, _)| at).collect()
        };
        is_named.iter().map(places).find(|places| !places.is_empty()).unwrap_or_default()
    }

    /// The place of the first column with this name, or else this number.
    fn at(&self, column: &str) -> Option<usize> {
        let names = &self.header.names;
        let numbered = || column.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
        // In a file without names, any line shows whether it is long enough.
        self.named(column).first().copied().or_else(|| numbered().filter(|at| names.is_empty() || *at < names.len()))
    }

    /// Time between samples, s, if time is computed.
    fn interval(&self, findings: &mut Findings) -> Option<f64> {
        if !self.wanted.iter().any(|w| w.name == TIME) {
            return None;
        }
        let given = self.reading.rate().map(|rate| 1.0 / rate);
        let has_time = matches!(self.place(TIME), Ok(Some(_)));
        if given.is_none() && self.reading.sample_column().is_some() {
            let message = "`--columns` names sample numbers, but the sampling rate is missing".to_owned();
            findings.add(codes::RECORD_HEADER, Some(self.header.line), message, "give `--rate HZ`, too");
        }
        // LabVIEW leaves `X_Value` empty and states the interval.
        let is_empty = |name: &String| name.eq_ignore_ascii_case("x_value");
        let stated = self.header.interval.filter(|_| self.header.names.iter().any(is_empty) || !has_time);
        given.or(stated)
    }

    /// The column with sample numbers, if there is one.
    fn sample_numbers(&self) -> Result<Option<Column<'static>>, Problem> {
        let at = match self.reading.sample_column() {
            Some(choice) => Some(self.chosen(choice, "sample")?.at),
            None => self.header.names.iter().position(|name| names::is_sample_number(name)),
        };
        Ok(at.filter(|_| self.reading.rate().is_some()).map(|at| Column::plain(at, "sample")))
    }

    /// What the header has.
    fn present(&self) -> String {
        let names: Vec<&str> = self.header.names.iter().map(String::as_str).collect();
        if let Some([names, columns]) = self.header.unfit {
            format!("the header has {names} names for {columns} columns")
        } else if names.is_empty() {
            "the file begins with numbers".to_owned()
        } else {
            format!("the header has {}", listed(&names))
        }
    }

    /// Options that assign a column to each of the `missing` quantities. None if there are too few.
    fn suggested(&self, missing: &[&'static str], found: &[Option<Column>]) -> Option<String> {
        let is_taken = |at: usize| found.iter().flatten().any(|column| column.at == at);
        let is_sample = |at: usize| self.header.names.get(at).is_some_and(|name| names::is_sample_number(name));
        let mut free: Vec<(usize, Shape)> = self.header.filled.clone();
        free.retain(|(at, _)| !is_taken(*at) && !is_sample(*at));
        let counts_samples = self.header.names.iter().any(|name| names::is_sample_number(name));
        let is_time = |at: usize| self.resemblance(TIME, at) > 0;
        let few = free.len() < missing.len() && !free.iter().any(|(at, _)| is_time(*at));
        let mut rate = missing.contains(&TIME) && (counts_samples || few);
        let mut entries = Vec::new();
        for &name in missing {
            if rate && name == TIME {
                continue;
            }
            let of = |(at, shape): &(usize, Shape)| (self.likelihood(name, *at, *shape), *at);
            // The first of equals.
            let is_rate = |at: usize| self.header.names.get(at).is_some_and(|name| names::is_rate(name));
            let is_kind = |at: usize| is_rate(at) == name.contains("/s") && (name == TIME || !is_time(at));
            let other = free.iter().filter(|(at, _)| is_kind(*at));
            let best = other.map(of).rev().max_by_key(|(likelihood, _)| *likelihood);
            match best {
                Some((likelihood, _)) if name == TIME && likelihood < 0 => rate = true,
                Some((_, at)) => {
                    free.retain(|(other, _)| *other != at);
                    entries.push(self.entry(name, at));
                }
                None => return None,
            }
        }
        let kept: Vec<String> = self.reading.chosen().map(|choice| choice.text.clone()).chain(entries).collect();
        let columns = self.reading.given(&kept.join(","));
        let options = [(!kept.is_empty()).then_some(columns), rate.then(|| "--rate HZ".to_owned())];
        Some(options.into_iter().flatten().collect::<Vec<_>>().join(" ")).filter(|options| !options.is_empty())
    }

    /// How likely a column holds the quantity `name`: by its name, its unit, and its first samples.
    fn likelihood(&self, name: &'static str, at: usize, shape: Shape) -> i32 {
        let header = self.header.names.get(at).map_or("", String::as_str);
        let Some(quantity) = names::quantity(name) else { return 0 };
        let by_name = if self.near(name) == Some(at) { 100 } else { 40 * self.resemblance(name, at) };
        let by_unit = match names::own_unit(header) {
            Some(unit) if quantity.per(unit).is_some() => 30,
            Some(_) => -40,
            None if name == TIME && names::has_unknown_unit(header) => -40,
            None => 0,
        };
        let by_samples = match shape {
            Shape::Rising | Shape::Clock if name == TIME => 20,
            Shape::Unknown => 0,
            Shape::Counting | Shape::Other if name == TIME => -200,
            Shape::Constant if name != TIME => -20,
            Shape::Constant | Shape::Clock => -200,
            Shape::Counting => -100,
            Shape::Rising | Shape::Other => 0,
        };
        by_name + by_unit + by_samples
    }

    /// Whether the name of a column has a word for the quantity `name` (1), for another one (-1), or neither (0).
    fn resemblance(&self, name: &str, at: usize) -> i32 {
        let header = self.header.names.get(at);
        header.and_then(|header| Some(names::quantity(name)?.resemblance(header))).unwrap_or_default()
    }

    /// The entry of `--columns` for a quantity in a column, with the unit of the column. If that is of another quantity,
    /// or not known, it gets a factor of 1; a header such as `-displacement (um)`, one of -1.
    fn entry(&self, name: &'static str, at: usize) -> String {
        let header = self.header.names.get(at).map_or("", String::as_str);
        let Some(quantity) = names::quantity(name) else { return String::new() };
        let (plain, word) = (quantity.plain(), self.word(at));
        let one = if header.starts_with(names::MINUS) { "-1" } else { "1" };
        let of_rate = || names::unit_in_brackets(header).filter(|unit| quantity.per(unit).is_some());
        match names::own_unit(header).map(str::to_owned).or_else(of_rate).as_deref() {
            Some(unit) if quantity.per(unit).is_some() && one == "-1" => format!("{plain}={word}*-1 {unit}"),
            Some(unit) if quantity.per(unit).is_some() => format!("{plain}_{unit}={word}"),
            Some(unit) => format!("{plain}={word}*{one} {}/{unit}", quantity.unit()),
            None if one == "-1" || has_other_unit(header, quantity) || names::has_unknown_unit(header) => {
                format!("{plain}={word}*{one} {}", quantity.unit())
            }
            None => format!("{name}={word}"),
        }
    }

    /// How `--columns` names a column: by its header, unless that has a letter with a meaning there or in a message.
    fn word(&self, at: usize) -> String {
        let names = &self.header.names;
        let is_plain = |name: &&String| {
            let is_trimmed = !name.is_empty() && name.trim() == name.as_str();
            is_trimmed && !name.contains(['=', '`', '\'', '\n']) && self.named(name) == [at]
        };
        names.get(at).filter(is_plain).cloned().unwrap_or_else(|| (at + 1).to_string())
    }

    /// The column whose name is the most similar to `name`, if one is similar.
    fn near(&self, name: &'static str) -> Option<usize> {
        let plain = names::quantity(name)?.plain();
        let lower = name.to_ascii_lowercase();
        // Of another quantity.
        let taken = |header: &str| {
            self.wanted
                .iter()
                .filter_map(|w| names::quantity(w.name))
                .any(|q| q.fits(header).is_some() || q.plain() != plain && q.is_named(header))
        };
        let headers = self.header.names.iter().enumerate();
        headers
            .filter(|(_, header)| !header.is_empty() && !header.starts_with(names::MINUS) && !taken(header))
            .map(|(at, header)| (strsim::damerau_levenshtein(&header.to_ascii_lowercase(), &lower), at, header))
            .filter(|(distance, _, header)| *distance < NEAR || header.to_ascii_lowercase().starts_with(plain))
            .min()
            .map(|(_, at, _)| at)
    }

    /// How to provide the column `name`; `suggested` are options that do.
    fn help(&self, name: &'static str, suggested: Option<&str>) -> String {
        let names = &self.header.names;
        let size =
            |options: &str| if options.contains("*1 ") { " with the size of its unit in place of 1" } else { "" };
        let or_give = suggested.map(|given| format!(", or give `{given}`{}", size(given))).unwrap_or_default();
        if names.is_empty() {
            let wanted: Vec<&str> = self.wanted.iter().filter(|w| w.required).map(|w| w.name).collect();
            return format!("the first line must be the header `{}`{or_give}", wanted.join(","));
        }
        if name == TIME && names.iter().any(|name| names::is_sample_number(name)) {
            return format!("the file has sample numbers: give `{}`", suggested.unwrap_or("--rate HZ"));
        }
        let Some(quantity) = names::quantity(name) else { return String::new() };
        if let Some(rate) = names.iter().find(|header| names::is_rate(header) && quantity.unit() == "um") {
            return format!("`{rate}` is a rate: record or export `{name}` itself{or_give}");
        }
        match self.near(name).map(|at| &names[at]) {
            Some(header) if has_other_unit(header, quantity) => {
                let all = quantity.all_names();
                format!("the unit of `{header}` is not known: convert it to one of {all}{or_give}")
            }
            Some(header) => format!("rename `{header}` to `{name}` if that is what it holds{or_give}"),
            None if suggested.is_none() && (0..names.len()).all(|at| self.resemblance(name, at) <= 0) => {
                format!(
                    "record it as well, in a column `{name}`, whose unit is part of the name: no column seems to hold it"
                )
            }
            None => format!("name the column that holds it `{name}`; the unit is part of the name{or_give}"),
        }
    }
}

/// Whether `header` names `quantity` followed by other text.
fn has_other_unit(header: &str, quantity: &Quantity) -> bool {
    header
        .rsplit_once(['_', ' ', '(', '[', '/'])
        .is_some_and(|(name, unit)| name.trim().eq_ignore_ascii_case(quantity.plain()) && !unit.trim().is_empty())
}

fn listed(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{self, RECORD};
    use crate::signals::{optional, required};

    const WANTED: [ColumnSpec; 4] = [required(TIME), required(DRIVE), optional(MONITOR), required("displacement_um")];

    #[test]
    fn suggestions_assign_every_missing_column() {
        for (text, options) in [
            ("tme_s,U,y\n0,1,2\n", "`--columns time_s=tme_s,drive_V=U,displacement_um=y`"),
            ("Time,s;Ch 1,V;Ch2,V\n0;1;2\n", "`--columns 'drive_V=Ch 1,V,displacement=Ch2,V*1 um/V'`"),
            ("Time,s;Ch1 [m];Ch2,mV\n0;1;2\n", "`--columns 'drive_mV=Ch2,mV,displacement_m=Ch1 [m]'`"),
            ("time_s,drive_V,gauge_V\n0,1,2\n", "`--columns 'displacement=gauge_V*1 um/V'`"),
            (
                "No.,Sensor,Voltage,Start [d]\n0,3,4,0.1\n",
                "`--columns 'time_d=Start [d],drive_V=Voltage,displacement_um=Sensor'`",
            ),
            ("a,b,c\n4,0,.5\n3,0,.7\n2,0,.9\n", "`--columns time_s=c,drive_V=a,displacement_um=b`"),
            ("X,CH1,CH2 [V]\n0,5,1\n1,7,2\n2,5,4\n", "`--columns 'drive_V=CH2 [V],displacement_um=CH1' --rate HZ`"),
            (
                "a,H (Oe),M (emu)\n0,5,1\n1,7,2\n2,5,4\n",
                "`--columns 'drive=H (Oe)*1 V,displacement=M (emu)*1 um' --rate HZ`",
            ),
            (
                "Time (s),Voltage (V),Gauge (V)\n0,0,1\n1,0,2\n2,0,4\n",
                "`--columns 'drive_V=Voltage (V),displacement=Gauge (V)*1 um/V'`",
            ),
            ("a,b,c\n4,5,0\n3,7,0\n2,5,0\n", "`--columns drive_V=a,displacement_um=b --rate HZ`"),
            ("X_Value,Voltage,Weg\n0,0,0\n1,1,0\n2,0,0\n", "`--columns drive_V=Voltage,displacement_um=Weg`"),
            (",0,1,2\n", "`--columns time_s=2,drive_V=3,displacement_um=4`"),
            ("\u{a0}a;U;y\n0;1;2\n", "`--columns time_s=1,drive_V=U,displacement_um=y`"),
            (";a;a;x=1\n7;1;2;3\n", "`--columns time_s=1,drive_V=2,displacement_um=3`"),
            ("row,names\n1,0.5,5.5,2.5\n", "`--columns time_s=1,drive_V=2,displacement_um=3`"),
            ("a,b\n1,2\n", "`--columns drive_V=a,displacement_um=b --rate HZ`"),
            ("sample,a,b\n0,1,2\n", "`--columns drive_V=a,displacement_um=b --rate HZ`"),
            ("time_s,drive_V,displacement_ft\n0,1,2\n", "`--columns 'displacement=displacement_ft*1 um'`"),
            ("time_s,drive_V,-Displacement (nm)\n0,1,2\n", "`--columns 'displacement=-Displacement (nm)*-1 nm'`"),
            ("time_s,Vib [ m/s ],Amp,y\n0,1,2,3\n", "`--columns drive_V=Amp,displacement_um=y`"),
        ] {
            let all = found(text, &Reading::default()).unwrap_err();
            assert!(all.iter().all(|one| one.contains(options)), "{text}: {all:?}");
        }
        let some = Reading::new(&["drive_V=b".to_owned()], None).unwrap();
        let all = found("a,b,c\n1,2,3\n", &some).unwrap_err();
        assert!(all[0].contains("--columns drive_V=b,time_s=a,displacement_um=c"), "{all:?}");
    }

    #[test]
    fn without_a_column_for_each_quantity_nothing_is_suggested() {
        let all = found("Time,Ampl\n0,5\n1,7\n2,5\n", &Reading::default()).unwrap_err();
        assert!(all.iter().all(|one| !one.contains("--columns")), "{all:?}");
    }

    fn found(text: &str, reading: &Reading) -> Result<Vec<Option<usize>>, Vec<String>> {
        let mut findings = Findings::new("r.csv");
        let (header, _) = columns::open(text.as_bytes(), &RECORD, &mut findings).unwrap();
        let places = find(&header, &WANTED, (reading, &RECORD), &mut findings);
        let all = findings.into_diagnostics();
        assert_eq!(places.is_none(), !all.is_empty());
        let problems = all.into_iter().map(|d| format!("{} / {}", d.message, d.help)).collect();
        places.map(|p| p.columns.iter().map(|c| c.map(|c| c.at)).collect()).ok_or(problems)
    }

    #[test]
    fn order_case_and_extra_columns_do_not_matter() {
        let plain = Reading::default();
        assert_eq!(found("note,Displacement_UM, TIME_S,drive_v", &plain), Ok(vec![Some(2), Some(3), None, Some(1)]));
        assert_eq!(found("t (ms);monitor_mV;Position [nm]", &plain), Ok(vec![Some(0), None, Some(1), Some(2)]));
        let reading = Reading::new(&["drive_V=B".to_owned(), "displacement_nm=1".to_owned()], Some(1e3)).unwrap();
        assert_eq!(found("a,b,sample", &reading), Ok(vec![Some(2), Some(1), None, Some(0)]));
        assert_eq!(found("a,b,c", &reading), Ok(vec![None, Some(1), None, Some(0)]));
    }

    #[test]
    fn near_misses_units_and_numbers_get_their_own_advice() {
        let help = |header: &str| found(header, &Reading::default()).unwrap_err()[0].clone();
        assert!(help("tme_s,drive_V,displacement_um").contains("rename `tme_s` to `time_s`"));
        assert!(help("time_s,drive_V,displacement_foot").contains("`displacement_um`, `displacement_nm`"));
        assert!(help("time_s,drive_V,displacement").contains("rename `displacement` to `displacement_um`"));
        assert!(help("0.0,1.0,2.0").contains("first line must be the header"));
        assert!(help("sample,drive_V,displacement_um").contains("--rate HZ"));
        assert!(help("time_s,time_s,drive_V,displacement_um").contains("appears twice"));
        assert!(help("time_s,drive_V").contains("column `displacement_um` is missing"));
        let reading = Reading::new(&["force_N=1".to_owned(), "drive_V=9".to_owned()], None).unwrap();
        let all = found("time_s,drive_V,displacement_um", &reading).unwrap_err();
        assert!(all[0].contains("`force_N`") && all[1].contains("names `9` for `drive_V`"), "{all:?}");
    }
}
