//! Output lines against a few lines that know nothing of how the kernel counts: every position by itself, with a side and a flag.

use crate::common::Random;
use specgen_runtime::Real;
use specgen_runtime::trigger::{Direction, HIGH, Kind, Line, MISSED, Observation, OutputLines as _, Triggers, lines};

/// Positions of a line, each below or above the pose, armed or not.
struct Oracle<T: Real> {
    line: Line<T>,
    positions: Vec<(T, bool, bool)>,
    high: i32,
    missed: i32,
}

impl<T: Real> Oracle<T> {
    fn new(line: Line<T>, x: T) -> Self {
        let count = ((line.stop - line.start) / line.step + T::HALF).truncate() + 1;
        let at = |k| line.start + T::from_i32(k) * line.step;
        let far = |p: T| x >= p + line.hysteresis || x <= p - line.hysteresis;
        Self { line, positions: (0..count).map(|k| (at(k), x >= at(k), far(at(k)))).collect(), high: 0, missed: 0 }
    }

    /// Whether the line is high.
    fn tick(&mut self, x: T) -> bool {
        let h = self.line.hysteresis;
        let mut passed = 0;
        for (p, above, armed) in &mut self.positions {
            if !*armed && (x >= *p + h || x <= *p - h) {
                (*armed, *above) = (true, x > *p);
            }
            let crosses = if *above { x <= *p } else { x >= *p };
            if *armed && crosses {
                *armed = x >= *p + h || x <= *p - h;
                *above = !*above;
                passed += i32::from(match self.line.direction {
                    Direction::Both => true,
                    Direction::Up => *above,
                    Direction::Down => !*above,
                });
            }
        }
        let was_high = self.high > 0;
        self.high -= i32::from(was_high);
        if passed > 0 {
            self.missed += passed - i32::from(!was_high);
            self.high = if was_high { self.high } else { self.line.width };
        }
        self.high > 0
    }
}

fn seen<T: Real>(pose: &[T; 6]) -> Observation<'_, T> {
    Observation { pose, moves: false, streams: false, sequence: 0 }
}

fn position<T: Real>([start, stop, step, hysteresis]: [f64; 4], direction: Direction, width: i32) -> Line<T> {
    let [start, stop, step, hysteresis] = [start, stop, step, hysteresis].map(T::from_f64);
    Line { kind: Kind::Position, direction, start, stop, step, hysteresis, width, ..Line::new() }
}

/// A pose that goes to and fro with noise, and now and then jumps; pulses given.
fn walks<T: Real + std::fmt::Debug>(seed: u64) -> [i32; 2] {
    let mut random = Random(seed);
    let mut draw = |most: f64| (random.unit() * 2.0 - 1.0) * most;
    let (mut pulses, mut missed) = (0, 0);
    for direction in [Direction::Both, Direction::Up, Direction::Down] {
        for width in [1, 3] {
            let line = position::<T>([-8e-6, 7.2e-6, 0.5e-6, 40e-9], direction, width);
            let (mut place, mut speed) = (draw(1e-5), 0.0);
            let mut triggers = Triggers::<T, 1>::new();
            let mut oracle = None;
            let mut before = 0;
            for tick in 0..60_000 {
                if tick % 700 == 0 {
                    speed = draw(120e-9);
                }
                place += speed + if tick % 5000 == 4999 { draw(5e-6) } else { 0.0 };
                if place.abs() > 1e-5 {
                    speed = -speed;
                }
                let x = T::from_f64(place + draw(12e-9));
                let status = triggers.tick(&[line], &seen(&[x, T::ZERO, T::ZERO, T::ZERO, T::ZERO, T::ZERO]));
                let oracle = oracle.get_or_insert_with(|| Oracle::new(line, x));
                let wanted = oracle.tick(x);
                assert_eq!(lines(status), u32::from(wanted), "{direction:?}, width {width}, tick {tick}");
                assert_eq!(triggers.missed(), oracle.missed as u64, "{direction:?}, width {width}, tick {tick}");
                assert_eq!(status & MISSED != 0, oracle.missed > 0);
                pulses += i32::from(lines(status) > before);
                before = lines(status);
            }
            missed += oracle.map_or(0, |oracle| oracle.missed);
        }
    }
    [pulses, missed]
}

