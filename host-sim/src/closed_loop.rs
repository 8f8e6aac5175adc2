//! Six legs under a controller, tick by tick.
//!
//! At tick n (time t_n) the controller gets the set-point for the end of the next interval, T_{n+1}, and the gauge
//! readings Y_n. Its voltages are held until t_{n+1}, where Y_{n+1} is read.

use std::collections::VecDeque;
use std::fmt::Write as _;
use std::ops::ControlFlow;

use crate::controller::{ControllerError, TickController};
use crate::coverage::Coverage;
use crate::description::DescriptionError;
use crate::noise::{Gauge, Gaussian, amplifier};
use crate::plant::{LegParameters, LegPlant, NoiseParameters};
use crate::trace::Trace;
use crate::trajectory::LegTrajectory;
use crate::word::status_words;

/// Legs of a platform.
pub const LEGS: usize = 6;

/// Longest control interval, s.
const LONGEST_INTERVAL: f64 = 60.0;

/// One leg with its amplifier and gauge.
#[derive(Debug, Clone)]
struct Channel {
    leg: LegPlant,
    gauge: Gauge,
    amplifier: Gaussian,
}

/// Six legs with gauges and amplifiers.
#[derive(Debug, Clone)]
pub struct Rig {
    channels: [Channel; LEGS],
    latency: usize,
    /// Voltage of zero drive, at which the legs rest, V.
    lowest: f64,
    rest: f64,
}

/// History of the legs before the gauges are zeroed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preparation {
    /// Peak of the saturating pre-cycle 0 → peak → 0, V.
    pub peak: f64,
    /// Its slope, V/s.
    pub rate: f64,
    /// Rest at 0 V after it, s.
    pub settle: f64,
    /// Longest time a drive value is held while ramping, s.
    pub update: f64,
    /// Drive of the legs at rest after that, V, ≥ 0.
    pub rest: f64,
}

impl Preparation {
    /// From the parameters of a leg, to a drive of `rest` (V).
    pub fn of(leg: &LegParameters, rest: f64) -> Self {
        Self { peak: leg.u_max, rate: leg.forc_rate_v_per_s, settle: leg.settle_s, update: leg.step_s, rest }
    }
}

/// Motion of the legs, in metres.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracking {
    /// Time between samples, s.
    pub interval: f64,
    /// One sample per tick, at its end.
    pub samples: Vec<TrackingSample>,
    /// Ticks of the path.
    pub path: usize,
}

impl Tracking {
    /// The part of the path that the samples cover.
    pub fn coverage(&self) -> Coverage {
        Coverage::new(self.samples.len(), self.path, self.interval)
    }
}

/// The end of one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackingSample {
    /// t_n, s.
    pub time: f64,
    /// T_n, m.
    pub target: [f64; LEGS],
    /// q̂_n = ρ̂ X_n, the displacement that the controller requested, m.
    pub requested: [f64; LEGS],
    /// Y_n, m.
    pub measured: [f64; LEGS],
}

/// The words of one tick.
pub struct TickWords<'a> {
    /// Into the controller.
    pub input: &'a [u64],
    /// Out of it.
    pub output: &'a [u64],
    controller: &'a dyn TickController,
}

impl TickWords<'_> {
    /// Digest of the controller's state after the tick.
    pub fn digest(&self) -> u64 {
        self.controller.state_digest()
    }
}

/// A closed-loop run.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Every word.
    pub trace: Trace,
    /// The same in metres, with the reading at the end of each tick.
    pub tracking: Tracking,
}

/// Reason why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The controller lacks a word that the loop needs, or refuses a configuration.
    #[error(transparent)]
    Controller(#[from] ControllerError),
    /// It output a voltage that is not finite.
    #[error(
        "tick {tick}: the controller's voltage[{leg}] is not finite, which its design forbids; report this as a defect of specgen with the spec"
    )]
    NotFinite {
        /// Tick, counted from 0.
        tick: usize,
        /// Leg, counted from 0.
        leg: usize,
    },
    /// The run has no valid timing.
    #[error(
        "a control interval of {interval} s in a trajectory of {duration} s; expected 1 to 100,000,000 ticks of at most {LONGEST_INTERVAL} s"
    )]
    Timing {
        /// Control interval, s.
        interval: f64,
        /// Length of the trajectory, s.
        duration: f64,
    },
    /// A platform controller did not reach its bias pose.
    #[error(
        "the controller is still on its way to the start of the path or the bias pose after {limit} s (status {status:#x}); lower the bias or raise control.setpoint.speed in the spec"
    )]
    NotReady {
        /// Time limit, s.
        limit: f64,
        /// Its status word then.
        status: u32,
    },
    /// A platform controller did not follow its path to the last set-point.
    #[error(
        "the run ended early, after {:.3} s of a path of {:.3} s (status {status:#x}{}{}): there is no figure, for the error of a part is not that of the path",
        coverage.seconds,
        coverage.path_seconds,
        if *status == 0 { "" } else { ": " },
        status_words(*status)
    )]
    EndedEarly {
        /// How far it followed.
        coverage: Coverage,
        /// Status bits of a refused or stale set-point, or those of the last tick.
        status: u32,
    },
    /// A platform controller is still busy after the last set-point of its path.
    #[error(
        "the controller is still busy after {coverage} (status {status:#x}: {}): there is no figure, for the path that it plays is longer",
        status_words(*status)
    )]
    NotEnded {
        /// The covered part of the path: all of it.
        coverage: Coverage,
        /// Its status word then.
        status: u32,
    },
}

