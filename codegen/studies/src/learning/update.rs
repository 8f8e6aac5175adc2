//! The update c ← Q (c + L e), by the Fourier transform of a whole pass.

use std::f64::consts::TAU;
use std::sync::Arc;

use specgen_numerics::fft::{self, Complex64, Fft};

use super::coherence::Coherence;
use super::convergence::{Convergence, Learnable, highest, low_pass};
use super::legs::HystereticLegs;
use super::motion::Motion;
use specgen_numerics::Matrix6;
use specgen_numerics::complex6::{Matrix6c, inverse, mapped};

/// Fade-in and fade-out time of a correction, s.
pub(super) const FADE: [f64; 2] = [5e-3, 20e-3];
/// Rounds in which a correction is prepared for hysteretic legs.
const ROUNDS: usize = 12;

/// Update of a correction between passes of one length.
pub struct Update {
    /// L and Q at the frequencies that Q passes.
    bins: Vec<(Matrix6c, f64)>,
    /// Q at the frequencies that it passes if learning reaches [`Convergence::reach`].
    passed_at_reach: Vec<f64>,
    to_modal: Matrix6,
    from_modal: Matrix6,
    length: usize,
    fade: [usize; 2],
    /// Ticks of rest at the start of a pass.
    rest: usize,
    /// Ticks over which an error is averaged.
    spacing: usize,
    transforms: [Arc<dyn Fft<f64>>; 2],
}

impl Update {
    /// For passes of a motion with errors averaged over `spacing` ticks, which attenuates high frequencies.
    pub fn new(learnable: &Learnable, motion: &Motion, convergence: &Convergence, spacing: u32) -> Self {
        let width = f64::from(spacing) * learnable.closed_loop.period;
        let mut update = Self::of(learnable, motion, convergence.band[1], spacing, |frequencies| {
            let responses = learnable.known(frequencies, convergence);
            responses
                .iter()
                .zip(frequencies)
                .map(|(response, hertz)| {
                    let share = convergence.share(*hertz) / kept(hertz * width);
                    let part = match share {
                        // Where the response is unknown, it may have no inverse.
                        0.0 => [[[0.0; 2]; 6]; 6],
                        _ => inverse(response).map(|row| row.map(|value| value.map(|part| share * part))),
                    };
                    (part, convergence.passed(*hertz))
                })
                .collect()
        });
        let hertz = frequencies(update.length, convergence.reach(), learnable.closed_loop.period);
        update.passed_at_reach = hertz.into_iter().map(|hertz| convergence.passed_at_reach(hertz)).collect();
        update
    }

    /// With L in modal coordinates and Q, at the frequencies (Hz) that Q of f_c passes.
    fn of(
        learnable: &Learnable,
        motion: &Motion,
        bandwidth: f64,
        spacing: u32,
        design: impl FnOnce(&[f64]) -> Vec<(Matrix6c, f64)>,
    ) -> Self {
        let period = learnable.closed_loop.period;
        // Twice the length, so that the end does not wrap around to the beginning.
        let length = (2 * motion.corrected).next_power_of_two();
        Self {
            bins: design(&frequencies(length, bandwidth, period)),
            passed_at_reach: Vec::new(),
            to_modal: learnable.closed_loop.basis.to_modal,
            from_modal: learnable.closed_loop.basis.from_modal,
            length,
            fade: FADE.map(|time| libm::round(time / period) as usize),
            rest: motion.scored.start,
            spacing: spacing as usize,
            transforms: [fft::forward(length), fft::inverse(length)],
        }
    }

    /// A correction that compensates lag, modes and hysteresis by the model, before the first pass.
    ///
    /// ```text
    /// c = Q G⁻¹ (x_d − G (r + d))    r = x_d + τ Δx_d/T_s + ẍ_d/ω², per mode: the request to the legs with lead and load
    /// ```
    /// G is the open-loop channel from the request to the pose, with the structural modes of the legs that are known, and Q that of f_c
    /// (Hz), without phase. d is what hysteretic `legs` do differently under r + c: c is found in rounds. Without `legs`, d = 0.
    pub fn prepared(
        learnable: &Learnable,
        motion: &Motion,
        bandwidth: f64,
        legs: Option<&HystereticLegs>,
    ) -> Vec<[f64; 6]> {
        let learnable = &learnable.of_pose();
        let update = Self::of(learnable, motion, bandwidth, 1, |frequencies| {
            let channel = learnable.open_loop(frequencies);
            channel
                .iter()
                .zip(frequencies)
                .map(|(response, hertz)| (inverse(response), low_pass(*hertz, bandwidth)))
                .collect()
        });
        let [wanted, requests] = requested(learnable, motion);
        let zeros = update.spectra(&vec![[0.0; 6]; motion.corrected]);
        let correction = |requests: &[[f64; 6]]| {
            let shown = learnable.closed_loop.without_feedback(&requests[..motion.corrected]);
            let error = wanted.iter().zip(&shown).map(|(a, b)| std::array::from_fn(|mode| a[mode] - b[mode]));
            update.corrected(&zeros, &update.transformed(error.collect()), motion.corrected)
        };
        let mut found = correction(&requests);
        for _ in 0..legs.map_or(0, |_| ROUNDS) {
            let given = sum(&requests, &found.iter().map(|pose| mapped(&update.to_modal, pose)).collect::<Vec<_>>());
            found = correction(&sum(&requests, &legs.map_or_else(Vec::new, |legs| legs.excess(&given))));
        }
        found
    }

