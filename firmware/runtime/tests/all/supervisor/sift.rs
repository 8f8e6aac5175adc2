//! Samples against those before them: what is replaced, counted and a fault; any bits at all, against a sieve of its own text.

use specgen_runtime::supervisor::{Activity, Cause, Request, Sift, Supervision, Supervisor, WRONG};

const LEAP: f64 = 1e-6;
const RANGE: f64 = 50e-6;
const SUPERVISION: Supervision<f64> =
    Supervision { leap: [LEAP; 6], repeats: 3 * WRONG, arm_ticks: 20, ..super::SUPERVISION };

fn faults(words: &[f64; 6]) -> u32 {
    (0..6).fold(0, |bits, gauge| bits | u32::from(!(-RANGE..=RANGE).contains(&words[gauge])) << gauge)
}

/// One after the other from a seed; SplitMix64.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// Between −1 and 1.
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// A sieve and how it is called: what a tick gave the law, and the causes.
struct Bench {
    sift: Sift<f64>,
    dice: Dice,
    tick: u32,
}

impl Bench {
    /// Gauges that have shown their noise while the machine armed.
    fn noisy() -> Self {
        let mut bench = Self { sift: Sift::new(), dice: Dice(1), tick: 0 };
        for _ in 0..SUPERVISION.arm_ticks {
            let words = bench.good();
            assert_eq!(bench.step(words, Activity::Standing), (words, 0));
        }
        for _ in 0..10 {
            let words = bench.good();
            assert_eq!(bench.step(words, Activity::Moving), (words, 0));
        }
        assert!(bench.sift.quiet);
        bench
    }

    /// The next sample of six gauges in motion, with noise of a nanometre.
    fn good(&mut self) -> [f64; 6] {
        let along = f64::from(self.tick) * 0.1e-6;
        core::array::from_fn(|gauge| (gauge as f64 - 2.5) * along * 0.1 + 1e-9 * self.dice.unit())
    }

    fn step(&mut self, mut words: [f64; 6], activity: Activity) -> ([f64; 6], u32) {
        self.tick += 1;
        if activity == Activity::Oscillating {
            self.sift.look_closely();
        }
        if self.sift.accepts(&SUPERVISION, &words) {
            return (words, 0);
        }
        let lasted = self.sift.sift(&SUPERVISION, &mut words, faults, activity);
        (words, lasted)
    }
}

#[test]
fn one_word_that_leaps_is_replaced_by_the_line_through_those_before_and_counted() {
    for gauge in 0..6 {
        for leap in [1.1 * LEAP, -1.1 * LEAP, 20e-6, -20e-6] {
            let mut bench = Bench::noisy();
            let good = bench.good();
            let mut words = good;
            words[gauge] += leap;
            let (given, lasted) = bench.step(words, Activity::Moving);
            assert_eq!((lasted, bench.sift.replaced), (0, 1 << gauge));
            assert!((given[gauge] - good[gauge]).abs() < 5e-9, "{:e}", given[gauge] - good[gauge]);
            assert!((0..6).all(|other| other == gauge || given[other] == good[other]));
            let (of_gauge, cause) = (bench.sift.conditions() >> 22, bench.sift.conditions() & 0xffff);
            assert_eq!((of_gauge, cause), (1 << gauge, Cause::GaugeDisagreement.bit()));
            for _ in 0..4 {
                let words = bench.good();
                assert_eq!(bench.step(words, Activity::Moving), (words, 0));
                assert_eq!(bench.sift.conditions() | bench.sift.status(), 0);
            }
            assert!(bench.sift.quiet, "forgotten after four good ones");
        }
    }
    let mut bench = Bench::noisy();
    let mut words = bench.good();
    words[3] += 0.98 * LEAP;
    assert_eq!(bench.step(words, Activity::Moving), (words, 0), "a leap below the bound is motion");
}

