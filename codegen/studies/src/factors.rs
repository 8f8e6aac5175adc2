//! Uncertain parameters: which vary, their ranges, and the origin of each range.

use std::fmt;

use serde::{Deserialize, Serialize};

use specgen_language::model::Model;

specgen_language::named! {
    /// A parameter of a machine that may deviate from its spec.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Factor {
        /// Mass and inertia of the platform; for legs with their own gauges the moving mass, through the resonance.
        Mass => "mass",
        /// Axial stiffness of a leg.
        Stiffness => "stiffness",
        /// Damping ratio.
        Damping => "damping",
        /// λ, the gain of a leg.
        Gain => "gain",
        /// Thresholds of a leg's play operators: the width of its loop.
        Hysteresis => "hysteresis",
        /// Creep of a leg.
        Creep => "creep",
        /// Lag of an amplifier.
        Lag => "lag",
        /// Lag of the gauges.
        GaugeLag => "gauge_lag",
        /// Noise of gauges, amplifiers and force sensor.
        Noise => "noise",
        /// Delay of the voltages in control intervals: an integer, not a factor.
        DelayTicks => "delay_ticks",
        /// Kinds of structural modes that a platform may have ([`crate::machine::StructureRange`]), by number: none, or from 1 to the
        /// last of the spec; an option is 0 or 1. A random platform also has the rest of what real structures have.
        Structure => "structure",
    }
}

impl Factor {
    /// Whether each leg has its own value in a random machine.
    pub fn of_each_leg(self) -> bool {
        matches!(self, Self::Stiffness | Self::Gain | Self::Hysteresis | Self::Creep | Self::Lag | Self::GaugeLag)
    }

    /// The nominal value.
    pub fn nominal(self) -> f64 {
        if matches!(self, Self::DelayTicks | Self::Structure) { 0.0 } else { 1.0 }
    }
}

impl fmt::Display for Factor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Origin of a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// specgen's default.
    Default,
    /// `[robust]`, or `adaptation.gain_ratio`.
    Spec,
    /// An option of the command.
    Option,
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Default => "default",
            Self::Spec => "spec",
            Self::Option => "option",
        })
    }
}

/// Range of one parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FactorRange {
    /// The parameter.
    pub factor: Factor,
    /// Lower and upper limit.
    pub range: [f64; 2],
    /// Origin of the range.
    pub origin: Origin,
}

/// A range given by the user: `mass=5 %`, `gain=0.9:1.1`, `delay_ticks=2`.
#[derive(Debug, Clone, PartialEq)]
pub struct UserRange {
    /// The parameter.
    pub factor: Factor,
    /// Lower and upper limit.
    pub range: [f64; 2],
}

/// Largest factor, as in the key table of the spec.
const LARGEST: f64 = 10.0;
/// Largest delay in ticks, as in the key table of the spec.
const MOST_TICKS: f64 = 100.0;

impl UserRange {
    /// Reads `NAME=RANGE`.
    ///
    /// # Errors
    /// A message with the error and the expected format.
    pub fn parse(text: &str) -> Result<Self, String> {
        let how =
            "write NAME=PERCENT such as mass=5%, NAME=LOW:HIGH such as gain=0.9:1.1, delay_ticks=1, or structure=1";
        let Some((name, value)) = text.split_once('=') else { return Err(format!("found `{text}`; {how}")) };
        let name = name.trim();
        let Some(factor) = Factor::ALL.into_iter().find(|factor| factor.name() == name) else {
            let known: Vec<&str> = Factor::ALL.iter().map(|factor| factor.name()).collect();
            return Err(format!("unknown parameter `{name}`; expected one of {}", known.join(", ")));
        };
        let number = |part: &str| -> Result<f64, String> {
            let found = part.trim().parse().ok().filter(|value: &f64| value.is_finite());
            found.ok_or_else(|| format!("`{}` in `{text}` is not a number; {how}", part.trim()))
        };
        let value = value.trim();
        let range = match (value.split_once(':'), value.strip_suffix('%')) {
            (Some((low, high)), _) => [number(low)?, number(high)?],
            (None, Some(percent)) if factor.nominal() == 1.0 => {
                let part = number(percent)? / 100.0;
                [1.0 - part, 1.0 + part]
            }
            (None, None) if factor == Factor::DelayTicks => [0.0, number(value)?],
            (None, None) if factor == Factor::Structure => [number(value)?; 2],
            _ => return Err(format!("found `{text}`; {how}")),
        };
        check(factor, range)?;
        Ok(Self { factor, range })
    }
}

/// Checks that a machine can have these values.
fn check(factor: Factor, [low, high]: [f64; 2]) -> Result<(), String> {
    if low > high {
        return Err(format!("{factor} from {low} to {high} is an empty range; give the smaller value first"));
    }
    if factor == Factor::DelayTicks {
        let whole = low.fract() == 0.0 && high.fract() == 0.0;
        return if whole && low >= 0.0 && high <= MOST_TICKS {
            Ok(())
        } else {
            Err(format!("{factor} from {low} to {high}: expected whole control intervals from 0 to {MOST_TICKS}"))
        };
    }
    if factor == Factor::Structure {
        return if low == high && (low == 0.0 || low == 1.0) {
            Ok(())
        } else {
            Err(format!("structure from {low} to {high}: expected structure=0 or structure=1"))
        };
    }
    if low > 0.0 && high <= LARGEST {
        return Ok(());
    }
    Err(format!(
        "{factor} from {low} to {high} times the spec's value: expected factors above 0 and up to {LARGEST}; a percentage such as 5% \
         must be below 100%"
    ))
}

