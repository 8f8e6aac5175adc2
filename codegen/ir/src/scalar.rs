//! Numbers in the scalar of a controller, and constants that the IR holds in the runtime's types.

use std::marker::PhantomData;

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use specgen_language::model::FaultAction;
use specgen_runtime::{Real, supervisor};

/// Converts numbers to a scalar.
pub trait Numbers<T: Real> {
    /// The number rounded to the scalar.
    #[track_caller]
    fn real(&self, value: f64) -> T;

    /// Converts an array.
    #[track_caller]
    fn vector<const N: usize>(&self, values: &[f64; N]) -> [T; N] {
        let mut converted = [T::ZERO; N];
        for (converted, value) in converted.iter_mut().zip(values) {
            *converted = self.real(*value);
        }
        converted
    }

    /// Converts a slice, which stays in memory.
    #[track_caller]
    fn slice(&self, values: &[f64]) -> &'static [T] {
        let mut converted = Vec::with_capacity(values.len());
        for value in values {
            converted.push(self.real(*value));
        }
        kept(converted)
    }

    /// Converts a matrix.
    #[track_caller]
    fn matrix<const M: usize, const N: usize>(&self, rows: &[[f64; N]; M]) -> [[T; N]; M] {
        let mut converted = [[T::ZERO; N]; M];
        for (converted, row) in converted.iter_mut().zip(rows) {
            *converted = self.vector(row);
        }
        converted
    }
}

/// Leaks values, which stay in memory to the end of the process.
pub fn kept<X>(values: impl IntoIterator<Item = X>) -> &'static [X] {
    Box::leak(values.into_iter().collect())
}

/// A converter that only rounds.
#[derive(Debug)]
pub struct Rounding<T>(pub PhantomData<T>);

impl<T: Real> Numbers<T> for Rounding<T> {
    fn real(&self, value: f64) -> T {
        T::from_f64(value)
    }
}

/// A constant that the IR holds in the runtime's type, in `f64`.
pub trait Constant {
    /// Its type in a scalar.
    type In<T: Real>;

    /// Converts its numbers.
    #[track_caller]
    fn of<T: Real>(&self, numbers: &impl Numbers<T>) -> Self::In<T>;

    /// Serializes it for the text of the IR.
    ///
    /// # Errors
    /// Those of the serializer.
    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error>;
}

/// Serializes a constant.
#[derive(Debug)]
pub struct Written<'a, C>(pub &'a C);

impl<C: Constant> Serialize for Written<'_, C> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.write(serializer)
    }
}

impl Constant for f64 {
    type In<T: Real> = T;

    fn of<T: Real>(&self, numbers: &impl Numbers<T>) -> T {
        numbers.real(*self)
    }

    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(*self)
    }
}

impl<C: Constant, const N: usize> Constant for [C; N] {
    type In<T: Real> = [C::In<T>; N];

    fn of<T: Real>(&self, numbers: &impl Numbers<T>) -> Self::In<T> {
        self.each_ref().map(|one| one.of(numbers))
    }

    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter().map(Written))
    }
}

impl<C: Constant> Constant for Option<C> {
    type In<T: Real> = Option<C::In<T>>;

    fn of<T: Real>(&self, numbers: &impl Numbers<T>) -> Self::In<T> {
        self.as_ref().map(|one| one.of(numbers))
    }

    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.as_ref().map(Written).serialize(serializer)
    }
}

/// Constants that are the same in every scalar.
macro_rules! without_numbers {
    ($($of:ty, $written:expr;)+) => {$(
        impl Constant for $of {
            type In<T: Real> = Self;

            fn of<T: Real>(&self, _: &impl Numbers<T>) -> Self {
                *self
            }

            fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let written: fn(Self) -> _ = $written;
                written(*self).serialize(serializer)
            }
        }
    )+};
}
without_numbers! {
    u32, |count| count;
    i32, |code| code;
    supervisor::Reaction, |reaction| match reaction {
        supervisor::Reaction::Off => FaultAction::Off.word(),
        supervisor::Reaction::RampDown => FaultAction::RampDown.word(),
        supervisor::Reaction::Hold => FaultAction::Hold.word(),
    };
}

macro_rules! of_numbers {
    ($name:ident: $($field:ident)+) => {
        impl Constant for supervisor::$name<f64> {
            type In<T: Real> = supervisor::$name<T>;

            fn of<T: Real>(&self, numbers: &impl Numbers<T>) -> Self::In<T> {
                supervisor::$name { $($field: self.$field.of(numbers)),+ }
            }

            fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut map = serializer.serialize_map(None)?;
                $(map.serialize_entry(stringify!($field), &Written(&self.$field))?;)+
                map.end()
            }
        }
    };
}
specgen_runtime::supervision_fields!(of_numbers);
specgen_runtime::steadiness_fields!(of_numbers);
specgen_runtime::wiring_fields!(of_numbers);