impl From<DescriptionError> for RunError {
    fn from(error: DescriptionError) -> Self {
        Self::Controller(error.into())
    }
}

impl Run {
    /// CSV: the words of the trace, then time, set-point of each leg, set-point less reading, and the status as text.
    pub fn to_csv(&self) -> String {
        let status = self.trace.description().output("status").ok();
        let inputs = self.trace.description().input_names.len();
        let trace = self.trace.to_csv();
        let mut lines = trace.lines();
        let mut out = format!("{},time_s", lines.next().unwrap_or_default());
        for stem in ["target", "error"] {
            (0..LEGS).for_each(|leg| out.push_str(&format!(",{stem}[{leg}]_m")));
        }
        out.push_str(",status_text\n");
        for ((line, row), sample) in lines.zip(self.trace.rows()).zip(&self.tracking.samples) {
            // Writing to a String cannot fail, here and below.
            let _ = write!(out, "{line},{:.9}", sample.time);
            out.extend(sample.target.iter().map(|target| format!(",{target:.6e}")));
            let errors = sample.target.iter().zip(sample.measured).map(|(target, measured)| target - measured);
            out.extend(errors.map(|error| format!(",{error:.6e}")));
            let word = status.and_then(|place| row.get(inputs + place)).copied().unwrap_or_default();
            let _ = writeln!(out, ",{}", status_words(word as u32));
        }
        out
    }
}

impl Rig {
    /// Legs as built, each with its own noise stream from one seed.
    pub fn new(legs: [LegPlant; LEGS], noise: &NoiseParameters, seed: u64) -> Self {
        let mut index = 0;
        let channels = legs.map(|leg| {
            let channel =
                Channel { leg, gauge: Gauge::new(noise, seed, index), amplifier: amplifier(noise, seed, index) };
            index += 1;
            channel
        });
        Self { channels, latency: 0, lowest: 0.0, rest: 0.0 }
    }

    /// Sets the voltage of zero drive, `lowest` (V).
    pub fn set_lowest_voltage(&mut self, lowest: f64) {
        self.lowest = lowest;
        self.rest = lowest;
    }

    /// Pre-cycle and rest, then zeroes the gauges, then moves the legs to their rest drive.
    pub fn prepare(&mut self, preparation: &Preparation) {
        let Preparation { peak, rate, settle, update, rest } = *preparation;
        self.rest = self.lowest + rest;
        let built = self.channels.each_ref().map(|channel| channel.leg.clone());
        let mut zeros = [0.0; LEGS];
        for leg in 0..LEGS {
            // A leg equal to an earlier one takes the same history.
            if let Some(alike) = (0..leg).find(|before| built[*before] == built[leg]) {
                zeros[leg] = zeros[alike];
                self.channels[leg].leg = self.channels[alike].leg.clone();
            } else {
                let plant = &mut self.channels[leg].leg;
                plant.ramp(0.0, peak, peak / rate, update);
                plant.ramp(peak, 0.0, peak / rate, update);
                if settle > 0.0 {
                    plant.hold(0.0, settle);
                }
                zeros[leg] = plant.displacement();
                if rest > 0.0 {
                    plant.ramp(0.0, rest, rest / rate, update);
                    if settle > 0.0 {
                        plant.hold(rest, settle);
                    }
                }
            }
            self.channels[leg].gauge.zero_at(zeros[leg]);
        }
    }

    /// Runs `controller`, reset to power-up, over a leg trajectory with ticks of `interval` (s).
    ///
    /// # Errors
    /// If the controller lacks a word that the loop needs, a voltage is not finite, or there would be no tick.
    pub fn run(
        &mut self,
        controller: &mut dyn TickController,
        trajectory: &dyn LegTrajectory,
        interval: f64,
    ) -> Result<Run, RunError> {
        let (ticks, path) = ticks_of(trajectory, interval)?;
        let mut trace = Trace::new(controller.description().clone());
        let mut samples = Vec::with_capacity(ticks);
        self.follow(controller, trajectory, interval, |sample, words| {
            trace.push(words.input, words.output, words.digest());
            samples.push(*sample);
            ControlFlow::Continue(())
        })?;
        Ok(Run { trace, tracking: Tracking { interval, samples, path } })
    }

