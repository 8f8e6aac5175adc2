//! Reads states of a platform: a CSV file of eighteen columns with a line of names, in SI units unless a name has another
//! unit, such as `x (um)`, `vz [um/s]` or `ax_um/s^2`. The columns have a fixed order. A name that says another place or
//! ends with what may be an unknown unit is refused. A description of the columns replaces order and names.

use crate::columns::names::{COORDINATES, Conversion, PER_TIME, RATES, plain};
use crate::columns::{self, Column, Format, RECORD};
use crate::file::Source;
use crate::findings::Findings;
use crate::reading::Reading;
use crate::signals::{self, ColumnSpec, required};
use specgen_language::diagnostic::{Diagnostic, codes};

/// Pose, rate and acceleration of the six coordinates: m and rad, per s, per s².
pub type State = [[f64; 6]; 3];

const FORMAT: Format = Format { preamble: false, ..RECORD };
const COLUMNS: usize = 18;
const HELP: &str = "write 18 names, of pose, rate and acceleration in x, y, z, θx, θy, θz, such as `x,y,z,rx,ry,rz,vx,…` or `x (um),…`, or describe all columns by `--columns x_um=1,y_um=2,…`";

/// States from the text of their file, in order, as the user describes its columns.
///
/// # Errors
/// All findings of the file.
pub fn parse(text: &str, shown_as: &str, reading: &Reading) -> Result<Vec<State>, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    let is_described = reading.chosen().next().is_some();
    let states = if is_described { described(text, reading, &mut findings) } else { in_order(text, &mut findings) };
    findings.conclude(states).map(|(states, _)| states)
}

fn described(text: &str, reading: &Reading, findings: &mut Findings) -> Option<Vec<State>> {
    let quantities = || COORDINATES.iter().chain(&RATES);
    // A name without unit is not of µm here.
    if let Some(missing) = quantities().find(|quantity| reading.column(quantity.name).is_none()) {
        let message = format!("`--columns` describes no `{}`", missing.name);
        let help = "describe all 18 columns, each with its unit, such as `x_mm=1`";
        return findings.refuse(codes::RECORD_HEADER, None, message, help);
    }
    let wanted: Vec<ColumnSpec> =
        quantities().map(|quantity| ColumnSpec { per: 1e6, ..required(quantity.name) }).collect();
    let Source { content, choice } = Source::of_text(text.as_bytes(), None, findings)?;
    if choice.of > 1 || !findings.is_empty() {
        let message = "lines of text divide its rows".to_owned();
        return findings.refuse(codes::RECORD_VALUE, None, message, "delete the text between the rows");
    }
    let (header, rows) = content.open(&RECORD, findings)?;
    let columns = signals::assigned(&header, rows, &wanted, (reading, &RECORD), findings)?.columns;
    Some(rows_of(&columns.into_iter().map(Option::unwrap_or_default).collect::<Vec<_>>()))
}

/// The rows of eighteen columns.
fn rows_of(columns: &[Vec<f64>]) -> Vec<State> {
    let state = |row: usize| -> State {
        core::array::from_fn(|part| core::array::from_fn(|axis| columns[6 * part + axis][row]))
    };
    (0..columns.first().map_or(0, Vec::len)).map(state).collect()
}

