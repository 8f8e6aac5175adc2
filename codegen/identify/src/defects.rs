//! Defects of a record that a fit would follow: spikes, steps of the displacement, and hum. They are repaired, and
//! findings state them.
//!
//! A coarse table and a dead time are fitted first. In its residual a defect differs from the rest of the record,
//! whatever the drive.
//! Defects must be few: thresholds are multiples of what 95 % of the samples, and most of the neighbours, stay below.
//! Those that gather at the reversals of the drive are errors of the model.
//! ```text
//! spike  a sample off the median of its neighbourhood   at most 1 ms; no weight, replaced
//! step   medians before and after a sample differ       subtracted from all later samples
//! hum    a line of the spectrum that the drive lacks    subtracted
//! ```

use super::branches::Branch;
use super::findings::Findings;
use super::least_squares::{dot, fit, mean_square};
use super::normal::{self, Step, Weighting};
use super::record::{Record, later};
use super::regressor::{self, Plane};
use super::staircase::{Staircase, saturate};
use super::statistics::{Line, mean, median, median_interval, rates};
use super::{dead_time, prior, selection};
use nalgebra::{Matrix3, Vector3};
use specgen_language::diagnostic::codes;
use specgen_numerics::Factor;
use specgen_numerics::fft::{Complex64, forward};
use specgen_numerics::nnls;

/// Grid of the table, and most samples in its fit; a longer record is decimated evenly.
const GRID: usize = 16;
const SAMPLES: usize = 100_000;
/// Longest spike, s, at a third of its height.
const LONGEST: f64 = 1e-3;
/// Half width of the neighbourhood, s, which has these least and most samples.
const WIDTH: f64 = 1.5e-3;
const NEAR: [f64; 2] = [12.0, 100.0];
/// A spike may always have so many samples.
const FEW: usize = 3;
/// A defect is this many times what [`USUAL`] of the samples stay below, and [`ALONE`] times what three quarters of its
/// surroundings (in half widths) stay below.
const BEYOND: f64 = 6.0;
const USUAL: f64 = 0.95;
const ALONE: f64 = 4.0;
const SURROUNDINGS: usize = 8;
/// Smaller spikes and steps, and smaller hum, as a fraction of the displacement range, do not spoil a fit.
const LEAST: f64 = 0.005;
const HUM: f64 = 5e-4;
/// The same for hum near a frequency of the drive, which must also halve the residual. It is sought at these many bins
/// of the spectrum and as many between them, in these many samples.
const SHARED: f64 = 3e-3;
const SHARED_BINS: usize = 60;
const SHARED_SAMPLES: usize = 10_000;
/// Least ratio of the power of a line to the median of its neighbours, and their number on each side.
const PROMINENT: f64 = 1e3;
const BESIDE: usize = 40;
/// Least number of defects at reversals, if they are most of all, that the model causes.
const GATHERED: usize = 3;
/// A large defect bends the table, so that smaller ones show only after its repair.
const PASSES: usize = 4;
/// Most hums that are subtracted.
const HUMS: usize = 3;

/// `record` without its defects, for a table over `range` (V). A record that no coarse table can be fitted to is
/// returned as it is.
pub(crate) fn repaired(record: &Record, range: [f64; 2], grid: usize, findings: &mut Findings) -> Record {
    let size = record.displacement_range();
    let mut record = record.clone();
    // Each record was repaired before it was joined: a rate of its own looks like a defect among the others.
    if !record.parts.is_empty() {
        return record;
    }
    let plane = Plane { grid: if grid < GRID { grid } else { GRID }, range };
    selection::mask_unknown(&mut record, &plane, findings);
    for _ in 0..PASSES {
        let Some(mut residual) = residual(&record, &plane) else { break };
        let half = half_width(&record.time);
        let spikes = spikes(&mut record, &mut residual, half, LEAST * size, findings);
        if !(steps(&mut record, &mut residual, half, LEAST * size, findings) || spikes) {
            break;
        }
    }
    for _ in 0..HUMS {
        let Some(residual) = residual(&record, &plane) else { break };
        if !hum(&mut record, &plane, &residual, size, findings) {
            break;
        }
    }
    record
}

