//! Hysteresis models with kind, table size and memory chosen by the spec.

use std::convert::Infallible;
use std::fmt::Debug;

use specgen_ir::scalar::{Numbers as _, kept};
use specgen_ir::{self as ir, Hysteresis, Ir, LEGS, RateModel, Rest};
use specgen_law::LegMemory;
use specgen_runtime::plays::PLAYS;
use specgen_runtime::snapshot::{Field, InvalidState, Reader, WordSink};
use specgen_runtime::{
    BoucWenEverett, BoucWenMemory, Creep, CreepEverett, CreepMemory, DynamicEverett, DynamicMemory, LastLine, Nodes,
    PlayMemory, Plays, Real, ReversalMemory, Snapshot, WidenedMemory,
};

use crate::InvalidIr;
use crate::convert::Convert;

/// Largest `hysteresis.memory`, extrema.
pub const ROOM: usize = 256;

/// A static model, a rate-dependent one, or one with a number of creep operators, with or without a Bouc-Wen state.
macro_rules! models {
    ($($creep:ident $count:literal),+; $($bouc_wen:ident $plays:ident $terms:literal),+) => {
        /// Table of a leg.
        #[derive(Debug, Clone, Copy)]
        pub enum Table<T: Real> {
            Static(Nodes<'static, T>),
            Dynamic(DynamicEverett<T, Nodes<'static, T>>),
            $($creep(CreepEverett<'static, T, Nodes<'static, T>, $count>),)+
            $($bouc_wen(BoucWenEverett<'static, T, Nodes<'static, T>, $terms>),)+
            $($plays(BoucWenEverett<'static, T, &'static Plays<T>, $terms>),)+
        }

        /// Memory of a leg's drive.
        #[derive(Debug, Clone, Copy)]
        pub enum Memory<T: Real> {
            Static(ReversalMemory<T, ROOM>),
            Dynamic(DynamicMemory<T, ROOM>),
            $($creep(CreepMemory<T, ROOM, $count>),)+
            $($bouc_wen(BoucWenMemory<T, ROOM, $terms>),)+
            $($plays(WidenedMemory<T, $terms>),)+
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
                    $(Memory::$bouc_wen($name) => $value,)+
                    $(Memory::$plays($name) => $value,)+
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
                    $((Memory::$bouc_wen($name), Table::$bouc_wen($table)) => $value,)+
                    $((Memory::$plays($name), Table::$plays($table)) => $value,)+
                    _ => unreachable!("a memory and a table of one spec"),
                }
            };
        }

        fn with_creep<T: Real>(
            convert: &Convert<T>,
            tables: &[Nodes<'static, T>; LEGS],
            creep: [&[f64]; 3],
            direct: f64,
        ) -> Result<LegModels<T>, InvalidIr> {
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
                    return Ok((tables, [Memory::$creep(CreepMemory::new()); LEGS]));
                }
            )+
            Err(InvalidIr::Part("the number of creep operators"))
        }

        fn with_bouc_wen<T: Real>(
            convert: &Convert<T>,
            tables: &[Nodes<'static, T>; LEGS],
            legs: &[ir::BoucWen; LEGS],
            plays: Option<&[ir::Plays; LEGS]>,
        ) -> Result<LegModels<T>, InvalidIr> {
            $(
                let around: Option<Vec<_>> = legs.iter().map(|leg| leg.constants::<T, $terms>(convert)).collect();
                if let Some(around) = around {
                    let around: &'static [specgen_runtime::BoucWen<T, $terms>] = kept(around);
                    if let Some(plays) = plays {
                        let plays: Option<Vec<_>> = plays.iter().map(|leg| leg.constants(convert)).collect();
                        let wrong = InvalidIr::Part("the number of plays");
                        let plays: &'static [Plays<T>] = kept(plays.ok_or(wrong)?);
                        let table = |leg: usize| {
                            Table::$plays(BoucWenEverett { still: &plays[leg], around: &around[leg] })
                        };
                        let memory =
                            |leg: usize| Memory::$plays(WidenedMemory::at_rest(&plays[leg], around[leg].rest));
                        return Ok((std::array::from_fn(table), std::array::from_fn(memory)));
                    }
                    let tables = std::array::from_fn(|leg| {
                        Table::$bouc_wen(BoucWenEverett { still: tables[leg], around: &around[leg] })
                    });
                    let memory = |leg: usize| Memory::$bouc_wen(BoucWenMemory::at_rest(around[leg].rest));
                    return Ok((tables, std::array::from_fn(memory)));
                }
            )+
            Err(InvalidIr::Part("the number of creep operators"))
        }

        impl<T: Real> Memory<T> {
            /// Risen from negative saturation to `drive`; with a Bouc-Wen state, the table's part and z there; with plays, their
            /// states.
            pub fn risen(
                self,
                drive: T,
                displacement: T,
                rate: T,
                [still, z]: [T; 2],
                plays: Option<[T; PLAYS]>,
            ) -> Self {
                match self {
                    Self::Static(_) => Self::Static(ReversalMemory::risen(drive, displacement)),
                    Self::Dynamic(_) => Self::Dynamic(DynamicMemory::risen(drive, displacement, rate)),
                    $(Self::$creep(_) => Self::$creep(CreepMemory::risen(drive, displacement)),)+
                    $(Self::$bouc_wen(_) => Self::$bouc_wen(BoucWenMemory::risen(drive, still, z, displacement)),)+
                    $(Self::$plays(_) => {
                        let Some(states) = plays else { unreachable!("a rest of one spec") };
                        Self::$plays(WidenedMemory::risen(PlayMemory::risen(drive, still, states), z, displacement))
                    })+
                }
            }
        }
    };
}
models!(
    Creep1 1, Creep2 2, Creep3 3, Creep4 4, Creep5 5, Creep6 6;
    BoucWen0 Plays0 0, BoucWen1 Plays1 1, BoucWen2 Plays2 2, BoucWen3 Plays3 3, BoucWen4 Plays4 4, BoucWen5 Plays5 5,
    BoucWen6 Plays6 6
);

