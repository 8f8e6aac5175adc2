//! The wiring check: before feedback is allowed, each leg in turn makes a small pulse. The response of the gauges is
//! compared with the Jacobian.
//!
//! ```text
//! one leg    u = (1 − cos θ)/2 of the pulse, θ once around; of every gauge the part along u, beside the way of u (hysteresis),
//!            a constant, a drift and the mains: a weight for each sample, known before          → a column of the response Y
//! all legs   Y ≈ diag(a) S diag(b): S readings per leg displacement, a gains of the gauges, b of the legs
//! ```
//! A gauge or leg whose gain leaves its range is named. If no gains explain the response, the check tries one inverted
//! gauge, or two swapped gauges or legs, and names the best explanation. The response is in units of the spec's
//! displacement of a leg at the pulse, so b is the gain of small motions over the spec's. A common factor of all gauges
//! cannot be distinguished; it is in b.

use core::fmt;

use super::oscillation::Fallback;
use crate::linear::component;
use crate::real::{Real, saturate};
use crate::snapshot::LARGEST;

/// Readings of the gauges (rows) per displacement of the legs (columns).
pub type Response<T> = [[T; 6]; 6];

crate::constants::constants! {
    ($) wiring_fields;
    /// Constants of the check; from `supervisor.wiring_check`.
    pub struct Wiring<T> {
        /// Ticks per leg, ≥ 8.
        pub ticks: u32,
        /// Height of the pulse, codes; negative if there is no room above rest.
        pub height: i32,
        /// Rotation per tick as cosine and sine: of the pulse, then of the mains.
        pub turn: [[T; 2]; 2],
        /// Phase lag of the readings at the pulse, as cosine and sine.
        pub lag: [T; 2],
        /// Weights of u, of its displacement, of a constant, of the time (0 to 1), of the mains' cosine and sine. Their sum
        /// is the weight of a sample.
        pub weights: [T; 6],
        /// Unit of each leg's response: one over the spec's displacement of the leg at the pulse, 1/m.
        pub per_metre: [T; 6],
        /// Lowest and highest gain of a gauge over the median of all.
        pub gauge_gain: [T; 2],
        /// Lowest and highest gain of a leg over the mean of the five others; none if the legs differ by an unknown amount.
        pub leg_gain: Option<[T; 2]>,
        /// Largest part of the response that may remain unexplained by gains, squared.
        pub residual: T,
    }
}

/// A leg or gauge with a smaller gain is dead. Creep and hysteresis leave at least half of the gain.
const DEAD: f64 = 0.16;
/// Range of gauge gains in the fit.
const GAUGE: [f64; 2] = [0.05, 8.0];
/// Iterations of the fit, one a tick. On the reference platform, a gain of 2 is found as at least 1.8.
const ROUNDS: u32 = 8;
/// Trials beyond gains: six inverted gauges, fifteen pairs of gauges, fifteen pairs of legs.
const TRIALS: u32 = 36;
/// Ticks of all trials.
const TRIED: u32 = (TRIALS + 1) * ROUNDS;

/// Fault of one gauge or one leg.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Wrong direction.
    Inverted,
    /// No response.
    Dead,
    /// Swapped with that one.
    Swapped(u32),
    /// Wrong gain, in hundredths of the right one.
    Gain(u32),
}

/// Finding of a check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Finding {
    /// No fault, or no check was made.
    None,
    /// One gauge (0 to 5).
    Gauge(u32, Fault),
    /// One leg (0 to 5).
    Leg(u32, Fault),
    /// No gauge shows any leg.
    Nothing,
    /// All gauges or all legs have the wrong direction.
    Inverted,
    /// Common gain of all legs or all gauges, in hundredths of the right one.
    Common(u32),
    /// No single fault explains the response, and a repeated check did not help.
    Unexplained,
    /// The limits of the codes leave no room for the pulse.
    NoRoom,
    /// The step limit of a tick is too small for the pulse.
    TooSlow,
    /// Not a finding of the check: the law's fallback stage, for an oscillation.
    Fallback(Fallback),
}

