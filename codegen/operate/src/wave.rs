//! Reads a wave from a TOML file into the words of a device's generator.
//!
//! ```toml
//! drive   = false                              # true: of the voltages of an open drive, V in place of m and rad
//! center  = [0.0, 0.0, 1e-6, 0.0, 0.0, 0.0]   # start and end, m and rad (legs: m); zeros if not given
//! ramp    = 0.5                                # smooth start and end, s
//! seconds = 10.0                               # duration; until `wave stop` if not given
//!
//! [[axis]]
//! axis  = "z"                                  # x y z rx ry rz, or leg 0 to 5 as a number
//! offset = 0.0                                 # m or rad
//! shape = { kind = "sine", amplitude = 2e-6, frequency = 5.0 }
//! ```

use serde::Deserialize;
use specgen_runtime::Real;
use specgen_runtime::wave::{AxisWave, LARGEST, Refusal, Settings, Shape, TONES, Tone, WORDS, step_of};

use crate::place::AXES;

/// Largest number of ticks.
const MOST_TICKS: f64 = (1_u64 << 30) as f64;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    drive: bool,
    #[serde(default)]
    center: [f64; 6],
    ramp: f64,
    seconds: Option<f64>,
    axis: Vec<Axis>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Axis {
    axis: Name,
    #[serde(default)]
    offset: f64,
    shape: Kind,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Name {
    Pose(String),
    Leg(usize),
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
enum Kind {
    Constant,
    Ramp {
        amplitude: f64,
        seconds: f64,
    },
    Triangle {
        amplitude: f64,
        frequency: f64,
    },
    Sine {
        amplitude: f64,
        frequency: f64,
        #[serde(default)]
        phase: f64,
    },
    Chirp {
        amplitude: f64,
        from: f64,
        to: f64,
        seconds: f64,
    },
    Multisine {
        tones: Vec<ToneEntry>,
    },
    Reversals {
        amplitude: f64,
        levels: i32,
        seconds: f64,
        #[serde(default)]
        hold: f64,
        #[serde(default)]
        corner: f64,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ToneEntry {
    amplitude: f64,
    frequency: f64,
    #[serde(default)]
    phase: f64,
}

/// A wave for a device.
#[derive(Debug)]
pub struct WaveWords {
    /// For the device's generator.
    pub words: Vec<u64>,
    /// Words of its center.
    pub center: [u64; 6],
    /// Whether it is of the voltages of an open drive.
    pub drives: bool,
}

/// Words of a wave from the text of its file, for a controller with this period (s) and scalar.
///
/// # Errors
/// The wave is invalid; syntax errors have line and column.
pub fn read_wave(text: &str, period: f64, single: bool) -> Result<WaveWords, String> {
    let file: File = toml::from_str(text).map_err(|error| error.to_string())?;
    if single { words::<f32>(&file, period) } else { words::<f64>(&file, period) }
}

fn words<T: Real>(file: &File, period: f64) -> Result<WaveWords, String> {
    let drives = file.drive;
    let reader = Reading { period, unit: if drives { "V" } else { "m or rad" } };
    let mut settings = Settings::<T>::still();
    let mut tones = 0;
    for (slot, value) in settings.center.iter_mut().zip(file.center) {
        *slot = reader.number("center", value)?;
    }
    settings.ramp_ticks = reader.ticks("ramp", file.ramp)?;
    settings.ticks = file.seconds.map_or(Ok(0), |seconds| reader.ticks("seconds", seconds))?;
    let mut seen = [false; 6];
    for axis in &file.axis {
        let place = match &axis.axis {
            Name::Pose(_) if drives => return Err("axis: an open drive has legs 0 to 5".to_owned()),
            Name::Pose(name) => AXES.iter().position(|known| known == name),
            Name::Leg(leg) => Some(*leg).filter(|leg| *leg < 6),
        };
        let place = place.ok_or_else(|| format!("axis: expected one of {}, or a leg 0 to 5", AXES.join(", ")))?;
        if std::mem::replace(&mut seen[place], true) {
            return Err(format!("axis {} is given twice; give each axis one shape", AXES[place]));
        }
        let shape = reader.shape(&axis.shape, &mut settings.tones, &mut tones);
        let shape = shape.map_err(|error| format!("axis {}: {error}", AXES[place]))?;
        settings.axes[place] = AxisWave { offset: reader.number("offset", axis.offset)?, shape };
    }
    let words = settings.to_words();
    // Errors that every device would refuse.
    match Settings::<T>::from_words(&words) {
        Ok(_) => Ok(WaveWords { words: words.to_vec(), center: settings.center.map(Real::to_word), drives }),
        Err(refused) => Err(match refused {
            Refusal::Word(word) => format!(
                "{} is invalid: amplitudes must not be negative (except of ramp and reversals), chirps must stay between 0 Hz and \
                 half the control rate, and a corner must not be longer than its hold and its step",
                place_of(word)
            ),
            other => format!("{other:?}"),
        }),
    }
}

/// Name of the part of a wave that has this word.
fn place_of(word: usize) -> String {
    let per_axis = (WORDS - 6 - 3 * TONES - 2) / 6;
    match word.checked_sub(6).map(|word| word / per_axis) {
        None => "center".to_owned(),
        Some(axis) => AXES.get(axis).map_or_else(|| "a tone or a time".to_owned(), |name| format!("axis {name}")),
    }
}

/// Why a device refused a wave, from the word in its refusal. `drives`: it is one of an open drive.
#[must_use]
pub fn refused_wave(word: u16, drives: bool) -> String {
    let name = |axis: usize| match AXES.get(axis) {
        Some(_) if drives => format!("leg {axis}"),
        Some(name) => format!("axis {name} (leg {axis})"),
        None => format!("axis {axis}"),
    };
    let [range, rate, acceleration] = if drives {
        ["leave the voltage limits", "exceed the slew rate", "reverse too fast"]
    } else {
        ["leave its range", "exceed the speed of a stream", "exceed the acceleration of a stream"]
    };
    let slower = "reduce amplitude or frequency, or use a longer ramp";
    match Refusal::of_word(usize::from(word)) {
        Refusal::Range(axis) => format!("{} would {range}: reduce amplitude or offset", name(axis)),
        Refusal::Rate(axis) => format!("{} would {rate}: {slower}", name(axis)),
        Refusal::Acceleration(axis) => format!("{} would {acceleration}: {slower}", name(axis)),
        Refusal::Word(_) | Refusal::Busy => format!("{} is invalid", place_of(usize::from(word))),
    }
}

struct Reading {
    period: f64,
    /// Of places and amplitudes.
    unit: &'static str,
}

impl Reading {
    fn number<T: Real>(&self, what: &str, value: f64) -> Result<T, String> {
        if value.abs() <= LARGEST {
            Ok(T::from_f64(value))
        } else {
            Err(format!("{what}: expected {}, found {value}", self.unit))
        }
    }

    fn ticks(&self, what: &str, seconds: f64) -> Result<i32, String> {
        let ticks = (seconds / self.period).round();
        if (1.0..=MOST_TICKS).contains(&ticks) {
            Ok(ticks as i32)
        } else {
            Err(format!(
                "{what}: expected a time of at least one control period of {} s, found {seconds} s",
                self.period
            ))
        }
    }

    /// Phase increment per tick.
    fn step(&self, what: &str, frequency: f64) -> Result<u64, String> {
        if frequency >= 0.0 && frequency < 0.5 / self.period {
            Ok(step_of(frequency, self.period))
        } else {
            Err(format!(
                "{what}: expected Hz from 0 to half the control rate, {}; found {frequency}",
                0.5 / self.period
            ))
        }
    }

    fn tone<T: Real>(&self, amplitude: f64, frequency: f64, phase: f64) -> Result<Tone<T>, String> {
        if !(0.0..1.0).contains(&phase) {
            return Err(format!("phase: expected turns from 0 to 1, found {phase}"));
        }
        // In turns of 2⁻⁶⁴; below 1, so that it fits.
        let phase = (phase * (1_u128 << 64) as f64) as u64;
        Ok(Tone { amplitude: self.number("amplitude", amplitude)?, phase, step: self.step("frequency", frequency)? })
    }

    fn shape<T: Real>(&self, kind: &Kind, tones: &mut [Tone<T>; TONES], used: &mut usize) -> Result<Shape<T>, String> {
        Ok(match kind {
            Kind::Constant => Shape::Constant,
            Kind::Ramp { amplitude, seconds } => Shape::Ramp {
                amplitude: self.number("amplitude", *amplitude)?,
                ticks: self.ticks("seconds", *seconds)?,
            },
            Kind::Triangle { amplitude, frequency } => Shape::Triangle {
                amplitude: self.number("amplitude", *amplitude)?,
                step: self.step("frequency", *frequency)?,
            },
            Kind::Sine { amplitude, frequency, phase } => {
                Shape::Sine { tone: self.tone(*amplitude, *frequency, *phase)? }
            }
            Kind::Chirp { amplitude, from, to, seconds } => {
                let ticks = self.ticks("seconds", *seconds)?;
                let (first, last) = (self.step("from", *from)?, self.step("to", *to)?);
                let sweep = (last.cast_signed() - first.cast_signed()) / i64::from(ticks);
                Shape::Chirp { tone: self.tone(*amplitude, *from, 0.0)?, sweep, ticks }
            }
            Kind::Multisine { tones: wanted } => {
                let first = *used;
                for tone in wanted {
                    let slot = tones.get_mut(*used).ok_or_else(|| format!("a wave has {TONES} tones at most"))?;
                    *slot = self.tone(tone.amplitude, tone.frequency, tone.phase)?;
                    *used += 1;
                }
                Shape::Multisine { first, count: wanted.len() }
            }
            Kind::Reversals { amplitude, levels, seconds, hold, corner } => {
                let or_none = |what, time: f64| if time == 0.0 { Ok(0) } else { self.ticks(what, time) };
                let levels = Some(*levels).filter(|levels| *levels > 0);
                Shape::Reversals {
                    amplitude: self.number("amplitude", *amplitude)?,
                    levels: levels.ok_or_else(|| "levels: expected 1 or more".to_owned())?,
                    ticks: self.ticks("seconds", *seconds)?,
                    hold: or_none("hold", *hold)?,
                    corner: or_none("corner", *corner)?,
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "ramp = 0.1\nseconds = 2.0\ncenter = [0.0, 0.0, 1e-6, 0.0, 0.0, 0.0]\n\
        [[axis]]\naxis = \"z\"\nshape = { kind = \"sine\", amplitude = 2e-6, frequency = 5.0, phase = 0.25 }\n\
        [[axis]]\naxis = 4\noffset = 1e-6\nshape = { kind = \"multisine\", tones = [{ amplitude = 1e-6, frequency = 3.0 }, { amplitude = 2e-6, frequency = 7.0 }] }\n\
        [[axis]]\naxis = \"x\"\nshape = { kind = \"chirp\", amplitude = 1e-6, from = 10.0, to = 1.0, seconds = 1.0 }\n";

    #[test]
    fn a_file_becomes_the_words_of_its_wave_in_both_scalars() {
        let WaveWords { words, center, drives } = read_wave(GOOD, 1e-4, false).unwrap();
        assert!(!drives);
        let wave = Settings::<f64>::from_words(words.as_slice().try_into().unwrap()).unwrap();
        assert_eq!((wave.ramp_ticks, wave.ticks), (1000, 20_000));
        assert_eq!(center[2], 1e-6_f64.to_bits());
        let tone = Tone { amplitude: 2e-6, phase: 1 << 62, step: step_of(5.0, 1e-4) };
        assert_eq!(wave.axes[2].shape, Shape::Sine { tone });
        assert_eq!((wave.axes[4].offset, wave.axes[4].shape), (1e-6, Shape::Multisine { first: 0, count: 2 }));
        assert_eq!(wave.tones[1].amplitude, 2e-6);
        assert_eq!(wave.axes[5].shape, Shape::Constant);
        let WaveWords { words, .. } = read_wave(GOOD, 1e-4, true).unwrap();
        let single = Settings::<f32>::from_words(words.as_slice().try_into().unwrap()).unwrap();
        assert_eq!(single.center[2], 1e-6);
    }

    #[test]
    fn a_wave_of_an_open_drive_is_of_the_voltages_of_legs() {
        let text = "drive = true\nramp = 0.1\n[[axis]]\naxis = 4\noffset = 50.0\n\
            shape = { kind = \"sine\", amplitude = 40.0, frequency = 5.0 }\n";
        let wave = read_wave(text, 1e-4, false).unwrap();
        let settings = Settings::<f64>::from_words(wave.words.as_slice().try_into().unwrap()).unwrap();
        assert!(wave.drives);
        assert_eq!(settings.axes[4].offset, 50.0);
        let error = |from: &str, to: &str| read_wave(&text.replace(from, to), 1e-4, false).unwrap_err();
        assert!(error("axis = 4", "axis = \"z\"").contains("legs 0 to 5"));
        assert!(error("50.0", "5e4").contains("expected V, found 50000"));
    }

    #[test]
    fn an_invalid_wave_is_refused_with_its_place() {
        for (from, to, expected) in [
            ("ramp = 0.1", "rampe = 0.1", "unknown field `rampe`"),
            ("ramp = 0.1", "ramp = 1e-9", "at least one control period"),
            ("axis = \"z\"", "axis = \"w\"", "expected one of x, y, z, rx, ry, rz"),
            ("axis = 4", "axis = 2", "axis z is given twice"),
            ("frequency = 5.0", "frequency = 5000.0", "half the control rate, 5000"),
            ("phase = 0.25", "phase = 1.0", "turns from 0 to 1"),
            ("amplitude = 2e-6, frequency = 5.0", "amplitude = -2e-6, frequency = 5.0", "axis z is invalid"),
            ("amplitude = 2e-6, frequency = 5.0", "amplitude = nan, frequency = 5.0", "expected m or rad, found NaN"),
            ("\"sine\"", "\"square\"", "unknown variant `square`"),
        ] {
            let error = read_wave(&GOOD.replace(from, to), 1e-4, false).unwrap_err();
            assert!(error.contains(expected), "{to}: {error}");
        }
        assert!(refused_wave(6 + 2 * 7 + 1, false).contains("axis z (leg 2) would leave its range"));
        assert!(refused_wave(6 + 2 * 7 + 2, true).starts_with("leg 2 would exceed the slew rate: reduce"));
    }
}
