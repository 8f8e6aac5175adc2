//! Runs passes of a motion on a machine, simulated or real, and learns from each until learning ends.

use std::cmp::Ordering;
use std::fmt;
use std::ops::ControlFlow;

use host_sim::closed_loop::RunError;
use host_sim::coverage::Coverage;
use host_sim::platform::rig::{Bench, Request};
use host_sim::word::status_words;
use serde::Serialize;
use specgen_runtime::pass::{Course, Player};
use specgen_runtime::playback::{self, Knot, UNIT};

use super::coherence::Coherence;
use super::gain::{Judge, Score, Verdict};
use super::motion::Motion;
use super::observation::PassObservation;
use super::plan::Plan;
use super::table::knots;
use super::update::Update;

/// Shortest time in which a correction may rise from zero to its limit, s.
pub(super) const ONSET: f64 = 1e-3;
/// Status bits for refused or stale set-points: the machine did not follow the motion.
const NOT_FOLLOWED: u32 = 0x3_0000;
/// Status bits for implausible gauges.
const GAUGES: u32 = 0x3f00;
/// Status bits for legs at a limit.
const LEGS: u32 = 0x3f;
/// Status bit for a limited correction.
const CORRECTION_LIMITED: u32 = 1 << 20;
/// The error counts as growing above this multiple of the smallest one.
const GROWS: f64 = 1.5;
/// Smallest fraction of an update that the host applies; each worse pass halves the fraction. A smaller step converges with a larger
/// error of the response, such as another slope of the hysteresis.
const LEAST_SHARE: f64 = 0.25;
/// Factor on a sufficient limit, because later passes change the correction further.
const HEADROOM: f64 = 1.2;

/// Reasons learning is refused.
#[derive(Debug)]
pub enum LearnError {
    /// The simulated machine cannot make a pass.
    Run(RunError),
    /// The controller refused a set-point or rejected a gauge in a pass; its status bits.
    Status(u32),
    /// Limits restricted the excitation; the status bits.
    Limited(u32),
    /// The machine ended a pass; its operator knows why.
    Ended,
    /// The device refuses the plan.
    Refused,
}

impl fmt::Display for LearnError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Run(error) => error.fmt(f),
            Self::Status(status) => write!(
                f,
                "the controller cannot follow this motion: {}; make it slower, or raise control.setpoint.stream_speed or the \
                 workspace in the spec",
                status_words(*status)
            ),
            Self::Limited(status) => write!(
                f,
                "limits restricted the sweep, so the response could not be measured: {}; use a smaller motion or a larger \
                 control.correction",
                status_words(*status)
            ),
            Self::Ended => f.write_str("the machine ended a pass"),
            Self::Refused => f.write_str("the device refuses this learning plan"),
        }
    }
}

impl std::error::Error for LearnError {}

impl From<RunError> for LearnError {
    fn from(error: RunError) -> Self {
        Self::Run(error)
    }
}

/// Computes the correction of the next pass.
#[derive(Clone, Copy)]
pub enum Learner<'a> {
    /// The host, from the spectra of a whole pass.
    Host(&'a Update),
    /// The machine's own device, in its background loop.
    Device(&'a Plan),
}

impl<'a> Learner<'a> {
    /// Begins to learn. The difference of two passes with the `equal` correction shows the noise.
    fn session(self, equal: [&PassObservation; 2], motion: &Motion) -> Session<'a> {
        match self {
            Self::Host(update) => {
                Session::Host(update, Box::new(update.coherence(equal.map(|seen| errors(seen, motion)))))
            }
            Self::Device(plan) => Session::Device(plan),
        }
    }
}

/// A learner; for the host with its estimate of the noise.
enum Session<'a> {
    Host(&'a Update, Box<Coherence>),
    Device(&'a Plan),
}

impl Session<'_> {
    /// [`LearningResult::expected_nm`] of a pass.
    fn expected_nm(&self, seen: &PassObservation, motion: &Motion) -> Option<f64> {
        match self {
            Self::Host(update, coherence) => {
                Some(measured_nm(&update.remainder(errors(seen, motion), coherence), motion))
            }
            Self::Device(_) => None,
        }
    }

    /// Whether the step can be reduced: a device always applies the full update.
    fn can_share(&self) -> bool {
        matches!(self, Self::Host(..))
    }

    /// The correction of the next pass. `played` is the present correction, `before` and `seen` are observations of passes with it.
    fn next(
        &mut self,
        machine: &mut dyn RepeatableMachine,
        motion: &Motion,
        (played, before, seen): (&[Knot], Option<PassObservation>, &PassObservation),
        spacing: u32,
    ) -> Result<Vec<Knot>, LearnError> {
        match self {
            Self::Device(plan) => machine.next(plan, played, seen),
            Self::Host(update, coherence) => {
                let errors: Vec<_> = before.iter().chain([seen]).map(|seen| errors(seen, motion)).collect();
                Ok(knots(&update.next(&given(played, motion, spacing), &errors, coherence), spacing))
            }
        }
    }
}

