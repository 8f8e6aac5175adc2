//! Rules about gauges, control, trajectories, reach and budgets at their boundaries.

use super::rules::{RULE, Rule};

/// Set-points that may move as fast as a test needs them to.
const FAST_STREAM: (&str, &str) = (
    "stream_speed = [\"5 mm/s\", \"5 mm/s\", \"5 mm/s\", \"50 mrad/s\", \"50 mrad/s\", \"50 mrad/s\"]",
    "stream_speed = [\"0.9 m/s\", \"0.9 m/s\", \"0.9 m/s\", \"6 rad/s\", \"6 rad/s\", \"6 rad/s\"]",
);

/// In the order of the codes.
pub(super) const OF_CONTROL: &[Rule] = &[
    Rule {
        code: "W0820",
        key: "sensor.noise",
        text: "\"2.2 nm\"",
        raises: "\"0.0167 nm\"",
        passes: "\"0.0169 nm\"",
        ..RULE
    },
    Rule { code: "W0822", key: "sensor.bits", text: "bits  = 17", raises: "bits  = 10", passes: "bits  = 11", ..RULE },
    Rule {
        code: "W0823",
        key: "gauge[0].point[1]",
        text: "point     = [\"80 mm\", \"0 mm\", \"180 mm\"]\ndirection = [0, 0, 1]",
        raises: "point     = [\"80 mm\", \"0.19 mm\", \"180 mm\"]\ndirection = [0, 0, 1]",
        passes: "point     = [\"80 mm\", \"0.21 mm\", \"180 mm\"]\ndirection = [0, 0, 1]",
        ..RULE
    },
    Rule {
        code: "W0824",
        key: "gauge[1].direction",
        text: "\"69.282 mm\", \"180 mm\"]\ndirection = [0, 0, 1]",
        raises: "\"69.282 mm\", \"180 mm\"]\ndirection = [0, 0.13, -0.9915140]",
        passes: "\"69.282 mm\", \"180 mm\"]\ndirection = [0, 0.15, -0.9886860]",
        line: Some("direction = [0, 0.13"),
        ..RULE
    },
    Rule {
        code: "W0825",
        key: "gauge[0].point[0]",
        text: "point     = [\"80 mm\", \"0 mm\", \"180 mm\"]\ndirection = [0, 0, 1]",
        raises: "point     = [\"151 mm\", \"0 mm\", \"180 mm\"]\ndirection = [0, 0, 1]",
        passes: "point     = [\"149 mm\", \"0 mm\", \"180 mm\"]\ndirection = [0, 0, 1]",
        ..RULE
    },
    Rule {
        code: "W0826",
        key: "gauge[3].direction",
        text: "point     = [\"-80 mm\"",
        raises: "point     = [\"20 mm\"",
        passes: "point     = [\"-20 mm\"",
        line: Some("direction = [0, 1, 0]"),
        ..RULE
    },
    Rule {
        code: "W0827",
        key: "gauge[2].calibration[1]",
        base: "features/platform-calibration.toml",
        text: "\"9.97 um/V\"",
        raises: "\"30.1 um/V\"",
        passes: "\"29.9 um/V\"",
        ..RULE
    },
    Rule {
        code: "W0828",
        key: "position_gains.proportional[0]",
        base: "features/platform-gains.toml",
        text: "[\"5.7e5 N/m\"",
        raises: "[\"5.5e4 N/m\"",
        passes: "[\"5.8e4 N/m\"",
        ..RULE
    },
    Rule {
        code: "W0829",
        key: "control.environment.stiffness[0]",
        base: "features/platform-environment.toml",
        text: "[\"2.4e6 N/m\"",
        raises: "[\"1.0e4 N/m\"",
        passes: "[\"1.02e4 N/m\"",
        ..RULE
    },
    Rule {
        code: "W0830",
        key: "amplifier.lag",
        text: "\"0.35 ms\"",
        raises: "\"0.99 us\"",
        passes: "\"1.01 us\"",
        ..RULE
    },
    Rule {
        code: "W0831",
        key: "control.lead",
        text: "\"0.1 ms\"",
        raises: "\"0.57 ms\"",
        passes: "\"0.56 ms\"",
        ..RULE
    },
    Rule {
        code: "W0832",
        key: "control.transfer_time",
        text: "\"50 ms\"",
        raises: "\"99 us\"",
        passes: "\"100 us\"",
        ..RULE
    },
    Rule {
        code: "W0833",
        key: "control.velocity_cutoff",
        text: "\"1.9e4 rad/s\"",
        raises: "\"226 rad/s\"",
        passes: "\"227 rad/s\"",
        ..RULE
    },
    Rule {
        code: "W0834",
        key: "timing.period",
        base: "legs.toml",
        with: &[("mode         = \"pcc\"", "mode         = \"invhys\"")],
        text: "\"200 us\"",
        raises: "\"0.7 ms\"",
        passes: "\"0.69 ms\"",
        also: &["W0302"],
        ..RULE
    },
    Rule {
        code: "W0840",
        key: "control.setpoint.speed[0]",
        with: &[("[\"10 mm/s^2\"", "[\"10 m/s^2\""), ("[\"1 m/s^3\"", "[\"1000 m/s^3\"")],
        text: "speed        = [\"100 um/s\"",
        raises: "speed        = [\"47 mm/s\"",
        passes: "speed        = [\"46 mm/s\"",
        also: &["W0842", "E0459"],
        ..RULE
    },
    Rule {
        code: "W0841",
        key: "control.setpoint.speed[0]",
        with: &[("[\"10 mm/s^2\"", "[\"1 mm/s^2\"")],
        text: "speed        = [\"100 um/s\"",
        raises: "speed        = [\"0.83 um/s\"",
        passes: "speed        = [\"0.84 um/s\"",
        ..RULE
    },
    Rule {
        code: "W0842",
        key: "control.setpoint.acceleration[0]",
        with: &[("[\"1 m/s^3\"", "[\"100 m/s^3\"")],
        text: "[\"10 mm/s^2\"",
        raises: "[\"1.01 m/s^2\"",
        passes: "[\"0.99 m/s^2\"",
        ..RULE
    },
    Rule {
        code: "W0843",
        key: "control.setpoint.stream_speed[0]",
        text: "[\"5 mm/s\"",
        raises: "[\"1.01 m/s\"",
        passes: "[\"0.99 m/s\"",
        also: &["E0459"],
        ..RULE
    },
    Rule {
        code: "W0844",
        key: "workspace.translation[0]",
        base: "legs.toml",
        text: "[\"40 um\"",
        raises: "[\"0.27 um\"",
        passes: "[\"0.28 um\"",
        ..RULE
    },
    Rule {
        code: "E0850",
        key: "trajectory[0].frequency",
        text: "\"40 V/ms\"",
        raises: "\"0.0903 V/ms\"",
        passes: "\"0.0907 V/ms\"",
        line: Some("frequency = \"1 Hz\""),
        also: &["W0809", "W0840", "W0851", "E0459"],
        ..RULE
    },
    Rule {
        code: "W0851",
        key: "trajectory[0].frequency",
        text: "\"40 V/ms\"",
        raises: "\"0.152 V/ms\"",
        passes: "\"0.154 V/ms\"",
        also: &["E0459"],
        line: Some("frequency = \"1 Hz\""),
        ..RULE
    },
    Rule {
        code: "E0852",
        key: "trajectory[0].frequency",
        with: &[("[amplifier]", "capacitance = \"1 uF\"\n\n[amplifier]")],
        text: "noise = \"2 mV\"",
        raises: "noise = \"2 mV\"\ncurrent = \"152 uA\"",
        passes: "noise = \"2 mV\"\ncurrent = \"154 uA\"",
        line: Some("frequency = \"1 Hz\""),
        also: &["W0806"],
        ..RULE
    },
    Rule {
        code: "W0853",
        key: "trajectory[0].frequency",
        with: &[("\"40 V/ms\"", "\"430 V/ms\""), FAST_STREAM],
        text: "kind      = \"case-1\"\nfrequency = \"1 Hz\"",
        raises: "kind      = \"case-1\"\nfrequency = \"336 Hz\"",
        passes: "kind      = \"case-1\"\nfrequency = \"332 Hz\"",
        also: &["W0854", "E0459"],
        line: Some("frequency = \"336 Hz\""),
        ..RULE
    },
    Rule {
        code: "W0854",
        key: "trajectory[0].frequency",
        with: &[FAST_STREAM],
        text: "kind      = \"case-1\"\nfrequency = \"1 Hz\"",
        raises: "kind      = \"case-1\"\nfrequency = \"73 Hz\"",
        passes: "kind      = \"case-1\"\nfrequency = \"72 Hz\"",
        also: &["E0459"],
        line: Some("frequency = \"73 Hz\""),
        ..RULE
    },
    Rule {
        code: "E0860",
        key: "leg.joint_angle",
        text: "[actuator]",
        raises: "joint_angle = \"1.11 mrad\"\n\n[actuator]",
        passes: "joint_angle = \"1.12 mrad\"\n\n[actuator]",
        line: Some("joint_angle = "),
        ..RULE
    },
    Rule {
        code: "W0861",
        base: "legs.toml",
        key: "geometry.height",
        text: "base_angle      = \"0.012 pi rad\"",
        raises: "base_angle      = \"2 rad\"",
        passes: "base_angle      = \"1 rad\"",
        line: Some("height "),
        ..RULE
    },
    Rule {
        code: "N0862",
        key: "workspace.rotation[0]",
        base: "legs.toml",
        with: &[("[\"0.6 mrad\", \"0.6 mrad\", \"0.6 mrad\"]", "[\"0.3 mrad\", \"0.3 mrad\", \"0.3 mrad\"]")],
        text: "[\"0.3 mrad\"",
        raises: "[\"0.4215 mrad\"",
        passes: "[\"0.4205 mrad\"",
        ..RULE
    },
    Rule {
        code: "N0863",
        key: "sensor.range[1]",
        base: "legs.toml",
        with: &[("\"48 um\"", "\"65 um\"")],
        text: "\"65 um\"",
        raises: "\"59.9 um\"",
        passes: "\"60.1 um\"",
        ..RULE
    },
    Rule {
        code: "W0304",
        key: "sensor.range[1]",
        base: "legs.toml",
        text: "\"48 um\"",
        raises: "\"29.9 um\"",
        passes: "\"30.1 um\"",
        ..RULE
    },
    Rule {
        code: "E0870",
        key: "target.budget.flash",
        text: "\"128 KiB\"",
        raises: "\"4487 B\"",
        passes: "\"4488 B\"",
        also: &["W0873"],
        ..RULE
    },
    Rule {
        code: "W0871",
        key: "target.budget.flash",
        text: "\"128 KiB\"",
        raises: "\"2245 KiB\"",
        passes: "\"2244 KiB\"",
        ..RULE
    },
    Rule {
        code: "N0872",
        key: "target.budget",
        base: "minimal.toml",
        text: "[timing]",
        raises: "[target.budget]\nflash = \"128 KiB\"\n\n[timing]",
        passes: "[target]\nmcu = \"mps2-an500\"\n\n[timing]",
        line: Some("[target.budget]"),
        ..RULE
    },
    Rule {
        code: "W0873",
        key: "target.budget.ram",
        text: "\"32 KiB\"",
        raises: "\"129 KiB\"",
        passes: "\"128 KiB\"",
        ..RULE
    },
    Rule {
        code: "W0880",
        key: "controller.scalar",
        base: "features/platform-f32.toml",
        with: &[("bits  = 17", "bits  = 20")],
        text: "\"2.2 nm\"",
        raises: "\"0.21 nm\"",
        passes: "\"0.25 nm\"",
        line: Some("scalar"),
        ..RULE
    },
];
