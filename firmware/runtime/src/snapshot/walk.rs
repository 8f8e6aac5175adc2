//! The walk over a state: one list of fields gives the struct, its reset value, and how it is saved, restored and
//! digested.

use core::convert::Infallible;

use super::{Choice, InvalidState, LARGEST, Reader, Sizes, Snapshot, StatePart, Writer};
use crate::digest::Digest;
use crate::field::Field;
use crate::real::Real;

/// Declares a state in one list. Each field has a type, a reset value, and the method of [`WordSink`] that walks over
/// it. [`Reader`] has a method of the same name; it checks the bounds. An expression after `if` must hold for the
/// fields restored so far, which are references there.
///
/// The macro makes the struct, `new`, and [`Snapshot`] with the words in the order of the fields. The name between bars
/// is the walk, for use in bounds, see [`WordSink::sizes`]. Generic parameters follow the name; their declarations
/// follow in brackets.
#[macro_export]
macro_rules! state {
    (
        |$words:ident|
        $(#[$about:meta])*
        $visible:vis struct $name:ident $(<$($generic:ident),+>[$($declared:tt)+])? $(($($arg:ident: $of_arg:ty),+))? {
            $(
                $(#[$of_field:meta])*
                $seen:vis $field:ident: $type:ty = $start:expr, $walk:ident $(($($bound:expr),+))? $(if $fits:expr)?;
            )+
        }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy)]
        $visible struct $name $(<$($declared)+>)? {
            $($(#[$of_field])* $seen $field: $type,)+
        }

        impl $(<$($declared)+>)? $name $(<$($generic),+>)? {
            /// At reset.
            #[must_use]
            pub const fn new($($($arg: $of_arg),+)?) -> Self {
                Self { $($field: $start),+ }
            }
        }

        $crate::state!(@default [$($($declared)+)?] $name $(<$($generic),+>)? $(($($arg)+))?);

        impl $(<$($declared)+>)? $crate::snapshot::Field for $name $(<$($generic),+>)? {
            const WORDS: usize = 0 $(+ <$type as $crate::snapshot::Field>::WORDS)+;
        }

        impl $(<$($declared)+>)? $crate::Snapshot for $name $(<$($generic),+>)? {
            fn show(&self, $words: &mut impl $crate::snapshot::WordSink) -> Result<(), ::core::convert::Infallible> {
                let Self { $($field),+ } = self;
                $(
                    $words.$walk($field $($(, $bound)+)?)?;
                    $($words.check(|| $fits)?;)?
                )+
                Ok(())
            }

            fn restore(
                &mut self,
                $words: &mut $crate::snapshot::Reader<'_>,
            ) -> Result<(), $crate::snapshot::InvalidState> {
                let Self { $($field),+ } = self;
                $(
                    $words.$walk($field $($(, $bound)+)?)?;
                    $($words.check(|| $fits)?;)?
                )+
                Ok(())
            }
        }
    };
    // A state whose `new` has arguments has no default.
    (@default [$($declared:tt)*] $name:ident $(<$($generic:ident),+>)? ($($arg:ident)+)) => {};
    (@default [$($declared:tt)*] $type:ty) => {
        impl<$($declared)*> Default for $type {
            fn default() -> Self {
                Self::new()
            }
        }
    };
}

/// Receives a state word by word: a writer or a digest. Its methods never fail. They return the type that the methods
/// of [`Reader`] return, so that one walk serves both.
pub trait WordSink: Sized {
    /// A word.
    fn put(&mut self, word: u64);

    /// Unused: the state that is written has valid sizes.
    #[inline]
    fn sizes(&self) -> Sizes {
        Sizes::ANY
    }

    /// The same with sizes known at run time. [`Reader::within`] reads it.
    fn within(&mut self, sizes: Sizes) -> SizedSink<'_, Self> {
        SizedSink { words: self, sizes }
    }

    /// A number within ±`largest`.
    #[inline]
    fn number<T: Real>(&mut self, value: &T, _largest: f64) -> Result<(), Infallible> {
        self.put(value.to_word());
        Ok(())
    }

    /// Numbers within ±`largest`.
    #[inline]
    fn numbers<T: Real>(&mut self, values: &[T], _largest: f64) -> Result<(), Infallible> {
        self.stored(values, values.len(), LARGEST)
    }

    /// Six numbers, each with its own bound.
    #[inline]
    fn axes<T: Real>(&mut self, values: &[T; 6], _largest: [f64; 6]) -> Result<(), Infallible> {
        self.numbers(values, LARGEST)
    }

    /// Rows of such numbers.
    #[inline]
    fn rows<T: Real, const N: usize>(&mut self, rows: &[[T; N]], largest: f64) -> Result<(), Infallible> {
        rows.iter().try_for_each(|row| self.numbers(row, largest))
    }

    /// Numbers of a memory within ±`largest`. The first `count` are stored; the others are zeros, and a digest leaves
    /// them out.
    #[inline]
    fn stored<T: Real>(&mut self, values: &[T], count: usize, _largest: f64) -> Result<(), Infallible> {
        for value in values.iter().take(count) {
            self.put(value.to_word());
        }
        Ok(())
    }

    /// A count, such as ticks, from 0 to `largest`.
    #[inline]
    fn ticks(&mut self, value: &i32, _largest: i32) -> Result<(), Infallible> {
        self.put(u64::from(*value as u32));
        Ok(())
    }

    /// An index from 0 to `largest`.
    #[inline]
    fn place(&mut self, value: &usize, _largest: usize) -> Result<(), Infallible> {
        self.put(*value as u64);
        Ok(())
    }

    /// A counter.
    #[inline]
    fn tally(&mut self, value: &u32) -> Result<(), Infallible> {
        self.put(u64::from(*value));
        Ok(())
    }

    /// Counters.
    #[inline]
    fn tallies(&mut self, values: &[u32]) -> Result<(), Infallible> {
        values.iter().try_for_each(|value| self.tally(value))
    }

    /// A flag.
    #[inline]
    fn set(&mut self, value: &bool) -> Result<(), Infallible> {
        self.put(u64::from(*value));
        Ok(())
    }

    /// A choice.
    #[inline]
    fn choice(&mut self, value: &impl Choice) -> Result<(), Infallible> {
        self.put(value.to_word());
        Ok(())
    }

    /// A field that follows from the others and has no word.
    #[inline]
    fn derived<F: Field>(&mut self, _value: &F) -> Result<(), Infallible> {
        const { assert!(F::WORDS == 0) };
        Ok(())
    }

    /// A zero in place of a counter that this state does not have.
    #[inline]
    fn blank(&mut self) -> Result<(), Infallible> {
        self.put(0);
        Ok(())
    }

    /// A state within this one.
    #[inline]
    fn part(&mut self, part: &impl Snapshot) -> Result<(), Infallible> {
        part.show(self)
    }

    /// States within this one.
    #[inline]
    fn parts(&mut self, parts: &[impl Snapshot]) -> Result<(), Infallible> {
        parts.iter().try_for_each(|part| self.part(part))
    }

    /// Checks that the fields restored so far are consistent.
    #[inline]
    fn check(&self, _fits: impl FnOnce() -> bool) -> Result<(), Infallible> {
        Ok(())
    }
}

/// A walk with sizes known at run time: it stores only as many extrema of a memory as the memory uses.
#[derive(Debug)]
pub struct SizedSink<'a, W> {
    words: &'a mut W,
    sizes: Sizes,
}

