//! Drives that identify the legs of an assembled platform with its own converters: cross-talk, reversal curves at three
//! rates, and an arbitrary record, of one leg or a fitting pair at a time.
//!
//! ```text
//! Bench → groups of legs, with voltages of the others → timing → Drive: a wave file, and its voltage at any tick
//! ```
//! A group moves its full stroke within the workspace. The others are held at rest, or where that is not enough, at the
//! voltages nearest to rest that make room. Curves ascend; a hold at each turn shows peak and return in whole rows of the
//! recorder; the slope changes over nearly two periods of the slowest mode. A grid step lasts whole periods of the mains,
//! so that its mean has no hum, except at the fast rate.

mod groups;
mod nodes;
mod timing;
mod wave;

use specgen_language::model::MAX_GRID;
use specgen_numerics::largest;

use groups::{Group, Search};
use timing::Timing;
use wave::{Shape, Tone, Wave};

/// Time in which the other legs creep back before the strokes for the cross-talk, s.
const CREEP_BACK: f64 = 10.0;
/// Rest before any other drive, s.
const REST: f64 = 0.2;
/// A stroke for the cross-talk, V and s, and their number. The first one shows creep.
const STROKE: (f64, f64, u32) = (20.0, 0.5, 3);
/// A full stroke before the curves, s, and their number: without them a leg that creeps for long is off by 16 nm.
const PRECONDITIONING: (f64, u32) = (1.0, 2);
/// The fast and the slow set: part of the grid, and time to cross the whole range, s; 1,000 and 20 V/s over 100 V.
const OTHER_SETS: [(usize, f64); 2] = [(2, 0.1), (4, 5.0)];
/// Least number of curves of a set.
const LEAST_CURVES: usize = 4;
/// Smooth start and end of a drive, s.
const RAMP: f64 = 0.1;
/// Length of an arbitrary record, and of its smooth start and end, s.
const ARBITRARY: [f64; 2] = [10.0, 0.5];
/// Tones of an arbitrary record, and the frequencies of the first and the last, Hz: ten rows of 5 ms for a period.
const TONES: usize = 8;
const BAND: [f64; 2] = [0.1, 20.0];
/// Above this frequency the amplitudes of an arbitrary record fall, Hz.
const SLOWER: f64 = 2.0;
/// Part of the span that the converters may lack at each limit.
const MARGIN: f64 = 5e-4;
/// Part of the slew rate of a drive, and of the rate of curves before their step is rounded to the mains.
const SLEW: f64 = 0.25;
const ROUNDED: f64 = 1.25;
/// Part of the slew rate that the runtime may find in a drive with its start and end.
const PERMITTED: f64 = 0.9;

/// What the planner needs to know of a platform.
#[derive(Debug, Clone, PartialEq)]
pub struct Bench {
    /// Hz.
    pub tick_rate: f64,
    /// Limits of the drive, V.
    pub voltage: [f64; 2],
    /// Voltage of a leg at rest, V.
    pub rest: f64,
    /// V/s.
    pub slew_rate: f64,
    /// Displacement of each leg from the lowest to the highest voltage, m.
    pub stroke: [f64; 6],
    /// J = ∂l/∂h at rest: leg displacements (rows) per pose coordinate, m/m and m/rad.
    pub jacobian: [[f64; 6]; 6],
    /// Lower and upper limit of each pose coordinate, m and rad. Poses count from the legs at their lowest voltage.
    pub workspace: [[f64; 2]; 6],
    /// Other readings that have limits, such as those of gauges: reading per pose coordinate, lower, upper limit.
    pub readings: Vec<([f64; 6], [f64; 2])>,
    /// Mains, Hz.
    pub mains: f64,
    /// Frequency of the slowest mode, Hz.
    pub slowest_mode: f64,
}

/// What a drive is for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Two full strokes. They need no record.
    Preconditioning,
    /// Three small strokes of one leg.
    CrossTalk,
    /// Reversal curves in ascending order.
    Curves {
        /// Number of curves.
        grid: usize,
        /// V/s.
        rate: f64,
    },
    /// A sum of sines.
    Arbitrary {
        /// Of the phases.
        seed: u64,
    },
}

