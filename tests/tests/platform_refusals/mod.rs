//! Platforms that no controller may be made for: each is refused before anything is written, at its place in the file, with
//! what was expected, and with a fix that is itself accepted when it is put into the spec.

mod stops;
mod support;

use std::fs;

use crate::support::help;
use specgen::diagnostic::Severity;
use support::{BIAS_Z, CASE_1, after, case, edited, folder, hold, put, reference, value, verdict, with_table};

#[test]
fn the_reference_is_accepted() {
    let found = verdict(folder().path(), &reference(), None).expect("the reference compiles");
    assert!(found.iter().all(|found| found.severity < Severity::Error));
}

#[test]
fn a_bias_a_bound_or_a_path_out_of_reach() {
    hold(vec![
        case(
            "a bias below the strokes",
            &[(BIAS_Z, "\"-3 um\", \"0 urad\"")],
            ("E0440", "\"-3 um\"", "they move between 0 and 60.000 um"),
            |help, bad, _| put(bad, "\"-3 um\"", &format!("\"{} um\"", -3.0 + value(help, "add "))),
        ),
        case(
            "a path beyond the strokes",
            &[
                (BIAS_Z, "\"30 um\", \"0 urad\""),
                ("\"50 um\", \"52 um\"]", "\"50 um\", \"73 um\"]"),
                ("[\"-55 um\", \"55 um\"]", "[\"-75 um\", \"75 um\"]"),
            ],
            ("E0442", "\"case-1\"\nfrequency", "`case-1` needs leg displacements"),
            |help, bad, _| put(bad, "\"30 um\"", &format!("\"{} um\"", 30.0 + value(help, " um to "))),
        ),
        case(
            "a bound that its axis cannot reach",
            &[("translation = [\"50 um\"", "translation = [\"56 um\"")],
            ("E0313", "\"56 um\"", "no pose reaches |x| = 56.00 um"),
            |help, bad, _| put(bad, "\"56 um\"", &format!("\"{} um\"", after(help, "at most "))),
        ),
        case(
            "a bound in another unit",
            &[("translation = [\"50 um\"", "translation = [\"50 mm\"")],
            ("E0313", "\"50 mm\", \"50 um\"", "the stroke is 60 um"),
            |help, bad, _| put(bad, "\"50 mm\", \"50 um\"", &format!("\"{} um\", \"50 um\"", after(help, "at most "))),
        ),
        case(
            "the paper's angle",
            &[("rotation    = [\"0.4 mrad\", \"0.35 mrad\"", "rotation    = [\"0.4 mrad\", \"0.013889 pi rad\"")],
            ("E0313", "\"0.013889 pi rad\"", "the stroke is 60 um"),
            |help, bad, _| put(bad, "\"0.013889 pi rad\"", &format!("\"{} urad\"", after(help, "at most "))),
        ),
        case(
            "a bound of z",
            &[
                ("\"50 um\", \"52 um\"]", "\"50 um\", \"100 um\"]"),
                ("[\"-55 um\", \"55 um\"]", "[\"-75 um\", \"75 um\"]"),
            ],
            ("E0313", "\"100 um\"]", "the stroke is 60 um"),
            |help, bad, _| put(bad, "\"100 um\"]", &format!("\"{} um\"]", after(help, "at most "))),
        ),
        case(
            "a bias outside the workspace",
            &[(BIAS_Z, "\"53 um\", \"0 urad\"")],
            ("E0324", "\"53 um\"", "outside the workspace of 52 um"),
            |_, bad, _| put(bad, "\"53 um\"", "\"10 um\""),
        ),
        case(
            "paths that the bias takes out of the workspace",
            &[(BIAS_Z, "\"51 um\", \"0 urad\"")],
            ("E0454", "\"1 Hz\"", "it puts z at 91.000 um after 2.500000 s"),
            |help, bad, _| put(bad, "\"51 um\"", &format!("\"{} um\"", 51.0 + value(help, "bias[2] by "))),
        ),
        case(
            "a workspace too narrow for the paths",
            &[("\"50 um\", \"52 um\"]", "\"50 um\", \"47 um\"]")],
            ("E0454", "\"1 Hz\"", "outside the workspace of ±47.000 um"),
            |help, bad, _| put(bad, "\"47 um\"]", &format!("\"{} um\"]", after(help, "translation[2] to "))),
        ),
    ]);
}