fn in_order(text: &str, findings: &mut Findings) -> Option<Vec<State>> {
    columns::open(text.as_bytes(), &FORMAT, findings).and_then(|(header, lines)| {
        let names = header.names.iter().enumerate();
        let meanings: Vec<Option<(&str, Conversion)>> = names.clone().map(|(at, name)| meaning(at, name)).collect();
        let misplaced = meanings.iter().enumerate().find_map(|(at, found)| {
            let place = place((*found)?.0)?;
            (place != at).then_some((at, place))
        });
        let is_number = |name: &&String| name.parse::<f64>().is_ok();
        let wrong = if let Some(number) = header.names.iter().find(is_number) {
            format!("the first line names the columns, but `{number}` is a number")
        } else if meanings.len() != COLUMNS {
            format!("there are {} columns, expected {COLUMNS}", meanings.len())
        } else if let Some(unknown) = meanings.iter().position(Option::is_none) {
            format!("the unit of `{}` is not known in column {}", header.names[unknown], unknown + 1)
        } else if let Some((at, place)) = misplaced {
            format!("`{}` is column {} of a state, but column {} of the file", header.names[at], place + 1, at + 1)
        } else {
            let columns = names.zip(meanings.iter().flatten());
            let columns: Vec<Column> =
                columns.map(|((at, name), &(_, conversion))| Column { at, name, conversion }).collect();
            return Some(rows_of(&lines.read(&columns, findings).columns));
        };
        findings.refuse(codes::RECORD_HEADER, Some(header.line), wrong, HELP)
    })
}

/// Letters between the parts of a name.
const BETWEEN: [char; 4] = ['_', ' ', '/', ','];
/// What ends a name that has no unit, beside numbers.
const ENDINGS: [&str; 8] = ["x", "y", "z", "dot", "ddot", "dt", "dt2", "dt^2"];

/// A name, and the unit behind it in brackets; or the whole name.
fn divided(name: &str) -> (&str, Option<&str>) {
    let name = name.trim();
    let of = |open: char, close: char| name.strip_suffix(close)?.rsplit_once(open);
    match of('(', ')').or_else(|| of('[', ']')) {
        // An index.
        Some((_, inner)) if inner.trim().parse::<u8>().is_ok() => (name, None),
        Some((name, unit)) => (name.trim_end(), Some(unit)),
        None => (name, None),
    }
}

/// Whether a name ends with no unit.
fn has_no_unit(name: &str) -> bool {
    match name.rsplit_once(BETWEEN) {
        None => !name.ends_with([')', ']']) || divided(name).1.is_none(),
        Some((_, last)) => {
            ENDINGS.contains(&last.to_lowercase().as_str())
                || last.trim_matches(['[', ']', '(', ')']).parse::<u8>().is_ok()
        }
    }
}

/// The name of column `at`, from 0, without its unit, and the conversion to SI units, which a name without unit has. None if
/// what it ends with is not a unit of the coordinate, per s for a rate and per s² for an acceleration.
fn meaning(at: usize, name: &str) -> Option<(&str, Conversion)> {
    let per_time = at.checked_sub(6).and_then(|at| PER_TIME.get(at / 6)).map_or(&[""][..], |endings| *endings);
    let of = |unit: &str| {
        let ends = |ending: &&str| unit.len().checked_sub(ending.len()).and_then(|k| unit.split_at_checked(k));
        let mut divided =
            per_time.iter().filter_map(|ending| ends(ending).filter(|(_, end)| end.eq_ignore_ascii_case(ending)));
        // Coordinates are in µm and µrad.
        Some(Conversion::unit(1e6 * COORDINATES[at % 6].per(divided.next()?.0)?))
    };
    match divided(name) {
        (name, Some(unit)) => Some((name, of(unit.trim())?)).filter(|_| has_no_unit(name)),
        (name, None) if has_no_unit(name) => Some((name, Conversion::unit(1.0))),
        // `vx_mm_s` is `vx_mm/s`.
        (name, None) => name.match_indices(BETWEEN).find_map(|(k, _)| {
            let unit = name[k + 1..].replace('_', "/");
            Some((&name[..k], of(&unit)?)).filter(|(name, _)| has_no_unit(name))
        }),
    }
}

/// How usual names of positions, angles, and so on begin.
const BEGINNINGS: [&[&str]; 6] =
    [&["", "p"], &["r", "theta", "θ"], &["v"], &["w", "omega", "ω"], &["a"], &["alpha", "α"]];

