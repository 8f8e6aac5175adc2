//! Finds the three columns of a record by their header names.

use super::findings::Findings;
use specgen_language::diagnostic::codes;

/// Time of the sample, s.
pub(crate) const TIME: usize = 0;
/// Drive, V.
pub(crate) const DRIVE: usize = 1;
/// Displacement, µm.
pub(crate) const DISPLACEMENT: usize = 2;

/// Header names in the order of [`TIME`], [`DRIVE`], [`DISPLACEMENT`].
pub(crate) const NAMES: [&str; 3] = ["time_s", "drive_V", "displacement_um"];

/// Headers closer than this many edits to a wanted one are suggested.
const NEAR: usize = 4;

/// Positions of the three columns in a header, or `None` after every problem was reported.
pub(crate) fn locate(header: &csv::StringRecord, line: usize, findings: &mut Findings) -> Option<[usize; 3]> {
    let wanted = NAMES.map(|name| find(header, name, line, findings));
    match wanted {
        [Some(time), Some(drive), Some(displacement)] => Some([time, drive, displacement]),
        _ => None,
    }
}

fn find(header: &csv::StringRecord, name: &str, line: usize, findings: &mut Findings) -> Option<usize> {
    let matching: Vec<usize> = (0..header.len()).filter(|&i| header[i].trim().eq_ignore_ascii_case(name)).collect();
    match matching[..] {
        [only] => return Some(only),
        [] => {}
        [first, second, ..] => {
            let message = format!("column `{name}` appears twice, as columns {} and {}", first + 1, second + 1);
            findings.add(codes::RECORD_COLUMN_TWICE, Some(line), message, "keep one of them");
            return None;
        }
    }
    let present: Vec<String> = header.iter().map(|h| format!("`{}`", h.trim())).collect();
    let message = format!("column `{name}` is missing; the header has {}", present.join(", "));
    findings.add(codes::RECORD_HEADER, Some(line), message, &missing_column_help(header, name));
    None
}

fn missing_column_help(header: &csv::StringRecord, name: &str) -> String {
    if header.len() == 1 && (header[0].contains(';') || header[0].contains('\t')) {
        return "separate the columns by commas and write numbers with a decimal point".to_owned();
    }
    if (0..header.len()).any(|i| header[i].trim().parse::<f64>().is_ok()) {
        return format!("the first line must be the header `{}`", NAMES.join(","));
    }
    let quantity = name.split('_').next().unwrap_or(name);
    let lower = name.to_ascii_lowercase();
    let near = header
        .iter()
        .map(str::trim)
        .filter(|h| !NAMES.iter().any(|other| h.eq_ignore_ascii_case(other)))
        .map(|h| (strsim::damerau_levenshtein(&h.to_ascii_lowercase(), &lower), h))
        .filter(|(distance, h)| *distance < NEAR || h.to_ascii_lowercase().starts_with(quantity))
        .min();
    match near {
        Some((_, h)) if other_unit(h, name) => {
            format!("`{h}` seems to be in another unit: convert it and name the column `{name}`")
        }
        Some((_, h)) => format!("rename `{h}` to `{name}` if that is what it holds"),
        None => format!("name the column that holds it `{name}`; the unit is part of the name"),
    }
}

/// Whether `header` names the same quantity as `name` with another unit behind the underscore.
fn other_unit(header: &str, name: &str) -> bool {
    match (header.rsplit_once('_'), name.rsplit_once('_')) {
        (Some((quantity, unit)), Some((wanted, wanted_unit))) => {
            quantity.eq_ignore_ascii_case(wanted) && !unit.eq_ignore_ascii_case(wanted_unit)
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn help(header: &[&str]) -> Vec<String> {
        let mut findings = Findings::new("r.csv");
        let found = locate(&csv::StringRecord::from(header.to_vec()), 1, &mut findings);
        let all = findings.into_diagnostics();
        assert_eq!(found.is_none(), !all.is_empty());
        all.into_iter().map(|d| format!("{} / {}", d.message, d.help)).collect()
    }

    #[test]
    fn order_case_and_extra_columns_do_not_matter() {
        let header = csv::StringRecord::from(vec!["note", "Displacement_UM", " TIME_S", "drive_v"]);
        assert_eq!(locate(&header, 1, &mut Findings::new("r.csv")), Some([2, 3, 1]));
    }

    #[test]
    fn near_misses_units_and_wrong_separators_get_their_own_advice() {
        assert!(help(&["tme_s", "drive_V", "displacement_um"])[0].contains("rename `tme_s` to `time_s`"));
        assert!(
            help(&["time_s", "drive_V", "displacement_nm"])[0]
                .contains("`displacement_nm` seems to be in another unit")
        );
        assert!(help(&["time_s;drive_V;displacement_um"])[0].contains("separate the columns by commas"));
        assert!(help(&["0.0", "1.0", "2.0"])[0].contains("first line must be the header"));
        assert!(help(&["time_s", "time_s", "drive_V", "displacement_um"])[0].contains("appears twice"));
        assert!(help(&["time_s", "drive_V"])[0].contains("column `displacement_um` is missing"));
    }
}
