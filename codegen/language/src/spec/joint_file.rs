//! Twelve joints from a CSV file, as CAD programs write lists of points.

use std::path::Path;

use super::findings::Findings;
use super::text;
use crate::diagnostic::codes;
use crate::files;
use crate::keys::fields::{Field, Fields, KeyValue};
use crate::quantity::{self, Dimension};

const KEY: &str = "geometry.joints";
/// Largest file, bytes.
const LARGEST: u64 = 1 << 16;
/// Largest coordinate, m, as of `geometry.base_joints`.
const FARTHEST: f64 = 10.0;
const EXAMPLE: &str = "leg,where,x_mm,y_mm,z_mm";
const ROW_EXAMPLE: &str = "leg,base_x_mm,base_y_mm,base_z_mm,platform_x_mm,platform_y_mm,platform_z_mm";

/// Columns that say which joint a line is, in small letters.
const LEGS: &[&str] = &["leg", "number", "no", "no.", "nr", "#", "id", "index"];
const BODIES: &[&str] = &["where", "body", "part", "plate", "side", "joint", "name", "point", "label"];
/// How the name of a joint begins, or its only letter.
type BodyNames = (&'static [&'static str], char);
const BASE: BodyNames = (&["base", "bottom", "fixed", "ground", "lower"], 'b');
const PLATFORM: BodyNames = (&["platform", "top", "moving", "mobile", "upper"], 'p');

/// What is wrong with a file: its line, if it is one, and the help.
struct Refusal {
    line: Option<usize>,
    message: String,
    help: String,
}

fn refuse<T>(line: usize, message: String, help: impl Into<String>) -> Result<T, Refusal> {
    Err(Refusal { line: Some(line), message, help: help.into() })
}

/// Replaces `geometry.joints` by the joints in its file, as if they were given one by one.
pub(super) fn read(fields: &mut Fields, dir: &Path, findings: &mut Findings) {
    let Some(name) = fields.name(KEY).map(str::to_owned) else { return };
    let span = fields.span(KEY);
    let read = files::text_of(&dir.join(&name), LARGEST).map_err(|error| {
        let (message, help) = (format!("cannot be read: {error}"), error.help().to_owned());
        Refusal { line: None, message, help }
    });
    match read.and_then(|text| joints(&text)) {
        Ok(bodies) => {
            for (key, joints) in ["geometry.base_joints", "geometry.platform_joints"].into_iter().zip(bodies) {
                let parsed = KeyValue::Numbers(joints.as_flattened().to_vec());
                let items = vec![span.clone(); 6];
                fields.insert(key.to_owned(), Field { parsed, span: span.clone(), items, given: true });
            }
        }
        Err(Refusal { line, message, help }) => {
            let place = line.map_or_else(String::new, |line| format!(", line {line}"));
            let message = format!("\"{}\"{place}: {message}", text::shorten(&name));
            findings.add(codes::JOINT_FILE, KEY, span, message, help);
        }
    }
}