impl<W: WordSink> WordSink for SizedSink<'_, W> {
    fn put(&mut self, word: u64) {
        self.words.put(word);
    }

    fn numbers<T: Real>(&mut self, values: &[T], largest: f64) -> Result<(), Infallible> {
        self.words.numbers(values, largest)
    }

    fn stored<T: Real>(&mut self, values: &[T], count: usize, largest: f64) -> Result<(), Infallible> {
        self.words.stored(values.get(..self.sizes.memory).unwrap_or(values), count, largest)
    }
}

impl WordSink for Digest {
    #[inline]
    fn put(&mut self, word: u64) {
        self.word(word);
    }

    // Not inlined: a copy for every array of a state would take kilobytes of flash.
    #[inline(never)]
    fn stored<T: Real>(&mut self, values: &[T], count: usize, _largest: f64) -> Result<(), Infallible> {
        for value in values.iter().take(count) {
            self.word(value.to_word());
        }
        Ok(())
    }
}

impl WordSink for Writer<'_> {
    #[inline]
    fn put(&mut self, word: u64) {
        self.word(word);
    }

    #[inline]
    fn numbers<T: Real>(&mut self, values: &[T], _largest: f64) -> Result<(), Infallible> {
        self.reals(values);
        Ok(())
    }

    #[inline]
    fn stored<T: Real>(&mut self, values: &[T], count: usize, _largest: f64) -> Result<(), Infallible> {
        self.first_reals(values, count);
        Ok(())
    }
}

