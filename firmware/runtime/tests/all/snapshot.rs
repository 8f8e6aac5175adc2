//! States as words: every word of every state comes back, is part of the digest, and is refused where no state holds it.

use std::fmt::Debug;

use specgen_runtime::setpoint::{Generator, LONGEST, Profile, Stop};
use specgen_runtime::snapshot::{Field, InvalidState, LARGEST, Reader, Sizes, Snapshot, StatePart, Writer};
use specgen_runtime::supervisor::{Approach, Supervisor, TIMERS};
use specgen_runtime::{
    BoucWenMemory, CreepMemory, Damping, Digest, DynamicMemory, Estimate, Integral, Motion, NotchState, PlayMemory,
    Rate, ReversalMemory, Transfer,
};

/// No two bounds are alike.
const SIZES: Sizes = Sizes {
    place: [1.0, 1.1, 1.2, 1.3, 1.4, 1.5],
    user: [2.0, 2.1, 2.2, 2.3, 2.4, 2.5],
    rate: [3.0, 3.1, 3.2, 3.3, 3.4, 3.5],
    acceleration: [4.0, 4.1, 4.2, 4.3, 4.4, 4.5],
    pose: [5.0, 5.1, 5.2, 5.3, 5.4, 5.5],
    pose_rate: [6.0, 6.1, 6.2, 6.3, 6.4, 6.5],
    error: 7.0,
    apart: [13.0, 13.1, 13.2, 13.3, 13.4, 13.5],
    wrench: [8.0, 8.1, 8.2, 8.3, 8.4, 8.5],
    leg: 9.0,
    leg_rate: 10.0,
    line: 11.0,
    request: 32.0,
    reading: 12.0,
    stiffness: 2.0,
    codes: [-7, 7],
    grid: 100.0,
    memory: usize::MAX,
};
const GARBAGE: u64 = 0x5555_5555_5555_5555;

fn save<S: Snapshot>(state: &S) -> Vec<u64> {
    let mut words = vec![GARBAGE; S::WORDS + 3];
    let mut writer = Writer::new(&mut words);
    state.save(&mut writer);
    assert_eq!(writer.count(), S::WORDS);
    assert_eq!(words[S::WORDS..], [GARBAGE; 3]);
    words.truncate(S::WORDS);
    words
}

fn restore<S: Snapshot + Clone>(fresh: &S, words: &[u64]) -> Result<S, InvalidState> {
    let mut state = fresh.clone();
    let mut reader = Reader::new(words).within(SIZES);
    state.restore(&mut reader)?;
    assert_eq!(reader.count(), S::WORDS);
    Ok(state)
}

fn digest(add: impl FnOnce(&mut Digest)) -> u64 {
    let mut digest = Digest::new();
    add(&mut digest);
    digest.finish()
}

/// Words for a state: numbers that are all different and small, whole numbers, flags.
#[derive(Default)]
struct Words(Vec<u64>);

impl Words {
    fn reals(mut self, count: usize) -> Self {
        for _ in 0..count {
            self.0.push((0.001 * (self.0.len() + 1) as f64).to_bits());
        }
        self
    }

    fn whole(mut self, words: &[u64]) -> Self {
        self.0.extend(words);
        self
    }

    /// Counters that are all different.
    fn counters(mut self, count: usize) -> Self {
        for _ in 0..count {
            self.0.push(1000 + self.0.len() as u64);
        }
        self
    }
}

/// Restores `words` into `fresh`; then every word with every bit flipped, which is refused there or kept and seen in the digest;
/// then with every word missing.
fn every_word_counts<S: Snapshot + Clone + Debug>(fresh: &S, Words(words): Words, add: impl Fn(&S, &mut Digest)) {
    assert_eq!(words.len(), S::WORDS);
    let state = restore(fresh, &words).unwrap();
    assert_eq!(save(&state), words);
    assert_ne!(save(fresh), words);
    let of = |state: &S| digest(|digest| add(state, digest));
    for place in 0..S::WORDS {
        let mut taken = 0;
        for bit in 0..64 {
            let mut other = words.clone();
            other[place] ^= 1 << bit;
            match restore(fresh, &other) {
                Ok(changed) => {
                    taken += 1;
                    assert_eq!(save(&changed)[place], other[place], "word {place}, bit {bit}");
                    assert_ne!(of(&changed), of(&state), "word {place}, bit {bit}: {changed:?}");
                }
                Err(InvalidState { word }) => assert!(word >= place, "word {place}, bit {bit}: refused at {word}"),
            }
        }
        assert!(taken > 0, "word {place}");
        assert_eq!(restore(fresh, &words[..place]).err(), Some(InvalidState { word: place }));
    }
}

