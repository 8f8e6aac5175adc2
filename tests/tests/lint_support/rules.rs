//! Every rule of the lint by itself: the smallest change of a spec that it reports, at its key and line, and the nearest
//! one that it does not.

/// One rule at its boundary.
pub struct Rule {
    pub code: &'static str,
    /// The key of the finding.
    pub key: &'static str,
    /// The spec that is changed.
    pub base: &'static str,
    /// Changes that make room for the one that counts: old text and new.
    pub with: &'static [(&'static str, &'static str)],
    /// What is replaced.
    pub text: &'static str,
    /// By what, so that the rule reports it.
    pub raises: &'static str,
    /// And so that it does not.
    pub passes: &'static str,
    /// Part of the line that the finding stands at; none: the line that was changed.
    pub line: Option<&'static str>,
    /// Other codes that the same change cannot but raise.
    pub also: &'static [&'static str],
}

const RULE: Rule = Rule {
    code: "",
    key: "",
    base: "reference.toml",
    with: &[],
    text: "",
    raises: "",
    passes: "",
    line: None,
    also: &[],
};

/// Set-points that may move as fast as a test needs them to.
const FAST_STREAM: (&str, &str) = (
    "stream_speed = [\"5 mm/s\", \"5 mm/s\", \"5 mm/s\", \"50 mrad/s\", \"50 mrad/s\", \"50 mrad/s\"]",
    "stream_speed = [\"0.9 m/s\", \"0.9 m/s\", \"0.9 m/s\", \"6 rad/s\", \"6 rad/s\", \"6 rad/s\"]",
);

