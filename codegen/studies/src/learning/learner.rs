//! Computes the correction of the next pass, on the host or on the machine's own device.

use specgen_runtime::playback::{self, Knot};

use super::coherence::Coherence;
use super::machine::{LearnError, RepeatableMachine};
use super::motion::Motion;
use super::observation::PassObservation;
use super::plan::Plan;
use super::table::knots;
use super::update::Update;

/// Shortest time in which a correction may rise from zero to its limit, s.
pub(super) const ONSET: f64 = 1e-3;
/// Factor on the limit that a correction needs, because later passes change the correction further.
const HEADROOM: f64 = 1.2;

/// Where the correction of the next pass is computed.
#[derive(Clone, Copy)]
pub enum Learner<'a> {
    /// The host, from the spectra of a whole pass.
    Host(&'a Update),
    /// The machine's own device, in its background loop.
    Device(&'a Plan),
}

impl<'a> Learner<'a> {
    /// A learner with its estimate of the noise, from two passes with the same correction.
    pub(super) fn session(self, repeats: [&PassObservation; 2], motion: &Motion) -> Session<'a> {
        match self {
            Self::Host(update) => {
                Session::Host(update, Box::new(update.coherence(repeats.map(|pass| errors(pass, motion)))))
            }
            Self::Device(plan) => Session::Device(plan),
        }
    }
}

/// A learner; for the host with its estimate of the noise.
pub(super) enum Session<'a> {
    Host(&'a Update, Box<Coherence>),
    Device(&'a Plan),
}

impl Session<'_> {
    /// The part of a pass's error (tick by tick, m and rad) that would remain after learning with the machine's own response; `None` if the
    /// device learns.
    pub(super) fn remainder(&self, pass: &PassObservation, motion: &Motion) -> Option<Vec<[f64; 6]>> {
        match self {
            Self::Host(update, coherence) => Some(update.remainder(errors(pass, motion), coherence)),
            Self::Device(_) => None,
        }
    }

    /// Whether a part of the update can be applied: a device always applies the whole.
    pub(super) fn allows_smaller_steps(&self) -> bool {
        matches!(self, Self::Host(..))
    }

    /// The next correction, from the present one and one or more `passes` with it, the last one at the end. A device uses only the last.
    pub(super) fn next(
        &mut self,
        machine: &mut dyn RepeatableMachine,
        motion: &Motion,
        correction: &[Knot],
        passes: &[&PassObservation],
        spacing: u32,
    ) -> Result<Vec<Knot>, LearnError> {
        match self {
            Self::Device(plan) => machine.next(plan, correction, passes[passes.len() - 1]),
            Self::Host(update, coherence) => {
                let errors: Vec<_> = passes.iter().map(|pass| errors(pass, motion)).collect();
                Ok(knots(&update.next(&correction_by_tick(correction, motion, spacing), &errors, coherence), spacing))
            }
        }
    }
}

/// The measured errors of a pass, over the ticks in which a correction can act.
fn errors<'a>(pass: &'a PassObservation, motion: &Motion) -> &'a [[f64; 6]] {
    &pass.measured[..motion.corrected]
}

/// Interpolates between two corrections: `fraction` 0 gives `from`, 1 gives `to`. Knots missing in `from` count as zero.
pub(super) fn interpolate(from: &[Knot], to: Vec<Knot>, fraction: f64) -> Vec<Knot> {
    let value = |from: i32, to: i32| {
        let [from, to] = [f64::from(from), f64::from(to)];
        libm::round(from + fraction * (to - from)) as i32
    };
    let knot = |(k, to): (usize, &Knot)| {
        let from = from.get(k).copied().unwrap_or_default();
        std::array::from_fn(|axis| value(from[axis], to[axis]))
    };
    if fraction < 1.0 { to.iter().enumerate().map(knot).collect() } else { to }
}

/// The correction of each tick, interpolated between the knots, m and rad.
pub(super) fn correction_by_tick(knots: &[Knot], motion: &Motion, spacing: u32) -> Vec<[f64; 6]> {
    (0..motion.corrected as u32).map(|tick| playback::at(knots, spacing, tick)).collect()
}

/// The smallest limit `control.correction` (m) with which these knots are played unchanged, times [`HEADROOM`].
pub(super) fn sufficient_limit(knots: &[Knot], motion: &Motion, spacing: u32) -> f64 {
    let arms = [1.0, motion.radius];
    let correction = correction_by_tick(knots, motion, spacing);
    // The limit also bounds the rate: a correction takes at least the onset time to reach it.
    let rates = correction
        .windows(2)
        .map(|pair| std::array::from_fn(|axis| (pair[1][axis] - pair[0][axis]) * ONSET / motion.interval));
    let largest = correction
        .iter()
        .copied()
        .chain(rates)
        .flat_map(|c: [f64; 6]| (0..6).map(move |axis| (c[axis] * arms[axis / 3]).abs()));
    HEADROOM * largest.fold(0.0, |most, value| if value > most { value } else { most })
}
