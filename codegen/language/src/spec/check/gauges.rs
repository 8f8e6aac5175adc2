//! The six gauges that see the platform. Whether they see every direction needs the lowering.

use super::control;
use crate::diagnostic::codes;
use crate::keys::fields::Fields;
use crate::model;
use crate::spec::findings::Findings;
use crate::spec::text::number;

/// Least |cos| between the measuring line and the normal of its target.
const STEEPEST: f64 = 0.1;

pub(super) fn six(f: &Fields, findings: &mut Findings) -> Option<()> {
    control::there(f)?;
    let count = f.count("gauge");
    if count == 6 || findings.mentions(&["gauge"]) {
        return Some(());
    }
    // The seventh is one too many; without any, [control] asks for them.
    let path = if count > 6 { "gauge[6]" } else { "gauge" };
    let last = format!("gauge[{}]", count.saturating_sub(1));
    let place = if count > 6 { f.table(path) } else { f.table(&last).or_else(|| f.table("control")) };
    findings.add(
        codes::GAUGE_COUNT,
        path,
        place.unwrap_or(0..0),
        format!("there are {count} sections [[gauge]], expected 6"),
        "write six, one for each gauge, in the order of the gauge words:\n[[gauge]]\npoint = [\"80 mm\", \"0 mm\", \"180 mm\"]\ndirection = [0, 0, 1]".to_owned(),
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
                    format!("`{path}` has no length, so that it points nowhere"),
                    "write a direction such as [0, 0, 1]".to_owned(),
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
                    "the gauge looks along its target: its direction and the target's normal have a cosine of {}",
                    number(cosine)
                ),
                format!(
                    "check `gauge[{gauge}].direction` and `gauge[{gauge}].target_normal`; a target turns to face its gauge where target_normal is left out"
                ),
            );
        }
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

/// `sensor.input_range` is of gauges whose words are volts.
pub(super) fn input_of_calibrated(f: &Fields, findings: &mut Findings) -> Option<()> {
    let path = "sensor.input_range";
    let calibrated =
        f.given("sensor.calibration") || (0..f.count("gauge")).any(|k| f.given(&format!("gauge[{k}].calibration")));
    if f.given(path) && !calibrated {
        findings.add(
            codes::INPUT_WITHOUT_CALIBRATION,
            path,
            f.span(path),
            "`sensor.input_range` stands beside no calibration: the gauge words are metres, and their converter spans `sensor.range`".to_owned(),
            "take `input_range` out, or write `calibration`, the displacement as a polynomial of the voltage".to_owned(),
        );
    }
    Some(())
}
