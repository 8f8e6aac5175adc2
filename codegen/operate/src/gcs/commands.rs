//! Executes commands and queries.

use specgen_link::client::Port;

use super::axes::{Axes, from_wire, to_wire};
use super::code::Code;
use super::input::{Piece, STOP};
use super::stage::{Rejection, Stage};
use crate::motion::{Motion, limits};

/// Bits of the status of `#4`.
const REFERENCED: u32 = 0x1_0000;
const ON_TARGET: u32 = 0x8000;
const IN_MOTION: u32 = 0x2000;
const SERVO: u32 = 0x1000;
const ERROR: u32 = 0x100;

/// Parameters of `SPA?`: largest speed, unit of an axis.
const SPEED: u32 = 0xa;
const UNIT: u32 = 0x0700_0601;

/// Largest plausible pivot coordinate, m.
const FARTHEST: f64 = 10.0;

/// Every command, with its description in `HLP?`.
const HELP: &[&str] = &[
    "#3 Real positions",
    "#4 Status",
    "#5 Mask of axes in motion",
    "#7 Ready",
    "#24 Stop all axes",
    "*IDN? Identification",
    "CSV? Version of the command set",
    "ERR? Last error, then cleared",
    "FRF [axes] Reference: no motion, gauges are absolute",
    "FRF? [axes] Whether referenced",
    "HLP? This list",
    "HLT [axes] Stop",
    "MOV axis value ... Move to a position",
    "MOV? [axes] Target position",
    "MVR axis value ... Move by a distance",
    "NLM? [axes], TMN? [axes] Lowest position",
    "ONT? [axes] Whether on target",
    "PLM? [axes], TMX? [axes] Highest position",
    "POS? [axes] Position",
    "PUN? [axes] Unit",
    "SAI? [ALL] Axes",
    "SPA? axis id Parameter",
    "SPI point value ... Pivot point R S T",
    "SPI? [points] Pivot point",
    "STP Stop all axes",
    "SVO axis state ... Servo of the machine, all axes at once",
    "SVO? [axes] Servo",
    "TRA? axis direction ... Reach along a direction",
    "VEL axis value ... Speed; only that of the spec, or more",
    "VEL? [axes] Speed",
    "VLS value Speed; only that of the spec, or more",
    "VLS? Speed",
    "VMO? axis value ... Whether a position can be reached",
];

/// Result of one command: its answer, if it has one, or why it failed.
pub(super) type Outcome = Result<Option<String>, Rejection>;

/// The client of a command.
pub(super) struct ClientContext<'a> {
    pub(super) axes: &'a Axes,
    /// The pending error of `ERR?`.
    pub(super) error: &'a mut Option<Code>,
    /// Whether this client may control the machine.
    pub(super) may_control: bool,
}

/// Executes a command.
pub(super) fn execute<P: Port>(stage: &mut Stage<P>, asked: &mut ClientContext<'_>, piece: &Piece) -> Outcome {
    match piece {
        Piece::TooLong => Err(Code::TooLong.into()),
        Piece::Single(byte) => single(stage, asked, *byte),
        Piece::Line(line) => {
            if piece.needs_control() && !asked.may_control {
                return Err(Code::NotNow.into());
            }
            let words: Vec<&str> = line.split_whitespace().collect();
            let (command, rest) = words.split_first().ok_or(Code::UnknownCommand)?;
            match command.strip_suffix('?') {
                Some(command) => query(stage, asked, command, rest),
                None => control(stage, asked, command, rest),
            }
        }
    }
}

