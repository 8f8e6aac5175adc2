//! Repeats a motion on a machine, simulated or real, and learns from each pass.

use std::cmp::Ordering;
use std::ops::ControlFlow;

use host_sim::closed_loop::RunError;
use host_sim::coverage::Coverage;
use serde::Serialize;
use specgen_runtime::playback::{Knot, UNIT};

use super::gain::{Judge, Score, Verdict};
use super::learner::{Learner, Session, interpolate, sufficient_limit};
use super::machine::{CORRECTION_LIMITED, LearnError, RepeatableMachine, require_followed};
use super::motion::Motion;
use super::observation::PassObservation;

/// Ratio of an error to the smallest one above which the error counts as growing.
const GROWTH: f64 = 1.5;
/// Smallest fraction of an update that the host applies; each worse pass halves the fraction. A smaller step still
/// converges if the assumed response is further off, for instance at another slope of the hysteresis.
const SMALLEST_STEP: f64 = 0.25;

/// Errors of a pass, over the motion itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pass {
    /// Rms error of the translation as a norm, nm: of the true pose in simulation, of the measured one on a machine.
    pub translation_nm: f64,
    /// The same of the angles, nrad.
    pub orientation_nrad: f64,
    /// Rms measured error of both, with angles times the joint radius, nm: the criterion.
    pub measured_nm: f64,
    /// Accumulated status bits.
    pub status: u32,
    /// The measured part of the motion.
    #[serde(flatten)]
    pub coverage: Coverage,
}

impl Pass {
    /// The errors of an observed pass; an error if the machine stopped before the end of the motion.
    fn of(pass: &PassObservation, motion: &Motion) -> Result<Self, LearnError> {
        let Motion { scored, interval, .. } = motion;
        let end = pass.real.len().min(pass.measured.len()).min(scored.end);
        let coverage = Coverage::new(end.saturating_sub(scored.start), scored.len(), *interval);
        if !coverage.is_whole() {
            return Err(RunError::EndedEarly { coverage, status: pass.status }.into());
        }
        Ok(Self {
            translation_nm: rms(&pass.real, motion, [1.0, 0.0]),
            orientation_nrad: rms(&pass.real, motion, [0.0, 1.0]),
            measured_nm: measured_nm(&pass.measured, motion),
            status: pass.status,
            coverage,
        })
    }

    /// Whether the correction was limited.
    pub fn limited(&self) -> bool {
        self.status & CORRECTION_LIMITED != 0
    }
}

/// Rms of weighted translations and angles over the motion itself, without the rest before and after, nm or nrad.
fn rms(errors: &[[f64; 6]], motion: &Motion, weights: [f64; 2]) -> f64 {
    let sum: f64 = errors[motion.scored.clone()]
        .iter()
        .map(|error| (0..6).map(|axis| weights[axis / 3] * error[axis] * error[axis]).sum::<f64>())
        .sum();
    libm::sqrt(sum / motion.scored.len() as f64) * 1e9
}

/// The criterion [`Pass::measured_nm`].
fn measured_nm(errors: &[[f64; 6]], motion: &Motion) -> f64 {
    rms(errors, motion, [1.0, motion.radius * motion.radius])
}

/// Rms error of the translation as a norm, nm, from the recorded errors of a pass.
pub fn measured_translation_nm(errors: &[Knot]) -> f64 {
    let squares = errors.iter().flat_map(|knot| &knot[..3]).map(|value| f64::from(*value) * f64::from(*value));
    libm::sqrt(squares.sum::<f64>() / errors.len() as f64) * UNIT * 1e9
}

/// Why learning ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// All requested passes were made.
    AllPasses,
    /// The last pass was worse than the best one by more than the noise, or two consecutive passes were not better by more than the noise.
    NoGain,
    /// The error of the last pass was more than 1.5 times that of the best one.
    Growth,
    /// The user stopped it.
    Interruption,
    /// A pass was ended from outside, or the machine refused the final correction.
    Machine,
}

/// Result of learning.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LearningResult {
    /// All passes that count; the first one has no correction, or the initial one.
    pub passes: Vec<Pass>,
    /// The pass whose correction is kept: the last one better than all before it by more than the noise; 0 if there is none.
    pub best: usize,
    /// Knots of the correction of that pass.
    #[serde(skip)]
    pub knots: Vec<Knot>,
    /// Noise: difference of [`Pass::measured_nm`] between two passes with the same correction, nm; `None` if no pass was to be learned.
    pub noise_nm: Option<f64>,
    /// [`Pass::measured_nm`] that is expected after learning with the machine's measured response, up to [`super::Convergence::reach`],
    /// nm; `None` if the device learns.
    pub expected_nm: Option<f64>,
    /// If a correction was limited: the limit (`control.correction`) that the first one needs, with headroom, nm.
    pub sufficient_nm: Option<f64>,
    /// Why learning ended.
    pub ending: Ending,
}

impl LearningResult {
    /// A result with only the first pass, under the initial correction.
    fn of_first_pass(initial: &[Knot], pass: Pass) -> Self {
        Self {
            passes: vec![pass],
            best: 0,
            knots: initial.to_vec(),
            noise_nm: None,
            expected_nm: None,
            sufficient_nm: None,
            ending: Ending::AllPasses,
        }
    }

    /// Whether learning ended because the error grew.
    pub fn grew(&self) -> bool {
        self.ending == Ending::Growth
    }

