//! A state as 64-bit words, and back. A recording begins with one, so that it can be replayed from the middle of a run.
//!
//! Every word is the bits of a number (an `f32` zero-extended), an integer or a flag. Loading checks each word: a
//! number must be finite and of a plausible size, an index within its bounds, a staircase monotone. The digest shows
//! whether the state belongs to *this* run.

use core::convert::Infallible;

use crate::digest::Digest;
use crate::real::Real;

mod walk;

pub use crate::choice::Choice;
pub use crate::field::Field;
pub use walk::{SizedSink, WordSink};

/// Largest |place| that is loaded, m and rad: poses, set-points, displacements.
pub const LARGEST_PLACE: f64 = 16.0;
/// Largest |rate|, |acceleration| or |force| that is loaded, in SI units.
pub const LARGEST: f64 = 1e9;

/// Largest magnitudes of the numbers in a state, by axis where there are six. They follow from the spec's workspace,
/// gauges, tables and settings: the emitted `permitted::STATE`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizes {
    /// Set-point as passed to the law, within the workspace, m and rad.
    pub place: [f64; 6],
    /// The same in the user's coordinates.
    pub user: [f64; 6],
    /// Its rate in either, m/s and rad/s.
    pub rate: [f64; 6],
    /// Its acceleration, m/s² and rad/s².
    pub acceleration: [f64; 6],
    /// Measured pose, m and rad.
    pub pose: [f64; 6],
    /// Its rate, m/s and rad/s.
    pub pose_rate: [f64; 6],
    /// Pose error after the notch, m and rad.
    pub error: f64,
    /// Set-point, and its difference from the measured pose: per axis, m and rad, or per leg, m.
    pub apart: [f64; 6],
    /// Measured wrench, N and N m.
    pub wrench: [f64; 6],
    /// Displacement of a leg, requested or modelled, m.
    pub leg: f64,
    /// Change of that displacement at one cell a tick, m.
    pub leg_rate: f64,
    /// Position in the settings of an output line, m and rad.
    pub line: f64,
    /// Requests of the law and what it withholds, m and rad: deflection, load, excess, offset of a change of mode,
    /// estimates, and what the notch stores of them. Gains may make it larger than any place.
    pub request: f64,
    /// Word of a gauge: m, or V with a calibration.
    pub reading: f64,
    /// Stiffness of the environment, N/m and N m/rad.
    pub stiffness: f64,
    /// Lowest and highest code.
    pub codes: [i32; 2],
    /// Drive of a leg: cells of its table.
    pub grid: f64,
    /// Number of extrema stored for a reversal memory, if its room is larger than this ([`crate::Grid::capacity`]).
    pub memory: usize,
}

impl Sizes {
    /// Number of extrema stored for a memory with this `room`.
    #[must_use]
    pub const fn kept(&self, room: usize) -> usize {
        if self.memory < room { self.memory } else { room }
    }

    /// Bounds for a state of any spec.
    pub const ANY: Self = Self {
        place: [LARGEST_PLACE; 6],
        user: [LARGEST_PLACE; 6],
        rate: [LARGEST; 6],
        acceleration: [LARGEST; 6],
        pose: [LARGEST_PLACE; 6],
        pose_rate: [LARGEST; 6],
        error: LARGEST_PLACE,
        apart: [LARGEST_PLACE; 6],
        wrench: [LARGEST; 6],
        leg: LARGEST_PLACE,
        leg_rate: LARGEST_PLACE,
        line: LARGEST_PLACE,
        request: LARGEST_PLACE,
        reading: LARGEST_PLACE,
        stiffness: LARGEST,
        codes: [i32::MIN, i32::MAX],
        grid: LARGEST,
        memory: usize::MAX,
    };
}

/// State that later ticks depend on. [`state!`](crate::state) declares its fields, their reset values and the walk over
/// them.
pub trait Snapshot: Field {
    /// Writes every word in order.
    ///
    /// # Errors
    /// Never.
    fn show(&self, words: &mut impl WordSink) -> Result<(), Infallible>;

    /// Takes the state that [`Snapshot::save`] wrote.
    ///
    /// # Errors
    /// At the first invalid word. The words before it have been taken: restore into a copy if the old state is still
    /// needed.
    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), InvalidState>;

    /// Appends the state.
    #[inline]
    fn save(&self, words: &mut Writer<'_>) {
        let Ok(()) = self.show(words);
    }

    /// Number of words of the state if sizes are known only at run time. [`Field::WORDS`] is the number if every memory
    /// uses all its room.
    fn word_count(&self, sizes: Sizes) -> usize {
        let mut words = Writer::new(&mut []);
        let Ok(()) = self.show(&mut words.within(sizes));
        words.count()
    }

    /// Adds the state to a digest.
    #[inline]
    fn digest(&self, digest: &mut Digest) {
        let Ok(()) = self.show(digest);
    }
}

/// A word that no state can contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InvalidState {
    /// Its index.
    pub word: usize,
}

/// Writes words in the order of a state. Words that do not fit are counted but not stored.
#[derive(Debug)]
pub struct Writer<'a> {
    words: &'a mut [u64],
    count: usize,
}

impl<'a> Writer<'a> {
    /// Writes into `words`, from the first on.
    #[must_use]
    pub fn new(words: &'a mut [u64]) -> Self {
        Self { words, count: 0 }
    }

    /// Words written so far.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// An integer.
    #[inline]
    pub fn word(&mut self, word: u64) {
        if let Some(slot) = self.words.get_mut(self.count) {
            *slot = word;
        }
        self.count += 1;
    }