    /// The next correction, from the one played and the errors measured under it, pass by pass and tick by tick, m and rad. Learns only
    /// what repeats.
    #[must_use]
    pub(super) fn next(
        &self,
        correction: &[[f64; 6]],
        errors: &[&[[f64; 6]]],
        coherence: &mut Coherence,
    ) -> Vec<[f64; 6]> {
        let ticks = correction.len();
        let count = errors.len() as f64;
        let error: Vec<[f64; 6]> = (0..ticks)
            .map(|tick| std::array::from_fn(|axis| errors.iter().map(|error| error[tick][axis]).sum::<f64>() / count))
            .collect();
        let mut missed = self.spectra(&error);
        coherence.keep(&mut missed, self.noise(&error), count);
        self.corrected(&self.spectra(correction), &missed, ticks)
    }

    /// Coherence of errors, from those of two passes under the same correction, tick by tick, m and rad.
    pub(super) fn coherence(&self, pair: [&[[f64; 6]]; 2]) -> Coherence {
        Coherence::new(&pair.map(|error| self.spectra(error)))
    }

    /// The error (tick by tick, m and rad) that would remain of this one if learning converged with the machine's own response, up to
    /// [`Convergence::reach`]: what Q does not pass, and what does not repeat.
    pub(super) fn remainder(&self, error: &[[f64; 6]], coherence: &Coherence) -> Vec<[f64; 6]> {
        let mut missed = self.spectra(error);
        let repeated = coherence.repeated(&missed, self.noise(error));
        for (spectrum, shares) in missed.iter_mut().zip(&repeated) {
            for (bin, (share, passed)) in shares.iter().zip(&self.passed_at_reach).enumerate() {
                spectrum[bin] *= 1.0 - share * passed;
                if bin > 0 {
                    spectrum[self.length - bin] = spectrum[bin].conj();
                }
            }
        }
        self.signal(missed, error.len(), |_| 1.0)
    }

    /// Q (c + L e), with its fades, from modal spectra.
    fn corrected(&self, played: &[Vec<Complex64>; 6], missed: &[Vec<Complex64>; 6], ticks: usize) -> Vec<[f64; 6]> {
        let mut spectra: [_; 6] = std::array::from_fn(|_| vec![Complex64::default(); self.length]);
        for (bin, (inverse, filter)) in self.bins.iter().enumerate() {
            for (mode, row) in inverse.iter().enumerate() {
                let learned: Complex64 =
                    row.iter().zip(missed).map(|([re, im], missed)| Complex64::new(*re, *im) * missed[bin]).sum();
                let value = (played[mode][bin] + learned) * *filter;
                spectra[mode][bin] = value;
                if bin > 0 {
                    spectra[mode][self.length - bin] = value.conj();
                }
            }
        }
        self.signal(spectra, ticks, |tick| self.share(tick, ticks))
    }

    /// The signal of modal spectra in pose coordinates, times a share of each tick.
    fn signal(&self, mut spectra: [Vec<Complex64>; 6], ticks: usize, share: impl Fn(usize) -> f64) -> Vec<[f64; 6]> {
        for spectrum in &mut spectra {
            self.transforms[1].process(spectrum);
        }
        let scale = 1.0 / self.length as f64;
        (0..ticks)
            .map(|tick| {
                let share = share(tick) * scale;
                let modal: [f64; 6] = std::array::from_fn(|mode| spectra[mode][tick].re * share);
                mapped(&self.from_modal, &modal)
            })
            .collect()
    }