const UNEXPLAINED: u32 = 0x7fff;
const NO_ROOM: u32 = 0x7ffe;
const NOTHING: u32 = 0x7ffd;
const INVERTED: u32 = 0x7ffc;
const TOO_SLOW: u32 = 0x7ffb;
/// Plus a gain, hundredths.
const COMMON: u32 = 0x6000;
/// Plus a stage, 0 to 2.
const FALLBACK: u32 = 0x7ff0;
const SUBJECTS: u32 = 12;
const FIRST_GAIN: u32 = 8;
/// Largest gain in a word, hundredths.
const LARGEST_GAIN: u32 = 2000;
const LARGEST_COMMON: u32 = COMMON + LARGEST_GAIN;

const fn bounded(gain: u32) -> u32 {
    if gain > LARGEST_GAIN { LARGEST_GAIN } else { gain }
}

impl Finding {
    /// Bits that a word takes.
    pub const BITS: u32 = 15;

    /// As a word of [`Finding::BITS`] bits; 0 is none.
    #[must_use]
    pub const fn word(self) -> u32 {
        let (subject, fault) = match self {
            Self::None => return 0,
            Self::Nothing => return NOTHING,
            Self::Unexplained => return UNEXPLAINED,
            Self::NoRoom => return NO_ROOM,
            Self::TooSlow => return TOO_SLOW,
            Self::Inverted => return INVERTED,
            Self::Common(gain) => return COMMON + bounded(gain),
            Self::Fallback(Fallback::None) => return 0,
            Self::Fallback(stage) => return FALLBACK + stage.word() as u32,
            Self::Gauge(gauge, fault) => (gauge, fault),
            Self::Leg(leg, fault) => (6 + leg, fault),
        };
        let kind = match fault {
            Fault::Inverted => 0,
            Fault::Dead => 1,
            Fault::Swapped(other) => 2 + other,
            Fault::Gain(gain) => FIRST_GAIN + bounded(gain),
        };
        1 + subject + SUBJECTS * kind
    }

    /// The inverse of [`Finding::word`]; an unknown word means unexplained.
    #[must_use]
    pub const fn of_word(word: u32) -> Self {
        match word {
            0 => return Self::None,
            NOTHING => return Self::Nothing,
            NO_ROOM => return Self::NoRoom,
            TOO_SLOW => return Self::TooSlow,
            INVERTED => return Self::Inverted,
            COMMON..=LARGEST_COMMON => return Self::Common(word - COMMON),
            _ => {}
        }
        if word > FALLBACK {
            if let Some(stage) = Fallback::from_word((word - FALLBACK) as u64) {
                return Self::Fallback(stage);
            }
        }
        let (subject, kind) = ((word - 1) % SUBJECTS, (word - 1) / SUBJECTS);
        let fault = match kind {
            0 => Fault::Inverted,
            1 => Fault::Dead,
            2..FIRST_GAIN => Fault::Swapped(kind - 2),
            _ if kind - FIRST_GAIN > LARGEST_GAIN => return Self::Unexplained,
            _ => Fault::Gain(kind - FIRST_GAIN),
        };
        if subject < 6 { Self::Gauge(subject, fault) } else { Self::Leg(subject - 6, fault) }
    }
}

impl Finding {
    /// Whether `word` is the same fault. Gains compare by too small or too large.
    fn is_like(self, word: u32) -> bool {
        let less = |gain: u32| gain < 100;
        match (self, Self::of_word(word)) {
            (Self::Gauge(a, Fault::Gain(one)), Self::Gauge(b, Fault::Gain(two)))
            | (Self::Leg(a, Fault::Gain(one)), Self::Leg(b, Fault::Gain(two))) => a == b && less(one) == less(two),
            (one, two) => one == two,
        }
    }
}