#[test]
fn a_geometry_that_does_not_hold_and_gauges_that_do_not_see() {
    const LAST: &str = "point     = [\"0 mm\", \"80 mm\", \"180 mm\"]\ndirection = [1, 0, 0]";
    hold(vec![
        case(
            "parallel legs",
            &[("platform_angle  = \"0.012 pi rad\"", "platform_angle  = \"0.6546667 pi rad\"")],
            ("E0312", "\"180 mm\"", "hardly hold the platform"),
            |help, bad, _| {
                assert!(help.contains("small base_angle and platform_angle"), "{help}");
                put(bad, "\"0.6546667 pi rad\"", "\"0.02 pi rad\"")
            },
        ),
        case(
            "nothing looks along x",
            &[(LAST, "point     = [\"0 mm\", \"80 mm\", \"180 mm\"]\ndirection = [0, 1, 0]")],
            ("E0432", "[[gauge]]", "cannot see the motion x +1.000 µm"),
            |help, bad, _| {
                assert!(help.contains("three look along one axis") && help.contains("one along the third"), "{help}");
                // The last of the six.
                let at = bad.rfind("direction = [0, 1, 0]").expect("the gauge");
                (bad[..at].to_owned() + &bad[at..].replacen("[0, 1, 0]", "[1, 0, 0]", 1), String::new())
            },
        ),
        case(
            "three in a row",
            &[
                ("[\"-40 mm\", \"69.282 mm\", \"180 mm\"]", "[\"0 mm\", \"0 mm\", \"180 mm\"]"),
                ("[\"-40 mm\", \"-69.282 mm\", \"180 mm\"]", "[\"-80 mm\", \"0 mm\", \"180 mm\"]"),
            ],
            ("E0432", "[[gauge]]", "cannot see the motion θx"),
            |help, bad, _| {
                assert!(help.contains("at the corners of a triangle"), "{help}");
                put(bad, "[\"0 mm\", \"0 mm\", \"180 mm\"]", "[\"0 mm\", \"80 mm\", \"180 mm\"]")
            },
        ),
        case(
            "a line along its plane",
            &[(
                LAST,
                "point     = [\"0 mm\", \"80 mm\", \"180 mm\"]\ndirection = [1, 0, 0]\ntarget_normal = [0, 1, 0]",
            )],
            ("E0318", "[0, 1, 0]\n\n[hysteresis]", "looks along its target"),
            |_, bad, _| put(bad, "target_normal = [0, 1, 0]", "target_normal = [1, 0, 0]"),
        ),
        case(
            "gauges too short for the workspace",
            &[("[\"-55 um\", \"55 um\"]", "[\"-25 um\", \"25 um\"]")],
            ("E0433", "[\"-25 um\", \"25 um\"]", "beyond its range of -25.000 µm to 25.000 µm"),
            |help, bad, _| {
                let most = after(help, "takes in ");
                put(bad, "[\"-25 um\", \"25 um\"]", &format!("[\"-{most} um\", \"{most} um\"]"))
            },
        ),
    ]);
}

/// The form that a help shows for a value.
fn form(help: &str) -> &str {
    help::literal(help, "in the form ").unwrap_or_else(|| panic!("{help}"))
}

/// 3 µm in x and 40 µrad about y, up and back in 0.1 s.
fn table() -> String {
    let row = |k: u32| {
        let part = 0.5 * (1.0 - (std::f64::consts::TAU * f64::from(k) / 100.0).cos());
        format!("{:.6},{:.6}\n", 3.0 * part, 40.0 * part)
    };
    "x_um,theta_y_urad\n".to_owned() + &(0..=100).map(row).collect::<String>()
}