/// Converts a slice of exactly its length to an array.
trait FromSlice: Sized {
    fn from_slice(values: &[f64]) -> Option<&Self>;
}

impl<const N: usize> FromSlice for [f64; N] {
    fn from_slice(values: &[f64]) -> Option<&Self> {
        values.as_array()
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
        permit: impl FnOnce(T) -> Option<T>,
    ) -> bool {
        with_table!(self, table, (memory, table) => LegMemory::track(memory, table, last, displacement, permit))
    }

    fn follow_within(&mut self, table: &Table<T>, displacement: T, permit: impl FnOnce(T) -> T) -> bool {
        with_table!(self, table, (memory, table) => LegMemory::follow_within(memory, table, displacement, permit))
    }
}

/// Table and memory of each leg.
type LegModels<T> = ([Table<T>; LEGS], [Memory<T>; LEGS]);

/// The table of each leg, and its memory after a sweep to the highest voltage and back.
pub fn models<T: Real>(convert: &Convert<T>, h: &Hysteresis) -> Result<LegModels<T>, InvalidIr> {
    let tables = nodes(convert, h, &h.tables, &h.table_of_leg)?;
    Ok(match &h.rate {
        None => (tables.map(Table::Static), [Memory::Static(ReversalMemory::new()); LEGS]),
        Some(RateModel::DynamicPreisach { tables: rates, table_of_leg, tolerance }) => {
            let rates = nodes(convert, h, rates, table_of_leg)?;
            let tolerance = convert.real(*tolerance);
            let of_leg =
                |leg: usize| Table::Dynamic(DynamicEverett { still: tables[leg], rate: rates[leg], tolerance });
            (std::array::from_fn(of_leg), [Memory::Dynamic(DynamicMemory::new()); LEGS])
        }
        Some(RateModel::Creep { gains, weights, carried, direct }) => {
            with_creep(convert, &tables, [gains, weights, carried], *direct)?
        }
        Some(RateModel::BoucWen { legs, plays }) => with_bouc_wen(convert, &tables, legs, plays.as_deref())?,
    })
}

/// Those memories at power-up: risen to the rest of the spec.
pub fn at_rest<T: Real>(fresh: [Memory<T>; LEGS], convert: &Convert<T>, rest: &Rest) -> [Memory<T>; LEGS] {
    let drive = convert.real(rest.drive);
    let displacement = convert.vector(&rest.displacement);
    let rate = convert.vector(&rest.rate);
    let parts = convert.matrix(&rest.bouc_wen.unwrap_or_default());
    let plays = |leg: usize| Some(convert.vector(rest.plays.as_ref()?[leg].as_array()?));
    std::array::from_fn(|leg| fresh[leg].risen(drive, displacement[leg], rate[leg], parts[leg], plays(leg)))
}

/// The leg models of a spec on their own, from power-up on. Their tables stay in memory to the end of the process.
#[derive(Debug, Clone)]
pub struct ModelLegs {
    tables: [Table<f64>; LEGS],
    memory: [Memory<f64>; LEGS],
}

impl ModelLegs {
    /// Six legs at the rest of the spec.
    ///
    /// # Errors
    /// The IR is not one from the compiler.
    pub fn of(ir: &Ir) -> Result<Self, InvalidIr> {
        let convert = Convert::new();
        let (tables, fresh) = models(&convert, &ir.hysteresis)?;
        let memory = match &ir.supervision.risen {
            None => fresh,
            Some(rest) => at_rest(fresh, &convert, rest),
        };
        convert.finish()?;
        Ok(Self { tables, memory })
    }

    /// The drives last applied, cells of the table.
    pub fn drives(&self) -> [f64; LEGS] {
        self.memory.each_ref().map(|memory| each!(memory, memory => memory.drive()))
    }

    /// The displacements at the end of the last tick, m.
    pub fn displacements(&self) -> [f64; LEGS] {
        self.memory.each_ref().map(|memory| each!(memory, memory => memory.displacement()))
    }

    /// A tick with the drives that end at `displacements` (m, finite), as near as the tables reach.
    pub fn follow(&mut self, displacements: &[f64; LEGS]) {
        for ((memory, table), wanted) in self.memory.iter_mut().zip(&self.tables).zip(displacements) {
            memory.follow_within(table, *wanted, |drive| drive);
        }
    }

    /// A tick with `drives` (cells, finite).
    pub fn apply(&mut self, drives: &[f64; LEGS]) {
        for ((memory, table), drive) in self.memory.iter_mut().zip(&self.tables).zip(drives) {
            memory.apply(table, *drive);
        }
    }
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