#[test]
fn positions_are_passed_in_the_ticks_of_a_count_of_each_by_itself() {
    for [pulses, missed] in [walks::<f64>(1), walks::<f32>(2)] {
        println!("{pulses} pulses, {missed} missed");
        assert!(pulses > 1000 && missed > 50);
    }
}

#[test]
fn noise_at_a_position_gives_one_pulse_and_a_return_beyond_the_hysteresis_another() {
    let line = position::<f64>([0.0, 1e-5, 1e-6, 50e-9], Direction::Both, 1);
    let mut triggers = Triggers::<f64, 1>::new();
    let mut random = Random(7);
    let mut ticks = Vec::new();
    for tick in 0..4000 {
        let noise = (random.unit() - 0.5) * 20e-9;
        let place = [0.5e-6, 1e-6, 0.9e-6, 1e-6][tick / 1000];
        if lines(triggers.tick(&[line], &seen(&[place + noise, 0.0, 0.0, 0.0, 0.0, 0.0]))) == 1 {
            ticks.push(tick / 1000);
        }
    }
    // Upward, back over it while it is not armed, and upward again.
    assert_eq!(ticks, [1, 3]);
}

#[test]
fn levels_motion_points_and_ticks_show_what_they_say() {
    let level = Line { kind: Kind::Level, axis: 5, start: -1.0, stop: 1.0, hysteresis: 0.25, ..Line::<f64>::new() };
    let motion = Line { kind: Kind::Motion, ..Line::new() };
    let points = Line { kind: Kind::Points, first: 2, every: 3, last: 8, ..Line::new() };
    let ticks = Line { kind: Kind::Ticks, first: 3, every: 4, width: 2, ..Line::new() };
    let all = [level, motion, points, ticks];
    let mut triggers = Triggers::<f64, 4>::new();
    let mut shown = Vec::new();
    // Turn, and the counter of the stream; none: no stream.
    let course = [
        (-1.1, None),
        (-1.0, Some(5)),
        (-1.2, Some(6)),
        (-1.3, Some(6)),
        (1.1, Some(7)),
        (1.0, Some(8)),
        (1.25, Some(9)),
        (1.26, Some(10)),
        (0.0, Some(11)),
        (0.0, Some(12)),
        (0.0, Some(13)),
        (0.0, None),
        (0.0, Some(14)),
        (0.0, Some(15)),
    ];
    for (turn, sequence) in course {
        let pose = [0.0, 0.0, 0.0, 0.0, 0.0, turn];
        let (moves, streams) = (turn < 0.0, sequence.is_some());
        let status =
            triggers.tick(&all, &Observation { pose: &pose, moves, streams, sequence: sequence.unwrap_or_default() });
        shown.push(lines(status));
    }
    let line = |k: u32| shown.iter().map(|high| (high >> k & 1) as u8).collect::<Vec<_>>();
    assert_eq!(line(0), [0, 1, 1, 0, 0, 1, 1, 0, 1, 1, 1, 1, 1, 1]);
    assert_eq!(line(1), [1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    // The second, fifth and eighth set-point; counted anew after a pause.
    assert_eq!(line(2), [0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 1]);
    assert_eq!(line(3), [0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0]);
    assert_eq!((triggers.rest(), triggers.missed()), (0, 0));
}

#[test]
fn other_settings_begin_anew_low_and_a_line_that_is_too_slow_says_what_it_missed() {
    let slow = position::<f64>([0.0, 1e-5, 1e-6, 10e-9], Direction::Both, 30);
    let mut triggers = Triggers::<f64, 1>::new();
    let mut at = |line: Line<f64>, tick: usize| {
        let status = triggers.tick(&[line], &seen(&[tick as f64 * 1e-7 - 1e-6, 0.0, 0.0, 0.0, 0.0, 0.0]));
        (status, triggers.missed())
    };
    let shown: Vec<_> = (0..60).map(|tick| at(slow, tick)).collect();
    let rises = (1..60).filter(|tick| shown[*tick].0 & HIGH[0] > shown[tick - 1].0 & HIGH[0]).count();
    assert_eq!((rises, shown[59].1), (2, 3));
    assert_eq!(shown[59].0 & MISSED, MISSED);
    let quick = Line { width: 1, ..slow };
    assert_eq!(at(quick, 60), (0, 0));
    assert_eq!(at(Line { kind: Kind::Off, ..slow }, 61), (0, 0));
}