#[test]
fn converters_that_do_not_see_their_gauge() {
    const NOISE: &str = "noise = \"2.2 nm\"";
    const INPUT: &str = "input_range = [\"0 V\", \"2 V\"]";
    hold(vec![
        case(
            "the reading zero beyond the converter",
            &[(NOISE, "noise = \"2.2 nm\"\ncalibration = [\"-55 um\", \"10 um/V\"]\ninput_range = [\"0 V\", \"2 V\"]")],
            ("E0474", "[\"0 V\", \"2 V\"]", "does not see the reading zero"),
            |help, bad, _| {
                let (_, range) = help.split_once("write input_range = ").expect("a fix");
                let (range, _) = range.split_once(" or wider").expect("a fix");
                put(bad, "[\"0 V\", \"2 V\"]", range)
            },
        ),
        case(
            "volts for words in metres",
            &[(NOISE, "noise = \"2.2 nm\"\ninput_range = [\"0 V\", \"2 V\"]")],
            ("E0475", "[\"0 V\", \"2 V\"]", "needs a calibration"),
            |help, bad, _| {
                assert!(help.contains("remove `input_range`"), "{help}");
                put(bad, INPUT, "")
            },
        ),
    ]);
}

#[test]
fn tables_of_poses() {
    let line_50 = table().lines().nth(50).expect("a row").to_owned();
    let spoilt = |new: &str| table().replacen(&line_50, new, 1);
    let back: fn(&str, &str, &str) -> (String, String) = |_, bad, _| (bad.to_owned(), table());
    hold(vec![
        with_table("NaN", spoilt("NaN,1"), "E0461", "`x_um` is `NaN`, not a finite number", back),
        with_table("infinity", spoilt("1,-inf"), "E0461", "`theta_y_urad` is `-inf`", back),
        with_table("a decimal comma", spoilt("2,9,39"), "E0461", "3 values", back),
        with_table("a text", spoilt("2.9,high"), "E0461", "`high`, which is not a number", back),
        with_table("a row too short", spoilt("2.9"), "E0461", "`theta_y_urad` is missing", back),
        with_table("volts", table().replace("x_um", "x_V"), "E0460", "`x_V` is no column", |help, bad, table| {
            assert!(help.contains("`x_um`"), "{help}");
            (bad.to_owned(), table.replace("x_V", "x_um"))
        }),
        with_table(
            "no unit",
            table().replace("theta_y_urad", "theta_y"),
            "E0460",
            "`theta_y` is no column",
            |help, bad, table| {
                let name = help.split('`').nth(1).expect("a name").to_owned();
                (bad.to_owned(), table.replace("theta_y", &name))
            },
        ),
        with_table("millimetres", table().replace("x_um", "x_mm"), "E0453", "x jumps by", |help, bad, table| {
            assert!(help.contains("check the unit in the column's name"), "{help}");
            (bad.to_owned(), table.replace("x_mm", "x_um"))
        }),
        with_table("radians", table().replace("urad", "rad"), "E0453", "theta_y jumps by", |help, bad, table| {
            assert!(help.contains("check the unit in the column's name"), "{help}");
            (bad.to_owned(), table.replace("_rad", "_urad"))
        }),
        with_table("one lost sample", spoilt("-90,0"), "E0453", "x jumps by", back),
        with_table("one row", "x_um\n1\n".to_owned(), "E0463", "has 1 rows, expected 2 to", back),
        with_table("empty", String::new(), "E0460", "is empty", back),
        with_table(
            "times of another period",
            "time_ms,x_um\n0,0\n2,0\n4,0\n".to_owned(),
            "E0462",
            "the spec's period is 1.000000 ms",
            |help, bad, table| {
                assert!(help.contains("trajectory.period"), "{help}");
                (bad.replacen("period = \"1 ms\"", "period = \"2 ms\"", 1), table.to_owned())
            },
        ),
        with_table(
            "out of the workspace",
            "z_um\n".to_owned() + &(0..=220).map(|k| format!("{}\n", 0.2 * f64::from(k))).collect::<String>(),
            "E0454",
            "it puts z at 54.000 um",
            |help, bad, table| {
                // z of the workspace and the gauges are wide enough once the bias gives way.
                let (spec, _) = put(bad, BIAS_Z, &format!("\"{} um\", \"0 urad\"", 10.0 + value(help, "bias[2] by ")));
                // That much lower, the legs leave streams less room to stop in.
                (spec.replace("\"50 mrad/s\"", "\"40 mrad/s\""), table.to_owned())
            },
        ),
    ]);
    let mut between = with_table(
        "rows between ticks",
        table(),
        "E0456",
        "do not fall on the ticks of 0.1000 ms",
        |help, bad, table| {
            (bad.replacen("\"0.25 ms\"", &format!("\"{} ms\"", after(help, "such as \"")), 1), table.to_owned())
        },
    );
    between.edits[0].1 = between.edits[0].1.replace("1 ms", "0.25 ms");
    between.at = Some("\"0.25 ms\"");
    let mut unit = with_table("a period in volts", table(), "E0211", "expected a time", |help, bad, table| {
        (bad.replacen("\"1 V\"", &form(help).replace("<number>", "1"), 1), table.to_owned())
    });
    unit.edits[0].1 = unit.edits[0].1.replace("1 ms", "1 V");
    unit.at = Some("\"1 V\"");
    hold(vec![between, unit]);
}

