//! Settings of a wave as 64-bit words, for links and files.

use super::shape::{AxisWave, Shape, TONES, Tone};
use super::{Refusal, Settings};
use crate::real::Real;
use crate::snapshot::{InvalidState, Reader, Writer};

/// Words of an axis: kind (index in [`Shape`]), offset, amplitude, and four more: steps before phases, levels before
/// ticks, hold before corner.
const AXIS: usize = 7;
/// Words of [`Settings`]: center, axes, tones, two counts.
pub const WORDS: usize = 6 + 6 * AXIS + TONES * 3 + 2;
/// Largest tick count: a day at 10 kHz.
const MOST: i32 = 1 << 30;
/// Largest number of a wave, far beyond every limit: m and rad, or V of an open drive.
pub const LARGEST: f64 = 1e4;
/// Steps stay below half a turn.
const HALF_TURN: u64 = (1 << 63) - 1;

impl Refusal {
    /// The word to report when a wave is refused over a link; none if one is under way. If an axis exceeds a limit, it
    /// is the word of its offset (range), amplitude (rate) or the next one (acceleration), see [`Refusal::of_word`].
    #[must_use]
    pub const fn word(self) -> Option<usize> {
        let (axis, behind) = match self {
            Self::Busy => return None,
            Self::Word(word) => return Some(word),
            Self::Range(axis) => (axis, 1),
            Self::Rate(axis) => (axis, 2),
            Self::Acceleration(axis) => (axis, 3),
        };
        Some(6 + axis * AXIS + behind)
    }

    /// Meaning of a reported word if every word sent was in range.
    #[must_use]
    pub const fn of_word(word: usize) -> Self {
        let (axis, behind) = match word.checked_sub(6) {
            Some(place) => (place / AXIS, place % AXIS),
            None => return Self::Word(word),
        };
        match behind {
            1 if axis < 6 => Self::Range(axis),
            2 if axis < 6 => Self::Rate(axis),
            3 if axis < 6 => Self::Acceleration(axis),
            _ => Self::Word(word),
        }
    }
}

impl<T: Real> Settings<T> {
    /// As words.
    #[must_use]
    pub fn to_words(&self) -> [u64; WORDS] {
        let mut words = [0; WORDS];
        let mut writer = Writer::new(&mut words);
        writer.reals(&self.center);
        for axis in &self.axes {
            axis.save(&mut writer);
        }
        for tone in &self.tones {
            tone.save(&mut writer);
        }
        writer.word(u64::from(self.ramp_ticks as u32));
        writer.word(u64::from(self.ticks as u32));
        words
    }

    /// From words.
    ///
    /// # Errors
    /// [`Refusal::Word`]: the first word that is out of range.
    pub fn from_words(words: &[u64; WORDS]) -> Result<Self, Refusal> {
        let mut settings = Self::still();
        settings.read(&mut Reader::new(words)).map_err(|InvalidState { word }| Refusal::Word(word))?;
        Ok(settings)
    }

    fn read(&mut self, words: &mut Reader<'_>) -> Result<(), InvalidState> {
        words.reals(&mut self.center, LARGEST)?;
        for axis in &mut self.axes {
            *axis = AxisWave::load(words)?;
        }
        for tone in &mut self.tones {
            *tone = Tone::load(words)?;
        }
        self.ramp_ticks = positive(words)?;
        self.ticks = words.count_to(MOST)?;
        Ok(())
    }
}

fn positive(words: &mut Reader<'_>) -> Result<i32, InvalidState> {
    let count = words.count_to(MOST)?;
    if count == 0 { Err(words.refused()) } else { Ok(count) }
}

impl<T: Real> Tone<T> {
    fn save(&self, words: &mut Writer<'_>) {
        words.real(self.amplitude);
        words.word(self.phase);
        words.word(self.step);
    }

