//! Lag of the displacement behind the drive, from the turns of a triangular drive.
//!
//! Around a turn, creep, rate dependence and memory are smooth functions of the drive's distance from the turn; only a
//! lag shifts the kink between them. On each side the displacement is fitted by a cubic polynomial of that distance,
//! both with the same value at the turn. The distance is that of a drive behind a first-order lag, as an amplifier has
//! it. Such a drive turns later and at a smaller amplitude; the distance counts from that point, where the hysteresis of
//! the next branch starts.

use super::branches::Branch;
use super::dead_time;
use super::least_squares;
use super::record::Record;

/// Longest part of a branch beside a turn, s, and as a fraction of the branch.
const WINDOW: f64 = 20e-3;
const OF_BRANCH: f64 = 0.8;
/// Fewest samples on either side.
const SAMPLES: usize = 8;
/// Largest distance of the drive from a straight line there, as a fraction of its way.
const STRAIGHT: f64 = 0.01;
/// Degree of the polynomials.
const DEGREE: usize = 3;
/// Fewest turns.
const TURNS: usize = 4;

/// Largest standard error of an estimate from the turns, s.
const USEFUL: f64 = 5e-5;
/// Step for the curvature if the lag is 0, s.
const NEAR: f64 = 1e-5;
/// The lag (s) from the turns of the drive if its standard error is small enough, and a text that describes the decision.
pub(super) fn estimate(record: &Record, branches: &[Branch]) -> Option<(f64, String)> {
    let [lag, error] = lag(record, branches).filter(|[_, error]| *error < USEFUL)?;
    Some((lag, format!("estimated where the drive turns, standard error {:.3} ms", error * 1e3)))
}

/// A turn between two straight parts.
struct Turn {
    /// Time (s) from the turn, and displacement, of each sample.
    samples: Vec<[f64; 2]>,
    /// Slope of the drive before and after, V/s.
    slopes: [f64; 2],
}

/// The lag and its standard error, s; none if too few turns are sharp and sampled finely enough.
fn lag(record: &Record, branches: &[Branch]) -> Option<[f64; 2]> {
    let longest = dead_time::longest(record, branches);
    let turns = branches.windows(2).filter_map(|pair| turn(record, [pair[0], pair[1]]));
    let turns: Vec<Turn> = turns.filter(|turn| turn.shows(longest)).collect();
    if turns.len() < TURNS {
        return None;
    }
    let squares = |lag: f64| turns.iter().try_fold(0.0, |sum, turn| Some(sum + turn.square(lag)?));
    let squares = |lags: &[f64]| lags.iter().map(|lag| squares(*lag)).collect::<Option<Vec<f64>>>();
    let found = dead_time::search(longest, squares)?;
    // Variance 2 (S/free)/S″ by central differences around the least sum of squares S, or beside it if there is no lag.
    let lag = found.dead_time;
    let near = if lag > 0.0 { 0.1 * lag } else { NEAR };
    let middle = if lag > 0.0 { lag } else { near };
    let [below, at, above] = squares(&[middle - near, middle, middle + near])?[..] else { return None };
    let least = if lag > 0.0 { at } else { below };
    let free = turns.iter().fold(0, |sum, turn| sum + turn.samples.len() - (2 * DEGREE + 1));
    let variance = 2.0 * near * near * least / (free as f64 * (below - 2.0 * at + above));
    (!found.at_end && variance > 0.0).then(|| [lag, variance.sqrt()])
}

/// The turn between two branches, unless the drive rests there or is not straight.
fn turn(record: &Record, [before, after]: [Branch; 2]) -> Option<Turn> {
    let (time, drive, at) = (&record.time, &record.drive, after.first);
    let longest = |b: Branch| OF_BRANCH * (time[b.end - 1] - time[b.first]);
    let within = |b: Branch| if longest(b) < WINDOW { longest(b) } else { WINDOW };
    let from = time.partition_point(|t| *t < time[at] - within(before));
    let end = time.partition_point(|t| *t <= time[at] + within(after));
    if before.end != at + 1 || at < from + SAMPLES || end < at + 1 + SAMPLES {
        return None;
    }
    // Slope of the line through the ends of a part, if all of it is near the line.
    let line = |first: usize, last: usize| {
        let way = drive[last] - drive[first];
        let slope = way / (time[last] - time[first]);
        let off = |k: usize| (drive[k] - drive[first] - slope * (time[k] - time[first])).abs();
        (first..last).all(|k| off(k) <= STRAIGHT * way.abs()).then_some(slope)
    };
    let slopes = [line(from, at - 1)?, line(at + 1, end - 1)?];
    // Where the two lines meet.
    let [into, out] = slopes;
    let (u, v) = (drive[at - 1] - into * time[at - 1], drive[at + 1] - out * time[at + 1]);
    let corner = (v - u) / (into - out);
    let used = (from..end).filter(|k| !record.weightless[*k]);
    let samples: Vec<[f64; 2]> = used.map(|k| [time[k] - corner, record.displacement[k]]).collect();
    (into * out < 0.0 && samples.len() > 2 * SAMPLES).then_some(Turn { samples, slopes })
}