/// A wave of an open drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// Stem of its files, such as `leg0-curves-156`.
    pub name: String,
    /// The legs that move, all with the same voltage.
    pub legs: Vec<usize>,
    /// What it is for.
    pub kind: Kind,
    /// Time at rest before it, s.
    pub rest_before: f64,
    /// Voltage of each leg that does not move, V.
    pub held: [f64; 6],
    /// Lowest and highest voltage of the legs that move, V: the range of their table.
    pub range: [f64; 2],
    /// Ticks of a row of the record.
    pub average: u32,
    wave: Wave,
}

/// Drives in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// They begin and end with all legs at rest.
    pub drives: Vec<Drive>,
    /// Mains, Hz.
    pub mains: f64,
    /// Sentences about ranges that had to be reduced.
    pub notes: Vec<String>,
}

impl Drive {
    /// Its wave as a file for `wave` of `specgen operate`.
    #[must_use]
    pub fn wave_file(&self) -> String {
        self.wave.file(&self.legs, &self.held)
    }

    /// Duration without the rest before it, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        f64::from(self.wave.ticks) / self.wave.tick_rate
    }

    /// Duration with the rest before it, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.rest_before + self.seconds()
    }

    /// Voltage of the legs that move, V, so many ticks after the start; between ticks, too.
    #[must_use]
    pub fn voltage(&self, tick: f64) -> f64 {
        self.wave.voltage(tick)
    }

    /// Mean voltage of so many rows, V, as a recorder shows them whose first row begins `first` ticks after the wave;
    /// of the voltage `delay` (s) earlier, such as that of the stacks behind the amplifiers' lag.
    #[must_use]
    pub fn rows(&self, first: f64, count: usize, delay: f64) -> Vec<f64> {
        let begin = first - delay * self.wave.tick_rate;
        let row = |row: usize| {
            let before = begin + row as f64 * f64::from(self.average);
            let sum = (1..=self.average).fold(0.0, |sum, tick| sum + self.voltage(before + f64::from(tick)));
            sum / f64::from(self.average)
        };
        (0..count).map(row).collect()
    }

    /// Tick of the wave with which a record of it begins, negative before its start, from the mean voltage of each row (V).
    /// The record has all of the wave and begins at rest.
    #[must_use]
    pub fn first_tick(&self, volts: &[f64]) -> f64 {
        let center = |sums: [f64; 2], (time, volts): (f64, f64)| [sums[0] + volts, sums[1] + volts * time];
        let middle = |row: usize| (row as f64 + 0.5) * f64::from(self.average) + 0.5;
        let rows = volts.iter().enumerate().map(|(row, mean)| (middle(row), mean - volts[0]));
        let [recorded, recorded_moment] = rows.fold([0.0; 2], center);
        let ticks = (1..=self.wave.ticks).map(f64::from).map(|tick| (tick, self.voltage(tick) - self.voltage(0.0)));
        let [planned, planned_moment] = ticks.fold([0.0; 2], center);
        (planned_moment / planned - recorded_moment / recorded).round()
    }

    /// Mean voltage of every row, V, if the record begins with the wave.
    #[must_use]
    pub fn volts(&self) -> Vec<f64> {
        self.rows(0.0, self.wave.ticks.div_ceil(self.average) as usize, 0.0)
    }
}

/// Drives for a table of `grid` intervals; `pairs`: legs that fit move together, which needs their cross-talk.
///
/// # Errors
/// A grid that cannot be identified, or a value of the bench that is impossible.
pub fn plan(bench: &Bench, grid: usize, pairs: bool) -> Result<Plan, String> {
    check(bench, grid)?;
    let planner = Planner { bench, limits: bench.permitted() };
    let search = Search::new(bench, planner.limits, planner.fastest(grid))?;
    let groups = search.groups(pairs)?;
    let mut drives: Vec<Drive> = (0..6).map(|leg| planner.cross_talk(leg, &search)).collect();
    for group in &groups {
        drives.extend([planner.preconditioning(group), planner.curves(group, grid, None)]);
        for (part, crossing) in OTHER_SETS {
            let fewer = if grid / part > LEAST_CURVES { grid / part } else { LEAST_CURVES };
            let curves = planner.curves(group, fewer, Some(crossing));
            // On a coarse grid the sets have the same rate.
            if drives.iter().all(|known| known.name != curves.name) {
                drives.extend([planner.preconditioning(group), curves]);
            }
        }
        drives.push(planner.arbitrary(group));
    }
    let notes = groups.iter().filter(|group| group.share < 1.0).map(|group| reduced(group, bench)).collect();
    Ok(Plan { drives, mains: bench.mains, notes })
}

