//! Tables and memories of sizes that are known at run time against those that a compiler wrote: every bit, digest and word.

use crate::common::*;
use specgen_runtime::snapshot::{InvalidState, Reader, Sizes, StatePart, WordSink, Writer};
use specgen_runtime::{
    BoucWen, BoucWenEverett, BoucWenMemory, Creep, CreepEverett, CreepMemory, Digest, DynamicEverett, DynamicMemory,
    Everett, LastLine, Nodes, Real, ReversalMemory, Snapshot,
};

/// Room of a memory at run time: none of the capacities below.
const ROOM: usize = 67;
const TICKS: usize = 6000;
const CREEP: Creep<f64, 3> =
    Creep { gains: [0.5, 0.02, 1.0], weights: [0.1, 0.05, 0.02], carried: [0.05, 0.049, 0.0], direct: 1.071 };

/// The memories under one roof.
trait Model<T: Copy, Table>: Snapshot + Copy {
    fn apply(&mut self, table: &Table, drive: T) -> T;
    fn solve(&mut self, table: &Table, displacement: T) -> T;
    fn reaches(&self, table: &Table, displacement: T) -> bool;
    fn follow(&mut self, table: &Table, displacement: T, permitted: impl FnOnce(T) -> T) -> bool {
        let reaches = self.reaches(table, displacement);
        let drive = permitted(self.solve(table, displacement));
        self.apply(table, drive);
        !reaches
    }
    fn track(&mut self, _: &Table, _: &mut LastLine<T>, _: T, _: impl FnOnce(T) -> T) -> bool {
        false
    }
    fn now(&self) -> [T; 2];
    fn fell_back(&self) -> bool {
        false
    }
}

macro_rules! model {
    ([$($generic:tt)*] $memory:ty, $table:ty { $($own:tt)* }) => {
        impl<T: Real, G: Grid<T>, $($generic)*> Model<T, $table> for $memory {
            fn apply(&mut self, table: &$table, drive: T) -> T {
                self.apply(table, drive)
            }
            fn solve(&mut self, table: &$table, displacement: T) -> T {
                <$memory>::solve(self, table, displacement)
            }
            fn reaches(&self, table: &$table, displacement: T) -> bool {
                self.reaches(table, displacement)
            }
            fn now(&self) -> [T; 2] {
                [self.drive(), self.displacement()]
            }
            $($own)*
        }
    };
}
model!([const CAP: usize] ReversalMemory<T, CAP>, G {
    fn follow(&mut self, table: &G, displacement: T, permitted: impl FnOnce(T) -> T) -> bool {
        self.follow_within(table, displacement, permitted)
    }
    fn track(&mut self, table: &G, last: &mut LastLine<T>, displacement: T, permitted: impl FnOnce(T) -> T) -> bool {
        self.track(table, last, displacement, |drive| Some(permitted(drive)))
    }
});
model!([const CAP: usize] DynamicMemory<T, CAP>, DynamicEverett<T, G> {
    fn fell_back(&self) -> bool {
        self.fell_back()
    }
});
model!([const CAP: usize, const K: usize] CreepMemory<T, CAP, K>, CreepEverett<'_, T, G, K> {});
model!([const CAP: usize, const K: usize] BoucWenMemory<T, CAP, K>, BoucWenEverett<'_, T, G, K> {
    fn follow(
        &mut self,
        table: &BoucWenEverett<'_, T, G, K>,
        displacement: T,
        permitted: impl FnOnce(T) -> T,
    ) -> bool {
        self.follow_within(table, displacement, permitted)
    }
    fn track(
        &mut self,
        table: &BoucWenEverett<'_, T, G, K>,
        last: &mut LastLine<T>,
        displacement: T,
        permitted: impl FnOnce(T) -> T,
    ) -> bool {
        self.track(table, last, displacement, |drive| Some(permitted(drive)))
    }
});

/// What a tick leaves behind: a drive solved for, drive and displacement, flags, the digest.
type Step = [u64; 5];

struct Trace {
    steps: Vec<Step>,
    /// Some states on the way.
    states: Vec<Vec<u64>>,
}

impl Trace {
    /// Of pairs that did not fit.
    fn dropped(&self) -> u64 {
        self.states.last().unwrap()[1]
    }
}

fn words_of(state: &impl Snapshot, sizes: Sizes) -> Vec<u64> {
    let mut words = vec![0; state.word_count(sizes)];
    let mut writer = Writer::new(&mut words);
    let Ok(()) = state.show(&mut writer.within(sizes));
    assert_eq!(writer.count(), words.len());
    // A part of it, as a record is written on a board.
    let mut piece = [0; 5];
    let Ok(()) = state.show(&mut StatePart::new(&mut piece, words.len() - 5).within(sizes));
    assert_eq!(piece, words[words.len() - 5..]);
    words
}

fn restored<S: Snapshot + Copy>(fresh: S, words: &[u64], sizes: Sizes) -> Result<S, InvalidState> {
    let mut state = fresh;
    let mut reader = Reader::new(words).within(sizes);
    state.restore(&mut reader)?;
    assert_eq!(reader.count(), words.len());
    Ok(state)
}