    /// Power of white noise in each mode and bin, from the rest at the start of a pass: half of the mean square of the differences
    /// between averages there, times the ticks per average and those of the pass.
    fn noise(&self, error: &[[f64; 6]]) -> [f64; 6] {
        let rest: Vec<[f64; 6]> =
            error.iter().take(self.rest).step_by(self.spacing).map(|pose| mapped(&self.to_modal, pose)).collect();
        std::array::from_fn(|mode| {
            let sum: f64 = rest.windows(2).map(|pair| libm::pow(pair[1][mode] - pair[0][mode], 2.0)).sum();
            0.5 * sum * self.spacing as f64 / rest.len() as f64 * error.len() as f64
        })
    }

    /// Modal spectra of a signal in pose coordinates.
    fn spectra(&self, signal: &[[f64; 6]]) -> [Vec<Complex64>; 6] {
        self.transformed(signal.iter().map(|pose| mapped(&self.to_modal, pose)).collect())
    }

    /// Spectra of a signal in modal coordinates.
    fn transformed(&self, modal: Vec<[f64; 6]>) -> [Vec<Complex64>; 6] {
        std::array::from_fn(|mode| {
            let mut values: Vec<Complex64> = modal.iter().map(|value| Complex64::new(value[mode], 0.0)).collect();
            values.resize(self.length, Complex64::default());
            self.transforms[0].process(&mut values);
            values
        })
    }

    /// The fade window: 0 at both ends, 1 between the fades.
    fn share(&self, tick: usize, ticks: usize) -> f64 {
        let part = |inward: usize, fade: usize| {
            if inward >= fade { 1.0 } else { 0.5 - 0.5 * libm::cos(0.5 * TAU * inward as f64 / fade as f64) }
        };
        part(tick, self.fade[0]) * part(ticks - 1 - tick, self.fade[1])
    }
}

/// Sum of two signals, of which the second may be shorter.
fn sum(whole: &[[f64; 6]], part: &[[f64; 6]]) -> Vec<[f64; 6]> {
    let mut sum = whole.to_vec();
    for (sum, part) in sum.iter_mut().zip(part) {
        sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
    }
    sum
}

/// Pose from the start, and the request to the legs with lead and load, tick by tick in modal coordinates.
fn requested(learnable: &Learnable, motion: &Motion) -> [Vec<[f64; 6]>; 2] {
    let closed_loop = &learnable.closed_loop;
    let start = motion.targets[0].pose;
    let modal = |pose: &[f64; 6]| mapped(&closed_loop.basis.to_modal, pose);
    let lead = learnable.lead / closed_loop.period;
    let mut last = [0.0; 6];
    let mut all = [const { Vec::new() }; 2];
    for target in &motion.targets {
        let place = modal(&std::array::from_fn(|axis| target.pose[axis] - start[axis]));
        let bend = modal(&target.acceleration);
        let request = std::array::from_fn(|mode| {
            let frequency = closed_loop.basis.frequencies[mode];
            place[mode] + lead * (place[mode] - last[mode]) + bend[mode] / (frequency * frequency)
        });
        last = place;
        for (signal, value) in all.iter_mut().zip([place, request]) {
            signal.push(value);
        }
    }
    all
}

/// Frequencies (Hz) of the bins that Q of f_c passes; the constant term uses half of the lowest one.
fn frequencies(length: usize, bandwidth: f64, period: f64) -> Vec<f64> {
    let hertz = |bin: usize| bin as f64 / (length as f64 * period);
    let bins = 1 + (highest(bandwidth, period) * length as f64 * period) as usize;
    (0..bins).map(|bin| if bin == 0 { 0.5 * hertz(1) } else { hertz(bin) }).collect()
}