fn half_width(time: &[f64]) -> usize {
    saturate(WIDTH / median_interval(time), NEAR) as usize
}

/// Displacement minus a coarse table.
struct Residual {
    /// The first usable sample.
    first: usize,
    /// From there on, m.
    rest: Vec<f64>,
    /// Places in `rest` at which the drive turns back.
    turns: Vec<usize>,
    branches: Vec<Branch>,
    /// Displacement of every sample of the record, later by the dead time, m.
    target: Vec<f64>,
    /// Whether defects gather there.
    gathers: bool,
}

impl Residual {
    /// Drops the defects at reversals if they are most of `found`, places in `rest`: there the model errs.
    fn drop_gathered<D>(&mut self, found: &mut Vec<D>, place: impl Fn(&D) -> (usize, usize), half: usize) {
        let turns = &self.turns;
        let at_turn = |defect: &D| {
            let (from, end) = place(defect);
            turns.partition_point(|turn| turn + half < from) < turns.partition_point(|turn| *turn < end + half)
        };
        let count = found.iter().filter(|defect| at_turn(defect)).count();
        self.gathers |= count >= GATHERED && 2 * count > found.len();
        if self.gathers {
            found.retain(|defect| !at_turn(defect));
        }
    }
}

fn residual(record: &Record, plane: &Plane) -> Option<Residual> {
    let mut used = selection::usable(record, plane, &mut Findings::new(""))?;
    let (first, time) = (used.first, &record.time[used.first..]);
    let turns = used.branches.windows(2).filter(|b| b[0].end == b[1].first + 1).map(|b| b[1].first - first).collect();
    let found = dead_time::best(plane, record, first, &used.branches).filter(|(found, _)| !found.at_end);
    let tau = found.map_or(0.0, |(found, _)| found.dead_time);
    used.until(dead_time::within(record, tau));
    let every = time.len().div_ceil(SAMPLES);
    let scale = 1.0 / record.displacement_range();
    let target = dead_time::delayed(record, tau);
    let weighting = Weighting::Every(every, record.time.len());
    let mut normal = normal::accumulate(plane, record, first, &used.branches, weighting, 1, |k, values| {
        values[0] = scale * target[k];
    });
    prior::add(plane.grid, &mut normal.gram);
    let weights = nnls::solve(&normal.gram, &normal.rhs[0]).ok()?.weights;
    let table = normal::table_of(plane, &weights, 1.0 / scale);
    let mut model = Vec::with_capacity(time.len());
    normal::each_row(Staircase::negative_saturation(plane.range), plane, &record.drive, first, |_, row| {
        model.push(regressor::evaluate(row, &table.nodes));
    });
    let model = later(time, &model, tau);
    let rest = record.displacement[first..].iter().zip(model).map(|(y, f)| y - f).collect();
    Some(Residual { first, rest, turns, gathers: false, branches: used.branches, target })
}

/// For each sample, the size above which `off` is a defect: from all samples, and from the samples around it.
fn thresholds(off: &[f64], half: usize, least: f64) -> Vec<f64> {
    let quantile = |values: &[f64], share: f64| {
        let mut sizes: Vec<f64> = values.iter().map(|x| x.abs()).collect();
        let at = (share * (sizes.len() - 1) as f64) as usize;
        *sizes.select_nth_unstable_by(at, f64::total_cmp).1
    };
    let usual = BEYOND * quantile(off, USUAL);
    let floor = if usual > least { usual } else { least };
    let around = SURROUNDINGS * half;
    // One value for each half width of samples: it changes slowly.
    let local = |k: usize| {
        let middle = k / half * half;
        ALONE * quantile(&off[middle.saturating_sub(around)..(middle + around).min(off.len())], 0.75)
    };
    let blocks: Vec<f64> = (0..off.len()).step_by(half).map(local).collect();
    (0..off.len()).map(|k| if blocks[k / half] > floor { blocks[k / half] } else { floor }).collect()
}

fn middle(values: &[f64]) -> f64 {
    median(&mut values.to_vec())
}