/// Random drives and demands within and beyond the table, jumps, noise about a reversal, nodes and ends. Now and then the memory is
/// put into words and goes on as what they are read as.
fn trace<T: Real, Table, M: Model<T, Table>>(fresh: M, table: &Table, sizes: Sizes, seed: u64) -> Trace {
    let (mut memory, mut last, mut random) = (fresh, LastLine::new(), Random(seed));
    let mut trace = Trace { steps: Vec::new(), states: Vec::new() };
    let real = T::from_f64;
    for tick in 0..TICKS {
        let drive = real(sizes.grid * random.unit());
        let demand = match random.below(12) {
            0 => real(70e-6 * (random.unit() - 0.05)),
            1..=4 => real(60e-6 * random.unit()),
            _ => memory.now()[1] + real(3e-7 * (random.unit() - 0.5)),
        };
        let on_code = |drive: T| {
            let code = (drive * real(1365.0)).truncate();
            T::from_i32(code) * real(1.0 / 1365.0)
        };
        let (mut solved, mut flag) = (T::ZERO, false);
        match tick % 16 {
            0 => _ = memory.apply(table, T::from_i32(drive.truncate())),
            1 if tick % 5 == 0 => _ = memory.apply(table, real(sizes.grid * (3.0 * random.unit() - 1.0).round())),
            2..=5 => _ = memory.apply(table, drive),
            6..=7 => {
                solved = memory.solve(table, demand);
                memory.apply(table, solved);
            }
            8..=10 => flag = memory.follow(table, demand, on_code),
            _ => {
                flag = memory.track(table, &mut last, demand, on_code);
                if !flag {
                    memory.follow(table, demand, on_code);
                }
            }
        }
        let mut digest = Digest::new();
        memory.digest(&mut digest);
        let flags = u64::from(flag) | u64::from(memory.fell_back()) << 1;
        let [drive, displacement] = memory.now();
        trace.steps.push([solved.to_word(), drive.to_word(), displacement.to_word(), flags, digest.finish()]);
        if tick % 97 == 96 {
            let words = words_of(&memory, sizes);
            memory = restored(fresh, &words, sizes).unwrap();
            trace.states.push(words);
        }
    }
    trace
}

fn sizes(grid: usize, memory: usize) -> Sizes {
    Sizes { grid: grid as f64, memory, ..Sizes::ANY }
}

/// An emitted memory of that capacity, and one at run time that has more room.
fn alike<T: Real, A, B, F: Model<T, A>, R: Model<T, B>>(emitted: (F, &A), at_run_time: (R, &B), sizes: Sizes) -> u64 {
    // A compiler's sizes are those of the types, whatever it is told; records hold its words.
    assert_eq!(words_of(&emitted.0, Sizes::ANY).len(), F::WORDS);
    assert_eq!(at_run_time.0.word_count(sizes), F::WORDS);
    assert_eq!(emitted.0.word_count(sizes), F::WORDS);
    let mut dropped = 0;
    for seed in 0..4 {
        let expected = trace(emitted.0, emitted.1, sizes, seed);
        let got = trace(at_run_time.0, at_run_time.1, sizes, seed);
        for (tick, (a, b)) in expected.steps.iter().zip(&got.steps).enumerate() {
            assert_eq!(a, b, "capacity {}, seed {seed}, tick {tick}", sizes.memory);
        }
        assert!(expected.states == got.states, "capacity {}, seed {seed}", sizes.memory);
        dropped += got.dropped();
    }
    dropped
}

fn nodes<T: Real>(weights: &Weights) -> &'static [T] {
    everett_nodes(weights).into_iter().map(T::from_f64).collect::<Vec<_>>().leak()
}

