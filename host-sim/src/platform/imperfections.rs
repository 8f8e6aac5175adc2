//! What a real structure has beyond a rigid platform on six ideal legs: structural modes, flexure joints, cables, and
//! mains, drift and timing jitter in the measurement.

use core::f64::consts::TAU;
use core::fmt;

use serde::{Deserialize, Serialize};

use super::linear::{Matrix6, Six, Three, apply, exponential};
use crate::plant::Bound;

/// Where a structural mode acts; `None` means at all six.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum ModePlace {
    /// In a leg (0 to 5), in series: the platform gets H d of its free displacement d.
    Leg(Option<usize>),
    /// In the mount of a gauge (0 to 5).
    Gauge(Option<usize>),
    /// In the frame that carries base and gauges, or in the feet below it: in all readings.
    Frame,
}

impl TryFrom<String> for ModePlace {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let (kind, number) = text.split_once(' ').map_or((text.as_str(), None), |(kind, rest)| (kind, Some(rest)));
        let index = number.and_then(|number| ["1", "2", "3", "4", "5", "6"].iter().position(|known| *known == number));
        match (kind, number.is_none() || index.is_some()) {
            ("leg", true) => Ok(Self::Leg(index)),
            ("gauge", true) => Ok(Self::Gauge(index)),
            ("frame", true) if number.is_none() => Ok(Self::Frame),
            _ => Err(format!(
                "found {text:?}; expected \"leg\", \"gauge\" (all six), \"leg 1\" to \"leg 6\", \"gauge 1\" to \"gauge 6\" or \
                 \"frame\""
            )),
        }
    }
}

impl fmt::Display for ModePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Leg(None) => f.write_str("leg"),
            Self::Gauge(None) => f.write_str("gauge"),
            Self::Leg(Some(index)) => write!(f, "leg {}", index + 1),
            Self::Gauge(Some(index)) => write!(f, "gauge {}", index + 1),
            Self::Frame => f.write_str("frame"),
        }
    }
}

impl From<ModePlace> for String {
    fn from(place: ModePlace) -> Self {
        place.to_string()
    }
}

/// A structural mode: H = ω²/(s² + 2ζωs + ω²).
///
/// A leg mode is in series with the leg. A gauge or frame mode of participation a adds a r² H of the reading to it, with
/// r = f/`frequency_hz`; a frame that gives way to the reaction has a < 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StructuralMode {
    /// Its place.
    #[serde(rename = "at")]
    pub place: ModePlace,
    /// Undamped frequency, Hz.
    pub frequency_hz: f64,
    /// ζ.
    pub damping_ratio: f64,
    /// a of a gauge or frame mode, −1 to 1. None: 0.5 for a gauge, −0.1 for the frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub participation: Option<f64>,
}

/// Cables on the platform at P_C: along each axis of {B}, a spring of stiffness k in parallel with dry friction, which is
/// elastic with the same stiffness until it slides.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cable {
    /// k along x, y, z, N/m.
    pub stiffness_n_per_m: Three,
    /// Friction along x, y, z, N.
    pub friction_n: Three,
}

/// A sine of the mains in the readings of gauges.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mains {
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Gauge, 1 to 6; none: all, in phase.
    #[serde(default)]
    pub gauge: Option<usize>,
    /// Phase at the end of the preparation, rad.
    #[serde(default)]
    pub phase_rad: f64,
}

/// Deviations from the ideal platform; none by default.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Imperfections {
    /// Structural modes. Those of one leg are in series, those of one gauge add up.
    pub modes: Vec<StructuralMode>,
    /// Stiffness of a leg across its axis at the platform joint, over its axial stiffness.
    pub joint_stiffness_share: f64,
    /// Cables on the platform.
    pub cable: Option<Cable>,
    /// Mains in the gauges.
    pub mains: Vec<Mains>,
    /// Drift of each gauge, m/s, from the end of the preparation.
    pub gauge_drift_m_per_s: Six,
    /// Jitter of the instant at which all six gauges are read and, independently, of that at which the voltages change, s rms.
    pub timing_jitter_s: f64,
}