/// Places of the columns, and the units of the coordinates.
struct Head<'a> {
    separator: char,
    leg: Option<usize>,
    body: Option<usize>,
    coordinates: [(usize, &'a str); 3],
    /// Those of the platform, if a line has both joints of a leg.
    of_platform: Option<[(usize, &'a str); 3]>,
    /// Number of columns.
    count: usize,
    /// Whether numbers have a decimal comma.
    has_commas: bool,
}

/// A line of the file.
struct Joint {
    line: usize,
    leg: Option<i64>,
    is_platform: Option<bool>,
    point: [f64; 3],
}

/// The joints of the base and of the platform, leg by leg, m.
fn joints(text: &str) -> Result<[[[f64; 3]; 6]; 2], Refusal> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    // A tab before the first cell makes it an empty one.
    let numbered = text.lines().enumerate().map(|(at, line)| (at + 1, line.trim_end().trim_start_matches(' ')));
    let mut lines = numbered.filter(|(_, line)| !line.trim().is_empty() && !line.starts_with(['#', '%']));
    let Some((first, names)) = lines.next() else {
        return refuse(1, "the file is empty".to_owned(), format!("begin with a head such as {EXAMPLE}"));
    };
    // A line without a digit has units.
    let units = lines.clone().next().map(|(_, line)| line).filter(|line| !line.contains(|c: char| c.is_ascii_digit()));
    let mut head = Head::of(first, names, units.unwrap_or_default())?;
    if units.is_some() {
        lines.next();
    }
    // Beside decimal points a comma would divide thousands.
    head.has_commas = head.separator != ',' && !lines.clone().any(|(_, line)| line.contains('.'));
    let of_line = |(line, text)| head.coordinates_of(text).into_iter().map(move |cell| (line, cell));
    let coordinates = lines.clone().flat_map(of_line);
    let mut commas = coordinates.filter(|(_, cell)| head.has_commas && cell.contains(','));
    if let Some((line, cell)) = commas.clone().next()
        && commas.all(|(_, cell)| quantity::may_divide_thousands(cell, ','))
    {
        let message = format!("the comma of `{}` may divide thousands or begin the decimals", text::shorten(cell));
        return refuse(line, message, "write decimal points, and nothing between thousands");
    }
    let mut found = Vec::new();
    for (line, text) in lines {
        found.extend(head.joints(line, text)?);
    }
    if found.len() != 12 {
        let message = format!("there are {} joints, expected 12", found.len());
        return Err(Refusal {
            line: None,
            message,
            help: "write six lines of the base and six of the platform".to_owned(),
        });
    }
    for (at, joint) in found.iter_mut().enumerate() {
        joint.is_platform.get_or_insert(at >= 6);
    }
    let bodies = [false, true].map(|body| of_body(&found, body));
    let [base, platform] = bodies;
    Ok([base?, platform?])
}

/// The joints of one body, leg by leg.
fn of_body(all: &[Joint], is_platform: bool) -> Result<[[f64; 3]; 6], Refusal> {
    let own: Vec<&Joint> = all.iter().filter(|joint| joint.is_platform == Some(is_platform)).collect();
    let name = if is_platform { "platform" } else { "base" };
    if own.len() != 6 {
        let message = format!("there are {} joints of the {name}, expected 6", own.len());
        let help = "write base or platform, or B0 to B5 and P0 to P5".to_owned();
        return Err(Refusal { line: None, message, help });
    }
    let numbers: Vec<i64> = own.iter().enumerate().map(|(at, joint)| joint.leg.unwrap_or(at as i64)).collect();
    // Legs count from 0; many lists count from 1, and those of the platform go on.
    let from = i64::from(!numbers.contains(&0)) + if numbers.iter().all(|number| *number > 6) { 6 } else { 0 };
    let of_leg = |leg: i64| own.iter().zip(&numbers).filter(move |(_, number)| **number == leg + from);
    let mut points = [[0.0; 3]; 6];
    for (point, leg) in points.iter_mut().zip(0..) {
        let mut joints = of_leg(leg).map(|(joint, _)| joint);
        let Some(joint) = joints.next() else {
            let message = format!("the {name} has no joint of leg {}", leg + from);
            return Err(Refusal {
                line: None,
                message,
                help: "number the legs of each body from 0 to 5, or from 1 to 6".to_owned(),
            });
        };
        if let Some(other) = joints.next() {
            let message = format!("leg {} has a second joint at the {name}", leg + from);
            return refuse(other.line, message, "number the legs of each body from 0 to 5, or from 1 to 6");
        }
        *point = joint.point;
    }
    Ok(points)
}

/// What follows the name of a coordinate, such as `x`, or of one of a body, such as `Base X`, `bx` or `x_base`.
fn unit_of(name: &str, axis: char, body: Option<BodyNames>) -> Option<&str> {
    let is_named = |name: &str| {
        let name: String = name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
        let Some((words, letter)) = body else { return name.chars().eq([axis]) };
        let mut rests = [name.strip_prefix(axis), name.strip_suffix(axis)].into_iter().flatten();
        rests.any(|rest| words.contains(&rest) || rest.chars().eq([letter]))
    };
    let ends = name.char_indices().map(|(at, _)| at).chain([name.len()]);
    // `-x` has the other sign.
    let mut ends = ends
        .filter(|_| !name.starts_with(['-', '\u{2212}', '\u{2013}']))
        .filter(|end| !name[*end..].starts_with(char::is_alphanumeric));
    ends.find(|end| is_named(&name[..*end])).map(|end| &name[end..])
}

fn is_length(unit: &str) -> bool {
    quantity::parse_as(&format!("1 {unit}"), Dimension::LENGTH).is_ok_and(|one| one.dimension == Dimension::LENGTH)
}

fn cells(line: &str, separator: char) -> Vec<&str> {
    if separator == ' ' {
        return line.split_whitespace().map(|cell| cell.trim_matches('"')).collect();
    }
    line.split(separator).map(|cell| cell.trim().trim_matches('"').trim()).collect()
}

impl<'a> Head<'a> {
    /// `units`: the line below, if it has them.
    fn of(line: usize, names: &'a str, units: &'a str) -> Result<Self, Refusal> {
        let separator = ['\t', ';', ','].into_iter().find(|separator| names.contains(*separator)).unwrap_or(' ');
        let (names, units) = (cells(names, separator), cells(units, separator));
        // The clearest name first.
        let called =
            |known: &[&str]| known.iter().find_map(|one| names.iter().position(|name| name.to_lowercase() == *one));
        // Columns that may hold a coordinate, each with what follows its name, and with its unit in the line below.
        let candidates = |axis: char, body: Option<BodyNames>| {
            let all = names.iter().copied().enumerate().filter_map(|(at, name)| {
                let plain = |unit: &'a str| unit.trim_matches(|c: char| c.is_whitespace() || "_[]()/,.".contains(c));
                let below = units.get(at).copied().unwrap_or_default();
                Some((at, [unit_of(name, axis, body)?, below].map(plain)))
            });
            all.collect::<Vec<_>>()
        };
        let head = || format!("write the names and the unit in the first line: {EXAMPLE}, or {ROW_EXAMPLE}");
        let coordinate = |axis: char, body: Option<BodyNames>| {
            let mut found = candidates(axis, body);
            if found.is_empty() {
                return refuse(line, format!("there is no column {axis}"), head());
            }
            // Not `x_tol`.
            found.retain(|(_, [name, _])| name.is_empty() || is_length(name));
            if let [(first, _), (second, _), ..] = found[..] {
                let message = format!("the columns {} and {} are both {axis}", first + 1, second + 1);
                return refuse(line, message, "delete one of them");
            }
            match found[..] {
                [(at, ["", unit] | [unit, ""])] if is_length(unit) => Ok((at, unit)),
                [(at, [name, below])] if name == below && !name.is_empty() => Ok((at, name)),
                [(_, [name, below])] if !name.is_empty() && !below.is_empty() => {
                    let message = format!("the unit of {axis} is {name} in its name, and {below} in the line of units");
                    refuse(line, message, "keep the right one of the two")
                }
                _ => refuse(line, format!("the column {axis} has no unit of length"), head()),
            }
        };
        let all = |body| Ok::<_, Refusal>([coordinate('x', body)?, coordinate('y', body)?, coordinate('z', body)?]);
        let (leg, body, count) = (called(LEGS), called(BODIES), names.len());
        let head =
            Self { separator, leg, body, coordinates: [(0, ""); 3], of_platform: None, count, has_commas: false };
        if candidates('x', Some(PLATFORM)).is_empty() {
            return Ok(Self { coordinates: all(None)?, ..head });
        }
        let (coordinates, of_platform) = (all(Some(BASE))?, Some(all(Some(PLATFORM))?));
        // A line has both bodies, and its name only says the leg.
        Ok(Self { coordinates, of_platform, leg: leg.or(body), body: None, ..head })
    }

    /// The texts of the coordinates.
    fn coordinates_of<'t>(&self, text: &'t str) -> Vec<&'t str> {
        let cells = cells(text, self.separator);
        let places = self.coordinates.into_iter().chain(self.of_platform.into_iter().flatten());
        places.map(|(at, _)| cells.get(at).copied().unwrap_or_default()).collect()
    }

    /// The joints in a line: one, or both of a leg.
    fn joints(&self, line: usize, text: &str) -> Result<Vec<Joint>, Refusal> {
        let joint = self.joint(line, text)?;
        let Some(coordinates) = self.of_platform else { return Ok(vec![joint]) };
        let other = Self { coordinates, ..*self }.joint(line, text)?;
        Ok(vec![Joint { is_platform: Some(false), ..joint }, Joint { is_platform: Some(true), ..other }])
    }

    fn joint(&self, line: usize, text: &str) -> Result<Joint, Refusal> {
        let cells = cells(text, self.separator);
        let cell = |at: usize| cells.get(at).copied().unwrap_or_default();
        if cells.iter().skip(self.count).any(|cell| !cell.is_empty()) {
            let message = "the line has more cells than the first line has names".to_owned();
            return refuse(line, message, "write decimal points, or semicolons between the columns");
        }
        let mut point = [0.0; 3];
        for (value, (at, unit)) in point.iter_mut().zip(self.coordinates) {
            let decimal = if self.has_commas { cell(at).replace(',', ".") } else { cell(at).to_owned() };
            // With its unit, so that it has the bits of the same text in a spec.
            let number = quantity::parse(&decimal).is_ok_and(|number| number.dimension == Dimension::NONE);
            let read = quantity::parse_as(&format!("{decimal} {unit}"), Dimension::LENGTH).ok().filter(|_| number);
            let Some(read) = read.filter(|read| (-FARTHEST..=FARTHEST).contains(&read.value)) else {
                let message = format!("`{}` is no coordinate from -10 m to 10 m", text::shorten(cell(at)));
                return refuse(line, message, "write a number with a decimal point; its unit is in the first line");
            };
            *value = if read.value == 0.0 { 0.0 } else { read.value };
        }
        let (name, number) = self.body.map_or(("", ""), |at| {
            let name = cell(at);
            name.split_at(name.trim_end_matches(|c: char| c.is_ascii_digit()).len())
        });
        // `Base_A` to `Base_F`.
        let letter = name.rsplit_once(['_', ' ', '-']).filter(|_| number.is_empty()).map(|(_, letter)| letter);
        let letter = letter
            .and_then(|letter| ["a", "b", "c", "d", "e", "f"].iter().position(|one| letter.eq_ignore_ascii_case(one)));
        let plain = name.trim_end_matches([' ', '_', '-']).to_lowercase();
        let is =
            |(words, letter): BodyNames| words.iter().any(|word| plain.starts_with(word)) || plain.chars().eq([letter]);
        let is_platform = match plain.as_str() {
            "" => None,
            _ if is(BASE) => Some(false),
            _ if is(PLATFORM) => Some(true),
            _ => {
                let message = format!("`{}` is neither base nor platform", text::shorten(name));
                return refuse(line, message, "write base or platform, or B0 to B5 and P0 to P5");
            }
        };
        let given = self.leg.map_or(number, cell);
        let digits = given.trim_start_matches(|c: char| c.is_alphabetic() || matches!(c, ' ' | '_'));
        let leg = digits.parse().ok().or(letter.map(|letter| letter as i64));
        if leg.is_none() && (self.leg.is_some() || !given.is_empty()) {
            let message = format!("`{}` is no number of a leg", text::shorten(given));
            return refuse(line, message, "number the legs from 0 to 5, or from 1 to 6");
        }
        Ok(Joint { line, leg, is_platform, point })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: [[f64; 2]; 6] = [[1.0, 0.0], [0.5, 0.9], [-0.5, 0.9], [-1.0, 0.0], [-0.5, -0.9], [0.5, -0.9]];

    /// Twelve lines: leg from `first`, body as `name` has it, coordinates in mm.
    fn file(head: &str, first: usize, row: impl Fn(usize, bool, [String; 3]) -> String) -> String {
        let mut text = format!("{head}\n");
        for is_platform in [false, true] {
            for (leg, [x, y]) in BODY.iter().enumerate() {
                let far = if is_platform { 100.5 } else { 150.0 };
                let point = [x * far, y * far, f64::from(u8::from(is_platform))].map(|v| format!("{v}"));
                text += &format!("{}\n", row(leg + first, is_platform, point));
            }
        }
        text
    }

    /// Six lines, each with both joints of a leg in mm.
    fn of_legs(head: &str, row: impl Fn(usize, String) -> String) -> String {
        let line = |(leg, [x, y]): (usize, &[f64; 2])| {
            let row = row(leg, format!("{},{},0,{},{},1", x * 150.0, y * 150.0, x * 100.5, y * 100.5));
            format!("{row}\n")
        };
        format!("{head}\n{}", BODY.iter().enumerate().map(line).collect::<String>())
    }

    fn body(is_platform: bool) -> &'static str {
        if is_platform { "platform" } else { "base" }
    }

    fn plain() -> String {
        file(EXAMPLE, 0, |leg, top, [x, y, z]| format!("{leg},{},{x},{y},{z}", body(top)))
    }

    #[test]
    fn lists_of_many_programs_give_the_same_joints() {
        let expected = joints(&plain()).ok().expect("the plain form");
        assert_eq!(expected[1][1][0].to_bits(), quantity::parse("50.25 mm").expect("a length").value.to_bits());
        let turned = |text: String| {
            let mut lines: Vec<&str> = text.lines().collect();
            lines[1..].reverse();
            lines.join("\r\n")
        };
        for (what, text) in [
            ("from 1", file(EXAMPLE, 1, |leg, top, [x, y, z]| format!("{leg},{},{x},{y},{z}", body(top)))),
            ("reversed, Windows", turned(plain())),
            ("units twice", plain().replacen('\n', "\n,,mm,mm,mm\n", 1)),
            ("without legs and bodies", file("x (mm),y (mm),z (mm)", 0, |_, _, [x, y, z]| format!("{x},{y},{z}"))),
            (
                "names",
                file("Name;X [mm];Y [mm];Z [mm]", 1, |leg, top, point| {
                    format!("\"{}{leg}\";{}", if top { "P" } else { "B" }, point.join(";").replace('.', ","))
                }),
            ),
            (
                "tabs, other order",
                file("\u{feff}z_mm\ty_mm\tx_mm\tPoint", 0, |leg, top, [x, y, z]| {
                    format!("{z}\t{y}\t{x}\t{} {leg}", if top { "Top" } else { "Bottom" })
                }),
            ),
            (
                "a column of numbers that is called joint",
                file("joint,where,x_mm,y_mm,z_mm", 0, |leg, top, [x, y, z]| format!("{leg},{},{x},{y},{z}", body(top))),
            ),
            (
                "units below, platform from 7",
                file("\"Joint\",X,Y,Z\n,[mm],[mm],[mm]", 1, |leg, top, [x, y, z]| {
                    format!("{} {},{x},{y},{z}", body(top), leg + if top { 6 } else { 0 })
                }),
            ),
            (
                "blanks",
                file("name  x_mm  y_mm  z_mm", 1, |leg, top, point| {
                    format!("{}{leg}   {}", if top { "P" } else { "B" }, point.join(" "))
                }),
            ),
            (
                "letters, reversed",
                turned(file("name,x_mm,y_mm,z_mm", 0, |leg, top, [x, y, z]| {
                    format!("{}_{},{x},{y},{z}", body(top), ["A", "B", "C", "D", "E", "F"][leg])
                })),
            ),
            ("six lines", of_legs("leg,bx_mm,by_mm,bz_mm,px_mm,py_mm,pz_mm", |leg, row| format!("{leg},{row}"))),
            (
                "six lines with words",
                of_legs("Base X [mm];Base Y [mm];Base Z [mm];Top X [mm];Top Y [mm];Top Z [mm]", |_, row| {
                    row.replace(',', ";")
                }),
            ),
            (
                "six lines, reversed, the axis first",
                turned(of_legs("x_base,y_base,z_base,x_platform,y_platform,z_platform,name", |leg, row| {
                    format!("{row},Leg {}", leg + 1)
                }))
                .replacen("name", "name\nmm,mm,mm,mm,mm,mm,", 1),
            ),
            (
                "tolerances",
                file("leg,where,x_mm,x_tol,y_mm,z_mm\n,,mm,mm,mm,mm", 0, |leg, top, [x, y, z]| {
                    format!("{leg},{},{x},0.1,{y},{z}", body(top))
                }),
            ),
            (
                "tabs, units below an empty cell",
                file("NAME\tX\tY\tZ\n\tmm\tmm\tmm", 0, |leg, top, point| {
                    format!("{}_{leg}\t{}", body(top), point.join("\t"))
                }),
            ),
            (
                "metres",
                file("# CAD\nleg,where,x_m,y_m,z_m", 0, |leg, top, point| {
                    format!("{leg},{},{}", body(top), point.map(|v| v + "e-3").join(","))
                }),
            ),
        ] {
            let found = joints(&text).unwrap_or_else(|refused| panic!("{what}: {}: {text}", refused.message));
            assert_eq!(found, expected, "{what}");
        }
    }

    #[test]
    fn a_wrong_line_is_named() {
        let plain = plain();
        let without_last = plain.trim_end().rsplit_once('\n').expect("lines").0.to_owned();
        for (text, line, words) in [
            (String::new(), Some(1), "is empty"),
            (plain.replace("x_mm", "x"), Some(1), "the column x has no unit"),
            (plain.replace("y_mm", "y_kg"), Some(1), "the column y has no unit"),
            (plain.replace("z_mm", "height"), Some(1), "there is no column z"),
            (plain.replace("0,base,150", "0,base,wide"), Some(2), "`wide` is no coordinate"),
            (plain.replace("0,base,150", "0,base,15000"), Some(2), "`15000` is no coordinate"),
            (plain.replace("0,base", "first,base"), Some(2), "`first` is no number"),
            (plain.replace("0,base", "0,arm"), Some(2), "`arm` is neither"),
            (plain.replace("1,base", "2,base"), None, "the base has no joint of leg 1"),
            (plain.replace("5,base", "5,platform"), None, "there are 5 joints of the base"),
            (plain.replace("0,base", "0,machine"), Some(2), "`machine` is neither"),
            (plain.replace("0,base,150", "0,base,150,5"), Some(2), "more cells than"),
            (plain.replace("0,base,150", "0,base,\"150,5\""), Some(2), "more cells than"),
            (plain.replace(',', ";").replace("0;base;150", "0;base;1,234"), Some(2), "`1,234` is no coordinate"),
            (plain.replacen('\n', "\n,,m,m,m\n", 1), Some(1), "the unit of x is mm in its name, and m in the line"),
            (plain.replacen("z_mm", "x_m,z_mm", 1), Some(1), "the columns 3 and 5 are both x"),
            (file("x_mm;y_mm;z_mm", 0, |_, _, _| "1,234;5;6".to_owned()), Some(2), "the comma of `1,234` may divide"),
            (without_last, None, "there are 11 joints"),
            (of_legs("leg,bx_mm,by_mm,bz_mm,px_mm,py_mm,w", |leg, row| format!("{leg},{row}")), Some(1), "no column z"),
            (of_legs("leg,bx,by,bz,px,py,pz", |leg, row| format!("{leg},{row}")), Some(1), "column x has no unit"),
        ] {
            let refused = joints(&text).err().unwrap_or_else(|| panic!("{text}"));
            assert_eq!(refused.line, line, "{}: {text}", refused.message);
            assert!(refused.message.contains(words) && !refused.help.is_empty(), "{}: {text}", refused.message);
        }
    }
}
