//! Every rule of the lint by itself: the smallest change of a spec that it reports, at its key and line, and the nearest
//! one that it does not.

use super::rules_of_control::OF_CONTROL;
use super::rules_of_slips::OF_SLIPS;

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

pub(super) const RULE: Rule = Rule {
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

/// All of them.
pub fn all() -> impl Iterator<Item = &'static Rule> {
    OF_PARTS.iter().chain(OF_CONTROL).chain(OF_SLIPS)
}

/// Bodies, legs, electronics; in the order of the codes.
const OF_PARTS: &[Rule] = &[
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
        also: &["W0803", "W0812", "W0814", "W0834"],
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
        raises: "\"481 Hz\"",
        passes: "\"483 Hz\"",
        ..RULE
    },
    Rule {
        code: "W0804",
        key: "actuator.slew_rate",
        text: "\"40 V/ms\"",
        raises: "\"262 V/ms\"",
        passes: "\"260 V/ms\"",
        ..RULE
    },
    Rule {
        code: "W0805",
        key: "amplifier.lag",
        with: &[("\"40 V/ms\"", "\"200 V/ms\"")],
        text: "\"0.35 ms\"",
        raises: "\"0.51 ms\"",
        passes: "\"0.49 ms\"",
        also: &["E0459"],
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
        code: "W0819",
        key: "supervisor.rest_voltage",
        text: "[timing]\n",
        raises: "[supervisor]\nrest_voltage = \"1 V\"\n\n[timing]\n",
        passes: "[supervisor]\nrest_voltage = \"0 V\"\n\n[timing]\n",
        line: Some("rest_voltage"),
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
        raises: "\"1.07e6 g mm^2\"",
        passes: "\"1.08e6 g mm^2\"",
        ..RULE
    },
    Rule {
        code: "W0813",
        key: "platform.inertia[1]",
        with: &[("\"9.7e6 g mm^2\"", "\"2.6e7 g mm^2\"")],
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
        raises: "base_angle      = \"14.7 mrad\"",
        passes: "base_angle      = \"14.9 mrad\"",
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
        also: &["W0815"],
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
];
