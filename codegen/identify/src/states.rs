//! Reads states of a platform: a CSV file of eighteen columns with a line of names, in SI units.

use crate::columns::{self, Column, Format, RECORD};
use crate::findings::Findings;
use specgen_language::diagnostic::{Diagnostic, codes};

/// Pose, rate and acceleration of the six coordinates: m and rad, per s, per s².
pub type State = [[f64; 6]; 3];

const FORMAT: Format = Format { preamble: false, ..RECORD };
const COLUMNS: usize = 18;
const HELP: &str =
    "write 18 names, of pose, rate and acceleration in x, y, z, θx, θy, θz, such as `x,y,z,rx,ry,rz,vx,…`";

/// States from the text of their file, in order.
///
/// # Errors
/// All findings of the file.
pub fn parse(text: &str, shown_as: &str) -> Result<Vec<State>, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    let states = columns::open(text.as_bytes(), &FORMAT, &mut findings).and_then(|(header, lines)| {
        let names: Vec<Column> = header.names.iter().enumerate().map(|(at, name)| Column::plain(at, name)).collect();
        let is_number = |name: &&String| name.parse::<f64>().is_ok();
        let wrong = if let Some(number) = header.names.iter().find(is_number) {
            format!("the first line names the columns, but `{number}` is a number")
        } else if names.len() != COLUMNS {
            format!("there are {} columns, expected {COLUMNS}", names.len())
        } else {
            let columns = lines.read(&names, &mut findings).columns;
            let count = columns.first().map_or(0, Vec::len);
            let state = |row: usize| -> State {
                core::array::from_fn(|part| core::array::from_fn(|axis| columns[6 * part + axis][row]))
            };
            return Some((0..count).map(state).collect());
        };
        findings.refuse(codes::RECORD_HEADER, Some(header.line), wrong, HELP)
    });
    findings.conclude(states).map(|(states, _)| states)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(first: &str) -> String {
        format!("{first}{}", ",0".repeat(17))
    }

    #[test]
    fn states_are_pose_rate_and_acceleration() {
        let names = (0..18).map(|k| format!("c{k}")).collect::<Vec<_>>().join(",");
        let numbers = (0..18).map(|k| k.to_string()).collect::<Vec<_>>().join(",");
        let states = parse(&format!("# a comment\n{names}\n{numbers}\n"), "s.csv").unwrap();
        assert_eq!((states.len(), states[0][0][0], states[0][1][0], states[0][2][5]), (1, 0.0, 6.0, 17.0));
        let found = parse(&format!("{names}\n{}\n", row("NaN")), "s.csv").unwrap_err();
        assert!(found[0].message.contains("`c0` is `NaN`"), "{found:?}");
    }

    #[test]
    fn a_file_without_names_is_refused() {
        let found = parse(&format!("{}\n{}\n", row("0"), row("1")), "s.csv").unwrap_err();
        assert!(found[0].message.contains("names the columns") && found[0].help.contains("18 names"), "{found:?}");
    }
}