fn check(bench: &Bench, grid: usize) -> Result<(), String> {
    if !(LEAST_CURVES..=MAX_GRID).contains(&grid) {
        return Err(format!("grid: expected {LEAST_CURVES} to {MAX_GRID} curves, found {grid}; 32 is usual"));
    }
    let positive = [
        ("tick rate", bench.tick_rate),
        ("slew rate", bench.slew_rate),
        ("mains", bench.mains),
        ("slowest mode", bench.slowest_mode),
        ("range of the drive", bench.voltage[1] - bench.voltage[0]),
    ];
    let strokes = bench.stroke.iter().map(|stroke| ("stroke of a leg", *stroke));
    let wrong = positive.into_iter().chain(strokes).find(|(_, value)| !(*value > 0.0 && value.is_finite()));
    if let Some((name, value)) = wrong {
        return Err(format!("{name}: expected more than 0, found {value}"));
    }
    let [low, high] = bench.voltage;
    if !(low..=high).contains(&bench.rest) {
        return Err(format!("rest: expected a voltage from {low} V to {high} V, found {} V", bench.rest));
    }
    Ok(())
}

fn reduced(group: &Group, bench: &Bench) -> String {
    let ([from, to], [low, high]) = (group.range, bench.voltage);
    format!(
        "leg {}: only {from:.1} V to {to:.1} V of {low} V to {high} V ({:.0} % of the range): the platform would leave its workspace",
        names(&group.legs),
        100.0 * group.share
    )
}

fn names(legs: &[usize]) -> String {
    legs.iter().map(ToString::to_string).collect::<Vec<_>>().join("-")
}

impl Bench {
    /// Voltages that every converter reaches, V.
    fn permitted(&self) -> [f64; 2] {
        let [low, high] = self.voltage;
        let margin = MARGIN * (high - low);
        let inside = |limit: f64, margin: f64| if limit == self.rest { limit } else { limit + margin };
        [inside(low, margin), inside(high, -margin)]
    }
}

struct Planner<'a> {
    bench: &'a Bench,
    limits: [f64; 2],
}