/// What oscillates is not predicted by a straight line: the bound grows with it. A word that leaps well beyond the swing is replaced all the
/// same, and so is none of those behind it.
#[test]
fn an_oscillation_that_grows_is_not_replaced_and_a_leap_beyond_its_swing_is() {
    let (mut replaced, mut other) = (0, 0);
    for hertz in [300.0, 700.0, 1200.0, 2400.0, 4100.0] {
        let turn = std::f64::consts::TAU * hertz / 1e4;
        for spoiled in 20..200 {
            let mut bench = Bench::noisy();
            for tick in 0..200 {
                // Grows by the factor e in 6 ms.
                let amplitude = 0.1 * LEAP * (f64::from(tick) / 60.0).exp();
                let mut words = bench.good();
                words[2] += amplitude * f64::sin(turn * f64::from(tick));
                let good = words;
                // What it is off a straight line, at most.
                let largest = 1.05 * amplitude * 4.0 * f64::sin(0.5 * turn).powi(2);
                if tick == spoiled {
                    // Nor as near to the word before the last one.
                    let leap = 1.2 * (LEAP + 3.0 * largest) + 2.0 * amplitude * f64::sin(turn).abs();
                    words[2] += if tick % 2 == 0 { leap } else { -leap };
                }
                let (given, lasted) = bench.step(words, Activity::Oscillating);
                let found = bench.sift.replaced;
                assert_eq!(lasted, 0, "{hertz} Hz, spoiled {spoiled}, tick {tick}");
                if tick == spoiled {
                    assert_eq!(found, 4, "{hertz} Hz, tick {tick}");
                    let wrong = (given[2] - good[2]).abs();
                    assert!(wrong <= largest + 0.01 * LEAP, "{hertz} Hz, tick {tick}: {wrong:e} of {largest:e}");
                    replaced += 1;
                } else {
                    assert_eq!(found, 0, "{hertz} Hz, spoiled {spoiled}, tick {tick}");
                    other += 1;
                }
            }
        }
    }
    println!("{replaced} wrong samples in an oscillation replaced, none of {other} others");
    // Where nothing oscillates the same words are leaps.
    let mut bench = Bench::noisy();
    let mut words = bench.good();
    words[2] += 1.5 * LEAP;
    bench.step(words, Activity::Moving);
    assert_eq!(bench.sift.replaced, 4);
}

/// The swing is forgotten within a few ticks once it has ended, and goes on as long as words are off their predictions by more than the bound.
#[test]
fn the_bound_falls_back_once_the_swing_has_ended() {
    let mut bench = Bench::noisy();
    let swings = |tick: u32| 3.0 * LEAP * (f64::from(tick) / 100.0).min(1.0) * f64::sin(1.9 * f64::from(tick));
    for tick in 0..400 {
        let mut words = bench.good();
        words[1] += swings(tick);
        // What is counted as an oscillation may have become explained, and still be there.
        let activity = if tick < 200 { Activity::Oscillating } else { Activity::Moving };
        assert_eq!(bench.step(words, activity), (words, 0), "tick {tick}");
    }
    assert!(bench.sift.swing > 3.0 && !bench.sift.quiet, "{:?}", bench.sift.swing);
    let mut after = 0;
    while !bench.sift.quiet {
        let words = bench.good();
        bench.step(words, Activity::Moving);
        after += 1;
        assert!(after < 100, "{:?}", bench.sift.swing);
    }
    assert_eq!(bench.sift.swing, 0.0);
    let mut words = bench.good();
    words[1] += 1.1 * LEAP;
    bench.step(words, Activity::Moving);
    assert_eq!(bench.sift.replaced, 2);
}

/// Ticks until a fault where the samples are spoiled so.
fn lasts(spoil: impl Fn(u32, &mut [f64; 6], &[[f64; 6]; 2])) -> Option<(u32, u32)> {
    let mut bench = Bench::noisy();
    let mut before = [[0.0; 6]; 2];
    (0..1000).find_map(|tick| {
        let mut words = bench.good();
        spoil(tick, &mut words, &before);
        before = [words, before[0]];
        let (_, lasted) = bench.step(words, Activity::Moving);
        (lasted != 0).then_some((tick, lasted))
    })
}

/// A leap just below the bound passes. The good word behind it is twice as far from the line through it, and is not replaced for that.
#[test]
fn a_leap_below_the_bound_makes_no_good_word_suspect() {
    for part in [0.4, 0.6, 0.97, -0.6, -0.97] {
        let mut bench = Bench::noisy();
        let mut words = bench.good();
        words[1] += part * LEAP;
        assert_eq!(bench.step(words, Activity::Moving), (words, 0));
        for _ in 0..20 {
            let words = bench.good();
            assert_eq!(bench.step(words, Activity::Moving), (words, 0), "{part}");
            assert_eq!(bench.sift.conditions(), 0);
        }
        assert!(bench.sift.quiet);
    }
}

