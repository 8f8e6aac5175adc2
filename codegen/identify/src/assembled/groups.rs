//! Legs that may move together, and the voltages of the others.
//!
//! To first order the displacement of a leg is its stroke times the voltage from the lowest one, and the pose is J⁻¹ of
//! the displacements. Every limit is then linear in the voltages of the legs that are held, and those nearest to rest are
//! the solution of a least-distance problem. Hildreth's method (1957) solves it: it corrects one limit after the other.

use nalgebra::Matrix6;
use specgen_numerics::largest;

use super::Bench;
use crate::staircase::saturate;

/// Part of the workspace that is used. An open drive ends at 31/32; gauges and strokes are known to half a percent.
const REACH: f64 = 0.96;
/// The stroke of each leg may be larger or smaller than that of the spec by this factor, and a drive then still fits, if the other legs
/// can make room for it.
const SPREAD: f64 = 1.15;
/// Time for which the supervisor of an open drive looks ahead, s.
const AHEAD: f64 = 2e-3;
/// Least part of its range that a leg must move.
const LEAST_SHARE: f64 = 0.1;
/// Passes over the limits, and the violation, as a part of a limit, at which they end.
const PASSES: usize = 2000;
const TOLERANCE: f64 = 1e-6;

/// Legs that move together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Group {
    pub legs: Vec<usize>,
    /// Voltage of each leg that does not move, V.
    pub held: [f64; 6],
    /// Lowest and highest voltage of the legs, V.
    pub range: [f64; 2],
    /// Part of the permitted range, 1 for all of it.
    pub share: f64,
}

/// A reading that has limits.
struct Limit {
    /// Per volt of each leg.
    slope: [f64; 6],
    low: f64,
    high: f64,
}

/// slope · x ≤ most.
struct HalfSpace {
    slope: [f64; 6],
    most: f64,
}

pub(super) struct Search<'a> {
    bench: &'a Bench,
    limits: Vec<Limit>,
    permitted: [f64; 2],
    /// Voltage that a leg may go on, V.
    ahead: f64,
}

/// Tries every way to put the remaining legs into groups.
fn extend(all: &[Group], rest: f64, chosen: &mut Vec<Group>, best: &mut Vec<Group>) {
    let taken = |leg: &usize| chosen.iter().any(|group: &Group| group.legs.contains(leg));
    let Some(leg) = (0..6).find(|leg| !taken(leg)) else {
        let cost = |groups: &[Group]| groups.iter().fold(0.0, |sum, group| sum + away(group, rest));
        if chosen.len() < best.len() || chosen.len() == best.len() && cost(chosen) < cost(best) {
            best.clone_from(chosen);
        }
        return;
    };
    let fits = |group: &&Group| group.legs[0] == leg && !group.legs.iter().any(taken);
    let next: Vec<Group> = all.iter().filter(fits).cloned().collect();
    for group in next {
        chosen.push(group);
        extend(all, rest, chosen, best);
        chosen.pop();
    }
}

/// Square of the distance of the held legs from rest, V².
fn away(group: &Group, rest: f64) -> f64 {
    group.held.iter().fold(0.0, |sum, volts| sum + (volts - rest) * (volts - rest))
}

fn limits(bench: &Bench) -> Result<Vec<Limit>, String> {
    let jacobian = Matrix6::from_fn(|leg, axis| bench.jacobian[leg][axis]);
    let inverse = jacobian.try_inverse().ok_or("jacobian: the legs do not determine the pose")?;
    let span = bench.voltage[1] - bench.voltage[0];
    let poses = (0..6).map(|axis| {
        let unit = core::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 });
        (unit, bench.workspace[axis])
    });
    let limit = |(per_pose, [low, high]): ([f64; 6], [f64; 2])| {
        let of_leg = |leg: usize| (0..6).fold(0.0, |sum, axis| sum + per_pose[axis] * inverse[(axis, leg)]);
        let slope: [f64; 6] = core::array::from_fn(|leg| of_leg(leg) * bench.stroke[leg] / span);
        if low < high && slope.iter().all(|slope| slope.is_finite()) {
            Ok(Limit { slope, low: REACH * low, high: REACH * high })
        } else {
            Err(format!("workspace: expected a lower and a higher limit, found {low} and {high}"))
        }
    };
    poses.chain(bench.readings.iter().copied()).map(limit).collect()
}

impl<'a> Search<'a> {
    /// For voltages within `permitted` (V) and rates up to `fastest` (V/s).
    pub(super) fn new(bench: &'a Bench, permitted: [f64; 2], fastest: f64) -> Result<Self, String> {
        let search = Self { bench, limits: limits(bench)?, permitted, ahead: AHEAD * fastest };
        if search.stays(&[], [bench.rest; 2]) {
            Ok(search)
        } else {
            Err(format!("at rest, {} V, the platform is beyond its workspace; widen `workspace`", bench.rest))
        }
    }

    /// All six legs. With `pairs`, as few groups as there can be; among these, those whose other legs stay nearest to rest.
    pub(super) fn groups(&self, pairs: bool) -> Result<Vec<Group>, String> {
        let singles: Vec<Group> = (0..6).map(|leg| self.alone(leg)).collect::<Result<_, _>>()?;
        if !pairs {
            return Ok(singles);
        }
        let pairs =
            (0..6).flat_map(|a| (a + 1..6).map(move |b| [a, b])).filter_map(|legs| self.group(&legs, 1.0, SPREAD));
        let mut best = singles.clone();
        extend(&pairs.chain(singles).collect::<Vec<_>>(), self.bench.rest, &mut Vec::new(), &mut best);
        Ok(best)
    }