/// All parameters with their ranges.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Factors(Vec<FactorRange>);

impl Factors {
    /// Ranges from the options, else from the spec, else the defaults.
    pub fn of(model: &Model, given: &[UserRange]) -> Self {
        let declared = &model.robust;
        let about = |part: f64| [1.0 - part, 1.0 + part];
        let one = |factor: Factor| {
            let (spec, default) = match factor {
                Factor::Mass => (declared.mass, about(0.05)),
                Factor::Stiffness => (declared.stiffness, about(0.05)),
                Factor::Damping => (declared.damping, about(0.3)),
                Factor::Gain => (declared.gain.or(Some(model.adaptation.gain_ratio)), about(0.1)),
                Factor::Hysteresis => (declared.hysteresis, about(0.1)),
                Factor::Creep => (declared.creep, about(0.1)),
                Factor::Lag => (declared.lag, about(0.2)),
                // A parameter that is zero does not vary.
                Factor::GaugeLag if model.sensor.lag == 0.0 => (declared.gauge_lag, about(0.0)),
                Factor::GaugeLag => (declared.gauge_lag, about(0.2)),
                Factor::Noise => (declared.noise, about(0.5)),
                Factor::DelayTicks => (declared.delay_ticks.map(|ticks| [0.0, f64::from(ticks)]), [0.0, 1.0]),
                Factor::Structure => (None, [0.0; 2]),
            };
            // The last option wins, as elsewhere.
            let option = given.iter().rev().find(|given| given.factor == factor).map(|given| given.range);
            let kinds = if model.task_space.is_some() { model.structure.kinds.len() as f64 } else { 0.0 };
            let numbers = |[on, _]: [f64; 2]| if on * kinds > 0.0 { [1.0, kinds] } else { [0.0; 2] };
            let option = option.map(|range| if factor == Factor::Structure { numbers(range) } else { range });
            let (range, origin) = match (option, spec) {
                (Some(range), _) => (range, Origin::Option),
                (None, Some(range)) => (range, Origin::Spec),
                (None, None) => (default, Origin::Default),
            };
            FactorRange { factor, range, origin }
        };
        // `structure` is listed only if it is on.
        let listed = |one: &FactorRange| one.factor != Factor::Structure || one.range[1] > 0.0;
        Self(Factor::ALL.into_iter().map(one).filter(listed).collect())
    }

    /// The ranges, in the order of [`Factor::ALL`]; the structure only if it is on.
    pub fn iter(&self) -> impl Iterator<Item = &FactorRange> {
        self.0.iter()
    }

    /// The range of one parameter.
    pub fn range(&self, factor: Factor) -> [f64; 2] {
        // Every parameter has an entry; nominal otherwise.
        self.0.iter().find(|one| one.factor == factor).map_or([factor.nominal(); 2], |one| one.range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_have_three_formats() {
        let range = |text: &str| UserRange::parse(text).map(|given| (given.factor, given.range));
        let (factor, [low, high]) = range("mass=5 %").unwrap();
        assert!(factor == Factor::Mass && (low - 0.95).abs() < 1e-12 && (high - 1.05).abs() < 1e-12);
        assert_eq!(range("gain = 0.9 : 1.1"), Ok((Factor::Gain, [0.9, 1.1])));
        assert_eq!(range("delay_ticks=2"), Ok((Factor::DelayTicks, [0.0, 2.0])));
        assert_eq!(range("delay_ticks=1:2"), Ok((Factor::DelayTicks, [1.0, 2.0])));
        assert_eq!(range("structure=1"), Ok((Factor::Structure, [1.0, 1.0])));
        assert_eq!(range("lag=1:1"), Ok((Factor::Lag, [1.0, 1.0])));
    }

    #[test]
    fn impossible_ranges_are_refused_with_a_fix() {
        for (text, fix) in [
            ("mass", "write NAME=PERCENT"),
            ("weight=5%", "expected one of mass"),
            ("mass=5", "such as mass=5%"),
            ("mass=x%", "is not a number"),
            ("mass=nan:1", "is not a number"),
            ("mass=-0.5:1", "expected factors above 0"),
            ("mass=150%", "must be below 100%"),
            ("mass=-5%", "the smaller value first"),
            ("mass=1.1:0.9", "the smaller value first"),
            ("noise=1:11", "up to 10"),
            ("delay_ticks=0.5", "whole control intervals"),
            ("delay_ticks=101", "from 0 to 100"),
            ("delay_ticks=10%", "delay_ticks=1"),
            ("structure=2", "expected structure=0 or structure=1"),
            ("structure=0:1", "expected structure=0 or structure=1"),
            ("structure=5%", "structure=1"),
        ] {
            let error = UserRange::parse(text).unwrap_err();
            assert!(error.contains(fix), "{text}: {error}");
        }
    }
}