/// The gauge has another zero from one tick on: what it shows is not taken for the place of the platform, however little beyond the bound.
#[test]
fn a_gauge_that_stays_away_is_a_fault_in_the_third_tick() {
    for part in [1.1, 2.0, 2.9, 9.0] {
        assert_eq!(lasts(|_, words, _| words[5] += part * LEAP), Some((2, Cause::GaugeDisagreement.bit())), "{part}");
    }
}

#[test]
fn what_goes_on_is_a_fault_and_what_is_rare_is_not() {
    let leaps = |every: u32| lasts(move |tick, words, _| words[2] += if tick % every == 0 { 9e-6 } else { 0.0 });
    let disagree = Cause::GaugeDisagreement.bit();
    assert_eq!(leaps(1), Some((2, disagree)));
    let steadily = |every| leaps(every).filter(|(ticks, cause)| *ticks < 40 && *cause == disagree).is_some();
    assert!(steadily(2) && steadily(3) && steadily(4));
    assert_eq!([leaps(5), leaps(50)], [None; 2]);
    let stuck = Cause::GaugeStuck.bit();
    let stale = |every: u32, of: usize| {
        lasts(move |tick, words, before| {
            if tick > 1 && tick % every == 0 {
                *words = before[of];
            }
        })
    };
    assert_eq!(
        lasts(|tick, words, before| if tick > 0 {
            *words = before[0]
        }),
        Some((3, stuck))
    );
    assert!(stale(2, 0).is_some_and(|(ticks, cause)| ticks < 20 && cause == stuck), "{:?}", stale(2, 0));
    assert!(stale(2, 1).is_some_and(|(ticks, cause)| ticks < 20 && cause == stuck), "one of two buffers is dead");
    assert_eq!(stale(50, 0), None);
    let one_gauge = lasts(|tick, words, before| {
        if tick > 0 {
            words[0] = before[0][0]
        }
    });
    assert!(one_gauge.is_none_or(|(_, cause)| cause == disagree), "one gauge is the watch's");
}

#[test]
fn gauges_that_show_no_noise_are_not_called_stale() {
    let mut bench = Bench { sift: Sift::new(), dice: Dice(1), tick: 0 };
    for tick in 0..500 {
        let activity = if tick < 20 { Activity::Standing } else { Activity::Moving };
        assert_eq!(bench.step([1e-6; 6], activity), ([1e-6; 6], 0));
        assert_eq!(bench.sift.conditions(), 0);
    }
}

#[test]
fn samples_that_the_law_does_not_believe_are_left_to_it_and_the_next_one_is_not_taken_for_a_leap() {
    for missing in 1..=6 {
        let mut bench = Bench::noisy();
        for _ in 0..missing {
            let mut words = bench.good();
            words[4] = f64::NAN;
            let (given, lasted) = bench.step(words, Activity::Moving);
            assert!(given[4].is_nan() && lasted == 0 && bench.sift.replaced == 0);
        }
        for _ in 0..4 {
            let words = bench.good();
            assert_eq!(bench.step(words, Activity::Moving), (words, 0), "after {missing}");
        }
        let mut words = bench.good();
        words[4] += 9e-6;
        assert_ne!(bench.step(words, Activity::Moving).0, words, "and leaps are looked for again");
    }
}

/// A word that is just out of range is as near to the line as one within: the law refuses it, and it is not remembered.
#[test]
fn a_word_that_the_law_refuses_is_not_remembered_however_near_it_is() {
    let mut bench = Bench::noisy();
    for shift in [49.6e-6, 50.4e-6] {
        bench.sift.samples.iter_mut().for_each(|words| words[0] = 49.6e-6);
        let mut words = bench.good();
        words[0] = shift;
        assert_eq!(bench.step(words, Activity::Moving), (words, 0));
    }
    assert!(faults(&bench.sift.samples[bench.sift.newer]) != 0, "it was let pass");
    bench.sift.forget();
    assert!(bench.sift.samples.iter().all(|words| faults(words) == 0) && !bench.sift.quiet && bench.sift.known == 0);
    let words = bench.good();
    assert_eq!(bench.step(words, Activity::Moving), (words, 0));
    bench.sift.forget();
    assert_eq!(bench.sift.known, 1, "what was sifted needs no forgetting");
}