/// The place that a usual name says.
fn place(name: &str) -> Option<usize> {
    let name = plain(name);
    let is_at =
        |at: &usize| BEGINNINGS[at / 3].iter().any(|begin| name.strip_prefix(begin) == Some(["x", "y", "z"][at % 3]));
    let turn = || ["roll", "pitch", "yaw"].iter().position(|turn| name == *turn).map(|axis| 3 + axis);
    (0..COLUMNS).find(is_at).or_else(turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str, shown_as: &str) -> Result<Vec<State>, Vec<Diagnostic>> {
        super::parse(text, shown_as, &Reading::default())
    }

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
    fn units_behind_a_name_are_converted() {
        for (at, name, factor) in [
            (0, "x_um", Some(1e6)),
            (3, "theta_x_urad", Some(1e6)),
            (6, "vx_um/s", Some(1e6)),
            (6, "vx_mm_s", Some(1e3)),
            (6, "vx mm/s", Some(1e3)),
            (12, "ax_mm_s2", Some(1e3)),
            (12, "ax mm/s²", Some(1e3)),
            (0, "x", Some(1.0)),
            (3, "theta_x", Some(1.0)),
            (9, "theta_x_dot", Some(1.0)),
            (6, "dx/dt", Some(1.0)),
            (0, "h[0]", Some(1.0)),
            (0, "h_0", Some(1.0)),
            (0, "x_ft", None),
            (0, "x (ft)", None),
            (0, "x (mm) [m]", None),
            (0, "x_mm [m]", None),
            (0, "x mm filtered", None),
            (6, "vx_mm", None),
            (6, "vx_um/s2", None),
            (9, "wx_rpm", None),
            (9, "wx dps", None),
            (9, "wx_deg/min", None),
        ] {
            let found = meaning(at, name).map(|(_, conversion)| conversion.per);
            assert!(found.is_some() == factor.is_some(), "{name}: {found:?}");
            assert!(
                found.zip(factor).is_none_or(|(a, b): (f64, f64)| (a / b - 1.0).abs() < 1e-12),
                "{name}: {found:?}"
            );
        }
    }

    #[test]
    fn units_in_brackets_are_converted() {
        let name = |k: usize| match k {
            0 => "X (um)".to_owned(),
            5 => "Rz [deg]".to_owned(),
            6 => "vx [mm/s]".to_owned(),
            14 => "az (µm/s²)".to_owned(),
            _ => format!("c{k}"),
        };
        let names = (0..18).map(name).collect::<Vec<_>>().join(",");
        let [pose, rate, acceleration] = parse(&format!("{names}\n{}\n", ["180"; 18].join(",")), "s.csv").unwrap()[0];
        for (value, expected) in [
            (pose[0], 180e-6),
            (pose[1], 180.0),
            (pose[5], core::f64::consts::PI),
            (rate[0], 0.18),
            (acceleration[2], 180e-6),
        ] {
            assert!((value / expected - 1.0).abs() < 1e-12, "{value} {expected}");
        }
        let found = parse(&format!("{}\n{}\n", names.replace("mm/s", "mm"), row("0")), "s.csv").unwrap_err();
        assert!(found[0].message.contains("`vx [mm]`"), "{found:?}");
    }

    /// Names, numbers and words of the refusal.
    #[test]
    fn columns_in_another_order_and_fields_beside_them_are_refused() {
        let pose = "x,y,z,rx,ry,rz";
        let rate = "vx,vy,vz,wx,wy,wz";
        let last = "ax,ay,az,alpha_x,alpha_y,alpha_z";
        let usual = format!("{pose},{rate},{last}");
        assert!(parse(&format!("{usual}\n{}\n", row("0")), "s.csv").is_ok());
        for (names, row, words) in [
            (format!("{rate},{last},{pose}"), row("0"), "`vx` is column 7 of a state, but column 1"),
            (format!("rx,ry,rz,x,y,z,{rate},{last}"), row("0"), "`rx` is column 4"),
            (format!("roll,pitch,yaw,a,b,c,{rate},{last}"), row("0"), "`roll` is column 4"),
            (format!("time_s,{usual}"), format!("0,{}", row("0")), "there are 19 columns"),
            (usual.replace("alpha_z", "theta_z_dot_rpm"), row("0"), "the unit of `theta_z_dot_rpm`"),
            (usual.clone(), format!("7,{}", row("0.5")), "has 19 values, expected 18"),
            (usual.clone(), ["0,5"; 18].join(","), "has 36 values, expected 18"),
            (
                usual.replace(',', ";"),
                [["1"; 18], ["1,234"; 18]].map(|row| row.join(";")).join("\n"),
                "the comma may divide thousands",
            ),
            (format!("{usual}\n{}", ["mm"; 18].join(",")), row("0"), "the unit of `rx [mm]`"),
        ] {
            let found = parse(&format!("{names}\n{row}\n"), "s.csv").unwrap_err();
            assert!(found[0].message.contains(words) && !found[0].help.is_empty(), "{names}: {found:?}");
        }
        let units = "mm,mm,mm,mrad,mrad,mrad,mm/s,mm/s,mm/s,mrad/s,mrad/s,mrad/s,m/s2,m/s2,m/s2,rad/s2,rad/s2,rad/s2";
        let [pose, rate, last] = parse(&format!("{usual}\n{units}\n{}\n", ["1"; 18].join(",")), "s.csv").unwrap()[0];
        for (value, expected) in [(pose[0], 1e-3), (pose[3], 1e-3), (rate[5], 1e-3), (last[5], 1.0)] {
            assert!((value / expected - 1.0_f64).abs() < 1e-12, "{value} {expected}");
        }
    }

    #[test]
    fn a_description_gives_columns_in_any_order() {
        let names = ["x_mm", "y_m", "z_m", "theta_x_deg", "theta_y_rad", "theta_z_rad"];
        let rates = ["vx_mm/s", "vy_m/s", "vz_m/s", "omega_x_rad/s", "omega_y_rad/s", "omega_z_rad/s"];
        let last = ["ax_m/s2", "ay_m/s^2", "az_m/s2", "alpha_x_rad/s2", "alpha_y_rad/s2", "alpha_z_rad/s2"];
        let all = [names, rates, last].concat();
        let columns: Vec<String> = all.iter().enumerate().map(|(k, name)| format!("{name}={}", 19 - k)).collect();
        let described = |columns: &str, names: &str| {
            let reading = Reading::new(&[columns.to_owned()], None).unwrap();
            let numbers = (1..19).map(|k| k.to_string()).collect::<Vec<_>>().join(",");
            super::parse(&format!("t,{names}\n0,{numbers}\n"), "s.csv", &reading)
        };
        let columns = columns.join(",");
        let plain = (0..18).map(|k| format!("c{k}")).collect::<Vec<_>>().join(",");
        let [pose, rate, acceleration] = described(&columns, &plain).unwrap()[0];
        assert!((pose[0] / 18e-3 - 1.0).abs() < 1e-12 && (rate[0] / 12e-3 - 1.0).abs() < 1e-12, "{pose:?} {rate:?}");
        assert!((acceleration[5] - 1.0).abs() < 1e-12, "{acceleration:?}");
        let scaled = columns.replace("vx_mm/s=13", "vx=13*3 mm/s/V+1 m/s");
        let rate = described(&scaled, &plain).unwrap()[0][1][0];
        assert!((rate / 1.036 - 1.0).abs() < 1e-12, "{rate}");
        for (columns, names, words) in [
            ("x_m=1".to_owned(), plain.clone(), "`--columns` describes no `y_um`"),
            (columns.clone(), plain.replace("c11", "v (m/s)"), "names `v (m/s)` for `vx_um/s`, but its unit"),
            (format!("drive_V=1,{columns}"), plain, "names `drive_V`, which this kind of file"),
        ] {
            let found = described(&columns, &names).unwrap_err();
            assert!(found[0].message.contains(words), "{found:?}");
        }
    }

    #[test]
    fn a_file_without_names_is_refused() {
        let found = parse(&format!("{}\n{}\n", row("0"), row("1")), "s.csv").unwrap_err();
        assert!(found[0].message.contains("names the columns") && found[0].help.contains("18 names"), "{found:?}");
    }
}
