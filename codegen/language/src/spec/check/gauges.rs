//! The six gauges that measure the platform. Whether they observe every direction is checked in the lowering.

use super::control;
use crate::diagnostic::codes;
use crate::keys::fields::Fields;
use crate::model;
use crate::spec::findings::Findings;
use crate::spec::keys;
use crate::spec::text::number;

/// Tolerance on the sum of squares of three direction cosines that comes from angles with one or two decimals.
const COSINES: f64 = 2e-3;
/// Round angles in drawings, deg. A vector with only these components, one of them at least as large as the first, is
/// not a direction.
const DRAWN: [f64; 10] = [30.0, 45.0, 60.0, 90.0, 120.0, 135.0, 150.0, 180.0, 270.0, 360.0];
/// Least |cos| between the measuring line and the normal of its target.
const STEEPEST: f64 = 0.1;

pub(super) fn six(f: &Fields, findings: &mut Findings) -> Option<()> {
    control::there(f)?;
    let count = f.count("gauge");
    if count == 6 || findings.mentions(&["gauge"]) {
        return Some(());
    }
    // A seventh gauge is one too many; without gauges, the finding is about [control], which needs them.
    let path = if count > 6 { "gauge[6]" } else { "gauge" };
    let last = format!("gauge[{}]", count.saturating_sub(1));
    let place = if count > 6 { f.table(path) } else { f.table(&last).or_else(|| f.table("control")) };
    findings.add(
        codes::GAUGE_COUNT,
        path,
        place.unwrap_or(0..0),
        format!("there are {count} sections [[gauge]], expected 6"),
        format!(
            "write six, one for each gauge, in the order of the gauge words:\n{}",
            keys::section("gauge").map_or_else(String::new, |section| section.template().trim_end().to_owned())
        ),
    );
    Some(())
}

pub(super) fn directions(f: &Fields, findings: &mut Findings) -> Option<()> {
    for gauge in 0..f.count("gauge") {
        let paths = ["direction", "target_normal"].map(|key| format!("gauge[{gauge}].{key}"));
        let mut units = [None; 2];
        for (path, unit) in paths.iter().zip(&mut units) {
            let Some(vector) = f.list::<3>(path) else {
                continue;
            };
            *unit = model::unit(vector);
            if unit.is_none() {
                findings.add(
                    codes::BAD_DIRECTION,
                    path,
                    f.span(path),
                    format!("`{path}` is zero, so that it has no direction"),
                    "write the components of a direction, at least one of them not 0: [<number>, <number>, <number>]"
                        .to_owned(),
                );
            }
        }
        let [Some(line), Some(normal)] = units else {
            continue;
        };
        let cosine = line[0] * normal[0] + line[1] * normal[1] + line[2] * normal[2];
        if cosine.abs() < STEEPEST {
            findings.add(
                codes::BAD_DIRECTION,
                &paths[1],
                f.span(&paths[1]),
                format!(
                    "the gauge measures almost parallel to its target: its direction and the target's normal have a cosine of {}",
                    number(cosine)
                ),
                format!(
                    "check `gauge[{gauge}].direction` and `gauge[{gauge}].target_normal`; without target_normal the target faces its gauge"
                ),
            );
        }
    }
    Some(())
}

/// The vector with these `angles` to x, y and z; none if no vector has them.
fn from_angles(angles: [f64; 3], unit: f64, range: std::ops::RangeInclusive<f64>) -> Option<[f64; 3]> {
    let largest = angles.iter().fold(0.0, |most: f64, angle| if angle.abs() > most { angle.abs() } else { most });
    let cosines = angles.map(|angle| libm::cos(angle * unit));
    let sum: f64 = cosines.iter().fold(0.0, |sum, cosine| sum + cosine * cosine);
    (range.contains(&largest) && (sum - 1.0).abs() <= COSINES).then_some(cosines)
}

/// Whether a vector longer than a unit vector is a point, in any unit.
fn is_point(vector: [f64; 3], point: [f64; 3]) -> bool {
    let length = |v: [f64; 3]| libm::sqrt(v.iter().fold(0.0, |sum, one| sum + one * one));
    let (long, far) = (length(vector), length(point));
    let along: f64 = vector.iter().zip(point).fold(0.0, |sum, (a, b)| sum + a * b);
    let oblique = vector.iter().filter(|one| **one != 0.0).count() > 1;
    oblique && long > 2.0 && along > (1.0 - 1e-9) * long * far
}