fn every_model<T: Real, const N: usize, const NODES: usize, const CAP: usize>(seed: u64) -> u64 {
    let tables = [random_weights(seed, N), random_weights(seed + 1, N)].map(|weights| nodes::<T>(&weights));
    // The second weight is of either sign: a difference of tables.
    let rate: Vec<T> = tables[0].iter().zip(tables[1]).map(|(a, b)| *a - *b).collect();
    let [still, rate] = [tables[0], rate.leak()];
    let emitted = |nodes: &'static [T]| Everett::<T, N, NODES> { nodes: nodes.try_into().unwrap() };
    let at_run_time = |nodes: &'static [T]| Nodes::new(nodes, N, CAP).unwrap();
    let sizes = sizes(N, CAP);

    let dropped = alike(
        (ReversalMemory::<T, CAP>::new(), &emitted(still)),
        (ReversalMemory::<T, ROOM>::new(), &at_run_time(still)),
        sizes,
    );
    let tolerance = T::from_f64(2e-10);
    let of_rate = alike(
        (DynamicMemory::<T, CAP>::new(), &DynamicEverett { still: emitted(still), rate: emitted(rate), tolerance }),
        (
            DynamicMemory::<T, ROOM>::new(),
            &DynamicEverett { still: at_run_time(still), rate: at_run_time(rate), tolerance },
        ),
        sizes,
    );
    let real = |values: [f64; 3]| values.map(T::from_f64);
    let creep = Creep {
        gains: real(CREEP.gains),
        weights: real(CREEP.weights),
        carried: real(CREEP.carried),
        direct: T::from_f64(CREEP.direct),
    };
    let of_creep = alike(
        (CreepMemory::<T, CAP, 3>::new(), &CreepEverett { still: emitted(still), creep: &creep }),
        (CreepMemory::<T, ROOM, 3>::new(), &CreepEverett { still: at_run_time(still), creep: &creep }),
        sizes,
    );
    let around = BoucWen {
        creep,
        share: T::from_f64(1.0 / 1.071),
        read_out: [1.02, -600.0, 4e6, 0.0, 0.0].map(T::from_f64),
        inverse: [0.98, 576.0, -3e6, 0.0, 0.0].map(T::from_f64),
        travel: [-1e-6, 62e-6].map(T::from_f64),
        slope: T::from_f64(4e-7),
        beta_plus_gamma: T::from_f64(0.2),
        beta_minus_gamma: T::from_f64(0.1),
        limit: T::from_f64(2e-6),
        rest: T::from_f64(-1.9e-6),
    };
    let of_bouc_wen = alike(
        (BoucWenMemory::<T, CAP, 3>::at_rest(around.rest), &BoucWenEverett { still: emitted(still), around: &around }),
        (
            BoucWenMemory::<T, ROOM, 3>::at_rest(around.rest),
            &BoucWenEverett { still: at_run_time(still), around: &around },
        ),
        sizes,
    );
    [dropped, of_rate, of_creep, of_bouc_wen].into_iter().min().unwrap()
}

#[test]
fn a_table_read_at_run_time_is_the_one_that_a_compiler_wrote_to_the_bit() {
    let mut dropped = every_model::<f64, 32, 561, 4>(1);
    dropped = dropped.min(every_model::<f64, 32, 561, 6>(2));
    dropped = dropped.min(every_model::<f64, 13, 105, 5>(3));
    dropped = dropped.min(every_model::<f32, 32, 561, 8>(4));
    dropped = dropped.min(every_model::<f32, 2, 6, 4>(5));
    // In every model, over again.
    assert!(dropped > 30, "{dropped}");
    every_model::<f64, 8, 45, 64>(6);
    every_model::<f64, 1, 3, 16>(7);
    // As much as there is room for.
    every_model::<f64, 13, 105, ROOM>(8);
}

#[test]
fn one_ulp_in_any_node_is_seen_at_run_time() {
    let good: Vec<f64> = everett_nodes(&random_weights(4, 8));
    let of = |nodes: &[f64]| {
        let table = Nodes::new(nodes, 8, 8).unwrap();
        trace(ReversalMemory::<f64, ROOM>::new(), &table, sizes(8, 8), 1).steps
    };
    let expected = of(&good);
    // Those of the diagonal are zero.
    for node in (0..good.len()).filter(|node| good[*node] != 0.0) {
        let mut bad = good.clone();
        bad[node] = bad[node].next_up();
        let differing = expected.iter().zip(of(&bad)).filter(|(a, b)| *a != b).count();
        assert!(differing > 0, "node {node}");
    }
}

#[test]
fn only_a_whole_table_with_room_for_a_loop_within_a_loop_is_taken() {
    let all = [0.0; 561];
    assert!(Nodes::new(&all, 32, 4).is_some());
    for (nodes, cells, capacity) in [
        (&all[..560], 32, 4),
        (&all[..], 31, 4),
        (&all[..], 33, 4),
        (&all[..], 32, 3),
        (&all[..1], 0, 4),
        (&[], 0, 4),
        (&all[..1], usize::MAX, 4),
        (&all[..3], 1 << 33, 4),
    ] {
        assert!(Nodes::new(nodes, cells, capacity).is_none(), "{} nodes, {cells} cells, {capacity}", nodes.len());
    }
    // More than a memory has room for is not kept.
    assert_eq!([64, 68, 200].map(|capacity| Nodes::new(&all, 32, capacity).unwrap().capacity(ROOM)), [64, 67, 67]);
}

#[test]
fn words_of_more_extrema_than_the_table_keeps_are_refused() {
    let memory = ReversalMemory::<f64, ROOM>::new();
    let with_depth = |depth: u64| {
        let mut words = words_of(&memory, sizes(N, 8));
        assert_eq!(words.len(), 4 + 2 * 8);
        words[0] = depth;
        restored(memory, &words, sizes(N, 8)).map(|memory| memory.depth())
    };
    assert_eq!([with_depth(1), with_depth(8)], [Ok(1), Ok(8)]);
    assert_eq!([with_depth(0), with_depth(9), with_depth(67)], [Err(InvalidState { word: 0 }); 3]);
    let words = words_of(&memory, sizes(N, 8));
    assert_eq!(restored(memory, &words[..19], sizes(N, 8)).err(), Some(InvalidState { word: 19 }));
}
