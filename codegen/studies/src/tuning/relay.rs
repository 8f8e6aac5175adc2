//! Relay feedback test (Åström and Hägglund): ultimate gain and period of each axis, and PI gains by Ziegler
//! and Nichols.
//!
//! One axis at a time, at the bias pose. The relay replaces k_p: it follows the modal notch, and its force ± d requests the motion K⁻¹ d
//! from the legs. Active damping, which uses the raw error, is on. The emitted controller turns that motion into voltages in mode F with only
//! the inverse model, so the hysteresis is compensated as in operation; its lead, which applies to set-points and not to feedback, is undone. On
//! the bare loop the test finds the first resonance; with the notch it finds where the lags of amplifier, notch and tick turn the phase.
//!
//! A relay that switches at ticks may lock to a period of a few whole ticks, at more than twice the gain of the limit. So it is followed by
//! amplifiers that saturate at ± d (saturation relay, Yu 1999), each with a lower gain than that found last, until none oscillates: an
//! oscillation needs no more gain than its amplifier has.

use core::f64::consts::PI;

use host_sim::closed_loop::RunError;
use host_sim::controller::{Controller, TickController};
use host_sim::platform::PlatformScenario;
use host_sim::platform::rig::{Bench, Request};
use host_sim::trajectory::PoseTarget;
use serde::Serialize;

use specgen_compiler::stability::platform::{Biquad, ClosedLoop};
use specgen_numerics::Matrix6;

/// Config word of mode F with only the inverse model.
const OPEN: f64 = 1.0;
/// Motion requested by the relay, m at the joints: a hundred times the noise of a gauge.
const AMPLITUDE: f64 = 0.1e-6;
/// Number of initial switches that are ignored, and number of measured ones.
const SETTLED: usize = 20;
const MEASURED: usize = 40;
/// Number of ticks after which a relay without oscillation is given up.
const MOST_TICKS: usize = 20_000;
/// Gain of an amplifier, relative to the gain found last.
const LOWER: f64 = 0.8;
/// An amplifier whose output stays below this for so many ticks does not oscillate.
const SATURATED: f64 = 0.9;
const QUIET_TICKS: usize = 1000;
/// One that hardly saturates dies away slowly: gain found, relative to that of the amplifier.
const DYING: f64 = 0.98;

/// Relay test result of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ultimate {
    /// K_u divided by the stiffness of the axis.
    pub gain: f64,
    /// T_u, s.
    pub period: f64,
}

impl Ultimate {
    /// k_p and k_I by Ziegler and Nichols for PI, divided by the stiffness of the axis: 0.45 K_u and k_p/(T_u/1.2), the latter
    /// in 1/s.
    pub fn ziegler_nichols(&self) -> [f64; 2] {
        let proportional = 0.45 * self.gain;
        [proportional, proportional / (self.period / 1.2)]
    }
}

/// Runs the test on each axis; `None` if there is no oscillation. `radius` of the platform joints (m), `lead` of the set-point
/// (ticks).
///
/// # Errors
/// If the machine does not reach its bias pose.
pub fn test(
    scenario: &PlatformScenario,
    controller: &Controller,
    closed_loop: &ClosedLoop,
    [radius, lead]: [f64; 2],
) -> Result<[Option<Ultimate>; 6], RunError> {
    let mut out = [None; 6];
    for (axis, found) in out.iter_mut().enumerate() {
        let mut controller = controller.fork();
        let mut words = controller.default_config();
        controller.description().set_config(&mut words, "mode", OPEN)?;
        controller.configure(&words)?;
        let unit = if axis < 3 { 1.0 } else { 1.0 / radius };
        *found = one_axis(scenario, &mut controller, closed_loop, axis, [unit, lead])?;
    }
    Ok(out)
}