fn single<P: Port>(stage: &mut Stage<P>, asked: &mut ClientContext<'_>, byte: u8) -> Outcome {
    if byte == STOP {
        return stop(stage);
    }
    stage.refresh()?;
    let text = match byte {
        3 => return query(stage, asked, "POS", &[]),
        4 => {
            let moves = stage.moves();
            let bits = [
                (REFERENCED, true),
                (SERVO, stage.servo()),
                (IN_MOTION, moves),
                (ON_TARGET, stage.servo() && !moves),
                (ERROR, asked.error.is_some()),
            ];
            bits.iter().filter(|(_, is)| *is).map(|(bit, _)| bit).sum::<u32>().to_string()
        }
        // All axes of a platform move together.
        5 if stage.moves() => mask(asked.axes.iter().count()),
        7 => return Ok(Some(char::from(if stage.is_starting() { 0xb0 } else { 0xb1 }).to_string())),
        // Nothing in motion, no macro, no wave.
        _ => "0".to_owned(),
    };
    Ok(Some(text))
}

/// A mask of the lowest `count` bits, in hexadecimal. Above 9 it has the prefix `0x`: clients that parse it as C does would
/// otherwise stop at a letter, and take a moving platform for one at rest.
fn mask(count: usize) -> String {
    let mask = (1_u32 << count) - 1;
    if mask > 9 { format!("{mask:#X}") } else { mask.to_string() }
}

fn stop<P: Port>(stage: &mut Stage<P>) -> Outcome {
    stage.stop()?;
    Err(Code::Stopped.into())
}

fn control<P: Port>(stage: &mut Stage<P>, asked: &ClientContext<'_>, command: &str, rest: &[&str]) -> Outcome {
    match command {
        "MOV" | "MVR" => {
            let values = values(asked.axes, rest)?;
            stage.refresh()?;
            let mut pose = stage.start_of_move()?;
            for (axis, value) in values {
                let value = from_wire(value);
                pose[axis] = if command == "MVR" { pose[axis] + value } else { value };
            }
            stage.go(&pose)?;
        }
        "SVO" => {
            let values = values(asked.axes, rest)?;
            stage.refresh()?;
            match values.iter().map(|(_, value)| *value).collect::<Vec<_>>()[..] {
                // The platform has one loop for all axes.
                [first, ref others @ ..] if others.iter().any(|other| other != &first) => {
                    return Err(Code::ParameterRange.into());
                }
                [0.0, ..] => stage.shut_down()?,
                [1.0, ..] => stage.start()?,
                _ => return Err(Code::ParameterRange.into()),
            }
        }
        // It stops even if its parameters are invalid.
        "STP" | "HLT" => {
            let stopped = stop(stage);
            return match chosen(asked.axes, rest) {
                _ if command == "STP" && !rest.is_empty() => Err(Code::ParameterCount.into()),
                Err(code) if command == "HLT" => Err(code.into()),
                _ => stopped,
            };
        }
        "FRF" => {
            chosen(asked.axes, rest)?;
            stage.refresh()?;
            if !stage.servo() {
                return Err(Code::ServoOff.into());
            }
        }
        "SPI" => {
            let mut pivot = stage.pivot();
            for (name, value) in pairs(rest)? {
                let value = from_wire(number(value)?);
                let place = point(name)?;
                if value.abs() > FARTHEST {
                    return Err(Code::ParameterRange.into());
                }
                pivot[place] = value;
            }
            stage.refresh()?;
            stage.set_pivot(pivot)?;
        }
        "VEL" => {
            for (axis, value) in values(asked.axes, rest)? {
                fast_enough(value, to_wire(stage.motion().speed()[axis]))?;
            }
        }
        "VLS" => match rest {
            [value] => fast_enough(number(value)?, system_speed(stage.motion()))?,
            _ => return Err(Code::ParameterCount.into()),
        },
        _ => return Err(Code::UnknownCommand.into()),
    }
    Ok(None)
}

/// The machine moves at the speed of its spec: a higher limit is accepted, a lower one refused.
fn fast_enough(value: f64, speed: f64) -> Result<(), Code> {
    // Tolerates the rounding of answers, so that a client may set the speed that it read.
    if value >= speed - 1e-6 { Ok(()) } else { Err(Code::Velocity) }
}