#[test]
fn paths_too_fast_and_paths_that_jump() {
    hold(vec![
        case(
            "200 Hz",
            &[(CASE_1, "kind      = \"case-1\"\nfrequency = \"200 Hz\"")],
            ("E0455", "\"200 Hz\"", "faster than control.setpoint.stream_speed"),
            |help, bad, _| put(bad, "\"200 Hz\"", &format!("\"{} Hz\"", after(help, "at most "))),
        ),
        case(
            "as printed",
            &[(CASE_1, "kind      = \"case-1\"\nfrequency = \"1 Hz\"\nas_printed = true")],
            ("E0453", "true", "trajectory \"case-1\": y jumps by"),
            |help, bad, _| {
                assert!(help.contains("leave as_printed out"), "{help}");
                put(bad, "\nas_printed = true", "")
            },
        ),
        case(
            "moves that never end",
            &[("jerk         = [\"1 m/s^3\"", "jerk         = [\"1e-12 m/s^3\"")],
            ("E0451", "[\"100 um/s\"", "a move across the workspace takes more than"),
            |help, bad, _| {
                assert!(help.contains("jerk"), "{help}");
                put(bad, "[\"1e-12 m/s^3\"", "[\"1 m/s^3\"")
            },
        ),
        case(
            "a stream that is stale at once",
            &[("stale_ticks  = 10", "stale_ticks  = 0")],
            ("E0301", "0\n\n# [gains]", "expected 1 to 1000000"),
            |help, bad, _| put(bad, "stale_ticks  = 0", &format!("stale_ticks  = {}", after(help, "range: "))),
        ),
        case(
            "a stream without speed",
            &[("stream_speed = [\"5 mm/s\"", "stream_speed = [\"nan mm/s\"")],
            ("E0212", "nan mm/s", "which is not a finite number"),
            |help, bad, _| put(bad, "\"nan mm/s\"", &form(help).replace("<number>", "5000")),
        ),
    ]);
}