fn widened(swing: f64) -> f64 {
    swing.max((3.0 * swing).min(64.0))
}

/// The same text as the sieve's first comment, in numbers that are kept in a list.
#[derive(Default)]
struct Oracle {
    /// Samples as they came.
    came: Vec<[u64; 6]>,
    /// Samples taken, and how many of the last were predicted.
    history: Vec<[f64; 6]>,
    predicted: u32,
    leapt: u32,
    stale: u32,
    swing: f64,
}

impl Oracle {
    fn step(&mut self, words: &mut [f64; 6], oscillates: bool) -> (u32, bool, u32) {
        let count = self.history.len();
        let history = self.history.clone();
        let at = |back: usize| history[count - back];
        let bits = words.map(f64::to_bits);
        let believed = faults(words) == 0;
        // A missing sample is no repeated one, whatever its bits.
        let repeated = believed && self.came.iter().rev().take(2).any(|before| *before == bits);
        self.came.push(bits);
        let line = |gauge: usize| {
            let [a, b] = [1, 2].map(|back| at(back)[gauge]);
            a + a - b
        };
        let prediction = (count >= 2).then(|| core::array::from_fn(line)).filter(|line| faults(line) == 0);
        let prediction: Option<[f64; 6]> = prediction.or_else(|| self.history.last().copied());
        let mut replaced = 0;
        let raw = *words;
        self.swing -= self.swing / 16.0;
        if believed && count >= 2 {
            let mut swings = self.swing;
            let wide = f64::from([1, 3, 6, 10][self.predicted as usize]);
            for (gauge, word) in words.iter_mut().enumerate() {
                let (predicted, before) = (prediction.unwrap()[gauge], at(2)[gauge]);
                let (off, swing) = ((*word - predicted).abs(), self.swing);
                if off <= LEAP * ((1.0 + 2.0 * swing) * wide) {
                    if self.predicted == 0 && (oscillates || swing != 0.0 && off > LEAP) {
                        swings = swings.max(off / LEAP);
                    }
                } else {
                    if (*word - before).abs() > LEAP {
                        *word = predicted;
                        replaced |= 1 << gauge;
                    } else {
                        self.history[count - 1][gauge] = (*word + before) * 0.5;
                    }
                }
            }
            self.swing = if replaced == 0 { swings } else { widened(swings) };
        }
        let wrong = !believed || repeated;
        if wrong && (count < 2 || self.predicted == 3) {
            self.history.clear();
            if believed {
                self.history.push(if count < 2 { raw } else { *words });
            }
            self.predicted = 0;
        } else {
            if wrong {
                self.swing = widened(self.swing);
            }
            self.history.push(if wrong { prediction.unwrap() } else { *words });
            self.predicted = if wrong { self.predicted + 1 } else { 0 };
        }
        let leaky = |count: u32, wrong: bool| if wrong { (count + WRONG).min(12) } else { count.saturating_sub(1) };
        (self.leapt, self.stale) = (leaky(self.leapt, replaced != 0), leaky(self.stale, repeated));
        let mut lasted = 0;
        if replaced != 0 && self.leapt == 12 {
            lasted |= Cause::GaugeDisagreement.bit();
            self.history.clear();
        }
        if repeated && self.stale == 12 {
            lasted |= Cause::GaugeStuck.bit();
        }
        (replaced, repeated, lasted)
    }
}