/// `unit` converts metres at the joints to the unit of the axis.
fn one_axis(
    scenario: &PlatformScenario,
    controller: &mut Controller,
    closed_loop: &ClosedLoop,
    axis: usize,
    [unit, lead]: [f64; 2],
) -> Result<Option<Ultimate>, RunError> {
    let options = &scenario.options;
    let mut rig = scenario.rig().clone();
    rig.plant_mut().step_whole_ticks(options.interval);
    let mut bench = Bench::new(&mut rig, controller, options.interval, options.latency)?;
    bench.arm(options.arming)?;
    for _ in 0..(options.settle / options.interval) as usize {
        bench.tick(&Request::default())?;
    }
    let basis = &closed_loop.basis;
    // K⁻¹ d of the axis as a pose, for d = K_ii · amplitude.
    let modal = basis.compliance(axis);
    let amplitude = AMPLITUDE * unit;
    let force = basis.axis_stiffness[axis] * amplitude;
    let motion: [f64; 6] =
        std::array::from_fn(|k| force * (0..6).map(|i| basis.from_modal[k][i] * modal[i]).sum::<f64>());
    let mut notch = Sections::new(closed_loop, closed_loop.notch.as_ref().map(|notch| notch.sections));
    let mut damping = closed_loop.active_damping.map(|sections| Sections::new(closed_loop, Some(sections)));
    let center = bench.rig().plant().pose();
    let mut relay = Relay::default();
    let mut asked = [0.0; 6];
    let mut lowest = None;
    let mut begun = 0;
    for tick in 0.. {
        if tick - begun >= MOST_TICKS {
            break;
        }
        let pose = bench.rig().plant().pose();
        let error: [f64; 6] = std::array::from_fn(|k| center[k] - pose[k]);
        let output = relay.switch(tick, notch.filter(&error)[axis] / amplitude);
        let damped = damping.as_mut().map_or([0.0; 6], |damping| damping.filter(&error));
        if let Some((gain, period)) = relay.found {
            if relay.gain.is_some_and(|own| gain > DYING * own) {
                break;
            }
            lowest = Some(Ultimate { gain, period: period * options.interval });
            (relay, begun) = (Relay::saturating(LOWER * gain), tick);
        } else if relay.quiet > QUIET_TICKS {
            break;
        }
        // The controller requests r + lead (r − r_last), so choose r to give what relay and damping request.
        for (k, asked) in asked.iter_mut().enumerate() {
            *asked = (motion[k] * output + damped[k] + lead * *asked) / (1.0 + lead);
        }
        bench.tick(&Request::stream(PoseTarget { pose: asked, ..PoseTarget::default() }))?;
    }
    Ok(lowest)
}

/// Switches on the sign of its input, or amplifies it up to ± 1, and measures the oscillation.
#[derive(Debug, Clone, Default)]
struct Relay {
    /// Gain of the amplifier; `None` for a relay.
    gain: Option<f64>,
    /// Ticks since the output was last near ± 1.
    quiet: usize,
    high: bool,
    last: f64,
    /// Times of upward switches, ticks, interpolated linearly between samples.
    rises: Vec<f64>,
    /// Time, input and output: sums with cosine and sine are not possible before the period is known.
    samples: Vec<(f64, [f64; 2])>,
    found: Option<(f64, f64)>,
}

impl Relay {
    fn saturating(gain: f64) -> Self {
        Self { gain: Some(gain), ..Self::default() }
    }

    fn switch(&mut self, tick: usize, input: f64) -> f64 {
        let time = tick as f64;
        // A relay at rest starts upwards.
        self.high = if input == 0.0 { tick == 0 || self.high } else { input > 0.0 };
        let relay = if self.high { 1.0 } else { -1.0 };
        let output = self.gain.map_or(relay, |gain| (gain * input).clamp(-1.0, 1.0));
        self.quiet = if output.abs() < SATURATED { self.quiet + 1 } else { 0 };
        if self.rises.len() > SETTLED {
            self.samples.push((time, [input, output]));
        }
        if tick > 0 && self.last < 0.0 && input >= 0.0 {
            self.rises.push(time - input / (input - self.last));
            if self.rises.len() == SETTLED + MEASURED + 1 {
                self.measure();
            }
        }
        self.last = input;
        output
    }