/// At these places numbers up to `largest` and no others.
fn numbers_within<S: Snapshot + Clone + Debug>(state: &S, places: impl IntoIterator<Item = usize>, largest: f64) {
    let words = save(state);
    for place in places {
        let with = |value: f64| {
            let mut words = words.clone();
            words[place] = value.to_bits();
            restore(state, &words).err()
        };
        let beyond = largest * (1.0 + f64::EPSILON);
        for good in [largest, -largest, -0.0] {
            assert_eq!(with(good), None, "word {place}: {good}");
        }
        for bad in [beyond, -beyond, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(with(bad), Some(InvalidState { word: place }), "word {place}: {bad}");
        }
    }
}

/// From this place on numbers of six axes, each up to its `largest`.
fn axes_within<S: Snapshot + Clone + Debug>(state: &S, first: usize, largest: [f64; 6]) {
    for (place, largest) in (first..).zip(largest) {
        numbers_within(state, [place], largest);
    }
}

/// At a place whole numbers from `least` to `most` and no others.
fn whole_within<S: Snapshot + Clone + Debug>(state: &S, place: usize, least: u64, most: u64) {
    let words = save(state);
    let with = |word: u64| {
        let mut words = words.clone();
        words[place] = word;
        restore(state, &words).err()
    };
    for good in [least, most] {
        assert_eq!(with(good), None, "word {place}: {good}");
    }
    for bad in [least.wrapping_sub(1), most + 1, u64::MAX] {
        assert_eq!(with(bad), Some(InvalidState { word: place }), "word {place}: {bad}");
    }
}

#[test]
fn every_word_of_the_small_states_counts() {
    let motion = Motion::<f64>::new();
    every_word_counts(&motion, Words::default().reals(18), Motion::digest);
    for (first, largest) in [(0, SIZES.place), (6, SIZES.rate), (12, SIZES.acceleration)] {
        axes_within(&motion, first, largest);
    }
    let estimate = Estimate::<f64>::new();
    every_word_counts(&estimate, Words::default().reals(2), Estimate::digest);
    numbers_within(&estimate, 0..2, SIZES.request);
    let integral = Integral::<f64>::new();
    every_word_counts(&integral, Words::default().reals(6), Integral::digest);
    numbers_within(&integral, 0..6, LARGEST);
    let notch = NotchState::<f64>::new();
    every_word_counts(&notch, Words::default().reals(12), NotchState::digest);
    numbers_within(&notch, 0..12, SIZES.request);
    let damping = Damping::<f64, 6>::new();
    every_word_counts(&damping, Words::default().reals(18), Damping::digest);
    numbers_within(&damping, 0..18, SIZES.request);
    let transfer = Transfer::<f64>::new();
    every_word_counts(&transfer, Words::default().reals(6).whole(&[1]), Transfer::digest);
    numbers_within(&transfer, 0..6, SIZES.request);
    let rate = Rate::<f64>::new();
    every_word_counts(&rate, Words::default().reals(12).whole(&[1]), Rate::digest);
    axes_within(&rate, 0, SIZES.pose);
    axes_within(&rate, 6, SIZES.pose_rate);
}