/// Any bits, leaps of every size, repeats and gaps: the sieve does what the oracle does, bit for bit, and remembers only what is
/// believed.
#[test]
fn hostile_samples_are_sifted_as_by_the_oracle_and_nothing_that_is_not_believed_is_remembered() {
    let mut dice = Dice(46);
    let (mut of_kind, mut faulted) = ([0_u32; 4], 0);
    for _ in 0..2000 {
        let mut sift = Sift { noise: 3 * SUPERVISION.arm_ticks, ..Sift::new() };
        let mut oracle = Oracle::default();
        let mut last = [[0.0; 6]; 2];
        let rate = 1 + dice.next() % 20;
        for tick in 0..300 {
            let along = f64::from(tick) * 0.15e-6;
            let mut words: [f64; 6] = core::array::from_fn(|_| along + 20e-9 * dice.unit());
            if dice.next() % rate == 0 {
                let gauge = (dice.next() % 6) as usize;
                match dice.next() % 8 {
                    0 => words[gauge] = f64::from_bits(dice.next()),
                    1 => words = last[(dice.next() & 1) as usize],
                    2 => words = core::array::from_fn(|_| f64::from_bits(dice.next())),
                    3 => words[gauge] = [f64::NAN, f64::INFINITY, f64::MAX, -f64::MAX, -0.0, 5e-324][gauge],
                    4 => words = core::array::from_fn(|_| RANGE * dice.unit()),
                    _ => words[gauge] += 2f64.powi((dice.next() % 12) as i32) * 20e-9 * dice.unit(),
                }
            }
            last = [words, last[0]];
            let (mut given, mut expected) = (words, words);
            let oscillates = tick % 100 > 60;
            let activity = if oscillates { Activity::Oscillating } else { Activity::Moving };
            let lasted = if !oscillates && sift.accepts(&SUPERVISION, &words) {
                0
            } else {
                sift.sift(&SUPERVISION, &mut given, faults, activity)
            };
            let of_oracle = oracle.step(&mut expected, oscillates);
            if sift.quiet {
                // Too little is left to matter.
                assert!(oracle.swing <= 1.0 / 16.0);
                oracle.swing = 0.0;
            }
            let (replaced, repeated) = if sift.quiet { (0, false) } else { (sift.replaced, sift.repeated) };
            assert_eq!((replaced, repeated, lasted), of_oracle, "tick {tick}: {words:?}");
            assert_eq!(given.map(f64::to_bits), expected.map(f64::to_bits), "tick {tick}");
            let remembered = &sift.samples[..];
            assert!(remembered.iter().all(|words| faults(words) == 0), "tick {tick}: {remembered:?}");
            assert!(faults(&given) & !faults(&words) == 0, "no word is spoiled");
            of_kind[0] += u32::from(replaced != 0);
            of_kind[1] += u32::from(repeated);
            of_kind[2] += u32::from(faults(&words) != 0);
            of_kind[3] += u32::from(sift.quiet);
            faulted += u32::from(lasted != 0);
        }
    }
    println!("replaced, repeated, not believed, quiet: {of_kind:?} of 600000; faults {faulted}");
    assert!(of_kind.iter().all(|count| *count > 5000) && faulted > 500, "{of_kind:?} {faulted}");
}

/// Six words that leap from tick to tick, in phases with and without power.
#[test]
fn nothing_is_sifted_without_power_and_a_fault_ramps_down_in_the_tick_of_the_third() {
    let supervision = Supervision { arm_ticks: 4, ..SUPERVISION };
    let mut supervisor = Supervisor::new();
    let mut dice = Dice(3);
    let mut tick = |supervisor: &mut Supervisor<f64>, request, leap: f64| {
        let mut words: [f64; 6] = core::array::from_fn(|_| leap + 1e-9 * dice.unit());
        if !supervisor.accepts(&supervision, &words) {
            supervisor.sift(&supervision, &mut words, faults);
        }
        supervisor.decide(&supervision, request, 0, false);
        (supervisor.phase, supervisor.conditions, words[0])
    };
    for leap in [0.0, 30e-6, -30e-6] {
        let (_, conditions, word) = tick(&mut supervisor, Request::None, leap);
        assert!(conditions == 0 && (word - leap).abs() < 2e-9);
    }
    supervisor.decide(&supervision, Request::None, 0, true);
    supervisor.decide(&supervision, Request::Arm, 0, true);
    use specgen_runtime::supervisor::Phase;
    assert_eq!(supervisor.phase, Phase::Arming);
    for _ in 0..10 {
        assert_eq!(tick(&mut supervisor, Request::Run, 0.0).1, 0);
    }
    assert_eq!(supervisor.phase, Phase::Running);
    for (count, phase) in [(1, Phase::Running), (2, Phase::Running), (3, Phase::RampingDown)] {
        let (now, conditions, word) = tick(&mut supervisor, Request::Run, 30e-6);
        assert_eq!((now, conditions), (phase, Cause::GaugeDisagreement.bit() | 0x3f << 16 | 0x3f << 22), "{count}");
        assert!(word.abs() < 50e-9, "{word:e}");
    }
    assert_eq!(supervisor.cause, Cause::GaugeDisagreement);
    assert_eq!(tick(&mut supervisor, Request::Run, 30e-6).1, 0, "from here on as they come");
}
