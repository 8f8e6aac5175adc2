//! Stops that have no room, and what gives it to them.

use super::support::{after, case, hold, put};

#[test]
fn stops_that_leave_workspace_or_strokes() {
    const FAST: &str = "stream_speed = [\"13 mm/s\"";
    const GENTLE: &str = "stop_acceleration = [\"10 mm/s^2\", \"10 mm/s^2\", \"10 mm/s^2\", \"100 mrad/s^2\", \"100 mrad/s^2\", \"100 mrad/s^2\"]
stop_jerk = [\"1 m/s^3\", \"1 m/s^3\", \"1 m/s^3\", \"10 rad/s^3\", \"10 rad/s^3\", \"10 rad/s^3\"]
stream_speed";
    /// The spec with the limits of stops that the help offers, in place of its own if it has any.
    fn offered(help: &str, bad: &str, _: &str) -> (String, String) {
        let list = |name: &str| {
            let (_, rest) = help.split_once(&format!("{name} = [")).unwrap_or_else(|| panic!("{help}"));
            format!("{name} = [{}]\n", rest.split_once(']').expect("a list").0)
        };
        let kept: String =
            bad.lines().filter(|line| !line.starts_with("stop_")).map(|line| format!("{line}\n")).collect();
        let lists = list("stop_acceleration") + &list("stop_jerk");
        put(&kept, "stream_speed", &(lists + "stream_speed"))
    }
    hold(vec![
        case(
            "a stream too fast to stop, slower",
            &[("stream_speed = [\"5 mm/s\"", FAST)],
            ("E0459", "\"13 mm/s\"", "a stream along x that is stopped at 13000.000 um/s"),
            |help, bad, _| put(bad, "\"13 mm/s\"", &format!("\"{} um/s\"", after(help, "at most "))),
        ),
        case(
            "a stream too fast to stop, stopped harder",
            &[("stream_speed = [\"5 mm/s\"", FAST)],
            ("E0459", "\"13 mm/s\"", "11.700 um until it counts as stale"),
            offered,
        ),
        case(
            "a stream that goes by before it counts as stale",
            &[("stale_ticks  = 10", "stale_ticks  = 60")],
            ("E0459", "\"50 mrad/s\"", "that is stopped at 50000.000 urad/s"),
            |help, bad, _| {
                assert!(help.contains("lower control.setpoint.stale_ticks") && !help.contains("stop_jerk"), "{help}");
                put(bad, "stale_ticks  = 60", "stale_ticks  = 12")
            },
        ),
        case(
            "stops as gentle as moves",
            &[("stream_speed", GENTLE)],
            ("E0459", "\"50 mrad/s\"", "workspace and strokes end"),
            offered,
        ),
        case(
            "a trajectory that a gentle stop takes out of its strokes, slower",
            &[
                (STREAMS, GENTLE_AND_SLOW),
                // Case 1 goes up to 50 µm and turns back there.
                ("\"50 um\", \"52 um\"]", "\"50 um\", \"50.1 um\"]"),
                ("kind      = \"case-2\"\nfrequency = \"1 Hz\"", "kind      = \"case-2\"\nfrequency = \"0.05 Hz\""),
                (
                    "kind      = \"machining\"\nfrequency = \"1 Hz\"",
                    "kind      = \"machining\"\nfrequency = \"0.05 Hz\"",
                ),
            ],
            ("E0459", "\"1 Hz\"", "another command on the way"),
            |help, bad, _| put(bad, "\"1 Hz\"", &format!("\"{} Hz\"", after(help, "at most "))),
        ),
    ]);
}

/// The line that ends with the limits of streams, and streams that gentle stops have room for.
const STREAMS: &str =
    "stream_speed = [\"5 mm/s\", \"5 mm/s\", \"5 mm/s\", \"50 mrad/s\", \"50 mrad/s\", \"50 mrad/s\"]";
const GENTLE_AND_SLOW: &str = "stop_acceleration = [\"0.7 mm/s^2\", \"0.7 mm/s^2\", \"0.7 mm/s^2\", \"7 mrad/s^2\", \"7 mrad/s^2\", \"7 mrad/s^2\"]
stop_jerk = [\"1 m/s^3\", \"1 m/s^3\", \"1 m/s^3\", \"10 rad/s^3\", \"10 rad/s^3\", \"10 rad/s^3\"]
stream_speed = [\"100 um/s\", \"100 um/s\", \"100 um/s\", \"1 mrad/s\", \"1 mrad/s\", \"1 mrad/s\"]";