    /// A flag.
    #[inline]
    pub fn flag(&mut self, flag: bool) {
        self.word(u64::from(flag));
    }

    /// A number.
    #[inline]
    pub fn real<T: Real>(&mut self, value: T) {
        self.word(value.to_word());
    }

    /// Numbers.
    #[inline]
    pub fn reals<T: Real>(&mut self, values: &[T]) {
        let end = self.count + values.len();
        if let Some(slots) = self.words.get_mut(self.count..end) {
            for (slot, value) in slots.iter_mut().zip(values) {
                *slot = value.to_word();
            }
        }
        self.count = end;
    }

    /// The first `count` numbers, and zeros in place of the others.
    #[inline]
    pub fn first_reals<T: Real>(&mut self, values: &[T], count: usize) {
        let end = self.count + values.len();
        if let Some(slots) = self.words.get_mut(self.count..end) {
            for (slot, value) in slots.iter_mut().zip(values).take(count) {
                *slot = value.to_word();
            }
            clear(slots.get_mut(count..).unwrap_or_default());
        }
        self.count = end;
    }
}

/// Writes a range of a state's words, from the `first`-th on. A state can so be written in several walks.
#[derive(Debug)]
pub struct StatePart<'a> {
    words: &'a mut [u64],
    first: usize,
    count: usize,
}

impl<'a> StatePart<'a> {
    /// As many words as fit.
    #[must_use]
    pub fn new(words: &'a mut [u64], first: usize) -> Self {
        Self { words, first, count: 0 }
    }

    /// The next word. Not inlined: a walk calls it for every field.
    #[inline(never)]
    fn word(&mut self, word: u64) {
        // A word before the first wraps to an index beyond the end.
        if let Some(slot) = self.words.get_mut(self.count.wrapping_sub(self.first)) {
            *slot = word;
        }
        self.count += 1;
    }

    #[inline(never)]
    fn stored<T: Real>(&mut self, values: &[T], count: usize) {
        for (k, value) in values.iter().enumerate() {
            self.word(if k < count { value.to_word() } else { 0 });
        }
    }
}

/// Writes zeros. Most of a state is unused room of staircases. `fill` would become a call of `memset`, which takes
/// about eight instructions a word on a Cortex-M. Eight words at a time, with a zero that the compiler does not know,
/// take one and a half.
#[inline]
fn clear(words: &mut [u64]) {
    let zero = core::hint::black_box(0);
    let mut chunks = words.chunks_exact_mut(8);
    for chunk in &mut chunks {
        if let Some(chunk) = chunk.first_chunk_mut::<8>() {
            *chunk = [zero; 8];
        }
    }
    for word in chunks.into_remainder() {
        *word = zero;
    }
}

/// Reads words of a state and checks each one.
#[derive(Debug)]
pub struct Reader<'a> {
    words: &'a [u64],
    count: usize,
    sizes: Sizes,
}

impl<'a> Reader<'a> {
    /// Reads from the first of `words` on.
    #[must_use]
    pub fn new(words: &'a [u64]) -> Self {
        Self { words, count: 0, sizes: Sizes::ANY }
    }

    /// Limits the numbers to these sizes.
    #[must_use]
    pub fn within(self, sizes: Sizes) -> Self {
        Self { sizes, ..self }
    }

    /// How large the numbers of the state may be.
    #[must_use]
    pub fn sizes(&self) -> Sizes {
        self.sizes
    }

    /// Words read so far.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Reports the word last read as invalid.
    #[must_use]
    pub fn refused(&self) -> InvalidState {
        InvalidState { word: self.count.saturating_sub(1) }
    }

    /// An integer up to `largest`.
    ///
    /// # Errors
    /// It is larger, or there are no more words.
    #[inline]
    pub fn word(&mut self, largest: u64) -> Result<u64, InvalidState> {
        let word = self.words.get(self.count).copied();
        self.count += 1;
        match word {
            Some(word) if word <= largest => Ok(word),
            _ => Err(self.refused()),
        }
    }

    /// A count, such as ticks, from 0 to `largest`.
    ///
    /// # Errors
    /// The word is out of range, see [`Reader::word`].
    #[inline]
    pub fn count_to(&mut self, largest: i32) -> Result<i32, InvalidState> {
        let largest = if largest < 0 { 0 } else { largest as u64 };
        Ok(self.word(largest)? as i32)
    }

    /// A counter.
    ///
    /// # Errors
    /// It has more than 32 bits.
    #[inline]
    pub fn counter(&mut self) -> Result<u32, InvalidState> {
        Ok(self.word(u64::from(u32::MAX))? as u32)
    }

    /// A flag.
    ///
    /// # Errors
    /// It is neither 0 nor 1.
    #[inline]
    pub fn flag(&mut self) -> Result<bool, InvalidState> {
        Ok(self.word(1)? != 0)
    }

    /// A finite number within ±`largest`.
    ///
    /// # Errors
    /// The word is not such a number.
    #[inline]
    pub fn real<T: Real>(&mut self, largest: f64) -> Result<T, InvalidState> {
        let word = self.word(u64::MAX)?;
        let value = T::from_word(word);
        // A NaN fails the comparison. Bits above those of an `f32` do not survive the conversion.
        if value.abs() <= T::from_f64(largest) && value.to_word() == word { Ok(value) } else { Err(self.refused()) }
    }

    /// Finite numbers within ±`largest`.
    ///
    /// # Errors
    /// At the first word that is not such a number.
    pub fn reals<T: Real>(&mut self, values: &mut [T], largest: f64) -> Result<(), InvalidState> {
        for value in values {
            *value = self.real(largest)?;
        }
        Ok(())
    }
}