    fn load(words: &mut Reader<'_>) -> Result<Self, InvalidState> {
        let amplitude: T = words.real(LARGEST)?;
        if amplitude < T::ZERO {
            return Err(words.refused());
        }
        Ok(Self { amplitude, phase: words.word(u64::MAX)?, step: words.word(HALF_TURN)? })
    }
}

impl<T: Real> AxisWave<T> {
    fn save(&self, words: &mut Writer<'_>) {
        let tick = |count: i32| u64::from(count as u32);
        let zero = T::ZERO;
        let (kind, amplitude, rest) = match self.shape {
            Shape::Constant => (0, zero, [0; 4]),
            Shape::Ramp { amplitude, ticks } => (1, amplitude, [tick(ticks), 0, 0, 0]),
            Shape::Triangle { amplitude, step } => (2, amplitude, [step, 0, 0, 0]),
            Shape::Sine { tone } => (3, tone.amplitude, [tone.step, tone.phase, 0, 0]),
            Shape::Chirp { tone, sweep, ticks } => {
                (4, tone.amplitude, [tone.step, tone.phase, sweep as u64, tick(ticks)])
            }
            Shape::Multisine { first, count } => (5, zero, [first as u64, count as u64, 0, 0]),
            Shape::Reversals { amplitude, levels, ticks, hold, corner } => {
                (6, amplitude, [tick(levels), tick(ticks), tick(hold), tick(corner)])
            }
        };
        words.word(kind);
        words.real(self.offset);
        words.real(amplitude);
        for word in rest {
            words.word(word);
        }
    }

    fn load(words: &mut Reader<'_>) -> Result<Self, InvalidState> {
        let kind = words.word(6)?;
        let offset = words.real(LARGEST)?;
        let amplitude: T = words.real(LARGEST)?;
        let signed = matches!(kind, 1 | 6);
        if amplitude < T::ZERO && !signed {
            return Err(words.refused());
        }
        let (shape, read) = match kind {
            0 => (Shape::Constant, 0),
            1 => (Shape::Ramp { amplitude, ticks: positive(words)? }, 1),
            2 => (Shape::Triangle { amplitude, step: words.word(HALF_TURN)? }, 1),
            3 => (Shape::Sine { tone: tone(words, amplitude)? }, 2),
            4 => (chirp(words, amplitude)?, 4),
            5 => {
                let first = words.word(TONES as u64)? as usize;
                (Shape::Multisine { first, count: words.word((TONES - first) as u64)? as usize }, 2)
            }
            _ => {
                let (levels, ticks) = (positive(words)?, positive(words)?);
                if levels.saturating_mul(ticks) > MOST / 2 {
                    return Err(words.refused());
                }
                let hold = words.count_to(MOST / 4)?;
                let corner = words.count_to(if hold < ticks { hold } else { ticks })?;
                (Shape::Reversals { amplitude, levels, ticks, hold, corner }, 4)
            }
        };
        // Unused words must be zero, so that each shape has one encoding.
        for _ in read..4 {
            words.word(0)?;
        }
        Ok(Self { offset, shape })
    }
}

fn tone<T: Real>(words: &mut Reader<'_>, amplitude: T) -> Result<Tone<T>, InvalidState> {
    Ok(Tone { amplitude, step: words.word(HALF_TURN)?, phase: words.word(u64::MAX)? })
}

/// A chirp whose step stays below half a turn to its end.
fn chirp<T: Real>(words: &mut Reader<'_>, amplitude: T) -> Result<Shape<T>, InvalidState> {
    let tone = tone(words, amplitude)?;
    let sweep = words.word(u64::MAX)? as i64;
    let ticks = positive(words)?;
    let last = sweep.checked_mul(i64::from(ticks)).and_then(|change| (tone.step as i64).checked_add(change));
    match last {
        Some(last) if last >= 0 => Ok(Shape::Chirp { tone, sweep, ticks }),
        _ => Err(words.refused()),
    }
}