/// Text for messages; empty for no finding. Inlined, so that no controller links the formatting code.
impl fmt::Display for Finding {
    #[inline]
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, place, fault) = match self {
            Self::None => return Ok(()),
            Self::Nothing => return f.write_str("no gauge shows any leg"),
            Self::Inverted => return f.write_str("all gauges or all legs inverted"),
            Self::Common(gain) => {
                return write!(f, "all legs or all gauges gain × {}.{:02}", gain / 100, gain % 100);
            }
            Self::Unexplained => return f.write_str("more than one fault of gauges or legs, or vibration"),
            Self::NoRoom => return f.write_str("the code limits leave no room for the pulse"),
            Self::TooSlow => return f.write_str("the limit max_step_codes is too small for the pulse"),
            Self::Fallback(stage) => return f.write_str(stage.name()),
            Self::Gauge(gauge, fault) => ("gauge", gauge, fault),
            Self::Leg(leg, fault) => ("leg", leg, fault),
        };
        match fault {
            Fault::Inverted => write!(f, "{what} {place} inverted"),
            Fault::Dead => write!(f, "{what} {place} dead"),
            Fault::Swapped(other) => write!(f, "{what} {place} swapped with {what} {other}"),
            Fault::Gain(gain) => write!(f, "{what} {place} gain × {}.{:02}", gain / 100, gain % 100),
        }
    }
}

/// A finding and its alternatives, as text. On a geometry with these sets of equivalent faults, the alternatives have
/// the same response.
#[derive(Debug, Clone, Copy)]
pub struct FindingText<'a, S>(pub Finding, pub &'a [S]);

impl<S: AsRef<[u32]>> fmt::Display for FindingText<'_, S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(finding, alike) = self;
        fmt::Display::fmt(finding, f)?;
        for other in
            alike.iter().map(AsRef::as_ref).filter(|set| set.iter().any(|word| finding.is_like(*word))).flatten()
        {
            if !finding.is_like(*other) {
                write!(f, ", or {}", Self::of_gain(*finding, Finding::of_word(*other)))?;
            }
        }
        Ok(())
    }
}

impl<S> FindingText<'_, S> {
    /// An alternative, with the gain that was found.
    fn of_gain(finding: Finding, other: Finding) -> Finding {
        match (finding, other) {
            (
                Finding::Gauge(_, gain @ Fault::Gain(_)) | Finding::Leg(_, gain @ Fault::Gain(_)),
                Finding::Gauge(gauge, _),
            ) => Finding::Gauge(gauge, gain),
            (
                Finding::Gauge(_, gain @ Fault::Gain(_)) | Finding::Leg(_, gain @ Fault::Gain(_)),
                Finding::Leg(leg, _),
            ) => Finding::Leg(leg, gain),
            _ => other,
        }
    }
}

crate::state! { |words|
    /// A check under way.
    pub struct Check<T>[T: Real] {
        /// The leg that moves, 0 to 5; 6 while the response is evaluated.
        pub leg: usize = 0, place(6);
        /// Completed ticks of this leg, or iterations of all trials.
        pub tick: u32 = 0, tally;
        /// Cosine and sine of θ, then of the mains.
        pub turned: [[T; 2]; 2] = [[T::ONE, T::ZERO]; 2], rows(2.0);
        /// Response of the gauges (rows) to each leg (columns), in units of the spec's displacement of a leg at the
        /// pulse.
        pub response: Response<T> = [[T::ZERO; 6]; 6], rows(LARGEST);
        /// Gauge gains after the last iteration of a trial.
        pub gauges: [T; 6] = [T::ONE; 6], numbers(GAUGE[1]);
        /// Smallest residual of a trial so far.
        pub least: T = T::ONE, number(2.0);
        /// Word of the finding of that trial; after the check, of the check.
        pub finding: u32 = 0, tally;
        /// It is over.
        pub done: bool = false, set;
    }
}

impl<T> Wiring<T> {
    /// Whether codes limited to this change per tick can follow the pulse, whose steepest step is π/ticks of its
    /// height.
    #[must_use]
    pub(super) fn can_follow(&self, max_step: i32) -> bool {
        let steepest = (i64::from(self.height).abs() - 1) * 355;
        steepest <= i64::from(max_step) * i64::from(self.ticks) * 113
    }
}

impl<T: Real> Check<T> {
    /// Offset of a leg from rest, codes.
    #[inline]
    #[must_use]
    pub fn pulse(&self, wiring: &Wiring<T>, leg: usize) -> i32 {
        if leg != self.leg || self.done {
            return 0;
        }
        let height = (T::ONE - self.turned[0][0]) * T::HALF * T::from_i32(wiring.height);
        if wiring.height < 0 { (height - T::HALF).truncate() } else { (height + T::HALF).truncate() }
    }

