//! The choice of one table of a file that has several: by the user, otherwise the longest.

use super::findings::Findings;
use specgen_language::diagnostic::codes;

/// A table of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Extent {
    /// Its title, struct or group; may be empty.
    pub(crate) name: String,
    /// Number of its samples.
    pub(crate) rows: usize,
    /// Names of its columns; empty if it has none.
    pub(crate) columns: Vec<String>,
    /// Line of its first sample in a text.
    pub(crate) first_line: Option<usize>,
}

/// What the user chose of a file by `--series`: a table, a stretch of it between gaps, or both, as in `2.3`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Choice {
    /// Index of the table.
    pub(crate) table: usize,
    /// Number of tables, if there are several.
    pub(crate) of: usize,
    /// Number of the stretch, from 1; the longest if none.
    pub(crate) stretch: Option<usize>,
}

impl Choice {
    /// The value of `--series` that chooses a stretch of the table.
    pub(crate) fn series_of(self, stretch: usize) -> String {
        if self.of > 1 { format!("{}.{stretch}", self.table + 1) } else { stretch.to_string() }
    }
}

/// Most items of a list in a message.
const LISTED: usize = 8;

/// A list for a message.
pub(crate) fn listed(items: &[String]) -> String {
    let more = items.len().saturating_sub(LISTED);
    let list = items[..items.len() - more].join(", ");
    if more > 0 { format!("{list} and {more} more") } else { list }
}

impl Extent {
    fn in_words(&self, index: usize) -> String {
        let name = if self.name.is_empty() { String::new() } else { format!(" `{}`", self.name) };
        let place = self.first_line.map(|line| format!(" from line {line}")).unwrap_or_default();
        let columns: Vec<String> = self.columns.iter().map(|name| format!("`{name}`")).collect();
        let of = if columns.is_empty() { String::new() } else { format!(" of {}", listed(&columns)) };
        let rows = if self.rows == 1 { "row" } else { "rows" };
        format!("{}{name} ({} {rows}{of}{place})", index + 1, self.rows)
    }
}

/// The table that is read: `series`, a name or a number from 1, or else the longest; and the stretch of it. `is_known`:
/// whether its names are those of a record. A note lists the others, and what was left out. `None` after the problem was
/// reported.
pub(crate) fn choose(
    all: &[Extent],
    is_known: impl Fn(&Extent) -> bool,
    left_out: &[String],
    series: Option<&str>,
    findings: &mut Findings,
) -> Option<Choice> {
    let is_one_of = all.len() > 1;
    let whole = |table| Choice { table, of: all.len(), stretch: None };
    let words = |but: Option<usize>| -> Vec<String> {
        let others = all.iter().enumerate().filter(|(index, _)| Some(*index) != but);
        others.map(|(index, table)| table.in_words(index)).collect()
    };
    if let Some(series) = series {
        let named = all.iter().position(|table| table.name.eq_ignore_ascii_case(series.trim()));
        let number = |text: &str| text.parse::<usize>().ok().filter(|number| *number > 0);
        let numbered = || match series.trim().split_once('.') {
            Some((table, stretch)) => Some(Choice { stretch: Some(number(stretch)?), ..whole(number(table)? - 1) }),
            None if is_one_of => Some(whole(number(series.trim())? - 1)),
            None => Some(Choice { stretch: Some(number(series.trim())?), ..whole(0) }),
        };
        let numbered = || numbered().filter(|choice| choice.table < all.len());
        // A note names stretches and tables by their numbers, so that a name which is a number comes second.
        return numbered().or_else(|| named.map(whole)).or_else(|| {
            let message = format!("`--series` names `{series}`; the file has {}", listed(&words(None)));
            findings.refuse(codes::RECORD_HEADER, None, message, "name a table of the file by its name or number")
        });
    }
    // The first of equals.
    let chosen =
        all.iter().enumerate().rev().max_by_key(|(_, table)| (is_known(table), table.rows)).map(|(index, _)| index)?;
    let mut parts = Vec::new();
    if is_one_of {
        parts.push(format!(
            "table {} is read; not read: {}",
            all[chosen].in_words(chosen),
            listed(&words(Some(chosen)))
        ));
    }
    if !left_out.is_empty() {
        parts.push(format!("left out: {}", listed(left_out)));
    }
    if !parts.is_empty() {
        let help = if is_one_of {
            format!("`--series {}` reads another table", if chosen == 0 { 2 } else { 1 })
        } else {
            "check that the record needs none of them".to_owned()
        };
        findings.add(codes::RECORD_PART, None, parts.join("; "), &help);
    }
    Some(whole(chosen))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_table_is_read_unless_the_user_names_one() {
        let table = |name: &str, rows, first_line| Extent {
            name: name.to_owned(),
            rows,
            columns: vec!["a".to_owned()],
            first_line: Some(first_line),
        };
        let all = [table("R, C", 3, 2), table("20 Hz", 500, 8), table("7", 500, 600)];
        let choose = |series: Option<&str>| {
            let mut findings = Findings::new("r.csv");
            let found = choose(&all, |_| false, &["`s` (a text)".to_owned()], series, &mut findings);
            let found = found.map(|choice| (choice.table, choice.stretch));
            (found, findings.into_diagnostics())
        };
        let (found, notes) = choose(None);
        assert_eq!((found, notes[0].code), (Some((1, None)), codes::RECORD_PART.id));
        for word in ["table 2 `20 Hz` (500 rows of `a` from line 8)", "3 `7`", "left out: `s` (a text)"] {
            assert!(notes[0].message.contains(word), "{}", notes[0].message);
        }
        assert_eq!(choose(Some("3")), (Some((2, None)), Vec::new()));
        assert_eq!(choose(Some("2.4")), (Some((1, Some(4))), Vec::new()));
        // A table that is called as a number hides no other one, and no stretch.
        assert_eq!(choose(Some("7")), (Some((2, None)), Vec::new()));
        let single = [table("3", 500, 1)];
        let of_single = |series| {
            let found = super::choose(&single, |_| false, &[], Some(series), &mut Findings::new("r.csv")).unwrap();
            (found.table, found.stretch)
        };
        assert_eq!([of_single("3"), of_single("2")], [(0, Some(3)), (0, Some(2))]);
        let (found, refused) = choose(Some("4"));
        assert!(
            found.is_none() && refused[0].code == codes::RECORD_HEADER.id && refused[0].message.contains("1 `R, C`"),
            "{refused:?}"
        );
    }
}
