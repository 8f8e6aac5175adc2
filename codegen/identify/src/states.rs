//! Reads states of a platform: a CSV file of eighteen columns with a line of names, in SI units unless a name has another
//! unit in brackets, such as `x (um)`, `vz [um/s]` or `ax [um/s^2]`.

use crate::columns::names::{COORDINATES, Conversion, unit_in_brackets};
use crate::columns::{self, Column, Format, RECORD};
use crate::findings::Findings;
use specgen_language::diagnostic::{Diagnostic, codes};

/// Pose, rate and acceleration of the six coordinates: m and rad, per s, per s².
pub type State = [[f64; 6]; 3];

const FORMAT: Format = Format { preamble: false, ..RECORD };
const COLUMNS: usize = 18;
const HELP: &str = "write 18 names, of pose, rate and acceleration in x, y, z, θx, θy, θz, such as `x,y,z,rx,ry,rz,vx,…` or `x (um),…`";

/// States from the text of their file, in order.
///
/// # Errors
/// All findings of the file.
pub fn parse(text: &str, shown_as: &str) -> Result<Vec<State>, Vec<Diagnostic>> {
    let mut findings = Findings::new(shown_as);
    let states = columns::open(text.as_bytes(), &FORMAT, &mut findings).and_then(|(header, lines)| {
        let columns = header.names.iter().enumerate();
        let columns = columns.map(|(at, name)| Some(Column { at, name, conversion: conversion(at, name)? }));
        let names: Vec<Option<Column>> = columns.collect();
        let is_number = |name: &&String| name.parse::<f64>().is_ok();
        let wrong = if let Some(number) = header.names.iter().find(is_number) {
            format!("the first line names the columns, but `{number}` is a number")
        } else if names.len() != COLUMNS {
            format!("there are {} columns, expected {COLUMNS}", names.len())
        } else if let Some(unknown) = names.iter().position(Option::is_none) {
            format!("the unit of `{}` is not known in column {}", header.names[unknown], unknown + 1)
        } else {
            let names: Vec<Column> = names.into_iter().flatten().collect();
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

/// From the unit of column `at`, from 0, to SI units: names without a unit have them. None if the unit is
/// not one of the coordinate, per s for a rate and per s² for an acceleration.
fn conversion(at: usize, name: &str) -> Option<Conversion> {
    // `x_um`, or nothing: then they are in SI units.
    let behind = || {
        let (_, unit) = name.trim().rsplit_once('_')?;
        let coordinate = unit.split('/').next().unwrap_or_default();
        COORDINATES[at % 6].per(coordinate).map(|_| unit.to_owned())
    };
    let Some(unit) = unit_in_brackets(name).or_else(behind) else { return Some(Conversion::unit(1.0)) };
    let per_time: &[&str] = match at / 6 {
        0 => &[""],
        1 => &["/s"],
        _ => &["/s^2", "/s2", "/s²", "/s/s"],
    };
    let unit = per_time.iter().find_map(|ending| unit.strip_suffix(ending))?;
    // Coordinates are in µm and µrad.
    Some(Conversion::unit(1e6 * COORDINATES[at % 6].per(unit)?))
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
    fn units_behind_a_name_are_converted() {
        for (at, name, factor) in
            [(0, "x_um", 1e6), (3, "theta_x_urad", 1e6), (6, "vx_um/s", 1e6), (0, "x", 1.0), (3, "theta_x", 1.0)]
        {
            let found = format!("{:?}", conversion(at, name));
            assert_eq!(found, format!("{:?}", Some(Conversion::unit(factor))), "{name}");
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

    #[test]
    fn a_file_without_names_is_refused() {
        let found = parse(&format!("{}\n{}\n", row("0"), row("1")), "s.csv").unwrap_err();
        assert!(found[0].message.contains("names the columns") && found[0].help.contains("18 names"), "{found:?}");
    }
}