    /// Notes the limit that a correction needs, if it is the first one that was limited.
    fn note_limited(&mut self, pass: &Pass, knots: &[Knot], motion: &Motion, spacing: u32) {
        if pass.limited() && self.sufficient_nm.is_none() {
            self.sufficient_nm = Some(1e9 * sufficient_limit(knots, motion, spacing));
        }
    }
}

/// Learning after the first pass.
struct Progress<'a> {
    motion: &'a Motion,
    spacing: u32,
    session: Session<'a>,
    judge: Judge,
    /// The correction from which the next one is computed.
    correction: Vec<Knot>,
    /// Passes with this correction, the last one at the end.
    observed: Vec<PassObservation>,
    /// The last pass with the best correction.
    best: PassObservation,
    /// Fraction of an update that is applied.
    step: f64,
}

impl Progress<'_> {
    /// Computes the next correction and runs a pass with it.
    fn advance(&mut self, machine: &mut dyn RepeatableMachine) -> Result<(), LearnError> {
        let observed: Vec<_> = self.observed.iter().collect();
        let next = self.session.next(machine, self.motion, &self.correction, &observed, self.spacing)?;
        self.correction = interpolate(&self.correction, next, self.step);
        self.observed = vec![require_followed(machine.pass(self.motion, &self.correction, self.spacing)?)?];
        Ok(())
    }

    /// The last pass.
    fn last(&self) -> &PassObservation {
        &self.observed[self.observed.len() - 1]
    }

    /// Compares the last `pass` of the result with the best one. Keeps its correction, goes on from it, or goes back to the best one with a
    /// smaller step. `Some` if learning ends.
    fn decide(&mut self, pass: &Pass, result: &mut LearningResult) -> Option<Ending> {
        match self.judge.judge(Score::of(self.last(), self.motion)) {
            Verdict::Keep => {
                (result.best, result.knots) = (result.passes.len() - 1, self.correction.clone());
                self.best = self.last().clone();
            }
            Verdict::Worse if self.step > SMALLEST_STEP && self.session.allows_smaller_steps() => {
                self.step *= 0.5;
                (self.correction, self.observed) = (result.knots.clone(), vec![self.best.clone()]);
            }
            Verdict::GoOn => {}
            Verdict::Worse | Verdict::Stop => {
                let smallest = result.passes[result.best].measured_nm;
                // NaN counts as growth.
                let grew = matches!(pass.measured_nm.partial_cmp(&(GROWTH * smallest)), None | Some(Ordering::Greater));
                return Some(if grew { Ending::Growth } else { Ending::NoGain });
            }
        }
        None
    }
}

/// Makes up to `count` passes after the first and learns from each.
///
/// - The first pass and the two before it (one if `count` is 0) have the correction `initial`; no knots means no correction. Those two do not count: one brings the
///   hysteresis into the state of every repetition, the other shows the noise, the difference between repetitions.
/// - A correction is kept if its pass is better than the best one before it by more than the noise of both, and not worse than the first
///   pass in translation or angles.
/// - After a pass worse by more than the noise, the host goes back to the best correction and halves its step. The third such pass ends
///   learning, or the first if the device learns, and so do two consecutive passes without improvement.
/// - If the machine ends a pass after the first, learning ends. `watch` is called after each pass and may stop learning.
///
/// # Errors
/// If the machine does not complete a pass or does not follow the motion.
pub fn learn(
    machine: &mut dyn RepeatableMachine,
    motion: &Motion,
    learner: Learner<'_>,
    initial: &[Knot],
    spacing: u32,
    count: usize,
    mut watch: impl FnMut(usize, &Pass) -> ControlFlow<()>,
) -> Result<LearningResult, LearnError> {
    let mut repeat = || require_followed(machine.pass(motion, initial, spacing)?);
    repeat()?;
    let before = if count > 0 { Some(repeat()?) } else { None };
    let first = repeat()?;
    let pass = Pass::of(&first, motion)?;
    let mut result = LearningResult::of_first_pass(initial, pass);
    result.note_limited(&pass, initial, motion, spacing);
    let mut progress = before.map(|before| {
        let session = learner.session([&before, &first], motion);
        let judge = Judge::new(Score::of(&first, motion), &Score::of(&before, motion));
        result.noise_nm = Some(judge.noise_nm());
        result.expected_nm = session.remainder(&first, motion).map(|errors| measured_nm(&errors, motion));
        let (correction, best, observed) = (initial.to_vec(), first.clone(), vec![before, first]);
        Progress { motion, spacing, session, judge, correction, observed, best, step: 1.0 }
    });
    let mut flow = watch(0, &pass);
    for number in 1..=count {
        let Some(progress) = &mut progress else { break };
        if flow.is_break() {
            result.ending = Ending::Interruption;
            break;
        }
        match progress.advance(machine) {
            // The pass was ended: return what was learned so far.
            Err(LearnError::PassEnded) => return Ok(LearningResult { ending: Ending::Machine, ..result }),
            advanced => advanced?,
        }
        let pass = Pass::of(progress.last(), motion)?;
        result.note_limited(&pass, &progress.correction, motion, spacing);
        result.passes.push(pass);
        flow = watch(number, &pass);
        if let Some(ending) = progress.decide(&pass, &mut result) {
            result.ending = ending;
            break;
        }
    }
    if machine.keep(motion, &result.knots, spacing).is_err() {
        result.ending = Ending::Machine;
    }
    Ok(result)
}
