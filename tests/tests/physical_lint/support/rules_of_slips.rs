//! Rules that find slips which earlier ones let pass, at their boundaries; in the order of the codes.

use super::rules::{RULE, Rule};

pub(super) const OF_SLIPS: &[Rule] = &[
    // The same code as among the bodies, for moments that are less uneven, and the odd one is not that about z.
    Rule {
        code: "W0813",
        key: "platform.inertia[1]",
        with: &[("\"9.7e6 g mm^2\"", "\"3.2e7 g mm^2\"")],
        text: "[\"3.26e7 g mm^2\", \"3.26e7 g mm^2\"",
        raises: "[\"3.26e7 g mm^2\", \"2.5e7 g mm^2\"",
        passes: "[\"3.26e7 g mm^2\", \"2.52e7 g mm^2\"",
        ..RULE
    },
    // Of the platform: a gauge that reaches too far on one side.
    Rule {
        code: "W0821",
        key: "sensor.range[0]",
        text: "\"55 um\"]",
        raises: "\"469 um\"]",
        passes: "\"468 um\"]",
        ..RULE
    },
    Rule {
        code: "W0835",
        key: "adaptation.gain_ratio[1]",
        text: "[0.9, 1.1]",
        raises: "[0.9, 4.01]",
        passes: "[0.9, 3.99]",
        ..RULE
    },
    Rule {
        code: "W0836",
        key: "adaptation.level_bandwidth",
        base: "features/ewma-bandwidth.toml",
        text: "level_bandwidth = \"1260 rad/s\"",
        raises: "level_bandwidth = \"1.99 rad/s\"",
        passes: "level_bandwidth = \"2.01 rad/s\"",
        ..RULE
    },
    Rule {
        code: "W0837",
        key: "adaptation.drift_bandwidth",
        base: "features/platform-gains.toml",
        text: "\"19.6 rad/s\"",
        raises: "\"0.22 rad/s\"",
        passes: "\"0.23 rad/s\"",
        ..RULE
    },
    Rule {
        code: "W0837",
        key: "adaptation.drift_bandwidth",
        base: "features/platform-gains.toml",
        text: "\"19.6 rad/s\"",
        raises: "\"451 rad/s\"",
        passes: "\"449 rad/s\"",
        also: &["W0423"],
        ..RULE
    },
    Rule {
        code: "W0838",
        key: "control.environment.stiffness[3]",
        base: "features/platform-environment.toml",
        text: "\"3e6 N/m\", \"3.8e3 N m/rad\"",
        raises: "\"3e6 N/m\", \"2.71e5 N m/rad\"",
        passes: "\"3e6 N/m\", \"2.69e5 N m/rad\"",
        ..RULE
    },
    Rule {
        code: "W0839",
        key: "control.environment.rest[2]",
        base: "features/platform-environment.toml",
        text: "rest      = [\"0 um\", \"0 um\", \"10 um\"",
        raises: "rest      = [\"0 um\", \"0 um\", \"499 um\"",
        passes: "rest      = [\"0 um\", \"0 um\", \"498 um\"",
        ..RULE
    },
    Rule {
        code: "W0845",
        key: "gains.proportional[0]",
        base: "features/platform-gains.toml",
        text: "[\"5.07e5 N/m\", \"5.07e5 N/m\", \"1.99e6 N/m\"",
        raises: "[\"1.99e6 N/m\", \"5.07e5 N/m\", \"7.6e5 N/m\"",
        passes: "[\"1.99e6 N/m\", \"5.07e5 N/m\", \"7.63e5 N/m\"",
        also: &["E0421"],
        ..RULE
    },
    Rule {
        code: "W0846",
        key: "sensor.range[0]",
        base: "legs.toml",
        text: "[\"-2 um\"",
        raises: "[\"-0.048 um\"",
        passes: "[\"-0.049 um\"",
        ..RULE
    },
    Rule {
        code: "W0847",
        key: "gauge[2].calibration[2]",
        base: "features/platform-calibration.toml",
        text: "\"12 nm/V^2\"",
        raises: "\"99.9 nm/V^2\"",
        passes: "\"99.7 nm/V^2\"",
        ..RULE
    },
    Rule {
        code: "W0848",
        key: "gauge[1].point",
        text: "[\"-40 mm\", \"69.282 mm\", \"180 mm\"]",
        raises: "[\"40 mm\", \"69.282 mm\", \"180 mm\"]",
        passes: "[\"40 mm\", \"69.6 mm\", \"180 mm\"]",
        ..RULE
    },
    Rule { code: "W0849", key: "dac.range[1]", text: "\"150 V\"", raises: "\"401 V\"", passes: "\"399 V\"", ..RULE },
    Rule {
        code: "W0856",
        key: "leg.fixed_inertia",
        text: "\"1.07e5 g mm^2\"",
        raises: "\"14100 g mm^2\"",
        passes: "\"14110 g mm^2\"",
        ..RULE
    },
    Rule {
        code: "W0857",
        key: "platform.center_of_mass[0]",
        text: "center_of_mass = [\"0 mm\"",
        raises: "center_of_mass = [\"101 mm\"",
        passes: "center_of_mass = [\"99 mm\"",
        ..RULE
    },
    Rule {
        code: "W0858",
        key: "actuator.damping_ratio",
        text: "damping_ratio   = 0.1 ",
        raises: "damping_ratio   = 0.00019 ",
        passes: "damping_ratio   = 0.00021 ",
        ..RULE
    },
    Rule {
        code: "W0859",
        key: "hysteresis.grid",
        text: "grid    = 32",
        raises: "grid    = 7",
        passes: "grid    = 8",
        ..RULE
    },
];