    /// Takes the readings (m, finite) of a tick, or continues the evaluation. `expected`: readings per leg
    /// displacement. `since`: ticks since the first check began. The check is repeated while nothing explains the
    /// response, because vibration may have hidden the pulse.
    #[cold]
    #[inline(never)]
    pub fn tick(&mut self, wiring: &Wiring<T>, expected: &Response<T>, readings: &[T; 6], since: u32) {
        if self.done {
            return;
        }
        let whole = TRIED.saturating_add(wiring.ticks.saturating_mul(6));
        if self.leg < 6 {
            self.sample(wiring, readings);
        } else if self.tick < TRIED {
            // The second check ends before this, the third after it.
            self.judge(wiring, expected, since / 5 >= whole / 2);
        } else {
            // Pauses differ, so that each check meets another phase of the vibration.
            let pause = if since / 3 >= whole / 2 { wiring.ticks / 2 } else { wiring.ticks / 4 };
            self.tick = self.tick.saturating_add(1);
            if self.tick >= TRIED.saturating_add(pause) {
                *self = Self::new();
            }
        }
    }

    fn sample(&mut self, wiring: &Wiring<T>, readings: &[T; 6]) {
        let leg = if self.leg < 6 { self.leg } else { 0 };
        let [pulse, mains] = &mut self.turned;
        let [cosine, sine] = rotated(*pulse, wiring.lag);
        let along = (T::ONE - cosine) * T::HALF;
        let way = if sine < T::ZERO { T::ONE + T::ONE - along } else { along };
        let time = T::from_i32(self.tick as i32) / T::from_i32(wiring.ticks as i32);
        let [of_pulse, of_way, constant, of_time, of_cosine, of_sine] = wiring.weights;
        let weight =
            of_pulse * along + of_way * way + constant + of_time * time + of_cosine * mains[0] + of_sine * mains[1];
        let weight = weight * component(&wiring.per_metre, leg);
        for (row, reading) in self.response.iter_mut().zip(readings) {
            row[leg] = row[leg] + weight * *reading;
        }
        let [of_pulse, of_mains] = wiring.turn;
        *pulse = rotated(*pulse, of_pulse);
        *mains = rotated(*mains, of_mains);
        self.tick = self.tick.saturating_add(1);
        if self.tick >= wiring.ticks {
            self.turned = [[T::ONE, T::ZERO]; 2];
            self.tick = 0;
            self.leg = leg + 1;
        }
    }

    /// One iteration of a fit per tick, because a whole fit takes longer than a tick: first gains, then inverted or
    /// swapped channels.
    fn judge(&mut self, wiring: &Wiring<T>, expected: &Response<T>, is_last: bool) {
        let (number, round) = (self.tick / ROUNDS, self.tick % ROUNDS);
        self.tick = self.tick.saturating_add(1);
        let trial = trial(number);
        let expected = with(expected, trial);
        if round < ROUNDS - 1 {
            self.gauges = next_gauges(&self.response, &expected, &self.gauges);
            return;
        }
        let fit = Fit::of_gauges(&self.response, &expected, self.gauges);
        self.gauges = [T::ONE; 6];
        let explains = fit.residual <= wiring.residual;
        if number == 0 {
            self.done = explains || fit.nothing;
            self.finding = if fit.nothing {
                NOTHING
            } else if explains {
                fit.finding(wiring).word()
            } else {
                UNEXPLAINED
            };
        } else {
            if fit.residual < self.least && explains && fit.finding(wiring) == Finding::None {
                self.least = fit.residual;
                self.finding = trial.word();
            }
            self.done = number >= TRIALS && (is_last || self.finding != UNEXPLAINED);
        }
    }
}

/// A rotated vector of the plane.
#[inline]
fn rotated<T: Real>([x, y]: [T; 2], [cosine, sine]: [T; 2]) -> [T; 2] {
    [x * cosine - y * sine, y * cosine + x * sine]
}