    /// Describing function: K_u is the first harmonic of the output over that of the input; for a relay the former is 4/π.
    fn measure(&mut self) {
        let (first, last) = (self.rises[SETTLED], self.rises[SETTLED + MEASURED]);
        let period = (last - first) / MEASURED as f64;
        let mut sums = [[0.0; 2]; 2];
        for (time, values) in self.samples.iter().filter(|(time, _)| *time < last) {
            let (s, c) = libm::sincos(2.0 * PI * (time - first) / period);
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum = [sum[0] + value * c, sum[1] + value * s];
            }
        }
        let [input, output] = sums.map(|[cosine, sine]| libm::hypot(cosine, sine));
        if period > 0.0 && input > 0.0 {
            self.found = Some((output / input, period));
        }
    }
}

/// Modal filter sections of the controller, written independently for the simulator.
struct Sections {
    to_modal: Matrix6,
    from_modal: Matrix6,
    sections: [Biquad; 6],
    states: [[f64; 2]; 6],
}

impl Sections {
    /// Without sections the filters pass everything.
    fn new(closed_loop: &ClosedLoop, sections: Option<[Biquad; 6]>) -> Self {
        let basis = &closed_loop.basis;
        let sections = sections.unwrap_or([Biquad::IDENTITY; 6]);
        Self { to_modal: basis.to_modal, from_modal: basis.from_modal, sections, states: [[0.0; 2]; 6] }
    }

    fn filter(&mut self, pose: &[f64; 6]) -> [f64; 6] {
        let apply = |m: &Matrix6, x: &[f64; 6]| -> [f64; 6] {
            std::array::from_fn(|row| (0..6).map(|k| m[row][k] * x[k]).sum::<f64>())
        };
        let mut modal = apply(&self.to_modal, pose);
        for ((value, section), state) in modal.iter_mut().zip(&self.sections).zip(&mut self.states) {
            let input = *value;
            let output = section.b[0] * input + state[0];
            state[0] = section.b[1] * input - section.a[0] * output + state[1];
            state[1] = section.b[2] * input - section.a[1] * output;
            *value = output;
        }
        apply(&self.from_modal, &modal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_relay_on_an_integrator_with_delay_agrees_with_theory() {
        // ẏ = u delayed by L: K_u = π/(2 L), T_u = 4 L, by the describing function; sampled finely.
        let delay = 50;
        let mut relay = Relay::default();
        let (mut y, mut line) = (0.0, std::collections::VecDeque::from(vec![0.0; delay]));
        for tick in 0..MOST_TICKS {
            line.push_back(relay.switch(tick, -y));
            y += line.pop_front().unwrap();
            if relay.found.is_some() {
                break;
            }
        }
        let (gain, period) = relay.found.unwrap();
        // Sample-and-hold adds half a tick twice: 4 (L + 1) at most.
        assert!((period / 4.0 / delay as f64 - 1.0).abs() < 0.03, "{period}");
        // The wave is a triangle of height L, whose first harmonic is 8 L/π²; K_u is then π/(2 L).
        assert!((gain * 2.0 * delay as f64 / PI - 1.0).abs() < 0.03, "{gain}");
    }

    /// The same loop: it oscillates with an amplifier of more than K_u, and with one of less it comes to rest.
    #[test]
    fn an_amplifier_that_saturates_oscillates_above_the_limit_alone() {
        let (delay, limit) = (50, PI / 100.0);
        for (gain, oscillates) in [(1.3 * limit, true), (0.8 * limit, false)] {
            let mut relay = Relay::saturating(gain);
            let (mut y, mut line) = (-500.0, std::collections::VecDeque::from(vec![0.0; delay]));
            for tick in 0..MOST_TICKS {
                line.push_back(relay.switch(tick, -y));
                y += line.pop_front().unwrap();
                if relay.found.is_some() || relay.quiet > QUIET_TICKS {
                    break;
                }
            }
            assert_eq!(relay.quiet > QUIET_TICKS, !oscillates, "{gain}");
            if let Some((found, _)) = relay.found {
                assert!(oscillates && (found / limit - 1.0).abs() < 0.03, "{found} {limit}");
            }
        }
    }
}