/// Attenuation by averaging and holding over `cycles` periods: sinc², but at least one half, since little of higher frequencies
/// is passed.
pub(super) fn kept(cycles: f64) -> f64 {
    let angle = 0.5 * TAU * cycles;
    let part = if angle > 0.0 { libm::sin(angle) / angle } else { 1.0 };
    let square = part * part;
    if square > 0.5 { square } else { 0.5 }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::path::Path;

    use host_sim::trajectory::{PaperPath, PaperPose, Step};
    use specgen_compiler::compile::compile;
    use specgen_compiler::stability::platform::StructuralChannel;
    use specgen_numerics::nyquist::Flexure;
    use specgen_runtime::playback::{self, Knot};

    use super::*;
    use crate::factors::Factors;
    use crate::learning::{
        Bin, LearnError, Learner, LearningResult, PassObservation, RepeatableMachine, Response, learn,
    };

    const PERIOD: f64 = 1e-4;
    const RADIUS: f64 = 0.1;
    const SPEED: [f64; 6] = [1e-3, 1e-3, 1e-3, 1e-2, 1e-2, 1e-2];

    fn reference() -> (Learnable, Factors) {
        let compiled = compile(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../specs/reference.toml"))).unwrap();
        (Learnable::of(&compiled).unwrap(), Factors::of(&compiled.model, &[]))
    }

    fn rms(errors: &[[f64; 6]]) -> f64 {
        let sum: f64 = errors.iter().flat_map(|error| &error[..3]).map(|value| value * value).sum();
        libm::sqrt(sum / errors.len() as f64) * 1e9
    }

    /// A mode of each leg in series with its length, in the time domain: small steps, with the input interpolated.
    fn through(signal: &[[f64; 6]], (hertz, damping): (f64, f64)) -> Vec<[f64; 6]> {
        const STEPS: usize = 200;
        let (omega, step) = (TAU * hertz, PERIOD / STEPS as f64);
        let [mut place, mut rate, mut last] = [[0.0; 6]; 3];
        let each = |input: &[f64; 6]| {
            for part in 1..=STEPS {
                for mode in 0..6 {
                    let now = last[mode] + (input[mode] - last[mode]) * part as f64 / STEPS as f64;
                    rate[mode] += step * (omega * omega * (now - place[mode]) - 2.0 * damping * omega * rate[mode]);
                    place[mode] += step * rate[mode];
                }
            }
            last = *input;
            place
        };
        signal.iter().map(each).collect()
    }

    /// Modes of the legs that are known are compensated before the first pass; unknown ones remain.
    #[test]
    fn known_modes_of_the_legs_are_compensated_beforehand() {
        let (learnable, _) = reference();
        let step = Step { to: [1e-6, 0.0, 0.0, 0.0, 2e-6, 0.0], time: 5e-3 };
        let motion = Motion::of(&step, PERIOD, &SPEED, RADIUS).unwrap();
        let [wanted, requests] = requested(&learnable, &motion);
        let requests = &requests[..motion.corrected];
        let basis = &learnable.closed_loop.basis;
        // rms error of the open loop, nm.
        let left = |real: &[(f64, f64)], known: &[(f64, f64)]| {
            let structure = known.iter().map(|(hertz, damping)| StructuralChannel {
                flexure: Flexure::Series,
                frequency: TAU * hertz,
                damping_ratio: *damping,
                place: None,
            });
            let mut modelled = learnable.clone();
            modelled.closed_loop.structure = structure.collect();
            let correction = Update::prepared(&modelled, &motion, 800.0, None);
            let given: Vec<[f64; 6]> = requests
                .iter()
                .zip(&correction)
                .map(|(request, c)| {
                    let c = mapped(&basis.to_modal, c);
                    std::array::from_fn(|mode| request[mode] + c[mode])
                })
                .collect();
            let shown =
                real.iter().fold(learnable.closed_loop.without_feedback(&given), |shown, one| through(&shown, *one));
            let error =
                |(a, b): (&[f64; 6], &[f64; 6])| mapped(&basis.from_modal, &std::array::from_fn(|k| a[k] - b[k]));
            rms(&wanted.iter().zip(&shown).map(error).collect::<Vec<_>>())
        };
        let modes = [(700.0, 0.02), (1100.0, 0.05)];
        let without = left(&[], &[]);
        for real in [&modes[..1], &modes] {
            let [unknown, known] = [&[][..], real].map(|known| left(real, known));
            println!("{real:?}: {without:.2} nm without, {unknown:.2} unknown, {known:.2} known");
            assert!(known < 0.25 * unknown && known < without + 1.0, "{unknown} {known}");
            // A frequency that is 1 % off and a damping ratio that is 20 % off are worth knowing, too.
            let near: Vec<(f64, f64)> = real.iter().map(|(hertz, damping)| (1.01 * hertz, 0.8 * damping)).collect();
            let near = left(real, &near);
            assert!(near < 0.6 * unknown, "{unknown} {near}");
        }
    }

    /// A machine whose gauges show its correction as it is, with mains on each of them, m, which a pass meets at any phase. It reports a
    /// correction above its limit, m, as limited.
    struct Humming {
        mains: f64,
        limit: f64,
        passes: usize,
    }

    impl RepeatableMachine for Humming {
        fn pass(&mut self, motion: &Motion, knots: &[Knot], spacing: u32) -> Result<PassObservation, LearnError> {
            self.passes += 1;
            // Golden ratio: the phases of consecutive passes are spread evenly.
            let phase = TAU * 0.618_034 * self.passes as f64;
            let real: Vec<[f64; 6]> = (0..motion.corrected)
                .map(|tick| {
                    let c: [f64; 6] = playback::at(knots, spacing, tick as u32);
                    let time = tick as f64 * PERIOD;
                    // Within the fades of a correction there is nothing to correct.
                    let motion =
                        50e-9 * libm::exp(-libm::pow((time - 0.1) / 0.02, 2.0)) * libm::sin(TAU * 120.0 * time);
                    std::array::from_fn(|axis| if axis < 3 { motion } else { motion / RADIUS } - c[axis])
                })
                .collect();
            let shown = |(tick, error): (usize, &[f64; 6])| {
                let mains = self.mains * libm::sin(TAU * 50.0 * tick as f64 * PERIOD + phase);
                std::array::from_fn(|axis| error[axis] + if axis < 3 { mains } else { 0.0 })
            };
            let error: Vec<[f64; 6]> = real.iter().enumerate().map(shown).collect();
            let width = spacing as usize;
            let mean = |part: &[[f64; 6]]| -> [f64; 6] {
                std::array::from_fn(|axis| part.iter().map(|error| error[axis]).sum::<f64>() / part.len() as f64)
            };
            let measured = error.chunks(width).flat_map(|part| std::iter::repeat_n(mean(part), part.len())).collect();
            let most = (0..motion.corrected as u32).map(|tick| playback::at::<f64>(knots, spacing, tick)[0].abs());
            let limited = most.fold(0.0, f64::max) > self.limit;
            Ok(PassObservation { measured, real, kept: Vec::new(), status: u32::from(limited) << 20 })
        }
    }

    fn learned(mains: f64, begin: &[Knot], count: usize) -> LearningResult {
        let (learnable, factors) = reference();
        let motion = Motion::of(&PaperPose::corrected(PaperPath::Case1, 10.0), PERIOD, &SPEED, RADIUS).unwrap();
        let unity = std::array::from_fn(|i| std::array::from_fn(|j| [f64::from(i == j), 0.0]));
        let bin = |hertz: f64| Bin { hertz, response: unity, error: [[1e-3; 6]; 6] };
        let bins = (0..=400).map(|k| bin(0.01 + 5.0 * f64::from(k))).collect();
        let learnable = learnable.with(Response::new(["digest", "machine"], bins));
        let convergence = learnable.convergence(&factors, 800.0).unwrap();
        let spacing = convergence.spacing(PERIOD);
        let update = Update::new(&learnable, &motion, &convergence, spacing);
        let mut machine = Humming { mains, limit: 2e-6, passes: 0 };
        let go_on = |_: usize, _: &_| ControlFlow::Continue(());
        learn(&mut machine, &motion, Learner::Host(&update), begin, spacing, count, go_on).unwrap()
    }

    /// A correction that is given and limited, with passes to learn from and without.
    #[test]
    fn a_limited_initial_correction_has_a_sufficient_limit() {
        for (microns, limit) in [(1, None), (3, Some(3600.0))] {
            // It rises over many knots: a limit bounds the rate, too.
            let begin: Vec<Knot> = (0..4000).map(|k| [microns * 10_000 * k.min(100), 0, 0, 0, 0, 0]).collect();
            for count in [0, 1] {
                let found = learned(0.0, &begin, count);
                assert!(found.passes[0].limited() == limit.is_some(), "{found:?}");
                let as_stated = match (found.sufficient_nm, limit) {
                    (None, None) => true,
                    (Some(found), Some(limit)) => (found / limit - 1.0).abs() < 1e-3,
                    _ => false,
                };
                assert!(as_stated, "{microns} um, {count} passes: {found:?}");
            }
        }
    }

    /// What repeats is learned, and mains on the gauges, which does not, is not.
    #[test]
    fn mains_on_the_gauges_is_not_learned() {
        let [bare, humming] = [0.0, 5e-9].map(|mains| learned(mains, &[], 5));
        let errors =
            |learned: &LearningResult| learned.passes.iter().map(|pass| pass.translation_nm).collect::<Vec<_>>();
        let expected = [&bare, &humming].map(|learned| learned.expected_nm.unwrap());
        println!("without {:.2?}, with {:.2?}, expected {expected:.2?}", errors(&bare), errors(&humming));
        let [without, with] = [&bare, &humming].map(|learned| learned.passes[learned.best]);
        assert!(bare.passes[0].translation_nm > 10.0 && without.translation_nm < 0.5, "{bare:?}");
        // Mains of 5 nm along three axes is 6.1 nm rms. Learned as it is measured, it would be the error.
        assert!(with.translation_nm < 2.0, "{humming:?}");
        // Mains remains in what the gauges show, and is expected to.
        assert!(expected[0] < 0.1 * bare.passes[0].measured_nm, "{expected:?}");
        assert!((expected[1] / with.measured_nm - 1.0).abs() < 0.2, "{expected:?} {with:?}");
    }
}