/// Assumption of a trial of [`Check::judge`]: nothing, then inverted gauges, swapped pairs of gauges, swapped pairs of
/// legs.
fn trial(number: u32) -> Finding {
    if number == 0 {
        return Finding::None;
    }
    if number <= 6 {
        return Finding::Gauge(number - 1, Fault::Inverted);
    }
    let mut pair = (number - 7) % 15;
    let mut first = 0;
    while pair >= 5 - first {
        pair -= 5 - first;
        first += 1;
    }
    let fault = Fault::Swapped(first + 1 + pair);
    if number < 22 { Finding::Gauge(first, fault) } else { Finding::Leg(first, fault) }
}

/// Response of a machine with this fault; a gain of 0 if it is dead.
#[must_use]
pub fn with<T: Real>(expected: &Response<T>, finding: Finding) -> Response<T> {
    let mut shown = *expected;
    let (of_gauge, subject, fault) = match finding {
        Finding::Gauge(gauge, fault) => (true, gauge as usize, fault),
        Finding::Leg(leg, fault) => (false, leg as usize, fault),
        _ => return shown,
    };
    let (other, gain) = match fault {
        Fault::Inverted => (subject, -T::ONE),
        Fault::Dead => (subject, T::ZERO),
        Fault::Swapped(other) => (other as usize, T::ONE),
        Fault::Gain(gain) => (subject, T::from_i32(gain as i32) / T::from_i32(100)),
    };
    for (gauge, row) in shown.iter_mut().enumerate() {
        for (leg, entry) in row.iter_mut().enumerate() {
            let place = if of_gauge { gauge } else { leg };
            let from = if place == subject {
                other
            } else if place == other {
                subject
            } else {
                continue;
            };
            let [row, column] = if of_gauge { [from, leg] } else { [gauge, from] };
            *entry = gain * entry_of(expected, row, column);
        }
    }
    shown
}

/// Whether a fault-free machine explains the `response` of a machine that shows `expected`: then the check passes.
#[must_use]
pub fn explains<T: Real>(wiring: &Wiring<T>, expected: &Response<T>, response: &Response<T>) -> bool {
    let fit = Fit::of(response, expected);
    fit.residual <= wiring.residual && fit.finding(wiring) == Finding::None
}

fn entry_of<T: Real>(matrix: &Response<T>, row: usize, column: usize) -> T {
    match matrix.get(row) {
        Some(row) => component(row, column),
        None => T::ZERO,
    }
}

/// diag(a) S diag(b), fitted to a response.
struct Fit<T> {
    gauges: [T; 6],
    legs: [T; 6],
    /// Residual of the response, in power.
    residual: T,
    /// Whether there is no response.
    nothing: bool,
}

impl<T: Real> Fit<T> {
    fn of(response: &Response<T>, expected: &Response<T>) -> Self {
        let mut gauges = [T::ONE; 6];
        for _ in 1..ROUNDS {
            gauges = next_gauges(response, expected, &gauges);
        }
        Self::of_gauges(response, expected, gauges)
    }

    /// The last iteration; its gauge gains are those of the iteration before.
    fn of_gauges(response: &Response<T>, expected: &Response<T>, mut gauges: [T; 6]) -> Self {
        // Unchanged, unless a snapshot was tampered with.
        for gain in &mut gauges {
            *gain = held(*gain);
        }
        let mut legs = legs_of(response, expected, &gauges);
        let [mut left, mut power, mut whole] = [T::ZERO; 3];
        for ((shown, expected), gauge) in response.iter().zip(expected).zip(&gauges) {
            for ((shown, expected), leg) in shown.iter().zip(expected).zip(&legs) {
                let off = *shown - *gauge * *expected * *leg;
                left = left + off * off;
                power = power + *shown * *shown;
                whole = whole + *expected * *expected;
            }
        }
        let dead = T::from_f64(DEAD);
        let nothing = power <= dead * dead * whole;
        let residual = if nothing { T::ONE } else { left / power };
        let middle = median(&gauges);
        for (gauge, leg) in gauges.iter_mut().zip(&mut legs) {
            *gauge = *gauge / middle;
            *leg = *leg * middle;
        }
        Self { gauges, legs, residual, nothing }
    }