impl WordSink for StatePart<'_> {
    fn put(&mut self, word: u64) {
        self.word(word);
    }

    fn stored<T: Real>(&mut self, values: &[T], count: usize, _largest: f64) -> Result<(), Infallible> {
        self.stored(values, count);
        Ok(())
    }
}

/// The methods of [`WordSink`], for restoring.
impl Reader<'_> {
    /// [`WordSink::number`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    #[inline]
    pub fn number<T: Real>(&mut self, value: &mut T, largest: f64) -> Result<(), InvalidState> {
        *value = self.real(largest)?;
        Ok(())
    }

    /// [`WordSink::numbers`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    pub fn numbers<T: Real>(&mut self, values: &mut [T], largest: f64) -> Result<(), InvalidState> {
        self.reals(values, largest)
    }

    /// [`WordSink::axes`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    pub fn axes<T: Real>(&mut self, values: &mut [T; 6], largest: [f64; 6]) -> Result<(), InvalidState> {
        values.iter_mut().zip(largest).try_for_each(|(value, largest)| self.number(value, largest))
    }

    /// [`WordSink::rows`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    #[inline]
    pub fn rows<T: Real, const N: usize>(&mut self, rows: &mut [[T; N]], largest: f64) -> Result<(), InvalidState> {
        rows.iter_mut().try_for_each(|row| self.numbers(row, largest))
    }

    /// [`WordSink::stored`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    pub fn stored<T: Real>(&mut self, values: &mut [T], _count: usize, largest: f64) -> Result<(), InvalidState> {
        let kept = self.sizes().kept(values.len());
        self.reals(values.get_mut(..kept).unwrap_or_default(), largest)
    }

    /// [`WordSink::ticks`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    #[inline]
    pub fn ticks(&mut self, value: &mut i32, largest: i32) -> Result<(), InvalidState> {
        *value = self.count_to(largest)?;
        Ok(())
    }

    /// [`WordSink::place`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    #[inline]
    pub fn place(&mut self, value: &mut usize, largest: usize) -> Result<(), InvalidState> {
        *value = self.word(largest as u64)? as usize;
        Ok(())
    }

    /// [`WordSink::tally`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    #[inline]
    pub fn tally(&mut self, value: &mut u32) -> Result<(), InvalidState> {
        *value = self.counter()?;
        Ok(())
    }

    /// [`WordSink::tallies`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    #[inline]
    pub fn tallies(&mut self, values: &mut [u32]) -> Result<(), InvalidState> {
        values.iter_mut().try_for_each(|value| self.tally(value))
    }

    /// [`WordSink::set`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    #[inline]
    pub fn set(&mut self, value: &mut bool) -> Result<(), InvalidState> {
        *value = self.flag()?;
        Ok(())
    }

    /// [`WordSink::choice`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    #[inline]
    pub fn choice<C: Choice>(&mut self, value: &mut C) -> Result<(), InvalidState> {
        *value = C::of_word(self.word(u64::MAX)?).ok_or(self.refused())?;
        Ok(())
    }

    /// [`WordSink::derived`], left as it is.
    ///
    /// # Errors
    /// Never.
    #[inline]
    pub fn derived<F: Field>(&mut self, _value: &mut F) -> Result<(), InvalidState> {
        const { assert!(F::WORDS == 0) };
        Ok(())
    }

    /// [`WordSink::blank`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    #[inline]
    pub fn blank(&mut self) -> Result<(), InvalidState> {
        self.counter().map(|_| ())
    }

    /// [`WordSink::part`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    #[inline]
    pub fn part(&mut self, part: &mut impl Snapshot) -> Result<(), InvalidState> {
        part.restore(self)
    }

    /// [`WordSink::parts`], restored.
    ///
    /// # Errors
    /// No state holds the word.
    #[inline]
    pub fn parts(&mut self, parts: &mut [impl Snapshot]) -> Result<(), InvalidState> {
        parts.iter_mut().try_for_each(|part| self.part(part))
    }

    /// [`WordSink::check`], restored.
    ///
    /// # Errors
    /// They are not consistent.
    #[inline]
    pub fn check(&self, fits: impl FnOnce() -> bool) -> Result<(), InvalidState> {
        if fits() { Ok(()) } else { Err(self.refused()) }
    }
}
