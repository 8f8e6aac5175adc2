//! Whether the fields of the rows are below the names: more numbers than names, or fewer fields between blanks, have
//! another meaning than their places say.

use super::head::{BLANK, Head, Line, decoded, has_fields, is_row, split};
use super::names::plain;
use super::number::{clock, is_date, number};

/// How names of columns begin that may have no values.
const REMARKS: [&str; 8] = ["comment", "remark", "note", "event", "marker", "flag", "start", "increment"];
/// Rows that are checked for decimal commas.
const ROWS: usize = 10;

impl Head {
    /// The line, the message and the help if commas are both decimal signs and separators in the `lines` of samples.
    pub(super) fn ambiguous_commas(&self, lines: &[Line]) -> Option<(usize, String, String)> {
        let count = self.names.len();
        let rows: Vec<&Line> = lines.iter().filter(|(_, line)| has_fields(line)).take(ROWS).collect();
        let all = |is: &dyn Fn(&[u8]) -> bool| rows.iter().all(|(_, line)| is(line));
        // Without names, `0,007` has the digits of decimals.
        let is_decimals = |field: &&[u8]| matches!(field, [b'0', _, ..]) && field.iter().all(u8::is_ascii_digit);
        let is_time = |field: &&[u8]| is_date(field) || clock(&decoded(field)).is_some();
        let has_decimals = |fields: &[&[u8]]| fields.iter().skip(1).any(is_decimals) && !fields.iter().any(is_time);
        let is_ambiguous = match count {
            0 => !all(&|line| !has_decimals(&split(line, b','))),
            _ => all(&|line| filled(&split(line, b',')) > count),
        };
        let (number, line) = rows.first()?;
        let is_integers = all(&|line| is_row(line, b',') && !line.contains(&b'.'));
        if self.separator != b',' || !is_integers || !is_ambiguous {
            return None;
        }
        let fields: Vec<String> = split(line, b',').into_iter().map(decoded).collect();
        let fixed: Vec<String> = fields.chunks(2).map(|pair| pair.join(",")).collect();
        let example = match fields.len() {
            pairs if pairs == 2 * count => format!("; this line is then `{}`", fixed.join(";")),
            one_more if one_more == count + 1 => ", or name every column".to_owned(),
            _ => String::new(),
        };
        let columns = if count > 0 { format!("{count} columns") } else { "columns without names".to_owned() };
        let message = format!(
            "has {} numbers for {columns}: a comma seems to be the decimal sign, and the separator, too",
            fields.len()
        );
        let help = format!("export with semicolons or tabs between the columns, or with decimal points{example}");
        Some((*number, message, help))
    }

    /// Takes the names as not given if they are not above the fields of the first of the `lines`: as of R, which does not
    /// name the column of row names, or with blanks or commas within them. No row then has a field for the last name.
    pub(super) fn drop_unfit_names(&mut self, lines: &[Line]) {
        let mut rows = lines.iter().filter(|(_, line)| has_fields(line)).map(|(_, line)| split(line, self.separator));
        let Some(fields) = rows.next().filter(|_| !self.names.is_empty()) else { return };
        let is_remark = |name: &String| {
            let name = plain(name);
            name.is_empty() || REMARKS.iter().any(|begin| name.starts_with(begin))
        };
        let longest = rows.fold(fields.len(), |longest, row| if row.len() > longest { row.len() } else { longest });
        let has_more_names = !self.names.iter().skip(longest).all(is_remark);
        if has_more_names || misaligned(&fields, self.names.len(), self.separator).is_some() {
            self.unfit = Some([self.names.len(), fields.len()]);
            self.names.clear();
        }
    }
}

/// Number of fields up to the last that is not empty.
fn filled(fields: &[&[u8]]) -> usize {
    fields.iter().rposition(|field| !field.is_empty()).map_or(0, |last| last + 1)
}

/// Help for a row whose fields do not match `count` columns. A text behind them is a remark.
pub(super) fn misaligned(fields: &[&[u8]], count: usize, separator: u8) -> Option<&'static str> {
    let is_number = |field: &&[u8]| number(&decoded(field), separator).is_some();
    if fields.iter().skip(count).any(is_number) {
        return Some("one value to each column, a point as decimal sign, and a name for every column");
    }
    let is_short = separator == BLANK && fields.len() < count;
    is_short.then_some("complete the line, or write commas between the columns, so that an empty one shows")
}