#[test]
fn loops_that_would_be_unstable() {
    const TABLE: &str = "proportional = [\"5e5 N/m\", \"5e5 N/m\", \"2e6 N/m\", \"1e4 N m/rad\", \"1e4 N m/rad\", \"1e4 N m/rad\"]
integral     = [\"1e13 N/(m s)\", \"1e13 N/(m s)\", \"4e13 N/(m s)\", \"2e11 N m/(rad s)\", \"2e11 N m/(rad s)\", \"2e11 N m/(rad s)\"]
derivative   = [\"0 N s/m\", \"0 N s/m\", \"0 N s/m\", \"0 N m s/rad\", \"0 N m s/rad\", \"0 N m s/rad\"]

[[trajectory]]
name      = \"case-1\"";
    const FIRST: &str = "[[trajectory]]\nname      = \"case-1\"";
    /// The two lists that the help offers in place of those given.
    fn offered(help: &str, bad: &str, _: &str) -> (String, String) {
        let list = |name: &str| {
            let (_, rest) = help.split_once(&format!("{name} [")).unwrap_or_else(|| panic!("{help}"));
            rest.split_once(']').expect("a list").0.split(", ").map(str::to_owned).collect::<Vec<_>>()
        };
        let written = |name: &str, units: [&str; 2]| {
            let values = list(name).into_iter().enumerate().map(|(k, v)| format!("\"{v} {}\"", units[k / 3]));
            format!("{name} = [{}]", values.collect::<Vec<_>>().join(", "))
        };
        let mut lines: Vec<String> = bad.lines().map(str::to_owned).collect();
        for line in &mut lines {
            if line.starts_with("proportional = ") {
                *line = written("proportional", ["N/m", "N m/rad"]);
            } else if line.starts_with("integral     = ") {
                *line = written("integral", ["N/(m s)", "N m/(rad s)"]);
            }
        }
        (lines.join("\n") + "\n", String::new())
    }
    let gains = format!("[gains]\n{TABLE}");
    let position_gains = format!("[position_gains]\n{TABLE}");
    hold(vec![
        case("gains of P/F", &[(FIRST, &gains)], ("E0421", "[\"1e13 N/(m s)\"", "control mode P/F"), offered),
        case(
            "gains of P",
            &[(FIRST, &position_gains)],
            ("E0421", "[\"1e13 N/(m s)\"", "control mode P is unstable"),
            offered,
        ),
        case(
            "bandwidths",
            &[(
                "mode       = \"pcc\"",
                "mode       = \"pcc\"\nlevel_bandwidth = \"5000 rad/s\"\ndrift_bandwidth = \"200 rad/s\"",
            )],
            ("E0421", "\"5000 rad/s\"", "control mode F pcc"),
            |help, bad, _| {
                let bad =
                    bad.replacen("\"5000 rad/s\"", &format!("\"{} rad/s\"", after(help, "level_bandwidth = \"")), 1);
                put(&bad, "\"200 rad/s\"", &format!("\"{} rad/s\"", after(help, "drift_bandwidth = \"")))
            },
        ),
        case(
            "a measured force of a part too stiff",
            &[
                ("interaction     = \"none\"", "interaction     = \"measured\""),
                (
                    "[control.setpoint]",
                    "[control.environment]\nstiffness = [\"1e9 N/m\", \"1e9 N/m\", \"1e9 N/m\", \"1e6 N m/rad\", \"1e6 N m/rad\", \"1e6 N m/rad\"]\n\n[control.setpoint]",
                ),
            ],
            ("E0421", "[\"1e9 N/m\"", "touching the work piece"),
            |help, bad, _| {
                let factor = value(help, "stable up to ");
                let list = format!(
                    "[\"{0:e} N/m\", \"{0:e} N/m\", \"{0:e} N/m\", \"{1:e} N m/rad\", \"{1:e} N m/rad\", \"{1:e} N m/rad\"]",
                    1e9 * factor,
                    1e6 * factor
                );
                let (begin, end) =
                    (bad.find("[\"1e9").expect("the list"), bad.find("\n\n[control.setpoint]").expect("its end"));
                (bad[..begin].to_owned() + &list + &bad[end..], String::new())
            },
        ),
        case(
            "a filter in hertz",
            &[("\"1.9e4 rad/s\"", "\"3000 Hz\"")],
            ("E0211", "\"3000 Hz\"", "expected an angular rate"),
            |help, bad, _| {
                assert!(help.ends_with("as \"6000 pi rad/s\""), "{help}");
                put(bad, "\"3000 Hz\"", "\"6000 pi rad/s\"")
            },
        ),
    ]);
}

#[test]
fn what_can_be_found_is_found_in_one_run() {
    let folder = folder();
    let bad = edited(
        &reference(),
        &[
            (CASE_1, "kind   = \"waveform\"\nfile   = \"table.csv\"\nperiod = \"1 ms\"".to_owned()),
            (
                "mode       = \"pcc\"",
                "mode       = \"pcc\"\nlevel_bandwidth = \"5000 rad/s\"\ndrift_bandwidth = \"200 rad/s\"".to_owned(),
            ),
            ("records/reference-forc.csv", "records/bad.csv".to_owned()),
        ],
    );
    fs::write(folder.path().join("records/bad.csv"), "seconds,volts\n0,1\n").expect("written");
    let table = table().replace("x_um", "x_V");
    let refused = verdict(folder.path(), &bad, Some(&table)).expect_err("refused");
    let found: Vec<&str> = refused.findings.iter().map(|found| found.code).collect();
    for code in ["E0504", "E0421", "E0460"] {
        assert!(found.contains(&code), "no {code} among {found:?}");
    }
}