    /// Delays voltages by `ticks` control intervals in every later run; the rest voltage is held before the first.
    pub fn set_latency(&mut self, ticks: usize) {
        self.latency = ticks;
    }

    /// Draws the noise of the next `ticks` ticks and of the reading before them now, so that later clones share it. The
    /// bits of a run do not change.
    pub fn draw_ahead(&mut self, ticks: usize) {
        for channel in &mut self.channels {
            channel.gauge.draw_ahead(ticks + 1);
            channel.amplifier.draw_ahead(ticks);
        }
    }

    /// As [`Rig::run`], but stores nothing: `watch` gets the end of every tick with its words and may end the run.
    /// Returns the covered part of the path.
    ///
    /// # Errors
    /// As [`Rig::run`].
    pub fn follow(
        &mut self,
        controller: &mut dyn TickController,
        trajectory: &dyn LegTrajectory,
        interval: f64,
        mut watch: impl FnMut(&TrackingSample, &TickWords) -> ControlFlow<()>,
    ) -> Result<Coverage, RunError> {
        let (ticks, path) = ticks_of(trajectory, interval)?;
        let wiring = Wiring::of(controller)?;
        let scalar = controller.description().scalar;
        let mut input = vec![0; controller.description().input_names.len()];
        let mut output = vec![0; controller.description().output_names.len()];
        controller.reset();
        let mut underway = VecDeque::from(vec![[self.rest; LEGS]; self.latency]);
        let mut measured = self.read();
        for tick in 0..ticks {
            let time = (tick + 1) as f64 * interval;
            let target = trajectory.displacements(time);
            for leg in 0..LEGS {
                input[wiring.setpoint[leg]] = scalar.encode(target[leg]);
                input[wiring.displacement[leg]] = scalar.encode(measured[leg]);
            }
            controller.step(&input, &mut output);
            // From before any motion in the tick; costs nothing unless it is used.
            let words = TickWords { input: &input, output: &output, controller: &*controller };
            let (requested, voltages) = (wiring.requested, wiring.voltage);
            let [requested, voltages] = [requested, voltages].map(|six| six.map(|place| scalar.decode(output[place])));
            if let Some(leg) = voltages.iter().position(|voltage| !voltage.is_finite()) {
                return Err(RunError::NotFinite { tick, leg });
            }
            underway.push_back(voltages);
            let held = underway.pop_front().unwrap_or(voltages);
            self.hold(&held, interval);
            measured = self.read();
            if watch(&TrackingSample { time, target, requested, measured }, &words).is_break() {
                return Ok(Coverage::new(tick + 1, path, interval));
            }
        }
        Ok(Coverage::new(ticks, path, interval))
    }

    /// Holds six voltages (V) for `interval` (s), each with the noise of its amplifier.
    pub fn hold(&mut self, voltages: &[f64; LEGS], interval: f64) {
        for (channel, voltage) in self.channels.iter_mut().zip(voltages) {
            channel.leg.hold(voltage - self.lowest + channel.amplifier.draw(), interval);
        }
    }

    /// Positions of the legs, from the zeros of their gauges, m.
    pub fn displacements(&self) -> [f64; LEGS] {
        self.channels.each_ref().map(|channel| channel.gauge.from_zero(channel.leg.displacement()))
    }

    /// Reads the six gauges, m.
    pub fn read(&mut self) -> [f64; LEGS] {
        self.channels.each_mut().map(|channel| channel.gauge.read(channel.leg.seen()))
    }
}

/// Ticks of `interval` (s) of a leg trajectory, and of the whole path.
fn ticks_of(trajectory: &dyn LegTrajectory, interval: f64) -> Result<(usize, usize), RunError> {
    Ok((ticks_within(trajectory.duration(), interval)?, ticks_within(trajectory.whole(), interval)?))
}

/// Number of ticks of `interval` (s) in `duration` (s).
///
/// # Errors
/// If there would be none, or more than 100 million.
pub fn ticks_within(duration: f64, interval: f64) -> Result<usize, RunError> {
    // The slack keeps the last tick if the ratio is a whole number apart from rounding.
    let ticks = libm::floor(duration / interval + 1e-6);
    if interval > 0.0 && interval <= LONGEST_INTERVAL && (1.0..=1e8).contains(&ticks) {
        Ok(ticks as usize)
    } else {
        Err(RunError::Timing { interval, duration })
    }
}

/// Indices of the words that the loop connects.
struct Wiring {
    setpoint: [usize; LEGS],
    displacement: [usize; LEGS],
    voltage: [usize; LEGS],
    requested: [usize; LEGS],
}