/// Interpolates between two corrections: `share` 0 gives `from`, 1 gives `to`. Knots missing in `from` count as zero.
fn between(from: &[Knot], to: Vec<Knot>, share: f64) -> Vec<Knot> {
    let part = |from: i32, to: i32| {
        let [from, to] = [f64::from(from), f64::from(to)];
        libm::round(from + share * (to - from)) as i32
    };
    let knot = |(k, to): (usize, &Knot)| {
        let from = from.get(k).copied().unwrap_or_default();
        std::array::from_fn(|axis| part(from[axis], to[axis]))
    };
    if share < 1.0 { to.iter().enumerate().map(knot).collect() } else { to }
}

/// The measured errors of a pass, over the ticks in which a correction can act.
fn errors<'a>(seen: &'a PassObservation, motion: &Motion) -> &'a [[f64; 6]] {
    &seen.measured[..motion.corrected]
}

/// The correction of each tick, interpolated between the knots, m and rad.
pub(super) fn given(played: &[Knot], motion: &Motion, spacing: u32) -> Vec<[f64; 6]> {
    (0..motion.corrected as u32).map(|tick| playback::at(played, spacing, tick)).collect()
}

/// The limit `control.correction` (m) with which these knots are played unchanged, times [`HEADROOM`].
fn sufficient(played: &[Knot], motion: &Motion, spacing: u32) -> f64 {
    let arms = [1.0, motion.radius];
    let correction = given(played, motion, spacing);
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

/// A machine that can repeat a motion.
pub trait RepeatableMachine {
    /// Runs a pass of the motion with a correction given by knots, `spacing` ticks apart.
    ///
    /// # Errors
    /// If the machine does not complete it.
    fn pass(&mut self, motion: &Motion, knots: &[Knot], spacing: u32) -> Result<PassObservation, LearnError>;

    /// The correction that the device computes from the one played and the observation.
    ///
    /// # Errors
    /// If the device refuses the plan.
    fn next(&mut self, plan: &Plan, played: &[Knot], seen: &PassObservation) -> Result<Vec<Knot>, LearnError> {
        plan.next(played, &seen.kept).ok_or(LearnError::Refused)
    }

    /// Learning has ended with this correction: the machine loads it if it has another one in memory.
    ///
    /// # Errors
    /// If the machine refuses it.
    fn keep(&mut self, _motion: &Motion, _knots: &[Knot], _spacing: u32) -> Result<(), LearnError> {
        Ok(())
    }
}

/// Timing of a pass: its ticks, the spacing of its knots, and the number of its trajectory.
#[must_use]
pub fn course(motion: &Motion, spacing: u32, trajectory: u32) -> Course {
    Course { spacing, before: motion.scored.start as u32, ticks: motion.corrected as u32, trajectory }
}

/// The error of each tick, m and rad: that of its knot, held for `spacing` ticks.
#[must_use]
pub fn held(errors: &[Knot], spacing: u32, ticks: usize) -> Vec<[f64; 6]> {
    let metres = |knot: &Knot| knot.map(|value| f64::from(value) * UNIT);
    errors.iter().flat_map(|knot| std::iter::repeat_n(metres(knot), spacing as usize)).take(ticks).collect()
}

/// Rms error of the translation as a norm, nm, from the recorded errors of a pass.
#[must_use]
pub fn translation_nm(errors: &[Knot]) -> f64 {
    let squares = errors.iter().flat_map(|knot| &knot[..3]).map(|value| f64::from(*value) * f64::from(*value));
    libm::sqrt(squares.sum::<f64>() / errors.len() as f64) * UNIT * 1e9
}

/// The simulated machine. It plays knots with the code of a real device.
impl RepeatableMachine for Bench<'_> {
    fn pass(&mut self, motion: &Motion, knots: &[Knot], spacing: u32) -> Result<PassObservation, LearnError> {
        let course = course(motion, spacing, 0);
        let count = course.knots() as usize;
        let mut memory = vec![[0; 6]; 2 * count];
        let mut player = Player::<f64>::new(&mut memory);
        let known = player.put(0, knots.iter().copied().take(count)) && player.begin(course);
        debug_assert!(known, "{course:?}");
        let mut real = Vec::with_capacity(motion.targets.len());
        let mut status = 0;
        self.lose_mains_phase(motion.targets[0])?;
        for target in &motion.targets {
            let correction = player.give().map_or([0.0; 6], |given| given.correction);
            let done = self.tick(&Request { correction, ..Request::stream(*target) })?;
            player.keep(&done.target, &done.measured, done.status);
            status |= done.status;
            real.push(std::array::from_fn(|axis| done.target[axis] - done.pose[axis]));
        }
        let kept = player.errors().to_vec();
        Ok(PassObservation { measured: held(&kept, spacing, motion.corrected), real, kept, status })
    }
}