impl Imperfections {
    /// Whether there are none.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Findings about its values.
    pub(super) fn findings(&self) -> Vec<String> {
        use Bound::{Above, AtLeast, AtMost};
        let mut out = Vec::new();
        let mut expect = |field: String, value: f64, low: Bound, high: Bound| {
            out.extend(low.and(high, &format!("imperfections.{field}"), value));
        };
        let mut no_leg = Vec::new();
        for (k, mode) in self.modes.iter().enumerate() {
            expect(format!("modes[{k}].frequency_hz"), mode.frequency_hz, AtLeast(1.0), AtMost(20e3));
            expect(format!("modes[{k}].damping_ratio"), mode.damping_ratio, Above(0.0), Bound::Below(1.0));
            if let Some(share) = mode.participation {
                expect(format!("modes[{k}].participation"), share, AtLeast(-1.0), AtMost(1.0));
                if matches!(mode.place, ModePlace::Leg(_)) {
                    no_leg.push(format!(
                        "`imperfections.modes[{k}].participation` is {share}; a leg mode is in series: remove it"
                    ));
                }
            }
        }
        expect("joint_stiffness_share".into(), self.joint_stiffness_share, AtLeast(0.0), AtMost(1.0));
        for (k, cable) in self.cable.iter().flat_map(|cable| (0..3).map(move |k| (k, cable))) {
            expect(format!("cable.stiffness_n_per_m[{k}]"), cable.stiffness_n_per_m[k], AtLeast(0.0), AtMost(1e7));
            expect(format!("cable.friction_n[{k}]"), cable.friction_n[k], AtLeast(0.0), AtMost(1e4));
        }
        for (k, mains) in self.mains.iter().enumerate() {
            expect(format!("mains[{k}].amplitude_m"), mains.amplitude_m, AtLeast(0.0), AtMost(1e-3));
            expect(format!("mains[{k}].frequency_hz"), mains.frequency_hz, AtLeast(0.0), AtMost(1e5));
            expect(format!("mains[{k}].phase_rad"), mains.phase_rad, AtLeast(-10.0), AtMost(10.0));
            expect(format!("mains[{k}].gauge"), mains.gauge.unwrap_or(1) as f64, AtLeast(1.0), AtMost(6.0));
        }
        for (k, drift) in self.gauge_drift_m_per_s.iter().enumerate() {
            expect(format!("gauge_drift_m_per_s[{k}]"), *drift, AtLeast(-1e-3), AtMost(1e-3));
        }
        expect("timing_jitter_s".into(), self.timing_jitter_s, AtLeast(0.0), AtMost(1e-3));
        out.extend(no_leg);
        out
    }

    /// Longest step (s), at most `step`: a sixteenth of the period of the fastest leg mode, whose gain at its frequency then is
    /// 1.3 % low.
    pub(super) fn leg_step(&self, step: f64) -> f64 {
        let legs = self.modes.iter().filter(|mode| matches!(mode.place, ModePlace::Leg(_)));
        legs.map(|mode| 1.0 / (16.0 * mode.frequency_hz)).fold(step, |step, own| if own < step { own } else { step })
    }

    /// What mains and drift add to the readings at a time (s) after the preparation, m.
    pub(super) fn offsets(&self, time: f64) -> Six {
        let mut out = self.gauge_drift_m_per_s.map(|drift| drift * time);
        for mains in &self.mains {
            let wave = mains.amplitude_m * libm::sin(TAU * mains.frequency_hz * time + mains.phase_rad);
            for (k, offset) in out.iter_mut().enumerate() {
                if mains.gauge.is_none_or(|gauge| gauge == k + 1) {
                    *offset += wave;
                }
            }
        }
        out
    }
}

/// H, exact for an input that is a cubic over a step, given by its values and rates at both ends.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Oscillator {
    natural: f64,
    damping: f64,
    step: f64,
    /// Of [w − x₀, ẇ step, ẋ step, ẍ step², x⃛ step³]: w − x₀ and ẇ step at the end.
    factors: [[f64; 5]; 2],
    position: f64,
    velocity: f64,
}

impl Oscillator {
    fn new(mode: &StructuralMode) -> Self {
        Self {
            natural: TAU * mode.frequency_hz,
            damping: mode.damping_ratio,
            step: 0.0,
            factors: [[0.0; 5]; 2],
            position: 0.0,
            velocity: 0.0,
        }
    }

    /// Sets the length of the following steps, s.
    fn set_step(&mut self, step: f64) {
        if step.to_bits() == self.step.to_bits() {
            return;
        }
        self.step = step;
        let w = self.natural * step;
        // d/ds of [w, w', x, x', x'', x'''] in units of one step.
        let mut rates = vec![vec![0.0; 6]; 6];
        rates[0][1] = 1.0;
        rates[1][..3].copy_from_slice(&[-w * w, -2.0 * self.damping * w, w * w]);
        (2..5).for_each(|k| rates[k][k + 1] = 1.0);
        let out = exponential(&rates);
        self.factors = [0, 1].map(|row| [0, 1, 3, 4, 5].map(|column| out[row][column]));
    }

    fn rest(&mut self) {
        (self.position, self.velocity) = (0.0, 0.0);
    }

    /// One step over which the input goes from `before` to `after`, each as value and rate (1/s).
    fn advance(&mut self, before: [f64; 2], after: [f64; 2]) {
        let (rise, r0, r1) = (after[0] - before[0], before[1] * self.step, after[1] * self.step);
        let curve = 6.0 * rise - 4.0 * r0 - 2.0 * r1;
        let bend = 6.0 * (r0 + r1) - 12.0 * rise;
        let state = [self.position - before[0], self.velocity * self.step, r0, curve, bend];
        let [position, velocity] = self.factors.map(|row| (0..5).map(|k| row[k] * state[k]).sum::<f64>());
        self.position = before[0] + position;
        self.velocity = velocity / self.step;
    }