/// Speed of the slowest translation, µm/s.
fn system_speed(motion: &Motion) -> f64 {
    let [x, y, z, ..] = *motion.speed();
    to_wire([y, z].into_iter().fold(x, |least, speed| if speed < least { speed } else { least }))
}

fn query<P: Port>(stage: &mut Stage<P>, asked: &mut ClientContext<'_>, command: &str, rest: &[&str]) -> Outcome {
    let axes = asked.axes;
    let text = match command {
        "*IDN" => {
            let description = stage.session().description();
            let digest: String = description.digest.chars().take(8).collect();
            // Clients split the answer at commas.
            let name = description.name.replace(',', " ");
            format!("specgen,HEXAPOD {name},{digest},{}", description.version)
        }
        "CSV" => "2.0".to_owned(),
        "ERR" => {
            stage.refresh()?;
            if asked.may_control {
                // The result of a move is known some ticks later.
                if !stage.is_answered() {
                    return Err(Rejection::Later);
                }
                if let Some(code) = stage.mishap() {
                    asked.error.get_or_insert(code);
                }
            }
            asked.error.take().map_or(0, |code| code as u32).to_string()
        }
        "HLP" => lines(HELP.iter().map(|line| (*line).to_owned())),
        "SAI" if rest.iter().all(|word| *word == "ALL") => lines(axes.iter().map(|(name, _)| name.to_owned())),
        "TPC" => "0".to_owned(),
        "JON" => lines(rest.iter().map(|name| format!("{name}=0"))),
        "HIN" => per_axis(axes, rest, |_| "0".to_owned())?,
        "PUN" => per_axis(axes, rest, |axis| unit(axis).to_owned())?,
        "FRF" | "RON" | "EAX" => per_axis(axes, rest, |_| "1".to_owned())?,
        "VEL" => per_axis(axes, rest, |axis| decimal(to_wire(stage.motion().speed()[axis])))?,
        "VLS" => decimal(system_speed(stage.motion())),
        "TMN" | "NLM" => per_axis(axes, rest, |axis| decimal(to_wire(ends(stage, axis)[0])))?,
        "TMX" | "PLM" => per_axis(axes, rest, |axis| decimal(to_wire(ends(stage, axis)[1])))?,
        "SPA" => parameters(stage.motion(), axes, rest)?,
        "SPI" => {
            let names = if rest.is_empty() { &["R", "S", "T"][..] } else { rest };
            let pivot = stage.pivot();
            let of = |name: &&str| Ok::<_, Code>(format!("{name}={}", decimal(to_wire(pivot[point(name)?]))));
            lines(names.iter().map(of).collect::<Result<Vec<_>, _>>()?.into_iter())
        }
        "POS" | "MOV" | "ONT" | "SVO" | "VMO" | "TRA" => {
            stage.refresh()?;
            match command {
                "POS" => {
                    let pose = stage.pose()?;
                    per_axis(axes, rest, |axis| decimal(to_wire(pose[axis])))?
                }
                "MOV" => per_axis(axes, rest, |axis| decimal(to_wire(stage.goal()[axis])))?,
                "ONT" => {
                    let there = stage.servo() && !stage.moves();
                    per_axis(axes, rest, |_| u32::from(there).to_string())?
                }
                "SVO" => per_axis(axes, rest, |_| u32::from(stage.servo()).to_string())?,
                "VMO" => {
                    let mut pose = stage.goal();
                    for (axis, value) in values(axes, rest)? {
                        pose[axis] = from_wire(value);
                    }
                    u32::from(stage.admitted(&pose).is_some()).to_string()
                }
                _ => reach(stage, axes, rest)?,
            }
        }
        _ => return Err(Code::UnknownCommand.into()),
    };
    Ok(Some(text))
}