/// Errors of a pass, over the motion itself.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Pass {
    /// Rms true error of the translation as a norm, nm.
    pub translation_nm: f64,
    /// Rms true error of the angles as a norm, nrad.
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
    fn of(seen: &PassObservation, motion: &Motion) -> Result<Self, LearnError> {
        let Motion { scored, interval, .. } = motion;
        let shown = seen.real.len().min(seen.measured.len()).min(scored.end);
        let coverage = Coverage::new(shown.saturating_sub(scored.start), scored.len(), *interval);
        if !coverage.is_whole() {
            return Err(RunError::EndedEarly { coverage, status: seen.status }.into());
        }
        Ok(Self {
            translation_nm: rms(&seen.real, motion, [1.0, 0.0]),
            orientation_nrad: rms(&seen.real, motion, [0.0, 1.0]),
            measured_nm: measured_nm(&seen.measured, motion),
            status: seen.status,
            coverage,
        })
    }

    /// Whether the correction was limited.
    #[must_use]
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

/// Why learning ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// All requested passes were made.
    AllPasses,
    /// The last pass was worse than the best one by more than the noise, or two consecutive passes were not better by more than the noise.
    NoGain,
    /// The error of the last pass was at least half as large again as that of the best one.
    Growth,
    /// The user stopped it.
    Interruption,
    /// The machine ended a pass.
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
    /// Whether learning ended because the error grew.
    #[must_use]
    pub fn grew(&self) -> bool {
        self.ending == Ending::Growth
    }
}

/// Makes up to `count` passes after the first and learns from each.
///
/// - The first pass and the two before it have the correction `begin`; no knots means no correction. Those two do not count: one brings the
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
    begin: &[Knot],
    spacing: u32,
    count: usize,
    mut watch: impl FnMut(usize, &Pass) -> ControlFlow<()>,
) -> Result<LearningResult, LearnError> {
    let mut played: Vec<Knot> = begin.to_vec();
    let mut equal = || followed(machine.pass(motion, begin, spacing)?);
    equal()?;
    let mut before = if count > 0 { Some(equal()?) } else { None };
    let mut seen = equal()?;
    let first = Pass::of(&seen, motion)?;
    let mut session = before.as_ref().map(|before| {
        let judge = Judge::new(Score::of(&seen, motion), &Score::of(before, motion));
        (judge, learner.session([before, &seen], motion))
    });
    let mut learned = LearningResult {
        passes: vec![first],
        best: 0,
        knots: played.clone(),
        noise_nm: session.as_ref().map(|(judge, _)| judge.noise_nm()),
        expected_nm: session.as_ref().and_then(|(_, session)| session.expected_nm(&seen, motion)),
        sufficient_nm: first.limited().then(|| 1e9 * sufficient(begin, motion, spacing)),
        ending: Ending::AllPasses,
    };
    let (mut number, mut share, mut best) = (0, 1.0, seen.clone());
    let mut go_on = watch(0, &first);
    while let Some((judge, session)) = session.as_mut().filter(|_| number < count) {
        if go_on.is_break() {
            learned.ending = Ending::Interruption;
            break;
        }
        number += 1;
        let made = session.next(machine, motion, (&played, before.take(), &seen), spacing);
        let passed = made.and_then(|made| {
            played = between(&played, made, share);
            followed(machine.pass(motion, &played, spacing)?)
        });
        seen = match passed {
            // Keep what was learned so far.
            Err(LearnError::Ended) => {
                learned.ending = Ending::Machine;
                return Ok(learned);
            }
            passed => passed?,
        };
        let pass = Pass::of(&seen, motion)?;
        if pass.limited() && learned.sufficient_nm.is_none() {
            learned.sufficient_nm = Some(1e9 * sufficient(&played, motion, spacing));
        }
        let least = learned.passes[learned.best].measured_nm;
        learned.passes.push(pass);
        go_on = watch(number, &pass);
        let found = judge.judge(Score::of(&seen, motion));
        if found == Verdict::Keep {
            (learned.best, learned.knots, best) = (number, played.clone(), seen.clone());
        } else if found == Verdict::Worse && share > LEAST_SHARE && session.can_share() {
            share *= 0.5;
            (played, seen) = (learned.knots.clone(), best.clone());
        } else if found != Verdict::GoOn {
            // NaN counts as growth.
            let within =
                matches!(pass.measured_nm.partial_cmp(&(GROWS * least)), Some(Ordering::Less | Ordering::Equal));
            learned.ending = if within { Ending::NoGain } else { Ending::Growth };
            break;
        }
    }
    if machine.keep(motion, &learned.knots, spacing).is_err() {
        learned.ending = Ending::Machine;
    }
    Ok(learned)
}

/// Checks that the motion was made and observed in a pass.
pub(super) fn followed(seen: PassObservation) -> Result<PassObservation, LearnError> {
    let bad = seen.status & (NOT_FOLLOWED | GAUGES);
    if bad == 0 { Ok(seen) } else { Err(LearnError::Status(bad)) }
}

/// Checks that no limit affected a leg or the correction in a pass.
pub(super) fn unlimited(seen: PassObservation) -> Result<PassObservation, LearnError> {
    let bad = seen.status & (LEGS | CORRECTION_LIMITED);
    if bad == 0 { Ok(seen) } else { Err(LearnError::Limited(bad)) }
}