/// A direction is a vector of any length, so three angles look like one. Angles with the axes are recognised by their
/// cosines, others as round angles of a drawing.
pub(super) fn not_angles(f: &Fields, findings: &mut Findings) -> Option<()> {
    for (gauge, key) in (0..f.count("gauge")).flat_map(|gauge| ["direction", "target_normal"].map(|key| (gauge, key))) {
        let path = format!("gauge[{gauge}].{key}");
        let Some(vector) = f.list::<3>(&path) else { continue };
        // Components of a unit vector are not radians, and those of a vector of a few units are not degrees.
        let degrees = from_angles(vector, std::f64::consts::PI / 180.0, 10.0..=360.0);
        // The numbers of the point: a position and not a direction. Along an axis the two are equal.
        let point = f.list::<3>(&format!("gauge[{gauge}].point")).filter(|_| key == "direction");
        if point.is_some_and(|point| is_point(vector, point)) {
            findings.add(
                codes::DIRECTION_ANGLES,
                &path,
                f.span(&path),
                format!("`{path}` has the numbers of `gauge[{gauge}].point`: the line would go through the origin of the base"),
                "a direction is a vector along which the reading grows, independent of the gauge's position: write its components".to_owned(),
            );
            continue;
        }
        let vector_of = degrees.or_else(|| from_angles(vector, 1.0, 1.1..=std::f64::consts::PI + 1e-3));
        let drawn = vector.iter().all(|one| *one == 0.0 || DRAWN.contains(&one.abs()));
        if vector_of.is_none() && !(drawn && vector != [0.0; 3]) {
            continue;
        }
        let shown = vector.map(number).join(", ");
        let help = match vector_of {
            Some(cosines) => format!(
                "if they are the angles with x, y and z, write {key} = [{}]; if they are a vector, write it with another length",
                cosines.map(|cosine| number(if cosine.abs() < 1e-9 { 0.0 } else { cosine })).join(", ")
            ),
            None => "if they are angles, write the components of the vector; if they are a vector, write it with another length".to_owned(),
        };
        let message = format!("`{path}` is a vector, and {shown} look like angles");
        findings.add(codes::DIRECTION_ANGLES, &path, f.span(&path), message, help);
    }
    Some(())
}

pub(super) fn calibrated_alike(f: &Fields, findings: &mut Findings) -> Option<()> {
    control::there(f)?;
    if f.given("sensor.calibration") || findings.mentions(&["sensor.calibration"]) {
        return Some(());
    }
    let paths: Vec<String> = (0..f.count("gauge")).map(|gauge| format!("gauge[{gauge}].calibration")).collect();
    let first = paths.iter().find(|path| f.given(path))?;
    let without = paths.iter().position(|path| !f.given(path) && !findings.mentions(&[path]))?;
    findings.add(
        codes::CALIBRATION_PARTLY,
        first,
        f.span(first),
        format!("`{first}` is given, but gauge[{without}] has no calibration"),
        "calibrate every gauge, or write the calibration of all in [sensor] and only what differs in [[gauge]]"
            .to_owned(),
    );
    Some(())
}

/// `sensor.input_range` applies only to gauges whose words are volts.
pub(super) fn input_of_calibrated(f: &Fields, findings: &mut Findings) -> Option<()> {
    let path = "sensor.input_range";
    let calibrated =
        f.given("sensor.calibration") || (0..f.count("gauge")).any(|k| f.given(&format!("gauge[{k}].calibration")));
    if f.given(path) && !calibrated {
        findings.add(
            codes::INPUT_WITHOUT_CALIBRATION,
            path,
            f.span(path),
            "`sensor.input_range` needs a calibration: without one the gauge words are metres, and their converter spans `sensor.range`".to_owned(),
            "remove `input_range`, or write `calibration`, the displacement as a polynomial of the voltage".to_owned(),
        );
    }
    Some(())
}