impl Wiring {
    fn of(controller: &dyn TickController) -> Result<Self, DescriptionError> {
        let description = controller.description();
        Ok(Self {
            setpoint: description.inputs("setpoint")?,
            displacement: description.inputs("displacement")?,
            voltage: description.outputs("voltage")?,
            requested: description.outputs("requested")?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::controller::StandIn;
    use crate::description::tests::six_legs;
    use crate::word::Scalar;

    /// A leg of 1 µm/V that has settled after a tick.
    fn spring() -> LegPlant {
        LegPlant::new(&LegParameters {
            gain_um_per_v: 1.0,
            s2: 0.0,
            play_thresholds_v: vec![0.0, 5.0],
            play_weights: vec![1.0, 1.0],
            creep_weights: vec![0.0; 5],
            tau_amp_s: 0.0,
            fn_hz: 1e6,
            zeta: 0.9,
            step_s: 1e-3,
            ..LegParameters::reference()
        })
    }

    /// Rises by 1 µm per s per leg number.
    struct Slope;

    impl LegTrajectory for Slope {
        fn duration(&self) -> f64 {
            1.0
        }
        fn displacements(&self, time: f64) -> [f64; LEGS] {
            std::array::from_fn(|leg| time * 1e-6 * (leg + 1) as f64)
        }
    }

    fn rig() -> Rig {
        let mut rig = Rig::new(std::array::from_fn(|_| spring()), &NoiseParameters::NONE, 1);
        rig.prepare(&Preparation { peak: 100.0, rate: 20.0, settle: 0.7, update: 1e-2, rest: 0.0 });
        rig
    }

    /// Outputs setpoint · `gain` V, requests the set-point, and counts ticks in its digest.
    fn follower(gain: f64) -> StandIn<impl FnMut(&mut u64, &[u64], &mut [u64])> {
        let tick = move |ticks: &mut u64, input: &[u64], output: &mut [u64]| {
            for leg in 0..LEGS {
                output[leg] = (f64::from_bits(input[leg]) * gain).to_bits();
                output[LEGS + leg] = input[leg];
            }
            *ticks += 1;
        };
        StandIn { description: six_legs(Scalar::F64), state: 99, tick }
    }

    #[test]
    fn the_setpoint_is_that_of_the_end_of_the_interval_and_readings_are_from_zero() {
        let run = rig().run(&mut follower(1e6), &Slope, 0.1).unwrap();
        assert_eq!(run.trace.len(), 10);
        assert_eq!(run.tracking.samples.len(), 10);
        let first = run.trace.rows().next().unwrap();
        assert_eq!(f64::from_bits(first[2]), 0.1 * 1e-6 * 3.0);
        assert_eq!(f64::from_bits(first[6 + 2]), 0.0);
        for (row, sample) in run.trace.rows().skip(1).zip(&run.tracking.samples) {
            for leg in 0..LEGS {
                assert!((sample.measured[leg] - sample.target[leg]).abs() < 1e-20);
                assert_eq!(f64::from_bits(row[6 + leg]), sample.measured[leg]);
            }
        }
        // Reset before the run, and one digest per tick.
        assert_eq!(run.trace.rows().map(|row| row[49]).collect::<Vec<_>>(), (1..=10).collect::<Vec<_>>());
    }

    #[test]
    fn a_voltage_that_is_not_finite_ends_the_run() {
        let error = rig().run(&mut follower(f64::NAN), &Slope, 0.1).unwrap_err().to_string();
        assert!(error.starts_with("tick 0: the controller's voltage[0] is not finite"), "{error}");
    }

    #[test]
    fn an_impossible_interval_or_a_missing_word_is_refused() {
        for interval in [0.0, -1.0, f64::NAN, 2.0, 1e-12] {
            assert!(
                matches!(rig().run(&mut follower(1e6), &Slope, interval), Err(RunError::Timing { .. })),
                "{interval}"
            );
        }
        let mut controller = follower(1e6);
        controller.description.output_names[3] = "volts".to_owned();
        let error = rig().run(&mut controller, &Slope, 0.1).unwrap_err().to_string();
        assert!(error.contains("no word `voltage[3]`"), "{error}");
    }

    #[test]
    fn noise_repeats_with_its_seed() {
        let noise = NoiseParameters { sensor_nm_rms: 2.0, adc_lsb_nm: 0.76, dac_lsb_mv: 0.0, amplifier_mv_rms: 2.0 };
        let run = |seed| {
            let mut rig = Rig::new(std::array::from_fn(|_| spring()), &noise, seed);
            rig.run(&mut follower(1e6), &Slope, 0.1).unwrap().trace
        };
        assert_eq!(run(3), run(3));
        assert_ne!(run(3), run(4));
    }
}
