//! Hysteresis models with kind, table size and memory chosen by the spec.

use std::convert::Infallible;
use std::fmt::Debug;

use specgen_ir::scalar::Numbers as _;
use specgen_ir::{Hysteresis, LEGS, RateModel};
use specgen_law::LegMemory;
use specgen_runtime::snapshot::{Field, InvalidState, Reader, WordSink};
use specgen_runtime::{
    Creep, CreepEverett, CreepMemory, DynamicEverett, DynamicMemory, LastLine, Nodes, Real, ReversalMemory, Snapshot,
};

use crate::InvalidIr;
use crate::convert::Convert;

/// Largest `hysteresis.memory`, extrema.
pub const ROOM: usize = 256;

/// A static model, a rate-dependent one, or one with a number of creep operators.
macro_rules! models {
    ($($creep:ident $count:literal),+) => {
        /// Table of a leg.
        #[derive(Debug, Clone, Copy)]
        pub enum Table<T: Real> {
            Static(Nodes<'static, T>),
            Dynamic(DynamicEverett<T, Nodes<'static, T>>),
            $($creep(CreepEverett<'static, T, Nodes<'static, T>, $count>),)+
        }

        /// Memory of a leg's drive.
        #[derive(Debug, Clone, Copy)]
        pub enum Memory<T: Real> {
            Static(ReversalMemory<T, ROOM>),
            Dynamic(DynamicMemory<T, ROOM>),
            $($creep(CreepMemory<T, ROOM, $count>),)+
        }

        impl<T: Real> Field for Memory<T> {
            /// Words of the largest kind; the actual number depends on the sizes, see [`Snapshot::word_count`].
            const WORDS: usize = DynamicMemory::<T, ROOM>::WORDS;
        }

        /// One expression for every kind of memory.
        macro_rules! each {
            ($memory:expr, $name:ident => $value:expr) => {
                match $memory {
                    Memory::Static($name) => $value,
                    Memory::Dynamic($name) => $value,
                    $(Memory::$creep($name) => $value,)+
                }
            };
        }

        /// The same with the table of the same kind.
        macro_rules! with_table {
            ($memory:expr, $given:expr, ($name:ident, $table:ident) => $value:expr) => {
                match ($memory, $given) {
                    (Memory::Static($name), Table::Static($table)) => $value,
                    (Memory::Dynamic($name), Table::Dynamic($table)) => $value,
                    $((Memory::$creep($name), Table::$creep($table)) => $value,)+
                    _ => unreachable!("a memory and a table of one spec"),
                }
            };
        }

        fn with_creep<T: Real>(
            convert: &Convert<T>,
            tables: &[Nodes<'static, T>; LEGS],
            creep: [&[f64]; 3],
            direct: f64,
        ) -> Result<([Table<T>; LEGS], Memory<T>), InvalidIr> {
            $(
                if let [Some(gains), Some(weights), Some(carried)] = creep.map(<[f64; $count]>::from_slice) {
                    let creep = Creep {
                        gains: convert.vector(gains),
                        weights: convert.vector(weights),
                        carried: convert.vector(carried),
                        direct: convert.real(direct),
                    };
                    let creep = Box::leak(Box::new(creep));
                    let tables = tables.map(|still| Table::$creep(CreepEverett { still, creep }));
                    return Ok((tables, Memory::$creep(CreepMemory::new())));
                }
            )+
            Err(InvalidIr::Part("the number of creep operators"))
        }
    };
}
models!(Creep1 1, Creep2 2, Creep3 3, Creep4 4, Creep5 5, Creep6 6);

/// Converts a slice of exactly its length to an array.
trait FromSlice: Sized {
    fn from_slice(values: &[f64]) -> Option<&Self>;
}

impl<const N: usize> FromSlice for [f64; N] {
    fn from_slice(values: &[f64]) -> Option<&Self> {
        values.as_array()
    }
}

impl<T: Real> Memory<T> {
    /// Risen from negative saturation to `drive`.
    pub fn risen(self, drive: T, displacement: T, rate: T) -> Self {
        match self {
            Self::Static(_) => Self::Static(ReversalMemory::risen(drive, displacement)),
            Self::Dynamic(_) => Self::Dynamic(DynamicMemory::risen(drive, displacement, rate)),
            Self::Creep1(_) => Self::Creep1(CreepMemory::risen(drive, displacement)),
            Self::Creep2(_) => Self::Creep2(CreepMemory::risen(drive, displacement)),
            Self::Creep3(_) => Self::Creep3(CreepMemory::risen(drive, displacement)),
            Self::Creep4(_) => Self::Creep4(CreepMemory::risen(drive, displacement)),
            Self::Creep5(_) => Self::Creep5(CreepMemory::risen(drive, displacement)),
            Self::Creep6(_) => Self::Creep6(CreepMemory::risen(drive, displacement)),
        }
    }
}

impl<T: Real> Snapshot for Memory<T> {
    fn show(&self, words: &mut impl WordSink) -> Result<(), Infallible> {
        each!(self, memory => memory.show(words))
    }

    fn restore(&mut self, words: &mut Reader<'_>) -> Result<(), InvalidState> {
        each!(self, memory => memory.restore(words))
    }
}

impl<T: Real + Debug> LegMemory<T, Table<T>> for Memory<T> {
    #[inline(always)]
    fn displacement(&self) -> T {
        each!(self, memory => memory.displacement())
    }

    #[inline(always)]
    fn fell_back(&self) -> bool {
        matches!(self, Self::Dynamic(memory) if memory.fell_back())
    }

    #[inline(always)]
    fn reaches(&self, table: &Table<T>, displacement: T) -> bool {
        with_table!(self, table, (memory, table) => memory.reaches(table, displacement))
    }

    fn apply(&mut self, table: &Table<T>, drive: T) -> T {
        with_table!(self, table, (memory, table) => memory.apply(table, drive))
    }

    fn solve(&mut self, table: &Table<T>, displacement: T) -> T {
        with_table!(self, table, (memory, table) => memory.solve(table, displacement))
    }

    #[inline(always)]
    fn track(
        &mut self,
        table: &Table<T>,
        last: &mut LastLine<T>,
        displacement: T,
        permitted: impl FnOnce(T) -> Option<T>,
    ) -> bool {
        match (self, table) {
            (Self::Static(memory), Table::Static(table)) => memory.track(table, last, displacement, permitted),
            // Only the static model has this fast path.
            _ => false,
        }
    }

    fn follow_within(&mut self, table: &Table<T>, displacement: T, permitted: impl FnOnce(T) -> T) -> bool {
        with_table!(self, table, (memory, table) => LegMemory::follow_within(memory, table, displacement, permitted))
    }
}

/// The table of each leg, and its memory after a sweep to the highest voltage and back.
pub fn models<T: Real>(convert: &Convert<T>, h: &Hysteresis) -> Result<([Table<T>; LEGS], Memory<T>), InvalidIr> {
    let tables = nodes(convert, h, &h.tables, &h.table_of_leg)?;
    Ok(match &h.rate {
        None => (tables.map(Table::Static), Memory::Static(ReversalMemory::new())),
        Some(RateModel::DynamicPreisach { tables: rates, table_of_leg, tolerance }) => {
            let rates = nodes(convert, h, rates, table_of_leg)?;
            let tolerance = convert.real(*tolerance);
            let of_leg =
                |leg: usize| Table::Dynamic(DynamicEverett { still: tables[leg], rate: rates[leg], tolerance });
            (std::array::from_fn(of_leg), Memory::Dynamic(DynamicMemory::new()))
        }
        Some(RateModel::Creep { gains, weights, carried, direct }) => {
            with_creep(convert, &tables, [gains, weights, carried], *direct)?
        }
    })
}

/// Tables of the legs; legs with the same table share its memory.
fn nodes<T: Real>(
    convert: &Convert<T>,
    h: &Hysteresis,
    tables: &[Vec<f64>],
    of_leg: &[usize; LEGS],
) -> Result<[Nodes<'static, T>; LEGS], InvalidIr> {
    if h.memory > ROOM {
        return Err(InvalidIr::Part("the capacity of a reversal memory"));
    }
    let distinct: Option<Vec<_>> =
        tables.iter().map(|table| Nodes::new(convert.slice(table), h.grid, h.memory)).collect();
    let distinct = distinct.ok_or(InvalidIr::Part("the size of a table or of a reversal memory"))?;
    let mut found = [None; LEGS];
    for (found, table) in found.iter_mut().zip(of_leg) {
        *found = distinct.get(*table).copied();
    }
    match found {
        [Some(a), Some(b), Some(c), Some(d), Some(e), Some(f)] => Ok([a, b, c, d, e, f]),
        _ => Err(InvalidIr::Part("the table of a leg")),
    }
}