    /// Whether `legs` may go through `range` (V) while the others rest.
    pub(super) fn stays(&self, legs: &[usize], range: [f64; 2]) -> bool {
        self.half_spaces(legs, range, 1.0).iter().all(|space| space.most >= 0.0)
    }

    /// The leg alone, over as much of its range as fits.
    fn alone(&self, leg: usize) -> Result<Group, String> {
        if let Some(group) = self.group(&[leg], 1.0, SPREAD) {
            return Ok(group);
        }
        let share = largest(1.0, |share| self.group(&[leg], share, 1.0).is_some());
        let least = |group: &Group| group.share >= LEAST_SHARE;
        self.group(&[leg], share, 1.0).filter(least).ok_or_else(|| {
            format!("leg {leg}: {:.0} % of its range fit into the workspace; widen `workspace`", 100.0 * share)
        })
    }

    /// The legs over this share of the range from rest, if that fits with strokes larger by the factor `spread`.
    fn group(&self, legs: &[usize], share: f64, spread: f64) -> Option<Group> {
        let rest = self.bench.rest;
        let range = self.permitted.map(|limit| if share < 1.0 { rest + share * (limit - rest) } else { limit });
        let held = nearest(&self.half_spaces(legs, range, spread))?.map(|volts| rest + volts);
        // The search may pass a limit by its tolerance.
        let held = held.map(|volts| saturate(volts, self.permitted));
        self.holds(legs, (&held, range), spread).then(|| Group { legs: legs.to_vec(), held, range, share })
    }

    /// Whether every limit holds while `legs` go through `range`, with the stroke of each leg larger, or smaller, by as much as `spread`
    /// permits: the legs that make room may be those with the smaller strokes.
    fn holds(&self, legs: &[usize], (held, range): (&[f64; 6], [f64; 2]), spread: f64) -> bool {
        let [smaller, larger] = [2.0 - spread, spread];
        let lowest = self.bench.voltage[0];
        self.limits.iter().all(|limit| {
            [range[0] - self.ahead, range[1] + self.ahead].into_iter().all(|volts| {
                let at = |leg: usize| if legs.contains(&leg) { volts } else { held[leg] };
                let part = |leg: usize| limit.slope[leg] * (at(leg) - lowest);
                let most =
                    (0..6).map(part).fold(0.0, |sum, part| sum + part * if part > 0.0 { larger } else { smaller });
                let least =
                    (0..6).map(part).fold(0.0, |sum, part| sum + part * if part > 0.0 { smaller } else { larger });
                let slack = TOLERANCE * (limit.high - limit.low);
                most <= limit.high + slack && least >= limit.low - slack
            })
        })
    }

    /// What the voltages of the other legs, from rest, must fulfil while `legs` go through `range`, with strokes larger by
    /// the factor `spread`.
    fn half_spaces(&self, legs: &[usize], range: [f64; 2], spread: f64) -> Vec<HalfSpace> {
        let (rest, lowest) = (self.bench.rest, self.bench.voltage[0]);
        let span = self.bench.voltage[1] - lowest;
        let mut all = Vec::new();
        for limit in &self.limits {
            // Relative to the size of the limit.
            let (low, high) = (limit.low / spread, limit.high / spread);
            let size = 0.5 * (high - low);
            let of_others = |sign: f64| {
                core::array::from_fn(|leg| if legs.contains(&leg) { 0.0 } else { sign * limit.slope[leg] / size })
            };
            for volts in [range[0] - self.ahead, range[1] + self.ahead] {
                let at = |leg: usize| if legs.contains(&leg) { volts } else { rest };
                let reading = (0..6).fold(0.0, |sum, leg| sum + limit.slope[leg] * (at(leg) - lowest));
                all.push(HalfSpace { slope: of_others(1.0), most: (high - reading) / size });
                all.push(HalfSpace { slope: of_others(-1.0), most: (reading - low) / size });
            }
        }
        for leg in (0..6).filter(|leg| !legs.contains(leg)) {
            for (sign, most) in [(1.0, self.permitted[1] - rest), (-1.0, rest - self.permitted[0])] {
                let slope = core::array::from_fn(|other| if other == leg { sign / span } else { 0.0 });
                all.push(HalfSpace { slope, most: most / span });
            }
        }
        all
    }
}

/// The point of all half spaces that is nearest to zero; none if they have none in common, or hardly.
fn nearest(half_spaces: &[HalfSpace]) -> Option<[f64; 6]> {
    let dot = |a: &[f64; 6], b: &[f64; 6]| a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b);
    let mut point = [0.0; 6];
    let mut multipliers = vec![0.0; half_spaces.len()];
    for _ in 0..PASSES {
        let mut worst = 0.0;
        for (HalfSpace { slope, most }, multiplier) in half_spaces.iter().zip(&mut multipliers) {
            let excess = dot(slope, &point) - most;
            worst = if excess > worst { excess } else { worst };
            let square = dot(slope, slope);
            if square > 0.0 {
                let change = excess / square;
                let change = if change < -*multiplier { -*multiplier } else { change };
                *multiplier += change;
                point.iter_mut().zip(slope).for_each(|(x, slope)| *x -= change * slope);
            }
        }
        if worst <= TOLERANCE {
            return Some(point);
        }
    }
    None
}
