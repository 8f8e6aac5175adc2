//! Location of a platform, as text and as JSON: the pose is given only if it is measured now.

use std::fmt::Write as _;
use std::time::Duration;

use crate::place::AXES;
use crate::session::{GAUGES, MAX_AGE, MeasuredPose};
use serde::Serialize;
use specgen_link::Status;
use specgen_runtime::setpoint::BUSY;
use specgen_runtime::supervisor::Phase;

use super::pose::unit;
use specgen_language::outcome::Outcome;
use specgen_language::table::{left, right, row};

/// Location of a platform: µm and µrad, V.
#[derive(Debug, Serialize)]
pub struct Location {
    tick: u64,
    /// None if it is not currently measured.
    pose: Option<[f64; 6]>,
    target: [f64; 6],
    /// Set-point minus pose.
    error: Option<[f64; 6]>,
    /// Commanded; none without recent ticks or without gauges, because the outputs are then unknown.
    voltage: Option<[f64; 6]>,
    moves: bool,
    /// Why the pose is not measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    why: Option<String>,
    /// The last measured pose.
    #[serde(skip_serializing_if = "Option::is_none")]
    last: Option<LastPose>,
}

/// A pose that was measured earlier.
#[derive(Debug, Serialize)]
struct LastPose {
    pose: [f64; 6],
    /// s.
    age: f64,
}

/// An age as text.
pub fn ago(age: Duration) -> String {
    let seconds = age.as_secs_f64();
    if seconds < 100.0 { format!("{seconds:.1} s") } else { format!("{seconds:.0} s") }
}

/// Whether the last tick is recent.
pub fn ticks(status: &Status) -> bool {
    status.age.is_some_and(|age| Duration::from_micros(age) < MAX_AGE)
}

/// Why the pose is not measured; none if it is.
fn why(place: &MeasuredPose, status: &Status) -> Option<String> {
    let bad = (place.status & GAUGES) >> GAUGES.trailing_zeros();
    let all = GAUGES >> GAUGES.trailing_zeros();
    match status.age.map(Duration::from_micros) {
        None => Some("no tick yet".to_owned()),
        Some(age) if age >= MAX_AGE => Some(format!("no tick for {}", ago(age))),
        Some(_) if bad == all => Some("the gauges are not read".to_owned()),
        Some(_) if bad != 0 => {
            let numbers: Vec<String> =
                (0..6).filter(|gauge| bad >> gauge & 1 == 1).map(|gauge| gauge.to_string()).collect();
            let [gauges, are] = if numbers.len() == 1 { ["gauge", "is"] } else { ["gauges", "are"] };
            Some(format!("{gauges} {} {are} implausible", numbers.join(", ")))
        }
        Some(_) if !place.is_measured() => Some("the gauges are not read".to_owned()),
        Some(_) => None,
    }
}

impl Location {
    /// From a place and the status read with it; `seen` converts poses to the session's frame.
    pub fn of(place: &MeasuredPose, status: &Status, seen: impl Fn(&[f64; 6]) -> [f64; 6]) -> Self {
        let millionths = |values: [f64; 6]| values.map(|value| value * 1e6);
        let (pose, target) = (millionths(seen(&place.pose)), millionths(seen(&place.target)));
        let why = why(place, status);
        let is_measured = why.is_none();
        let answers = ticks(status) && place.status & GAUGES != GAUGES;
        let last = place.measured.filter(|_| !is_measured).map(|age| LastPose { pose, age: age.as_secs_f64() });
        Self {
            tick: place.tick,
            pose: is_measured.then_some(pose),
            target,
            error: is_measured.then(|| core::array::from_fn(|axis| target[axis] - pose[axis])),
            voltage: answers.then_some(place.voltage),
            moves: ticks(status) && u64::from(place.phase) == Phase::Running.word() && place.status & BUSY != 0,
            why,
            last,
        }
    }
}