/// Replaces spikes by the table and the median around them.
fn spikes(record: &mut Record, residual: &mut Residual, half: usize, least: f64, findings: &mut Findings) -> bool {
    let (first, rest) = (residual.first, &residual.rest);
    let around = |k: usize| middle(&rest[k.saturating_sub(half)..(k + half + 1).min(rest.len())]);
    let off: Vec<f64> = (0..rest.len()).map(|k| rest[k] - around(k)).collect();
    let bounds = thresholds(&off, half, least);
    let is_spike = |k: usize| off[k].abs() > bounds[k] && !record.weightless[first + k];
    let mut found: Vec<(usize, usize)> = Vec::new();
    for peak in (0..off.len()).filter(|k| is_spike(*k)) {
        if found.last().is_some_and(|(_, end)| peak < *end) {
            continue;
        }
        // Its flanks, to a third of the bound.
        let flank = |k: &usize| off[*k].abs() > bounds[peak] / 3.0;
        let from = (0..peak).rev().take_while(flank).last().unwrap_or(peak);
        found.push((from, (peak..off.len()).take_while(flank).last().unwrap_or(peak) + 1));
    }
    // What is longer is an error of the model. Flanks may reach over the neighbourhood where such an error is beside them.
    let interval = median_interval(&record.time);
    let lasts = |from: usize, end: usize| record.time[first + end - 1] - record.time[first + from];
    found.retain(|&(from, end)| {
        let height = off[from..end].iter().fold(0.0, |most, x| libm::fmax(most, x.abs()));
        let high = off[from..end].iter().filter(|x| 3.0 * x.abs() > height).count();
        high <= FEW || high as f64 * interval <= LONGEST && lasts(from, end) <= 2.0 * WIDTH
    });
    residual.drop_gathered(&mut found, |defect| *defect, half);
    for &(from, end) in &found {
        let most = off[from..end].iter().fold(0.0, |most: f64, x| if x.abs() > most.abs() { *x } else { most });
        for (k, error) in (from..end).zip(&off[from..end]) {
            record.displacement[first + k] -= error;
            record.weightless[first + k] = true;
            residual.rest[k] -= error;
        }
        let (start, stop, most) = (record.time[first + from], record.time[first + end - 1], most * 1e6);
        let samples = end - from;
        let message = format!(
            "from {start} s to {stop} s the displacement is off the model by up to {most:.3} um: these {samples} samples get no weight"
        );
        let help = "look for interference or a loose contact, or record again";
        findings.add(codes::RECORD_GLITCH, None, message, help);
    }
    !found.is_empty()
}

/// Subtracts steps of the displacement that the drive does not explain from all that follows.
fn steps(record: &mut Record, residual: &mut Residual, half: usize, least: f64, findings: &mut Findings) -> bool {
    let (first, rest) = (residual.first, residual.rest.as_slice());
    if rest.len() <= 2 * half {
        return false;
    }
    let height = |k: usize| {
        if k < half || k + half > rest.len() { 0.0 } else { middle(&rest[k..k + half]) - middle(&rest[k - half..k]) }
    };
    let off: Vec<f64> = (0..rest.len()).map(height).collect();
    let bounds = thresholds(&off, half, least);
    let whole = |k: usize| record.weightless[first + k - half..first + k + half].iter().all(|w| !*w);
    let mut added = 0.0;
    let mut found: Vec<(usize, f64)> = Vec::new();
    let mut k = half;
    while k + half <= rest.len() {
        if off[k].abs() <= bounds[k] {
            k += 1;
            continue;
        }
        // The sharpest difference within the stretch in which the medians differ.
        let end = (k..rest.len()).take_while(|j| off[*j].abs() > bounds[*j]).last().unwrap_or(k) + 1;
        let jump = |j: usize| rest[j] - rest[j - 1];
        let at = (k..end).fold(k, |best, j| if jump(j).abs() > jump(best).abs() { j } else { best });
        if 2.0 * (jump(at) / off[at]) > 1.0 && whole(at) {
            // Medians also contain what the residual moves within the neighbourhood.
            found.push((at, jump(at)));
        }
        k = end;
    }
    residual.drop_gathered(&mut found, |(at, _)| (*at, *at), half);
    for (at, step) in &found {
        let (at_time, height) = (record.time[first + at], step * 1e6);
        let message = format!(
            "at {at_time} s the displacement steps by {height:.3} um without the drive, as where two runs are joined: the step is subtracted from there on"
        );
        let help = "identify each run alone, or find what moved: a loose mount, another gauge range, a lost count";
        findings.add(codes::RECORD_STEP, None, message, help);
    }
    let mut next = found.iter().peekable();
    for (k, y) in record.displacement[first..].iter_mut().enumerate() {
        while let Some((_, step)) = next.next_if(|(at, _)| *at <= k) {
            added += step;
        }
        *y -= added;
    }
    !found.is_empty()
}

