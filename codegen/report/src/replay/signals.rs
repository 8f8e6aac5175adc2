//! Signals of each tick of a record, by name.

use std::fmt::Write as _;

use host_sim::platform::table::AXES;
use host_sim::record::{Header, ReplayedRows, Row};
use host_sim::word::Scalar;

/// Channels with pose values, if there is a pose.
const POSES: [&str; 3] = ["pose", "target", "error"];

pub const LEG_KEYS: [&str; 6] = ["leg0", "leg1", "leg2", "leg3", "leg4", "leg5"];
const GAUGE_KEYS: [&str; 6] = ["gauge0", "gauge1", "gauge2", "gauge3", "gauge4", "gauge5"];

/// Source of six numbers in a tick.
#[derive(Clone, Copy)]
pub enum Of {
    /// Input words from this one on.
    Input(usize),
    /// Replayed output words from this one on.
    Output(usize),
    /// Difference of output words: target minus pose.
    Difference(usize, usize),
    /// Output words minus input words: demand of the legs minus their gauges.
    FromInput(usize, usize),
}

impl Of {
    /// The numbers of a tick; `None` if the record was not replayed that far.
    pub fn numbers(self, scalar: Scalar, row: &Row, given: Option<&Vec<u64>>) -> Option<Numbers> {
        let six = |words: &[u64], first: usize| words.get(first..).and_then(|words| words.first_chunk::<6>()).copied();
        match self {
            Of::Input(place) => six(&row.input, place).map(|words| Numbers::Words(scalar, words)),
            Of::Output(place) => given.and_then(|given| six(given, place)).map(|words| Numbers::Words(scalar, words)),
            Of::Difference(target, pose) => given.and_then(|given| {
                let (target, pose) = (six(given, target)?, six(given, pose)?);
                let less = |k: usize| scalar.decode(target[k]) - scalar.decode(pose[k]);
                Some(Numbers::Values(core::array::from_fn(less)))
            }),
            Of::FromInput(target, place) => given.and_then(|given| {
                let (target, gauge) = (six(given, target)?, six(&row.input, place)?);
                let less = |k: usize| scalar.decode(target[k]) - scalar.decode(gauge[k]);
                Some(Numbers::Values(core::array::from_fn(less)))
            }),
        }
    }
}

/// Signals by name; whether there is a pose.
pub struct Signals(pub Vec<(&'static str, Of)>, pub bool);

impl Signals {
    pub fn new(header: &Header, again: Option<ReplayedRows>) -> Self {
        let place = |names: &[String], stem: &str| names.iter().position(|name| *name == format!("{stem}[0]"));
        let inputs = header.input_names();
        let gauges = place(&inputs, "gauge").or_else(|| place(&inputs, "displacement"));
        let mut all: Vec<(&str, Of)> = gauges.map(|place| ("gauges", Of::Input(place))).into_iter().collect();
        let outputs = again.map_or(&[][..], |again| again.names);
        let output = |stem: &str| place(outputs, stem);
        all.extend(output("voltage").map(|place| ("volts", Of::Output(place))));
        let (pose, target) = (output("pose"), output("target"));
        all.extend(pose.map(|place| ("pose", Of::Output(place))));
        all.extend(target.map(|place| ("target", Of::Output(place))));
        match (target.zip(pose), output("demand").zip(gauges)) {
            (Some((target, pose)), _) => all.push(("error", Of::Difference(target, pose))),
            (None, Some((demand, gauge))) => {
                all.push(("demand", Of::Output(demand)));
                all.push(("error", Of::FromInput(demand, gauge)));
            }
            (None, None) => {}
        }
        Self(all, pose.is_some())
    }

    pub fn keys(&self, name: &str) -> [&'static str; 6] {
        match name {
            "gauges" => GAUGE_KEYS,
            name if POSES.contains(&name) && self.1 => AXES,
            _ => LEG_KEYS,
        }
    }
}

pub enum Numbers {
    Words(Scalar, [u64; 6]),
    Values([f64; 6]),
    Codes([i32; 6]),
}

impl Numbers {
    /// Writes a JSON object with the shortest decimals that give the same bits. JSON has no NaN: a gauge without a reading is null.
    pub fn write(&self, keys: [&str; 6], text: &mut String) {
        text.push('{');
        for (k, key) in keys.into_iter().enumerate() {
            let comma = if k > 0 { "," } else { "" };
            // Writing to a String cannot fail.
            let _ = write!(text, "{comma}\"{key}\":");
            let _ = match *self {
                Self::Codes(codes) => write!(text, "{}", codes[k]),
                Self::Values(values) if values[k].is_finite() => write!(text, "{:e}", values[k]),
                Self::Words(scalar, words) if scalar.decode(words[k]).is_finite() => match scalar.bits() {
                    32 => write!(text, "{:e}", f32::from_bits(words[k] as u32)),
                    _ => write!(text, "{:e}", f64::from_bits(words[k])),
                },
                Self::Values(_) | Self::Words(..) => write!(text, "null"),
            };
        }
        text.push('}');
    }
}