#[test]
fn every_word_of_a_supervisor_counts() {
    let mut words = Words::default().whole(&[4, 14, 5, 0, 1, 1]).counters(3 + TIMERS);
    for _ in 0..6 {
        words = words.reals(1).whole(&[1]).reals(2).counters(3);
    }
    let words = words.whole(&[3]).counters(5);
    // Samples, the wiring check, the oscillation, then the approach.
    let words = words.reals(12).whole(&[1, 2, 1]).reals(1).counters(6).whole(&[1, 0]);
    let words = words.whole(&[2]).counters(1).reals(4 + 36 + 6 + 1).counters(1).whole(&[1]);
    let words = words.whole(&[1]).reals(18 + 1).counters(14).whole(&[1]).reals(6);
    let fresh = Supervisor::<f64>::new();
    every_word_counts(&fresh, words, Supervisor::digest);
    let channels = 9 + TIMERS;
    for channel in 0..6 {
        let first = channels + 7 * channel;
        numbers_within(&fresh, [first], SIZES.reading);
        numbers_within(&fresh, first + 2..first + 4, SIZES.request);
    }
    let end = channels + 6 * 7;
    let samples = end + 6;
    numbers_within(&fresh, samples..samples + 12, SIZES.reading);
    for (place, most) in [(12, 1), (13, 2), (14, 3)] {
        whole_within(&fresh, samples + place, 0, most);
    }
    numbers_within(&fresh, [samples + 15], LARGEST);
    let leg = samples + 24;
    let mut quiet = save(&fresh);
    quiet[leg - 1] = 1;
    assert_eq!(restore(&fresh, &quiet).err(), Some(InvalidState { word: leg - 1 }), "quiet without two samples");
    let [turned, response, gauges, least, stage] = [leg + 2, leg + 6, leg + 42, leg + 48, leg + 51];
    let approach = stage + 1 + 19 + 14;
    numbers_within(&fresh, (turned..response).chain([least]), 2.0);
    numbers_within(&fresh, response..gauges, LARGEST);
    numbers_within(&fresh, gauges..least, 8.0);
    axes_within(&fresh, stage + 1, SIZES.apart);
    axes_within(&fresh, stage + 7, SIZES.apart);
    numbers_within(&fresh, stage + 13..stage + 20, 1e30);
    axes_within(&fresh, approach + 1, SIZES.user);
    let flags = [(stage - 1, 1), (stage, 2), (approach, 2)];
    for (place, most) in [(0, 6), (1, 19), (2, 6), (end, 36), (leg, 6)].into_iter().chain(flags) {
        whole_within(&fresh, place, 0, most);
    }
}

#[test]
fn every_word_of_a_generator_counts() {
    let stop = Words::default().reals(12).whole(&[40, 7]);
    every_word_counts(&Stop::<f64>::new(), stop, Stop::digest);
    let profile = Words::default().whole(&[5, 9, 77]).reals(3);
    every_word_counts(&Profile::<f64>::new(), profile, Profile::digest);
    let longest = LONGEST as u64;
    for (place, most) in [(0, longest), (1, longest), (2, 3 * longest)] {
        whole_within(&Profile::<f64>::new(), place, 0, most);
    }
    whole_within(&Stop::<f64>::new(), 12, 1, longest);
    whole_within(&Stop::<f64>::new(), 13, 0, longest);
    numbers_within(&Profile::<f64>::new(), 3..6, 1.0);
    axes_within(&Stop::<f64>::new(), 0, SIZES.user);
    axes_within(&Stop::<f64>::new(), 6, SIZES.rate);

    let fresh = Generator::<f64>::new();
    let words = |phase: u64, index: u64, finished: u64| {
        let start = Words::default().whole(&[phase, index]).reals(30 + 18).whole(&[5, 9, 77]).reals(3).whole(&[8]);
        start.reals(12).whole(&[40, 7, 3, 11, finished]).counters(2)
    };
    for phase in [5, 6] {
        every_word_counts(&fresh, words(phase, 2, 1), Generator::digest);
    }
    // The others have no index; the word is read and forgotten.
    for phase in [0, 1, 2, 3, 4, 7] {
        let Words(words) = words(phase, 0, u64::MAX);
        assert_eq!(save(&restore(&fresh, &words).unwrap()), words);
    }
    let digests: Vec<u64> =
        (0..8).map(|phase| digest(|digest| restore(&fresh, &words(phase, 0, 1).0).unwrap().digest(digest))).collect();
    assert!((0..8).all(|a| (0..a).all(|b| digests[a] != digests[b])), "phases that a digest does not tell apart");
    for (first, largest) in [(2, SIZES.user), (8, SIZES.rate), (32, SIZES.place), (38, SIZES.rate)] {
        axes_within(&fresh, first, largest);
    }
    axes_within(&fresh, 44, SIZES.acceleration);
    // Start, goal and the way between them: to the bias they are the platform's own.
    let to_bias = restore(&fresh, &words(1, 0, 1).0).unwrap();
    for (state, largest) in [(&fresh, SIZES.user), (&to_bias, SIZES.place)] {
        axes_within(state, 14, largest);
        axes_within(state, 20, largest);
        axes_within(state, 26, largest.map(|largest| 2.0 * largest));
    }
    for (place, most) in [(0, 7), (56, 1 << 30), (71, 1 << 30), (72, 1 << 30), (74, u32::MAX.into())] {
        whole_within(&fresh, place, 0, most);
    }
    let finished = |word: u64| restore(&fresh, &words(6, 0, word).0).err();
    assert_eq!([finished(u32::MAX.into()), finished(u64::MAX)], [None; 2]);
    assert_eq!([1 << 32, u64::MAX - 1].map(finished), [Some(InvalidState { word: 73 }); 2]);
}