/// Subtracts the strongest line of the spectrum that the drive lacks. One near a frequency of the drive stays: a finding
/// names it.
fn hum(record: &mut Record, plane: &Plane, residual: &Residual, size: f64, findings: &mut Findings) -> bool {
    let (first, rest) = (residual.first, residual.rest.as_slice());
    let time = &record.time[first..];
    let (count, duration) = (rest.len(), time[time.len() - 1] - time[0]);
    if count < 8 * BESIDE {
        return false;
    }
    let power = |values: &[f64]| -> Vec<f64> {
        let flat = Line::fit(time, values).removed(time, values);
        let window = |k: usize| 0.5 - 0.5 * libm::cos(core::f64::consts::TAU * k as f64 / count as f64);
        let mut bins: Vec<Complex64> =
            flat.iter().enumerate().map(|(k, x)| Complex64::new(x * window(k), 0.0)).collect();
        forward(count).process(&mut bins);
        bins[..count / 2].iter().map(|bin| bin.norm_sqr()).collect()
    };
    let (own, driven) = (power(rest), power(&record.drive[first..]));
    let prominence = |power: &[f64], k: usize| {
        let (low, high) = (k.saturating_sub(BESIDE), (k + BESIDE).min(power.len()));
        power[k] / middle(&power[low..high])
    };
    let is_peak = |k: usize| own[k] > own[k - 1] && own[k] >= own[k + 1];
    let lacks =
        |k: usize| prominence(&own, k) > PROMINENT && (k - 1..=k + 1).all(|j| prominence(&driven, j) < PROMINENT);
    // Four cycles at least: a slower line is creep.
    let strongest = || {
        let peaks = (4..own.len() - 1).filter(|k| is_peak(*k) && lacks(*k));
        peaks.max_by(|a, b| own[*a].total_cmp(&own[*b]))
    };
    let keep: Vec<usize> = (0..count).filter(|k| !record.weightless[first + k]).collect();
    let pick = |values: &[f64]| -> Vec<f64> { keep.iter().map(|k| values[*k]).collect() };
    let at = |frequency: f64| {
        let phase = |of: fn(f64) -> f64| time.iter().map(|t| of(core::f64::consts::TAU * frequency * t)).collect();
        let waves: [Vec<f64>; 2] = [phase(libm::cos), phase(libm::sin)];
        let found = fit(&[&pick(&waves[0]), &pick(&waves[1]), &vec![1.0; keep.len()]], &pick(rest))?;
        Some((mean_square(&found.residual), [found.coefficients[0], found.coefficients[1]], waves))
    };
    if let Some(peak) = strongest() {
        // Sixths of a bin around the peak; a line is as wide as one.
        let tried = (-4..=4).map(|part| (peak as f64 + f64::from(part) / 6.0) / duration);
        let best = tried.filter_map(|f| Some((f, at(f)?))).reduce(|a, b| if b.1.0 < a.1.0 { b } else { a });
        let best = best.map(|(frequency, (_, [a, b], waves))| (frequency, libm::hypot(a, b), [a, b], waves));
        if let Some((frequency, amplitude, [a, b], [cos, sin])) = best.filter(|best| best.1 > HUM * size) {
            for ((y, c), s) in record.displacement[first..].iter_mut().zip(cos).zip(sin) {
                *y -= a * c + b * s;
            }
            let message = format!("{}, which the drive lacks: it is subtracted", hum_of(amplitude, frequency));
            let help = "look for a ground loop, a lamp or a pump; the table does not contain the hum";
            findings.add(codes::RECORD_HUM, None, message, help);
            return true;
        }
    }
    let mut bins: Vec<usize> = (4..own.len() - 1).collect();
    bins.sort_by(|a, b| own[*b].total_cmp(&own[*a]));
    let bins = bins.into_iter().filter(|k| !lacks(*k)).take(SHARED_BINS);
    let tried: Vec<f64> = bins.flat_map(|k| [k as f64, k as f64 + 0.5]).map(|bin| bin / duration).collect();
    if let Some((frequency, amplitude)) = shared(record, plane, residual, &tried)
        && amplitude > SHARED * size
    {
        let help = "record again at another rate: at a frequency of the drive, hum and hysteresis look the same";
        let what = hum_of(amplitude, frequency);
        let message = format!("{what}, near a frequency of the drive, or an error in step with it: it is in the fit");
        findings.add(codes::RECORD_HUM, None, message, help);
    }
    false
}