    /// The finding that the gains show.
    fn finding(&self, wiring: &Wiring<T>) -> Finding {
        let dead = T::from_f64(DEAD);
        if self.legs.iter().all(|gain| *gain <= -dead) {
            return Finding::Inverted;
        }
        let mut sum = T::ZERO;
        for (leg, gain) in (0..).zip(self.legs) {
            if gain < dead {
                return Finding::Leg(leg, if gain <= -dead { Fault::Inverted } else { Fault::Dead });
            }
            sum = sum + gain;
        }
        if let Some((gauge, gain)) = furthest(&self.gauges, wiring.gauge_gain) {
            return Finding::Gauge(gauge, if gain < dead { Fault::Dead } else { Fault::Gain(hundredths(gain)) });
        }
        if let Some([low, high]) = wiring.leg_gain {
            let five = T::from_i32(5);
            let mut relative = self.legs;
            for gain in &mut relative {
                *gain = *gain * five / (sum - *gain);
            }
            if let Some((leg, gain)) = furthest(&relative, [low, high]) {
                return Finding::Leg(leg, Fault::Gain(hundredths(gain)));
            }
            // Common to all legs, small motions explain a half, and creep with hysteresis one and a half.
            let common = sum / T::from_i32(6);
            if common < low * T::HALF || common > high + high * T::HALF {
                return Finding::Common(hundredths(common));
            }
        }
        Finding::None
    }
}

/// Leg gains that fit best to these gauge gains.
fn legs_of<T: Real>(response: &Response<T>, expected: &Response<T>, gauges: &[T; 6]) -> [T; 6] {
    let mut legs = [T::ZERO; 6];
    for (leg, gain) in legs.iter_mut().enumerate() {
        *gain = gain_of(&column(response, leg), &column(expected, leg), gauges, T::ZERO);
    }
    legs
}

/// An iteration of the fit: leg gains, then the gauge gains that fit best to them.
fn next_gauges<T: Real>(response: &Response<T>, expected: &Response<T>, gauges: &[T; 6]) -> [T; 6] {
    let legs = legs_of(response, expected, gauges);
    let mut next = [T::ONE; 6];
    for ((gain, shown), expected) in next.iter_mut().zip(response).zip(expected) {
        *gain = held(gain_of(shown, expected, &legs, T::ONE));
    }
    next
}

/// The gain of a gauge, limited to the range of the fit.
fn held<T: Real>(gain: T) -> T {
    let [low, high] = GAUGE.map(T::from_f64);
    saturate(gain, low, high)
}

fn column<T: Real>(matrix: &Response<T>, index: usize) -> [T; 6] {
    let mut column = [T::ZERO; 6];
    for (row, entry) in column.iter_mut().enumerate() {
        *entry = entry_of(matrix, row, index);
    }
    column
}

/// The gain with which `expected` times `gains` is nearest to `shown`; `otherwise` if that product is zero.
fn gain_of<T: Real>(shown: &[T; 6], expected: &[T; 6], gains: &[T; 6], otherwise: T) -> T {
    let (mut along, mut power) = (T::ZERO, T::ZERO);
    for ((shown, expected), gain) in shown.iter().zip(expected).zip(gains) {
        let expected = *expected * *gain;
        along = along + *shown * expected;
        power = power + expected * expected;
    }
    if power > T::from_f64(1e-9) { along / power } else { otherwise }
}

/// The gain (> 0) that is furthest beyond its range.
fn furthest<T: Real>(gains: &[T; 6], [low, high]: [T; 2]) -> Option<(u32, T)> {
    let (mut worst, mut found) = (T::ONE, None);
    for (place, gain) in (0..).zip(gains) {
        let beyond = if *gain > high { *gain / high } else { low / *gain };
        if beyond > worst {
            worst = beyond;
            found = Some((place, *gain));
        }
    }
    found
}

fn hundredths<T: Real>(gain: T) -> u32 {
    // Gains are above zero here.
    (gain * T::from_i32(100) + T::HALF).truncate() as u32
}

fn median<T: Real>(values: &[T; 6]) -> T {
    let mut sum = T::ZERO;
    for (place, value) in values.iter().enumerate() {
        let before = |(other, than): (usize, &T)| *than < *value || (*than == *value && other < place);
        if matches!(values.iter().enumerate().filter(|other| before(*other)).count(), 2 | 3) {
            sum = sum + *value;
        }
    }
    sum * T::HALF
}
