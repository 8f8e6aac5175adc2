//! Assigns the columns of a file: by the user's choice, otherwise by their names.

use super::{ColumnSpec, TIME};
use crate::columns::names::{self, Quantity};
use crate::columns::{Column, Head};
use crate::findings::Findings;
use crate::reading::Reading;
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
pub(super) fn find(header: &Head, wanted: &[ColumnSpec], reading: &Reading, findings: &mut Findings) -> Option<Places> {
    let search = Search { header, wanted, reading };
    let line = Some(header.line);
    let names: Vec<&str> = wanted.iter().map(|w| w.name).collect();
    for unknown in reading.unknown(&names) {
        let message = format!("`--columns` names `{unknown}`, which this kind of record does not have");
        findings.add(codes::RECORD_HEADER, line, message, &format!("it has {}", listed(&names)));
    }
    let interval = search.interval(findings);
    let mut columns = Vec::new();
    let measured = names.contains(&MONITOR) && matches!(search.place(MONITOR), Ok(Some(_)));
    for w in wanted {
        let counted = w.name == TIME && interval.is_some();
        let found = if counted { search.sample_numbers() } else { search.place(w.name) };
        if matches!(found, Ok(None)) && w.required && !counted && !(w.name == DRIVE && measured) {
            let message = format!("column `{}` is missing; {}", w.name, search.present());
            findings.add(codes::RECORD_HEADER, line, message, &search.help(w.name));
        }
        columns.push(found.unwrap_or_else(|(code, message, help)| findings.refuse(code, line, message, help)));
    }
    if findings.any_error() { None } else { Some(Places { columns, interval }) }
}

/// Code, message and help of a finding about the header.
type Problem = (Code, String, &'static str);

struct Search<'a> {
    header: &'a Head,
    wanted: &'a [ColumnSpec],
    reading: &'a Reading,
}

impl Search<'_> {
    /// The column of the quantity `name`, if there is one; two that fit equally well are a problem.
    fn place(&self, name: &'static str) -> Result<Option<Column<'static>>, Problem> {
        if let Some((column, per)) = self.reading.column(name) {
            return self.chosen(column, name).map(|at| Some(Column { at, name, per }));
        }
        let Some(quantity) = names::quantity(name) else { return Ok(None) };
        let fits = |(at, header): (usize, &String)| quantity.fits(header).map(|(fit, per)| (fit, at, per));
        let mut found: Vec<_> = self.header.names.iter().enumerate().filter_map(fits).collect();
        found.sort_by_key(|(fit, ..)| *fit);
        match found[..] {
            [(first, a, _), (second, b, _), ..] if first == second => {
                let message = format!("column `{name}` appears twice, as columns {} and {}", a + 1, b + 1);
                Err((codes::RECORD_COLUMN_TWICE, message, "keep one of them"))
            }
            [(_, at, per), ..] => Ok(Some(Column { at, name, per })),
            [] => Ok(None),
        }
    }

    /// The place of the column that the user named `column`.
    fn chosen(&self, column: &str, name: &str) -> Result<usize, Problem> {
        let names = &self.header.names;
        let named = names.iter().position(|header| header.eq_ignore_ascii_case(column));
        let numbered = || column.parse::<usize>().ok().and_then(|number| number.checked_sub(1));
        // In a file without names, any line shows whether it is long enough.
        let found = named.or_else(|| numbered().filter(|at| names.is_empty() || *at < names.len()));
        found.ok_or_else(|| {
            let message = format!("`--columns` names `{column}` for `{name}`; {}", self.present());
            (codes::RECORD_HEADER, message, "name a column as the file does, or by its number from 1")
        })
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
            Some(column) => Some(self.chosen(column, "sample")?),
            None => self.header.names.iter().position(|name| names::is_sample_number(name)),
        };
        Ok(at.filter(|_| self.reading.rate().is_some()).map(|at| Column::plain(at, "sample")))
    }

    /// What the header has.
    fn present(&self) -> String {
        let names: Vec<&str> = self.header.names.iter().map(String::as_str).collect();
        if names.is_empty() {
            "the file begins with numbers".to_owned()
        } else {
            format!("the header has {}", listed(&names))
        }
    }

    /// How to provide the column `name`.
    fn help(&self, name: &'static str) -> String {
        let names = &self.header.names;
        let wanted: Vec<&str> = self.wanted.iter().filter(|w| w.required).map(|w| w.name).collect();
        if names.is_empty() {
            let columns: Vec<String> = wanted.iter().enumerate().map(|(k, name)| format!("{name}={}", k + 1)).collect();
            return format!(
                "the first line must be the header `{}`; or give `--columns {}`",
                wanted.join(","),
                columns.join(",")
            );
        }
        if name == TIME && names.iter().any(|name| names::is_sample_number(name)) {
            return "the file has sample numbers: give `--rate HZ`".to_owned();
        }
        let Some(quantity) = names::quantity(name) else { return String::new() };
        let plain = quantity.plain();
        let lower = name.to_ascii_lowercase();
        let taken = |header: &str| {
            self.wanted.iter().any(|w| names::quantity(w.name).is_some_and(|q| q.fits(header).is_some()))
        };
        let near = names
            .iter()
            .filter(|header| !header.is_empty() && !taken(header))
            .map(|header| (strsim::damerau_levenshtein(&header.to_ascii_lowercase(), &lower), header))
            .filter(|(distance, header)| *distance < NEAR || header.to_ascii_lowercase().starts_with(plain))
            .min();
        match near {
            Some((_, header)) if has_other_unit(header, quantity) => {
                format!("the unit of `{header}` is not known: convert it to one of {}", quantity.all_names())
            }
            Some((_, header)) => {
                format!("rename `{header}` to `{name}` if that is what it holds, or give `--columns {name}={header}`")
            }
            None => format!(
                "name the column that holds it `{name}`, or give `--columns {name}=COLUMN`; the unit is part of the name"
            ),
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

    const WANTED: [ColumnSpec; 4] = [
        ColumnSpec { name: TIME, required: true },
        ColumnSpec { name: DRIVE, required: true },
        ColumnSpec { name: MONITOR, required: false },
        ColumnSpec { name: "displacement_um", required: true },
    ];

    fn found(text: &str, reading: &Reading) -> Result<Vec<Option<usize>>, Vec<String>> {
        let mut findings = Findings::new("r.csv");
        let (header, _) = columns::open(text.as_bytes(), &RECORD, &mut findings).unwrap();
        let places = find(&header, &WANTED, reading, &mut findings);
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
        assert!(help("time_s,drive_V,displacement_inch").contains("`displacement_um`, `displacement_nm`"));
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