fn hum_of(amplitude: f64, frequency: f64) -> String {
    format!("the displacement contains hum of {:.1} nm at {frequency:.2} Hz", amplitude * 1e9)
}

/// Frequency (Hz, of those `tried`) and amplitude (m) of a wave that halves the residual of table and dead time. All
/// three are fitted at once: a table alone takes much of a wave at a frequency of the drive, and the dead time the rest.
fn shared(record: &Record, plane: &Plane, residual: &Residual, tried: &[f64]) -> Option<(f64, f64)> {
    let (first, branches) = (residual.first, &residual.branches);
    let every = residual.rest.len().div_ceil(SHARED_SAMPLES);
    let end = record.time.len();
    let weighting = Weighting::Every(every, end);
    let keep: Vec<bool> = record.weightless.iter().map(|w| !w).collect();
    let slope = rates(&record.time, &residual.target, &keep);
    let mut values_of = |k: usize, values: &mut [f64]| {
        (values[0], values[1]) = (residual.target[k], slope[k]);
        for (pair, frequency) in values[2..].chunks_exact_mut(2).zip(tried) {
            (pair[1], pair[0]) = libm::sincos(core::f64::consts::TAU * frequency * record.time[k]);
        }
    };
    let count = 2 + 2 * tried.len();
    let mut normal = normal::accumulate(plane, record, first, branches, weighting, count, &mut values_of);
    prior::add(plane.grid, &mut normal.gram);
    // The columns, centred in each branch as in the normal equations.
    let mut columns = vec![Vec::new(); count];
    let (mut values, mut begin) = (vec![0.0; count], 0);
    normal::walk(
        plane,
        record,
        first,
        branches,
        |k| k.is_multiple_of(every),
        |step| match step {
            Step::Sample(_, k, _) => {
                values_of(k, &mut values);
                columns.iter_mut().zip(&values).for_each(|(column, value)| column.push(*value));
            }
            Step::End(_) => {
                for column in &mut columns {
                    let mean = mean(&column[begin..]);
                    column[begin..].iter_mut().for_each(|x| *x -= mean);
                }
                begin = columns[0].len();
            }
        },
    );
    let factor = Factor::of(normal.gram.nrows(), |row, column| normal.gram[(column, row)])?;
    let mut solved = normal.rhs.clone();
    factor.solve_all(&mut solved);
    let left = |a: usize, b: usize| dot(&columns[a], &columns[b]) - dot(&solved[a], &normal.rhs[b]);
    let late = left(0, 0) - left(0, 1) * left(0, 1) / left(1, 1);
    let wave = |k: usize| {
        let own = [1, 2 + 2 * k, 3 + 2 * k];
        let gram = Matrix3::from_fn(|a, b| left(own[a], own[b]));
        let rhs = Vector3::from_fn(|a, _| left(0, own[a]));
        let found = gram.cholesky()?.solve(&rhs);
        Some((left(0, 0) - found.dot(&rhs), libm::hypot(found[1], found[2])))
    };
    let each = (0..tried.len()).filter_map(|k| Some((wave(k)?, tried[k])));
    let ((least, amplitude), frequency) = each.reduce(|a, b| if b.0.0 < a.0.0 { b } else { a })?;
    (least < 0.5 * late).then_some((frequency, amplitude))
}
