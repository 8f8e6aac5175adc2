//! A state as 64-bit words and back: what a recording begins with, so that it can be replayed from the middle of a run.
//!
//! Every word is the bits of a number (an `f32` zero-extended), an integer or a flag. What is loaded is believed only if each
//! word is one that a state can hold: a finite number of a size that a machine has, an index within its bounds, a staircase
//! that is one. That it is the state of *this* run is for its digest to say.

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

/// How large the numbers of a state may be: magnitudes, by axis where there are six. What the spec's workspace, gauges, tables and
/// settings allow; the emitted `permitted::STATE`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizes {
    /// Set-point as it is given out: the workspace, m and rad.
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
    /// Pose error behind the notch, m and rad.
    pub error: f64,
    /// Set-point, and what it is off the measured pose: of each axis, m and rad, or of each leg, m.
    pub apart: [f64; 6],
    /// Measured wrench, N and N m.
    pub wrench: [f64; 6],
    /// Displacement of a leg, demanded or by its model, m.
    pub leg: f64,
    /// What a cell a tick adds to it, m.
    pub leg_rate: f64,
    /// Position of an output line's settings, m and rad.
    pub line: f64,
    /// What the law asks for or withholds, m and rad: deflection, load, excess, offset of a change of mode, estimates, and what
    /// the notch remembers of them. Gains may make it larger than any place.
    pub request: f64,
    /// Word of a gauge: m, or V with a calibration.
    pub reading: f64,
    /// Stiffness of the environment, N/m and N m/rad.
    pub stiffness: f64,
    /// Lowest and highest code.
    pub codes: [i32; 2],
    /// Drive of a leg: cells of its table.
    pub grid: f64,
    /// Extrema that a reversal memory has words for, if it has room for more than it keeps ([`crate::Grid::capacity`]).
    pub memory: usize,
}

impl Sizes {
    /// Extrema that a memory with this `room` has words for.
    #[must_use]
    pub const fn kept(&self, room: usize) -> usize {
        if self.memory < room { self.memory } else { room }
    }

    /// Of a state of no particular spec: what any machine has.
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

/// Something that later ticks depend on. [`state!`](crate::state) declares it: its fields, what they are at reset, and the walk over them.
pub trait Snapshot: Field {
    /// Shows every word in order.
    ///
    /// # Errors
    /// Never.
    fn show(&self, words: &mut impl WordSink) -> Result<(), Infallible>;

    /// Takes the state that [`Snapshot::save`] wrote.
    ///
    /// # Errors
    /// At the first word that no state holds; what was read before it is taken, so that a state which must not be lost is
    /// restored into a copy.
    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), InvalidState>;

    /// Appends the state.
    #[inline]
    fn save(&self, words: &mut Writer<'_>) {
        let Ok(()) = self.show(words);
    }

    /// Words of the state where sizes are known at run time. Of one whose memories keep all they have room for: [`Field::WORDS`].
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

/// A word that no state holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InvalidState {
    /// Its index.
    pub word: usize,
}

/// Words in the order of a state. What does not fit is counted, but not kept.
#[derive(Debug)]
pub struct Writer<'a> {
    words: &'a mut [u64],
    count: usize,
}

impl<'a> Writer<'a> {
    /// Into `words`, from the first on.
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

/// Some words of a state, from the `first`-th on: a state that is written piece by piece, where there is time for a walk each.
#[derive(Debug)]
pub struct StatePart<'a> {
    words: &'a mut [u64],
    first: usize,
    count: usize,
}

impl<'a> StatePart<'a> {
    /// As many words as have room.
    #[must_use]
    pub fn new(words: &'a mut [u64], first: usize) -> Self {
        Self { words, first, count: 0 }
    }

    /// The next word. Not inlined: a walk calls it for every field.
    #[inline(never)]
    fn word(&mut self, word: u64) {
        // One before the first has a place beyond all.
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

/// Zeros. Most of a state is the room behind its staircases, and `fill` would become a call of `memset`, which takes some eight
/// instructions a word on a Cortex-M; with a zero that the compiler does not know, and eight words at a time, it is one and a half.
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

/// Words of a state, checked one by one.
#[derive(Debug)]
pub struct Reader<'a> {
    words: &'a [u64],
    count: usize,
    sizes: Sizes,
}

impl<'a> Reader<'a> {
    /// From the first of `words` on.
    #[must_use]
    pub fn new(words: &'a [u64]) -> Self {
        Self { words, count: 0, sizes: Sizes::ANY }
    }

    /// The same for a state with numbers of these sizes.
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

    /// That the word last read is none.
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

    /// A number of ticks or the like, from 0 to `largest`.
    ///
    /// # Errors
    /// It is none, see [`Reader::word`].
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
    /// It is none.
    #[inline]
    pub fn real<T: Real>(&mut self, largest: f64) -> Result<T, InvalidState> {
        let word = self.word(u64::MAX)?;
        let value = T::from_word(word);
        // A NaN fails the comparison; bits above an `f32` do not come back.
        if value.abs() <= T::from_f64(largest) && value.to_word() == word { Ok(value) } else { Err(self.refused()) }
    }

    /// Finite numbers within ±`largest`.
    ///
    /// # Errors
    /// At the first that is none.
    pub fn reals<T: Real>(&mut self, values: &mut [T], largest: f64) -> Result<(), InvalidState> {
        for value in values {
            *value = self.real(largest)?;
        }
        Ok(())
    }
}
