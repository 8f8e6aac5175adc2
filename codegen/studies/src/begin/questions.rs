//! Questions and options of `specgen new`, and their answers as TOML literals.

use specgen_language::spec::keys::{self, Item, Shape};
use specgen_language::spec::quantity::{self, Dimension};

/// A value that the user can give.
pub struct Question {
    /// Its option, without the dashes.
    pub option: &'static str,
    /// The paper's symbol and common names, taken as options too.
    pub aliases: &'static [&'static str],
    /// Its key in the spec.
    pub key: &'static str,
    /// Whether the user is prompted for it; other values have a default that fits most platforms.
    pub asked: bool,
    /// The question.
    pub text: &'static str,
}

const ASKED: bool = true;
const OPTION: bool = false;

const fn row(
    asked: bool,
    option: &'static str,
    aliases: &'static [&'static str],
    key: &'static str,
    text: &'static str,
) -> Question {
    Question { option, aliases, key, asked, text }
}

/// In prompt order.
// A table: one question per line.
#[rustfmt::skip]
pub const QUESTIONS: &[Question] = &[
    row(ASKED, "base-radius", &["r_B"], "geometry.base_radius", "Radius of the circle through the base joints, r_B"),
    row(ASKED, "platform-radius", &["r_P"], "geometry.platform_radius", "Radius of the circle through the platform joints, r_P"),
    row(ASKED, "base-angle", &["alpha_B"], "geometry.base_angle", "Angle between the two base joints of a pair, alpha_B"),
    row(ASKED, "platform-angle", &["alpha_P"], "geometry.platform_angle", "Angle between the two platform joints of a pair, alpha_P"),
    row(ASKED, "height", &["P_z"], "geometry.height", "Height of the platform joints above the base joints"),
    row(ASKED, "mass", &["m", "payload"], "platform.mass", "Moving mass, with everything mounted on it"),
    row(ASKED, "inertia", &["I"], "platform.inertia", "Moments of inertia I_xx, I_yy, I_zz about the centre of mass"),
    row(ASKED, "stroke", &["travel"], "actuator.stroke", "Free stroke of a leg"),
    row(ASKED, "voltage", &["drive"], "actuator.voltage", "Lowest and highest voltage of a leg"),
    row(ASKED, "stiffness", &["k_a", "axial-stiffness"], "actuator.axial_stiffness", "Axial stiffness of a leg, k_a"),
    row(ASKED, "resonance", &["f_0"], "actuator.resonance", "First axial resonance of a leg as mounted"),
    row(ASKED, "slew-rate", &["slew"], "actuator.slew_rate", "Largest slew rate that amplifier and stack can take"),
    row(ASKED, "gauge-noise", &["sensor-noise"], "sensor.noise", "Noise of a gauge, rms"),
    row(ASKED, "rate", &["period", "T_s"], "timing.period", "Control rate or period"),
    row(OPTION, "gauge-range", &["sensor-range"], "sensor.range", "Lowest and highest displacement that a gauge can report"),
    row(OPTION, "gauge-bits", &["sensor-bits"], "sensor.bits", "Resolution of the gauges' converter, bits"),
    row(OPTION, "dac-bits", &[], "dac.bits", "Resolution of the output converter, bits"),
    row(OPTION, "dac-range", &[], "dac.range", "Volts at the stack at code 0 and at full scale"),
    row(OPTION, "amplifier-lag", &["lag"], "amplifier.lag", "Time constant of the amplifiers"),
    row(OPTION, "amplifier-noise", &[], "amplifier.noise", "Noise of the amplifiers, rms"),
    row(OPTION, "modal-damping", &["zeta"], "control.modal_damping", "Damping ratio of the lowest mode of the platform"),
    row(OPTION, "translation", &[], "workspace.translation", "Bounds on x, y and z from rest; default: the reach of the legs"),
    row(OPTION, "rotation", &[], "workspace.rotation", "Bounds on the three angles; default: the reach of the legs"),
    row(OPTION, "mcu", &[], "target.mcu", "Microcontroller"),
];

impl Question {
    /// Example of an answer, for help and prompt.
    pub fn example(&self) -> String {
        let example = keys::key(self.key).map_or("", |key| key.example);
        if self.option == "rate" { "20 kHz or 50 us".to_owned() } else { plain(example) }
    }
}

/// A TOML literal without quotes and brackets, as a user types it.
pub fn plain(literal: &str) -> String {
    literal.replace(['[', ']', '"'], "")
}

/// The TOML literal of an answer: quoted, as a list, or as the period of a rate, as the key requires.
pub fn literal(question: &Question, answer: &str) -> String {
    let Some(key) = keys::key(question.key) else { return quoted(answer) };
    let (item, list) = match key.shape {
        Shape::One(item) => (item, false),
        Shape::List(items) | Shape::Leading(_, items) | Shape::Rows(_, items) => (items[0], true),
        Shape::Records | Shape::Reasons | Shape::Paths => (Item::File, true),
    };
    let one = |text: &str| {
        let text = text.trim();
        match item {
            Item::Number(_) | Item::Integer(..) | Item::Flag if !text.is_empty() => text.to_owned(),
            Item::Quantity { dimension: Dimension::TIME, .. } => quoted(&period(text)),
            _ => quoted(text),
        }
    };
    let inner = answer.trim().trim_start_matches('[').trim_end_matches(']').replace('"', "");
    if list { format!("[{}]", inner.split(',').map(one).collect::<Vec<_>>().join(", ")) } else { one(&inner) }
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace(['\\', '"', '\n', '\r'], ""))
}

/// The period of a rate such as "20 kHz"; any other text unchanged.
fn period(text: &str) -> String {
    match quantity::parse(text) {
        Ok(found) if found.dimension == Dimension::FREQUENCY && found.value > 0.0 => {
            format!("{} us", 1e6 / found.value)
        }
        _ => text.to_owned(),
    }
}