    /// r² H of the input, of which `input` is value and rate now: its value, and its rate.
    fn second(&self, input: [f64; 2]) -> [f64; 2] {
        let loss = 2.0 * self.damping / self.natural;
        let acceleration =
            self.natural * (self.natural * (input[0] - self.position) - 2.0 * self.damping * self.velocity);
        [-(input[0] - self.position - loss * self.velocity), -(input[1] - self.velocity - loss * acceleration)]
    }
}

/// The structural modes of a plant.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Modes {
    /// Leg, and the mode in it.
    legs: Vec<(usize, Oscillator)>,
    /// Gauge, participation, and the mode in its reading.
    gauges: Vec<(usize, f64, Oscillator)>,
    /// Readings per pose near rest.
    readings: Matrix6,
    /// What the modes add to the readings, m, and its rate, m/s.
    added: [Six; 2],
}

impl Modes {
    /// None without a mode; `readings` per pose near rest.
    pub(super) fn of(modes: &[StructuralMode], readings: Matrix6) -> Option<Box<Self>> {
        let mut out = Self { legs: Vec::new(), gauges: Vec::new(), readings, added: [[0.0; 6]; 2] };
        for mode in modes {
            let places = |index: Option<usize>| (0..6).filter(move |k| index.is_none_or(|index| index == *k));
            match mode.place {
                ModePlace::Leg(index) => out.legs.extend(places(index).map(|k| (k, Oscillator::new(mode)))),
                ModePlace::Gauge(index) => {
                    let share = mode.participation.unwrap_or(0.5);
                    out.gauges.extend(places(index).map(|k| (k, share, Oscillator::new(mode))));
                }
                ModePlace::Frame => {
                    let share = mode.participation.unwrap_or(-0.1);
                    out.gauges.extend(places(None).map(|k| (k, share, Oscillator::new(mode))));
                }
            }
        }
        (!modes.is_empty()).then(|| Box::new(out))
    }

    /// Whether a leg has one.
    pub(super) fn in_legs(&self) -> bool {
        !self.legs.is_empty()
    }

    /// Everything at rest at zero.
    pub(super) fn rest(&mut self) {
        self.legs.iter_mut().for_each(|(_, mode)| mode.rest());
        self.gauges.iter_mut().for_each(|(_, _, mode)| mode.rest());
        self.added = [[0.0; 6]; 2];
    }

    /// Free displacements at the end of a step (s) over which they go straight from one to the other, m: with the modes.
    pub(super) fn legs_follow(&mut self, before: &Six, after: &Six, step: f64) -> Six {
        let mut from: [[f64; 2]; 6] = std::array::from_fn(|k| [before[k], (after[k] - before[k]) / step]);
        let mut to: [[f64; 2]; 6] = std::array::from_fn(|k| [after[k], from[k][1]]);
        for (leg, mode) in &mut self.legs {
            mode.set_step(step);
            let start = [mode.position, mode.velocity];
            mode.advance(from[*leg], to[*leg]);
            (from[*leg], to[*leg]) = (start, [mode.position, mode.velocity]);
        }
        to.map(|[position, _]| position)
    }

    /// The gauges follow a step (s) from one pose and rate to another.
    pub(super) fn gauges_follow(&mut self, before: &[Six; 2], after: &[Six; 2], step: f64) {
        if self.gauges.is_empty() {
            return;
        }
        let [before, after] = [before, after].map(|motion| motion.each_ref().map(|six| apply(&self.readings, six)));
        self.added = [[0.0; 6]; 2];
        for (gauge, share, mode) in &mut self.gauges {
            let k = *gauge;
            let now = [after[0][k], after[1][k]];
            mode.set_step(step);
            mode.advance([before[0][k], before[1][k]], now);
            let [value, rate] = mode.second(now);
            self.added[0][k] += *share * value;
            self.added[1][k] += *share * rate;
        }
    }

    /// What the modes add to the readings, m, and its rate, m/s.
    pub(super) fn added(&self) -> &[Six; 2] {
        &self.added
    }
}

/// The state of a cable.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CableForce {
    of: Cable,
    position: Three,
    /// Friction on the cable, N.
    friction: Three,
}

impl CableForce {
    /// Without force at zero.
    pub(super) fn new(of: Cable) -> Self {
        Self { of, position: [0.0; 3], friction: [0.0; 3] }
    }

    /// Takes the platform (m from rest) to a place on a straight way.
    pub(super) fn follow(&mut self, position: &Three) {
        for k in 0..3 {
            let limit = self.of.friction_n[k];
            let held = self.friction[k] + self.of.stiffness_n_per_m[k] * (position[k] - self.position[k]);
            self.friction[k] = if held > limit {
                limit
            } else if held < -limit {
                -limit
            } else {
                held
            };
        }
        self.position = *position;
    }

    /// Force on the platform, N.
    pub(super) fn force(&self) -> Three {
        std::array::from_fn(|k| -(self.of.stiffness_n_per_m[k] * self.position[k] + self.friction[k]))
    }
}

#[cfg(test)]
mod tests;
