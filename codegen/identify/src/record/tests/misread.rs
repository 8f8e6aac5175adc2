//! Files that are easily read as something else.

use super::files::{assert_same, comma, file, read};

/// An integer with a sign between thousands.
fn grouped(value: f64, sign: &str) -> String {
    let value = value.round() as i64;
    match (value / 1000, (value % 1000).abs()) {
        (0, _) => value.to_string(),
        (thousands, rest) => format!("{thousands}{sign}{rest:03}"),
    }
}

/// A file, the options `--columns` and `--rate`, and the code and words of message and help of its refusal.
type RefusalCase<'a> = (&'a str, &'a [&'a str], Option<f64>, [&'a str; 3]);

/// Files that once were read as something else, and what they are: read right, with or without the options behind them; or
/// refused with a code and words of message and help.
#[test]
fn what_could_be_read_as_something_else_is_read_right_or_refused() {
    const NAMES: &str = "time_s,drive_V,displacement_um";
    let plain = |names: &str| file(names, |[t, u, y]| format!("{t:?},{u:?},{y:?}"));
    let small =
        |names: &str, of: fn(f64) -> String| file(names, |[t, u, y]| [1e3 * t, 1e3 * u, 1e3 * y].map(of).join(";"));
    let replaced = |line: usize, row: &str| {
        let text = plain(NAMES);
        let lines = text.lines().enumerate().map(|(at, old)| if at + 1 == line { row } else { old });
        lines.collect::<Vec<_>>().join("\n")
    };
    let row_names = |names: &str| file(names, |[t, u, y]| format!("\"{:.0}\" {t} {u} {y}", 1e3 * t + 1.0));
    let counted = |text: &str| text.replacen(NAMES, "sample,drive_V,displacement_um", 1);
    let small_names = "time_ms;drive_mV;displacement_nm";
    let dated = |later: &str| {
        file("Timestamp,drive_V,displacement_um", |[t, u, y]| {
            format!("{} 10:00:00.{:03.0},{u},{y}", if t < 0.1 { "3/4/2024" } else { later }, 1e3 * t)
        })
    };
    let again = |comment: &str| replaced(120, &format!("{comment}\n{}", plain(NAMES).lines().nth(119).unwrap()));
    let right: [(&str, String, &[&str]); 15] = [
        ("minus signs of typesetting", plain(NAMES).replace('-', "\u{2212}"), &[]),
        ("three decimals behind commas", small(small_names, |value| format!("{value:.3}").replace('.', ",")), &[]),
        ("whole numbers, some with a comma", small(small_names, |value| format!("{value}").replace('.', ",")), &[]),
        (
            "names without that of row names",
            row_names("time_s drive_V displacement_um"),
            &["time_s=2,drive_V=3,displacement_um=4"],
        ),
        (
            "the same comment again",
            replaced(120, &format!("# {NAMES}\n{}", plain(NAMES).lines().nth(119).unwrap())),
            &[],
        ),
        (
            "names in two sizes",
            file("time_s,u,U", |[t, u, y]| format!("{t},{y},{u}")),
            &["drive_V=U,displacement_um=u"],
        ),
        ("the same comment in other words", again("# Time (s), Drive (V), Displacement (um)"), &[]),
        ("the same comment with a comma behind it", again("# time_s,drive_V,displacement_um,"), &[]),
        (
            "names in a comment between the rows of a file without names",
            again(&format!("# {NAMES}")).replacen(&format!("{NAMES}\n"), "", 1),
            &["time_s=1,drive_V=2,displacement_um=3"],
        ),
        (
            "dates with noughts, and no names",
            file("", |[t, u, y]| format!("{:.0},05/03/2024,{:.0},{:.0}", 1e3 * t, 10.0 * u, 1e4 * y)),
            &["time_ms=1,drive=3*0.1 V,displacement=4*1e-4 um"],
        ),
        (
            "a factor per count",
            file("time_s,drive_V,enc_counts", |[t, u, y]| format!("{t},{u},{:?}", 1e3 * y)),
            &["displacement=enc_counts*0.001 um/count"],
        ),
        ("a remark in brackets", plain("time_s,drive_V,Position (act)"), &["displacement_um=Position (act)"]),
        ("dates on one day", dated("3/4/2024"), &[]),
        (
            "commas within names",
            file("Run (Nr, day),Time,s,drive_V,displacement_um", |[t, u, y]| format!("7,{t},{u},{y}")),
            &[],
        ),
        (
            "a name of this project beside another",
            file("time_s,drive_V,Position (nm),displacement_um", |[t, u, y]| format!("{t},{u},{},{y}", 2e3 * y)),
            &[],
        ),
    ];
    for (name, text, columns) in &right {
        assert_same(name, read(text.as_bytes(), columns, None));
    }
    let two =
        file("time_s,drive_V,Position (um),displacement_nm", |[t, u, y]| format!("{t},{u},{},{:?}", 2.0 * y, 1e3 * y));
    let cases: [RefusalCase; 25] = [
        (&small(small_names, |value| grouped(value, ",")), &[], None, ["E0506", "comma may divide thousands", "point"]),
        (
            &small(small_names, |value| grouped(value, ".")),
            &[],
            None,
            ["E0506", "point may divide thousands", "without"],
        ),
        (
            &small("time_ms\tdrive_mV\tdisplacement_nm", |value| grouped(value, ".")).replace(';', "\t"),
            &[],
            None,
            ["E0506", "point may divide thousands", "without"],
        ),
        (
            &file("time_s,drive, filtered,displacement_um,drive_V", |[t, u, y]| format!("{t},{u},{y},{u}")),
            &[],
            None,
            ["E0504", "5 names for 4 columns", "--columns time_s=1,drive_V=2,displacement_um=3"],
        ),
        (&small(small_names, |value| grouped(value, "'")), &[], None, ["E0506", "not a number", "between thousands"]),
        (
            &file("time_ms,drive_mV,displacement_nm", |[t, u, y]| {
                [t + 2.0, u, y].map(|value| format!("\"{}.25\"", grouped(1e3 * value, ","))).join(",")
            }),
            &[],
            None,
            ["E0506", "not a number", "between thousands"],
        ),
        (
            &file("time_s,Vib Velocity,drive_V\n[ s ],[ m/s ],[ V ]", |[t, u, y]| format!("{t},{y},{u}")),
            &[],
            None,
            ["E0504", "`displacement_um` is missing", "`Vib Velocity [m/s]` is a rate"],
        ),
        (
            &file("time_s,Position (um)", |[t, _, y]| format!("{t},{y}")),
            &[],
            None,
            ["E0504", "`drive_V` is missing", "record it as well"],
        ),
        (
            &counted(&file(NAMES, |[t, u, y]| format!("{:.0},{u:.0},{}", 1e3 * t, comma(y)))),
            &[],
            Some(1e3),
            ["E0506", "has 4 numbers for 3 columns", "semicolons"],
        ),
        (
            &counted(&file(NAMES, |[t, u, y]| {
                format!("{:.0},{u:.0},{}", 1e3 * t, if t < 0.1 { "0".to_owned() } else { comma(y) })
            })),
            &[],
            Some(1e3),
            ["E0506", "has 4 values, expected 3", "a point as decimal sign"],
        ),
        (
            &file("", |[t, u, y]| [t + 0.1171, u, y].map(comma).join(",")),
            &["drive_V=3,displacement_um=5"],
            Some(1e3),
            ["E0506", "columns without names", "decimal points"],
        ),
        (
            &row_names("time_s drive_V displacement_um"),
            &[],
            None,
            ["E0504", "3 names for 4 columns", "--columns time_s=2,drive_V=3,displacement_um=4"],
        ),
        (
            &file("time_s drive_V displacement_um degC", |[t, u, y]| {
                if t == 0.1 { format!("{t}   {y} 20") } else { format!("{t} {u} {y} 20") }
            }),
            &[],
            None,
            ["E0506", "has 3 values, expected 4", "commas between the columns"],
        ),
        (&two, &[], None, ["E0505", "appears twice", "--columns displacement_nm=displacement_nm"]),
        (
            &plain("time_s,drive_V,Field (Oe)"),
            &["displacement_um=Field (Oe)"],
            None,
            ["E0504", "its unit is not known", "'displacement=Field (Oe)*1 um'"],
        ),
        (
            &plain("time_s,drive_V,Speed (mm/s)"),
            &["displacement_um=3"],
            None,
            ["E0504", "its unit is not known", "*1 um"],
        ),
        (
            &plain("time_s,drive_V,gauge_counts"),
            &["displacement_um=3"],
            None,
            ["E0504", "its unit is not known", "*1 um"],
        ),
        (
            &plain("time_s,drive_V,Angle (deg)"),
            &["displacement=3*5 um/V"],
            None,
            ["E0504", "its unit is deg", "per unit"],
        ),
        (
            &plain("time_s,drive_V,Gauge (V)"),
            &["displacement=3*5 um/count"],
            None,
            ["E0504", "its unit is v", "per unit"],
        ),
        (
            &plain("time_s,drive_V,-displacement_um"),
            &[],
            None,
            ["E0504", "is missing", "'displacement=-displacement_um*-1 um'"],
        ),
        (&replaced(120, "0.118,9.91E+37,0.5"), &[], None, ["E0508", "`9.91E+37`", "delete the sample"]),
        (&replaced(120, "0.118,9.9e37,0.5"), &[], None, ["E0508", "`9.9e37`", "delete the sample"]),
        (
            &replaced(120, "# time_s,displacement_um,drive_V"),
            &[],
            None,
            ["E0504", "a comment names the columns", "a file of their own"],
        ),
        (&dated("3/6/2024"), &[], None, ["E0506", "does not say by how much", "2024-03-05"]),
        (&plain("Time (m),drive_V,displacement_um"), &["time_s=1"], None, ["E0504", "its unit is m", "*1 s/m"]),
    ];
    for (text, columns, rate, [code, message, help]) in cases {
        let found = read(text.as_bytes(), columns, rate).map(|record| record.warnings).unwrap_err();
        let one = found.iter().find(|one| one.code == code).unwrap_or_else(|| panic!("{message}: {found:?}"));
        assert!(one.message.contains(message) && one.help.contains(help), "{message}: {found:?}");
    }
    // With what the help says, they are read.
    assert_same("one of two", read(two.as_bytes(), &["displacement_nm=displacement_nm"], None));
    let minus = file("time_s,drive_V,-displacement_um", |[t, u, y]| format!("{t:?},{u:?},{:?}", -y));
    assert_same("the other sign", read(minus.as_bytes(), &["displacement=-displacement_um*-1 um"], None));
    assert_same("a unit", read(plain("time_s,drive_V,Field (Oe)").as_bytes(), &["displacement=Field (Oe)*1 um"], None));
}