/// In the order of the codes.
pub const RULES: &[Rule] = &[
    // Those that the data of the paper break.
    Rule {
        code: "E0208",
        key: "leg.fixed_center",
        text: "fixed_center       = \"50 mm\"",
        raises: "fixed_center       = 50",
        passes: "fixed_center       = \"5 cm\"",
        ..RULE
    },
    Rule {
        code: "E0311",
        key: "platform.mass",
        text: "\"1.195 kg\"",
        raises: "\"32.5 g\"",
        passes: "\"32.7 g\"",
        also: &["W0812", "W0814", "W0834"],
        ..RULE
    },
    Rule {
        code: "E0313",
        key: "workspace.translation[0]",
        base: "legs.toml",
        text: "[\"40 um\"",
        raises: "[\"110 um\"",
        passes: "[\"109 um\"",
        ..RULE
    },
    Rule {
        code: "W0303",
        key: "sensor.noise",
        text: "\"2.2 nm\"",
        raises: "\"1.11 um\"",
        passes: "\"1.09 um\"",
        also: &["E0471"],
        ..RULE
    },
    // The lint.
    Rule {
        code: "E0801",
        key: "actuator.stroke",
        text: "\"60 um\"",
        raises: "\"253 um\"",
        passes: "\"252 um\"",
        also: &["W0822"],
        ..RULE
    },
    Rule {
        code: "W0802",
        key: "actuator.stroke",
        text: "\"60 um\"",
        raises: "\"3.33 mm\"",
        passes: "\"3.31 mm\"",
        also: &["E0801", "W0304"],
        ..RULE
    },
    Rule {
        code: "W0803",
        key: "actuator.resonance",
        text: "\"870 Hz\"",
        raises: "\"192 Hz\"",
        passes: "\"193 Hz\"",
        ..RULE
    },
    Rule {
        code: "W0804",
        key: "actuator.slew_rate",
        text: "\"40 V/ms\"",
        raises: "\"436 V/ms\"",
        passes: "\"434 V/ms\"",
        ..RULE
    },
    Rule {
        code: "W0805",
        key: "amplifier.lag",
        with: &[("\"40 V/ms\"", "\"430 V/ms\"")],
        text: "\"0.35 ms\"",
        raises: "\"0.7 ms\"",
        passes: "\"0.69 ms\"",
        ..RULE
    },
    Rule {
        code: "W0806",
        key: "amplifier.current",
        with: &[("[amplifier]", "capacitance = \"1 uF\"\n\n[amplifier]")],
        text: "noise = \"2 mV\"",
        raises: "noise = \"2 mV\"\ncurrent = \"39 mA\"",
        passes: "noise = \"2 mV\"\ncurrent = \"41 mA\"",
        line: Some("current = "),
        ..RULE
    },
    Rule {
        code: "W0807",
        key: "amplifier.noise",
        text: "\"2 mV\"",
        raises: "\"1.01 V\"",
        passes: "\"0.99 V\"",
        ..RULE
    },
    Rule { code: "W0808", key: "dac.bits", text: "bits  = 16", raises: "bits  = 10", passes: "bits  = 11", ..RULE },
    Rule {
        code: "W0809",
        key: "actuator.slew_rate",
        base: "legs.toml",
        text: "\"40 V/ms\"",
        raises: "\"0.099 V/ms\"",
        passes: "\"0.101 V/ms\"",
        ..RULE
    },
    Rule {
        code: "W0810",
        key: "leg.fixed_inertia",
        text: "\"1.07e5 g mm^2\"",
        raises: "\"1760 g mm^2\"",
        passes: "\"1770 g mm^2\"",
        ..RULE
    },
    Rule {
        code: "W0811",
        key: "leg.fixed_center",
        text: "fixed_center       = \"50 mm\"",
        raises: "fixed_center       = \"0.68 mm\"",
        passes: "fixed_center       = \"0.7 mm\"",
        ..RULE
    },
    Rule {
        code: "W0812",
        key: "platform.inertia[2]",
        text: "\"9.7e6 g mm^2\"",
        raises: "\"1.19e5 g mm^2\"",
        passes: "\"1.2e5 g mm^2\"",
        ..RULE
    },
    Rule {
        code: "W0813",
        key: "platform.inertia[1]",
        with: &[("\"9.7e6 g mm^2\"", "\"3e7 g mm^2\"")],
        text: "[\"3.26e7 g mm^2\", \"3.26e7 g mm^2\"",
        raises: "[\"3.26e7 g mm^2\", \"1.62e7 g mm^2\"",
        passes: "[\"3.26e7 g mm^2\", \"1.64e7 g mm^2\"",
        ..RULE
    },
    Rule {
        code: "W0814",
        key: "leg.fixed_mass",
        with: &[("\"1.07e5 g mm^2\"", "\"1e7 g mm^2\"")],
        text: "\"90.26 g\"",
        raises: "\"5980 g\"",
        passes: "\"5970 g\"",
        ..RULE
    },
    Rule {
        code: "W0815",
        key: "geometry.base_angle",
        text: "base_angle      = \"0.012 pi rad\"",
        raises: "base_angle      = \"1.99 mrad\"",
        passes: "base_angle      = \"2.01 mrad\"",
        ..RULE
    },
    Rule {
        code: "W0816",
        key: "geometry.base_radius",
        base: "legs.toml",
        text: "\"150 mm\"",
        raises: "\"99.9 mm\"",
        passes: "\"100.1 mm\"",
        ..RULE
    },
    Rule {
        code: "W0817",
        key: "geometry.height",
        base: "legs.toml",
        text: "\"180 mm\"",
        raises: "\"613 mm\"",
        passes: "\"612 mm\"",
        ..RULE
    },
    Rule {
        code: "W0818",
        key: "geometry.platform_joints[4]",
        base: "features/platform-joints.toml",
        text: "    [\"-46 mm\", \"-84 mm\", \"-9 mm\"],\n    [\"98 mm\", \"-3 mm\", \"-10 mm\"],",
        raises: "    [\"98 mm\", \"-3 mm\", \"-10 mm\"],\n    [\"-46 mm\", \"-84 mm\", \"-9 mm\"],",
        passes: "    [\"-46 mm\", \"-84 mm\", \"-9 mm\"],\n    [\"97 mm\", \"-3 mm\", \"-10 mm\"],",
        line: Some(""),
        also: &["E0441"],
        ..RULE
    },
    Rule {
        code: "W0820",
        key: "sensor.noise",
        text: "\"2.2 nm\"",
        raises: "\"0.0167 nm\"",
        passes: "\"0.0169 nm\"",
        ..RULE
    },
    Rule {
        code: "W0821",
        key: "sensor.range[0]",
        text: "\"55 um\"]",
        raises: "\"5510 um\"]",
        passes: "\"5490 um\"]",
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
        raises: "\"1.36 ms\"",
        passes: "\"1.34 ms\"",
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
        also: &["W0842"],
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
        also: &["W0809", "W0840", "W0851"],
        ..RULE
    },
    Rule {
        code: "W0851",
        key: "trajectory[0].frequency",
        text: "\"40 V/ms\"",
        raises: "\"0.152 V/ms\"",
        passes: "\"0.154 V/ms\"",
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
        also: &["W0854"],
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