/// Least and largest position of an axis with the others at zero, m or rad.
fn ends<P: Port>(stage: &Stage<P>, axis: usize) -> [f64; 2] {
    limits(|pose| stage.admitted(pose).is_some(), &[0.0; 6], axis)
}

/// The farthest position of each axis from the goal along a direction.
fn reach<P: Port>(stage: &Stage<P>, axes: &Axes, rest: &[&str]) -> Result<String, Code> {
    let values = values(axes, rest)?;
    let mut way = [0.0; 6];
    for (axis, value) in &values {
        way[*axis] = from_wire(*value);
    }
    let start = stage.goal();
    let far = stage.reach(&start, &way);
    let names = rest.iter().step_by(2).zip(&values);
    Ok(lines(names.map(|(name, (axis, _))| format!("{name}={}", decimal(to_wire(start[*axis] + far * way[*axis]))))))
}

fn parameters(motion: &Motion, axes: &Axes, rest: &[&str]) -> Result<String, Code> {
    let of = |(name, id): (&str, &str)| {
        let axis = axes.place(name).ok_or(Code::Axis)?;
        let hexadecimal = id.strip_prefix("0x").or_else(|| id.strip_prefix("0X"));
        let number = hexadecimal.map_or_else(|| id.parse().ok(), |digits| u32::from_str_radix(digits, 16).ok());
        match number.ok_or(Code::Syntax)? {
            SPEED => Ok(format!("{name} {id}={}", decimal(to_wire(motion.speed()[axis])))),
            UNIT => Ok(format!("{name} {id}={}", unit(axis))),
            _ => Err(Code::ParameterRange),
        }
    };
    Ok(lines(pairs(rest)?.into_iter().map(of).collect::<Result<Vec<_>, _>>()?.into_iter()))
}

fn unit(axis: usize) -> &'static str {
    if axis < 3 { "um" } else { "urad" }
}

/// `NAME=…` of the given axes, or of all.
fn per_axis(axes: &Axes, rest: &[&str], of: impl Fn(usize) -> String) -> Result<String, Code> {
    Ok(lines(chosen(axes, rest)?.into_iter().map(|(name, axis)| format!("{name}={}", of(axis)))))
}

fn chosen<'a>(axes: &'a Axes, names: &[&'a str]) -> Result<Vec<(&'a str, usize)>, Code> {
    if names.is_empty() {
        return Ok(axes.iter().collect());
    }
    names.iter().map(|name| axes.place(name).map(|axis| (*name, axis)).ok_or(Code::Axis)).collect()
}

/// Axis and value of each pair; an axis may occur once.
fn values(axes: &Axes, rest: &[&str]) -> Result<Vec<(usize, f64)>, Code> {
    let mut found: Vec<(usize, f64)> = Vec::new();
    for (name, value) in pairs(rest)? {
        let axis = axes.place(name).ok_or(Code::Axis)?;
        if found.iter().any(|(known, _)| *known == axis) {
            return Err(Code::AxisTwice);
        }
        found.push((axis, number(value)?));
    }
    Ok(found)
}

fn pairs<'a>(rest: &[&'a str]) -> Result<Vec<(&'a str, &'a str)>, Code> {
    let (pairs, odd) = rest.as_chunks::<2>();
    if pairs.is_empty() || !odd.is_empty() {
        return Err(Code::ParameterCount);
    }
    Ok(pairs.iter().map(|[name, value]| (*name, *value)).collect())
}

fn number(text: &str) -> Result<f64, Code> {
    text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or(Code::Syntax)
}

fn point(name: &str) -> Result<usize, Code> {
    ["R", "S", "T"].iter().position(|known| *known == name).ok_or(Code::Axis)
}

/// Six decimals of µm or µrad; clients use four.
fn decimal(value: f64) -> String {
    format!("{value:.6}")
}

/// Joins the lines of an answer; each but the last ends with a space.
fn lines(lines: impl Iterator<Item = String>) -> String {
    lines.collect::<Vec<_>>().join(" \n")
}