/// Room for 24 extrema, five of them used.
const CAP: usize = 24;
const USED: usize = 5;
const STAIRS: [f64; USED] = [0.0, 20.0, 3.0, 15.0, 6.0];

fn staircase(len: u64, drive: f64, extrema: &[f64]) -> Words {
    let mut words = Words::default().whole(&[len, 3, drive.to_bits(), 0.02_f64.to_bits()]);
    for numbers in [extrema, &[0.01, 0.05, 0.02, 0.04, 0.03]] {
        let mut stairs = [0; CAP];
        for (word, number) in stairs.iter_mut().zip(numbers) {
            *word = number.to_bits();
        }
        words = words.whole(&stairs);
    }
    words
}

#[test]
fn every_word_of_plays_counts() {
    let fresh = PlayMemory::<f64>::new(std::array::from_fn(|k| k as f64));
    let of = |state: &PlayMemory<f64>| digest(|digest| state.digest(digest));
    let words = save(&fresh);
    for place in 0..words.len() {
        let mut other = words.clone();
        other[place] ^= 1;
        let changed = restore(&fresh, &other).unwrap();
        assert!(save(&changed) == other && of(&changed) != of(&fresh), "word {place}");
    }
}

/// The words of a state of rate-dependent legs begin with those of the staircase. Room that is not used is zero.
#[test]
fn every_word_of_the_reversal_memories_counts() {
    type Plain = ReversalMemory<f64, CAP>;
    let used = |Words(words): &Words| -> Vec<usize> {
        let rooms = [4, 4 + CAP, Plain::WORDS];
        (0..words.len()).filter(|place| rooms.iter().all(|room| !(room + USED..room + CAP).contains(place))).collect()
    };
    fn check<S: Snapshot + Clone + Debug>(fresh: &S, words: Words, used: &[usize], add: impl Fn(&S, &mut Digest)) {
        let state = restore(fresh, &words.0).unwrap();
        assert_eq!(save(&state), words.0);
        let of = |state: &S| digest(|digest| add(state, digest));
        for place in 0..words.0.len() {
            // The length takes extrema with it.
            let mut other = words.0.clone();
            other[place] = if place == 0 { 4 } else { other[place] ^ 1 };
            let changed = restore(fresh, &other).map(|state| (of(&state), save(&state)[place]));
            if place == 4 || (used.contains(&place) && place > 0) {
                // p₀ is zero and nothing else.
                let expected = if place == 4 { None } else { Some(other[place]) };
                assert_eq!(changed.ok().map(|(_, word)| word), expected, "word {place}");
                assert!(changed.is_err() || changed.unwrap().0 != of(&state), "word {place}");
            } else if place > 0 {
                assert_eq!(changed, Ok((of(&state), 0)), "word {place} is room");
            }
            assert_eq!(restore(fresh, &words.0[..place]).err(), Some(InvalidState { word: place }));
        }
    }
    let plain = || staircase(USED as u64, 10.0, &STAIRS);
    check(&Plain::new(), plain(), &used(&plain()), ReversalMemory::digest);
    let dynamic = || {
        let mut words = plain().reals(CAP);
        words.0[Plain::WORDS + USED..].fill(0);
        words.reals(2).whole(&[1])
    };
    check(&DynamicMemory::<f64, CAP>::new(), dynamic(), &used(&dynamic()), DynamicMemory::digest);
    let creep = || plain().reals(3 + 1);
    let all: Vec<usize> = used(&plain()).into_iter().chain(Plain::WORDS..Plain::WORDS + 4).collect();
    check(&CreepMemory::<f64, CAP, 3>::new(), creep(), &all, CreepMemory::digest);
    let bouc_wen = || plain().reals(2 + 3 + 1);
    let all: Vec<usize> = used(&plain()).into_iter().chain(Plain::WORDS..Plain::WORDS + 6).collect();
    check(&BoucWenMemory::<f64, CAP, 3>::at_rest(0.0), bouc_wen(), &all, BoucWenMemory::digest);
    let restored = restore(&Plain::new(), &plain().0).unwrap();
    assert_eq!((restored.drive(), restored.depth(), restored.dropped()), (10.0, USED, 3));
    whole_within(&restored, 1, 0, u32::MAX.into());
    numbers_within(&restored, [3].into_iter().chain(4 + CAP..Plain::WORDS), SIZES.leg);
    let creeping = restore(&CreepMemory::<f64, CAP, 3>::new(), &creep().0).unwrap();
    numbers_within(&creeping, Plain::WORDS..Plain::WORDS + 4, SIZES.leg);
    let losing = restore(&BoucWenMemory::<f64, CAP, 3>::at_rest(0.0), &bouc_wen().0).unwrap();
    numbers_within(&losing, [Plain::WORDS].into_iter().chain(Plain::WORDS + 2..Plain::WORDS + 6), SIZES.leg);
    let changing = restore(&DynamicMemory::<f64, CAP>::new(), &dynamic().0).unwrap();
    let rates = Plain::WORDS..Plain::WORDS + CAP;
    numbers_within(&changing, rates.chain([Plain::WORDS + CAP]), SIZES.leg_rate);
    numbers_within(&changing, [Plain::WORDS + CAP + 1], SIZES.leg);
}

