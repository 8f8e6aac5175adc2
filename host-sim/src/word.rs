//! Words: the common currency of controllers, traces and targets.
//!
//! Every input, output and configuration value travels as a `u64`: the bits of an f64, the bits of an f32 with zeros above,
//! or an integer.

use specgen_runtime::trigger;

/// Floating-point type of a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scalar {
    /// 32 bits.
    F32,
    /// 64 bits.
    F64,
}

impl Scalar {
    /// From the number of bits, 32 or 64.
    pub fn from_bits(bits: u32) -> Option<Self> {
        match bits {
            32 => Some(Self::F32),
            64 => Some(Self::F64),
            _ => None,
        }
    }

    /// 32 or 64.
    pub fn bits(self) -> u32 {
        match self {
            Self::F32 => 32,
            Self::F64 => 64,
        }
    }

    /// Word of `value`, rounded to this type.
    pub fn encode(self, value: f64) -> u64 {
        match self {
            Self::F32 => u64::from((value as f32).to_bits()),
            Self::F64 => value.to_bits(),
        }
    }

    /// Value of a word. Bits above an f32 are ignored.
    pub fn decode(self, word: u64) -> f64 {
        match self {
            Self::F32 => f64::from(f32::from_bits(word as u32)),
            Self::F64 => f64::from_bits(word),
        }
    }

    /// How many representable numbers lie between two words (1 for neighbours, 0 for equal ones; −0 and +0 are neighbours).
    /// `None` if either is NaN, or has bits set above its type.
    pub fn ulps(self, a: u64, b: u64) -> Option<u64> {
        if self == Self::F32 && (a | b) >> 32 != 0 {
            return None;
        }
        if self.decode(a).is_nan() || self.decode(b).is_nan() {
            return None;
        }
        Some(self.rank(a).abs_diff(self.rank(b)))
    }

    /// Position in the order of all numbers: negative ones mirrored below the positive ones.
    fn rank(self, word: u64) -> u64 {
        let sign = 1_u64 << (self.bits() - 1);
        if word & sign == 0 { word | sign } else { !word & (sign | (sign - 1)) }
    }
}

/// Content of a word of a given name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordKind {
    /// A number of the controller's scalar type.
    Real,
    /// An unsigned integer.
    Integer,
}

/// Names (without index) of the words that are integers; all others are real. Part of the controller's interface.
const INTEGERS: [&str; 25] = [
    "dac_code",
    "status",
    "state_digest",
    "mode",
    "setpoint_kind",
    "run_interval",
    "max_step_codes",
    "code_min",
    "code_max",
    "command",
    "selector",
    "sequence",
    "interaction",
    "request",
    "events",
    "supervisor",
    "conditions",
    "missed",
    "trigger_kind",
    "trigger_axis",
    "trigger_direction",
    "trigger_first",
    "trigger_every",
    "trigger_last",
    "trigger_width",
];

impl WordKind {
    /// Kind of the word called `name`, which may end in an index: `voltage[2]`.
    pub fn of(name: &str) -> Self {
        let stem = name.split('[').next().unwrap_or(name);
        if INTEGERS.contains(&stem) { Self::Integer } else { Self::Real }
    }
}

/// The bits of a status word as text, joined by `+`; empty if none is set. Both kinds of controller have the same bits;
/// legs and gauges count from 0, as words do. A bit without a meaning is shown by its number, so that a word of another
/// version does not look good.
pub fn status_words(status: u32) -> String {
    let mut words = Vec::new();
    let mut legs = |first: u32, what: &str, then: &str| {
        words.extend((0..6).filter(|leg| status >> (first + leg) & 1 == 1).map(|leg| format!("{what} {leg}{then}")));
    };
    legs(0, "leg", " limited");
    legs(8, "gauge", " fault");
    legs(24, "leg", " inverse static");
    for (bit, what) in [
        (16, "set-point refused"),
        (17, "set-point stale"),
        (18, "moving"),
        (19, "wrench fault"),
        (20, "correction limited"),
        (21, "trigger missed"),
        (22, "sample replaced"),
        (23, "sample repeated"),
    ] {
        words.extend((status >> bit & 1 == 1).then(|| what.to_owned()));
    }
    let high = trigger::lines(status);
    words.extend((0..trigger::MOST).filter(|line| high >> line & 1 == 1).map(|line| format!("trigger {line} high")));
    let known = 0xffff | 0xff << 16 | 0x3f << 24;
    words.extend((0..u32::BITS).filter(|bit| status & !known & 1 << bit != 0).map(|bit| format!("bit {bit}")));
    words.join("+")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_status_is_said_bit_by_bit() {
        assert_eq!(status_words(0), "");
        assert_eq!(status_words(0x1), "leg 0 limited");
        assert_eq!(status_words(0x2_2000), "gauge 5 fault+set-point stale");
        let texts: std::collections::BTreeSet<String> = (0..32).map(|bit| status_words(1 << bit)).collect();
        let unknown = texts.iter().filter(|text| text.starts_with("bit ")).count();
        assert_eq!((texts.len(), unknown), (32, 2), "each bit has a text of its own");
    }

    #[test]
    fn words_round_trip_in_both_types() {
        for value in [0.0, -0.0, 1.5, -2.25, f64::INFINITY] {
            assert_eq!(Scalar::F64.decode(Scalar::F64.encode(value)).to_bits(), value.to_bits());
            assert_eq!(Scalar::F32.decode(Scalar::F32.encode(value)).to_bits(), value.to_bits());
        }
        assert_eq!(Scalar::F32.encode(-1.0), 0xBF80_0000);
    }

    #[test]
    fn ulps_count_across_zero_and_exponents() {
        let ulps = |a: f64, b: f64| Scalar::F64.ulps(a.to_bits(), b.to_bits());
        assert_eq!(ulps(1.0, 1.0), Some(0));
        assert_eq!(ulps(2.0, 2.0_f64.next_down()), Some(1));
        assert_eq!(ulps(0.0, -0.0), Some(1));
        assert_eq!(ulps(f64::from_bits(1), -f64::from_bits(1)), Some(3));
        assert_eq!(ulps(1.0, f64::NAN), None);
        let f32_ulps = |a: f32, b: f32| Scalar::F32.ulps(a.to_bits().into(), b.to_bits().into());
        assert_eq!(f32_ulps(1.0, 1.0_f32.next_up()), Some(1));
        assert_eq!(f32_ulps(-1.0, (-1.0_f32).next_down()), Some(1));
        assert_eq!(Scalar::F32.ulps(1 << 32, 0), None);
    }

    #[test]
    fn integers_are_known_by_name() {
        assert_eq!(WordKind::of("dac_code[3]"), WordKind::Integer);
        assert_eq!(WordKind::of("voltage[3]"), WordKind::Real);
        assert_eq!(WordKind::of("level_weight"), WordKind::Real);
        assert_eq!(WordKind::of("level[0]"), WordKind::Real);
    }
}