impl Turn {
    /// Time by which a drive behind this lag (s) turns late, s.
    fn late(&self, lag: f64) -> f64 {
        let [into, out] = self.slopes;
        lag * libm::log(1.0 - into / out)
    }

    /// Whether there are enough samples on either side for every lag up to this one (s).
    fn shows(&self, longest: f64) -> bool {
        let late = self.late(longest);
        let count = |of: &dyn Fn(f64) -> bool| self.samples.iter().filter(|[t, _]| of(*t)).count();
        count(&|t| t < 0.0) >= SAMPLES && count(&|t| t >= late) >= SAMPLES
    }

    /// Σ of squares that the polynomials leave with this lag (s).
    fn square(&self, lag: f64) -> Option<f64> {
        let [into, out] = self.slopes;
        // Time and distance by which the lagged drive turns late.
        let late = self.late(lag);
        let lagged = |t: f64| {
            let decay = |t: f64| if lag > 0.0 { libm::exp(-t / lag) } else { 0.0 };
            if t <= 0.0 { into * (t - lag) } else { out * (t - lag) - (into - out) * lag * decay(t) }
        };
        let turned = out * late;
        let mut columns = vec![vec![0.0; self.samples.len()]; 2 * DEGREE + 1];
        let mut y = Vec::with_capacity(self.samples.len());
        let unit = 1.0 / (into.abs() * WINDOW);
        for (k, [t, displacement]) in self.samples.iter().enumerate() {
            let distance = unit * (lagged(*t) - turned);
            let side = if *t < late { 1 } else { 1 + DEGREE };
            columns[0][k] = 1.0;
            let mut power = 1.0;
            for column in &mut columns[side..side + DEGREE] {
                power *= distance;
                column[k] = power;
            }
            y.push(*displacement);
        }
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let residual = least_squares::fit(&columns, &y)?.residual;
        Some(least_squares::dot(&residual, &residual))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::branches::branches;

    /// Triangles of 100 V at 640 V/s, or sines of the same size, through a lag (s), hysteresis and creep. One of 2 V
    /// comes first.
    fn record(triangle: bool, lag: f64, interval: f64) -> Record {
        const STEP: f64 = 1e-5;
        const SMALL: usize = 625;
        let begun = SMALL as f64 * STEP;
        let half = 100.0 / 640.0;
        let (mut late, mut turned, mut rising, mut y, mut crept) = (0.0, 0.0, true, 0.0, 0.0);
        let every = (interval / STEP).round() as usize;
        let (mut time, mut drive, mut displacement) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..400_000 {
            let t = k as f64 * STEP;
            // A loop of 2 V, 3.1 ms a branch, whose turns are not shown at a lag of some ms.
            let (size, phase) =
                if k < SMALL { (2.0, t * 640.0 / 2.0 % 2.0) } else { (100.0, (t - begun) / half % 2.0) };
            let straight = if phase < 1.0 { phase } else { 2.0 - phase };
            let u = size * if triangle { straight } else { 0.5 - 0.5 * libm::cos(core::f64::consts::PI * phase) };
            let change = if lag > 0.0 { (u - late) * STEP / lag } else { u - late };
            if (change > 0.0) != rising && change != 0.0 {
                (turned, rising) = (late, change > 0.0);
            }
            late += change;
            // Flat after a turn, then steeper.
            y += change * (0.5 + 0.3 * (1.0 - libm::exp(-(late - turned).abs() / 20.0)));
            crept += (0.05 * y - crept) * STEP / 0.1;
            if k % every == 0 {
                time.push(t);
                drive.push(u);
                displacement.push(1e-6 * (y + crept));
            }
        }
        let weightless = vec![false; time.len()];
        let (shown_as, parts, warnings) = (String::new(), Vec::new(), Vec::new());
        Record { shown_as, time, drive, monitored: false, displacement, weightless, simulated: true, parts, warnings }
    }

    #[test]
    fn the_lag_of_sharp_turns_is_found_in_spite_of_creep_and_others_are_left_out() {
        let found = |record: &Record| lag(record, &branches(&record.drive, 0, 1.0));
        let [at, error] = found(&record(true, 3e-4, 5e-4)).unwrap();
        println!("{:.4} ms, standard error {:.4} ms", at * 1e3, error * 1e3);
        assert!((at - 3e-4).abs() < 1e-5 && error < 1e-5);
        assert!(found(&record(true, 3e-4, 5e-3)).is_none() && found(&record(false, 3e-4, 5e-4)).is_none());
        assert!(found(&record(true, 0.0, 5e-4)).unwrap()[0] < 1e-5);
        // The turns of the small loop have enough samples here, but not behind a lag of 8 ms.
        assert!((found(&record(true, 3e-4, 2e-4)).unwrap()[0] - 3e-4).abs() < 1e-5);
        let mut spoilt = record(true, 3e-4, 5e-4);
        for k in (100..4000).step_by(250) {
            spoilt.displacement[k] += 3e-6;
            spoilt.weightless[k] = true;
        }
        assert!((found(&spoilt).unwrap()[0] - 3e-4).abs() < 1e-5);
    }
}