impl Outcome for Location {
    fn text(&self) -> String {
        let mut text = String::new();
        let columns = [left(6), right(12), right(14), right(12), left(0).behind("  ")];
        let (pose, head) = match (&self.pose, &self.last) {
            (Some(pose), _) => (Some(pose), "pose".to_owned()),
            (None, Some(last)) => (Some(&last.pose), format!("{} ago", ago(Duration::from_secs_f64(last.age)))),
            (None, None) => (None, "pose".to_owned()),
        };
        // Writing to a String cannot fail, here and below.
        if let Some(why) = &self.why {
            let _ = writeln!(text, "  pose not measured: {why}");
        }
        row(&mut text, &columns, &[&"", &head, &"set-point", &"error"]);
        for (axis, name) in AXES.iter().enumerate() {
            let known =
                |values: Option<&[f64; 6]>| values.map_or_else(|| "-".to_owned(), |it| format!("{:.4}", it[axis]));
            let cells = [known(pose), known(Some(&self.target)), known(self.error.as_ref())];
            row(&mut text, &columns, &[&format!("  {name}"), &cells[0], &cells[1], &cells[2], &unit(axis)]);
        }
        let moving = if self.moves { "; moving" } else { "" };
        let _ = match &self.voltage {
            Some(voltage) => {
                let volts: Vec<String> = voltage.iter().map(|voltage| format!("{voltage:.2}")).collect();
                writeln!(text, "  legs 0 to 5: {} V commanded{moving}", volts.join(", "))
            }
            None => writeln!(text, "  legs 0 to 5: voltages unknown"),
        };
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use specgen_link::Counters;

    fn status(age: Option<u64>) -> Status {
        Status {
            tick: 9,
            phase: 3,
            cause: 0,
            finding: 0,
            amplifier_on: true,
            status: 0,
            events: 0,
            late: 0,
            age,
            link: Counters::NONE,
        }
    }

    fn location(bits: u32, measured: Option<u64>, age: Option<u64>) -> Location {
        let place = MeasuredPose {
            tick: 9,
            phase: 3,
            status: bits,
            pose: [1e-6; 6],
            measured: measured.map(Duration::from_millis),
            target: [2e-6; 6],
            voltage: [34.25; 6],
        };
        Location::of(&place, &status(age), |user| *user)
    }

    #[test]
    fn a_pose_that_is_not_measured_now_has_its_age_and_no_error() {
        let now = location(0, Some(0), Some(0));
        assert!(now.pose.is_some() && now.error.is_some() && now.voltage.is_some() && now.last.is_none(), "{now:?}");
        assert!(now.text().contains("1.0000") && now.text().contains("34.25"), "{}", now.text());
        // Status bits, ms since the gauges were read, µs since a tick; expected text, whether voltages are known.
        for (bits, measured, age, words, volts) in [
            (GAUGES, Some(3200), Some(0), &["the gauges are not read", "3.2 s ago", "1.0000"][..], false),
            (GAUGES, None, Some(0), &["the gauges are not read"], false),
            (0x200, Some(5), Some(0), &["gauge 1 is implausible", "0.0 s ago"], true),
            (0x2100, Some(150_000), Some(0), &["gauges 0, 5 are implausible", "150 s ago"], true),
            (0, Some(2000), Some(2_000_000), &["no tick for 2.0 s", "2.0 s ago"], false),
            (0, Some(2000), Some(0), &["the gauges are not read", "2.0 s ago"], true),
            (0, None, None, &["no tick yet"], false),
        ] {
            let found = location(bits, measured, age);
            let text = found.text();
            assert!(found.pose.is_none() && found.error.is_none() && found.voltage.is_some() == volts, "{found:?}");
            assert_eq!(found.last.is_some(), measured.is_some(), "{found:?}");
            assert!(words.iter().all(|words| text.contains(words)), "{words:?}: {text}");
            assert_eq!(text.contains("34.25"), volts, "{text}");
            let json = serde_json::json!(found);
            assert!(json["pose"].is_null() && json["error"].is_null() && json["why"].is_string(), "{json}");
        }
    }
}