#[test]
fn only_a_staircase_is_taken_for_one() {
    let taken = |len: u64, drive: f64, extrema: &[f64]| {
        restore(&ReversalMemory::<f64, CAP>::new(), &staircase(len, drive, extrema).0)
            .map_err(|InvalidState { word }| word)
    };
    let refused = 4 + CAP - 1;
    // Steps may be of no height.
    for (drive, extrema) in [
        (10.0, STAIRS),
        (6.0, STAIRS),
        (15.0, STAIRS),
        (5.0, [0.0, 20.0, 0.0, 15.0, 5.0]),
        (7.0, [0.0, 15.0, 3.0, 15.0, 3.0]),
        (6.0, [0.0, 6.0, 6.0, 6.0, 6.0]),
    ] {
        let memory = taken(5, drive, &extrema).unwrap();
        assert_eq!(memory.drive(), drive, "{extrema:?}");
    }
    for (drive, extrema) in [
        (5.9, STAIRS),
        (15.1, STAIRS),
        (10.0, [1.0, 20.0, 3.0, 15.0, 6.0]),
        (10.0, [-1.0, 20.0, 3.0, 15.0, 6.0]),
        (10.0, [0.0, 20.0, -1.0, 15.0, 6.0]),
        (10.0, [0.0, 20.0, 3.0, 20.1, 6.0]),
        (10.0, [0.0, 20.0, 3.0, 15.0, 2.9]),
        (10.0, [0.0, 20.0, 20.1, 20.05, 10.0]),
        (10.0, [0.0, 20.0, 3.0, 2.9, 3.0]),
        (10.0, [0.0, -1.0, 3.0, 15.0, 6.0]),
    ] {
        assert_eq!(taken(5, drive, &extrema).err(), Some(refused), "{drive} {extrema:?}");
    }
    // Alone, the drive is all there is; with a maximum, that is the highest. Neither is beyond the table.
    let [full, beyond] = [SIZES.grid, SIZES.grid.next_up()];
    assert_eq!(taken(1, full, &[0.0]).unwrap().depth(), 1);
    assert_eq!(taken(2, 10.0, &[0.0, full]).unwrap().depth(), 2);
    assert_eq!(taken(1, beyond, &[0.0]).err(), Some(refused));
    assert_eq!(taken(2, 10.0, &[0.0, beyond]).err(), Some(refused));
    assert_eq!(taken(1, -0.1, &[0.0]).err(), Some(refused));
    // From none to more than there is room for.
    let full: Vec<f64> = (0..CAP).map(|k| if k % 2 == 0 { k as f64 } else { 100.0 - k as f64 }).collect();
    assert_eq!(taken(CAP as u64, 50.0, &full).unwrap().depth(), CAP);
    assert_eq!([0, CAP as u64 + 1].map(|len| taken(len, 50.0, &full).err()), [Some(0); 2]);
}