impl Planner<'_> {
    /// An upper limit of the rate of every drive, V/s.
    fn fastest(&self, grid: usize) -> f64 {
        let span = self.limits[1] - self.limits[0];
        let interval = span / grid as f64;
        let first = Timing::of(self.bench, interval, None).rate(interval);
        let strokes = core::f64::consts::PI * span / PRECONDITIONING.0;
        let rates = OTHER_SETS.map(|(_, crossing)| ROUNDED * span / crossing).into_iter().chain([first, strokes]);
        let most = rates.fold(0.0, |most, rate| if rate > most { rate } else { most });
        let highest = ROUNDED * SLEW * self.bench.slew_rate;
        if most < highest { most } else { highest }
    }

    /// Raised cosines over `range` (V) of `seconds` each, or longer where the slew rate asks for it.
    fn strokes(&self, range: [f64; 2], seconds: f64, count: u32) -> Shape {
        let span = range[1] - range[0];
        let least = core::f64::consts::PI * span / (SLEW * self.bench.slew_rate);
        let ticks = if seconds > least { seconds } else { least } * self.bench.tick_rate;
        Shape::Strokes { ticks: ticks.ceil(), count }
    }

    /// The other legs rest: a record in which they move is refused.
    fn cross_talk(&self, leg: usize, search: &Search) -> Drive {
        let ([low, high], rest) = (self.limits, self.bench.rest);
        let [volts, seconds, span] = [STROKE.0, STROKE.1, 0.5 * (high - low)];
        // Away from the nearer limit.
        let upward = high - rest > rest - low;
        let range = |volts: f64| if upward { [rest, rest + volts] } else { [rest - volts, rest] };
        let volts = if volts < span { volts } else { span };
        let range = range(largest(volts, |volts| search.stays(&[leg], range(volts))));
        let group = Group { legs: vec![leg], held: [rest; 6], range, share: 1.0 };
        let shape = self.strokes(range, seconds, STROKE.2);
        Drive { rest_before: CREEP_BACK, ..self.drive(&group, Kind::CrossTalk, shape, RAMP) }
    }

    fn preconditioning(&self, group: &Group) -> Drive {
        let (seconds, count) = PRECONDITIONING;
        self.drive(group, Kind::Preconditioning, self.strokes(group.range, seconds, count), RAMP)
    }

    /// `crossing`: time for the whole range, s; without it a period of the mains for a step.
    fn curves(&self, group: &Group, grid: usize, crossing: Option<f64>) -> Drive {
        let interval = (group.range[1] - group.range[0]) / grid as f64;
        let timing = Timing::of(self.bench, interval, crossing.map(|seconds| seconds / grid as f64));
        let shape = Shape::Curves { grid: grid as u32, step: timing.step, hold: timing.hold, corner: timing.corner };
        let rate = timing.rate(interval);
        Drive { average: timing.row, ..self.drive(group, Kind::Curves { grid, rate }, shape, RAMP) }
    }

    fn arbitrary(&self, group: &Group) -> Drive {
        let seed = group.legs.iter().fold(1, |seed, leg| seed * 7 + *leg as u64);
        let amplitude = 0.5 * (1.0 - MARGIN) * (group.range[1] - group.range[0]);
        let tones = tones(seed, amplitude, SLEW * self.bench.slew_rate);
        let ticks = (ARBITRARY[0] * self.bench.tick_rate).ceil();
        let shape = Shape::Tones { tones, ticks };
        let average = timing::short_row(self.bench);
        Drive { average, ..self.drive(group, Kind::Arbitrary { seed }, shape, ARBITRARY[1]) }
    }

    fn drive(&self, group: &Group, kind: Kind, shape: Shape, ramp: f64) -> Drive {
        let (bench, range) = (self.bench, group.range);
        let what = match kind {
            Kind::Preconditioning => "preconditioning".to_owned(),
            Kind::CrossTalk => "cross-talk".to_owned(),
            Kind::Curves { rate, .. } => format!("curves-{rate:.0}"),
            Kind::Arbitrary { .. } => "arbitrary".to_owned(),
        };
        let extremes = range.iter().chain(&group.held).map(|volts| (volts - bench.rest).abs());
        let reach = extremes.fold(0.0, |most, volts| if volts > most { volts } else { most });
        let rate = shape.rate(range, bench.tick_rate);
        // The bound of the runtime: 15/8 is the largest slope of its start and end.
        let least = 1.875 * reach / (PERMITTED * bench.slew_rate - rate);
        let ramp = ((if ramp > least { ramp } else { least }) * bench.tick_rate).ceil();
        let ramp = if ramp > 4.0 { ramp } else { 4.0 };
        Drive {
            name: format!("leg{}-{what}", names(&group.legs)),
            legs: group.legs.clone(),
            kind,
            rest_before: REST,
            held: group.held,
            range,
            average: timing::mains_row(bench),
            wave: Wave::new(bench, range, ramp as u32, shape),
        }
    }
}

/// Sines whose sum stays within `amplitude` (V) and `rate` (V/s); the same for the same seed.
fn tones(seed: u64, amplitude: f64, rate: f64) -> Vec<Tone> {
    let spacing = libm::log(BAND[1] / BAND[0]) / (TONES - 1) as f64;
    let frequency = |k: usize| BAND[0] * libm::exp(k as f64 * spacing);
    let weight = |k: usize| 1.0 / (1.0 + frequency(k) / SLOWER);
    let sum = |of: &dyn Fn(usize) -> f64| (0..TONES).fold(0.0, |sum, k| sum + of(k));
    let share = amplitude / sum(&weight);
    let fastest = sum(&|k| share * weight(k) * core::f64::consts::TAU * frequency(k));
    let slower = if fastest > rate { rate / fastest } else { 1.0 };
    let mut state = seed;
    let tone = |k| Tone { amplitude: share * weight(k), frequency: slower * frequency(k), phase: phase(&mut state) };
    (0..TONES).map(tone).collect()
}

/// A number from 0 to 1: splitmix64 of Steele, Lea and Flood (2014).
fn phase(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mixed = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    // 24 bits, exact in any scalar.
    ((mixed ^ (mixed >> 31)) >> 40) as f64 / f64::from(1 << 24)
}