#[test]
fn a_way_to_a_set_point_reads_back_from_its_words_and_nothing_else_does() {
    let fresh = Approach::<f64>::new();
    let words = || Words::default().whole(&[2]).reals(6);
    every_word_counts(&fresh, words(), Approach::digest);
    whole_within(&restore(&fresh, &words().0).unwrap(), 0, 0, 2);
    axes_within(&restore(&fresh, &words().0).unwrap(), 1, SIZES.user);
    for stage in 0..3 {
        let mut words = words().0;
        words[0] = stage;
        assert_eq!(restore(&fresh, &words).unwrap().is_done(), stage == 0);
    }
}

#[test]
fn pieces_of_a_state_make_the_whole() {
    fn show(words: &mut impl specgen_runtime::snapshot::WordSink) {
        words.put(9);
        let Ok(()) = words.numbers(&[1.0_f64, 2.0, 3.0], 1.0);
        let Ok(()) = words.stored(&[5.0_f32, 6.0, 7.0, 8.0], 2, 1.0);
        words.put(1);
    }
    let mut whole = [GARBAGE; 9];
    show(&mut Writer::new(&mut whole));
    for length in 1..=10 {
        let mut found = Vec::new();
        for first in (0..whole.len()).step_by(length) {
            let mut piece = vec![GARBAGE; length.min(whole.len() - first)];
            show(&mut StatePart::new(&mut piece, first));
            found.extend(piece);
        }
        assert_eq!(found, whole, "in pieces of {length}");
    }
}

#[test]
fn a_writer_keeps_what_fits_and_counts_all() {
    let mut words = [GARBAGE; 5];
    let mut writer = Writer::new(&mut words);
    writer.word(9);
    writer.flag(true);
    writer.reals(&[1.0_f32, 2.0]);
    // No part of what does not fit.
    writer.reals(&[3.0_f64, 4.0]);
    writer.first_reals(&[5.0_f64, 6.0], 1);
    writer.real(7.0_f64);
    assert_eq!(writer.count(), 9);
    assert_eq!(words, [9, 1, 1.0_f32.to_bits().into(), 2.0_f32.to_bits().into(), GARBAGE]);
    for count in 0..=30 {
        let (mut words, values) = ([GARBAGE; 31], [1.5_f64; 30]);
        let mut writer = Writer::new(&mut words);
        writer.first_reals(&values, count);
        assert_eq!(writer.count(), 30);
        let expected: Vec<u64> = (0..30).map(|k| if k < count { 1.5_f64.to_bits() } else { 0 }).collect();
        assert_eq!((&words[..30], words[30]), (&expected[..], GARBAGE), "{count}");
    }
}

#[test]
fn a_reader_takes_what_is_asked_for_and_names_what_is_not() {
    let half = u64::from(0.5_f32.to_bits());
    let words = [7, 7, 1, 2, u64::from(u32::MAX), 1 << 32, half, half | 1 << 40, 3, 0];
    let mut reader = Reader::new(&words);
    assert_eq!(reader.sizes(), Sizes::ANY);
    assert_eq!(reader.refused(), InvalidState { word: 0 });
    assert_eq!((reader.word(7), reader.word(6)), (Ok(7), Err(InvalidState { word: 1 })));
    assert_eq!((reader.flag(), reader.flag()), (Ok(true), Err(InvalidState { word: 3 })));
    assert_eq!((reader.counter(), reader.counter()), (Ok(u32::MAX), Err(InvalidState { word: 5 })));
    assert_eq!((reader.real::<f32>(0.5), reader.real::<f32>(1.0)), (Ok(0.5), Err(InvalidState { word: 7 })));
    assert_eq!((reader.count_to(3), reader.count_to(-1)), (Ok(3), Ok(0)));
    assert_eq!((reader.count(), reader.refused()), (10, InvalidState { word: 9 }));
    assert_eq!((reader.flag(), reader.count()), (Err(InvalidState { word: 10 }), 11));
    assert_eq!(Reader::new(&words).within(SIZES).sizes(), SIZES);
    assert_eq!([6, 0, -1].map(|most| Reader::new(&words).count_to(most)), [Err(InvalidState { word: 0 }); 3]);
}
