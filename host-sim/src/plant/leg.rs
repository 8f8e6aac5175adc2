//! The reference leg: a plant outside the controller's model class.
//!
//! With u the drive (V), v the stack voltage (V), x and c in V, displacement y in µm:
//!
//! ```text
//! amplifier    τ_amp v̇ = u − v
//! plays        x = Σ w_i p_i            thresholds widen with the rate of v, filtered with τ_rate
//! creep        c = Σ w_j mean_k c_jk    ċ_jk = a_j dead(v − c_jk, r_k)
//! asymmetry    s = x + s2 x (1 − x / u_max) + c
//! leg          ÿ = ωn² (gain s − y) − 2 ζ ωn ẏ
//! gauge        τ_gauge ṁ = y − m                 shows m
//! ```
//!
//! A file with `bouc_wen` gives x = v − h in place of the plays, dh = α dv − β |dv| h − γ dv |h|: another class of
//! loop.
//!
//! Creep makes the loop depend on rate and on minutes of history, and the quadratic term breaks congruency: an Everett
//! table represents neither. The feasibility study that calibrated the parameters describes the chain in words. This
//! interpretation (weights divided among the thresholds, asymmetry only on the plays, reversal curves from the leg as
//! built) reproduces its figures, see `scenario.rs`.
//!
//! Step: linear parts and creep are exact for a held input. The plays get the voltage at the end of a step, and the leg
//! holds their sum over it, so the chain leads by half a step. `step_s` belongs to the plant: half of the reference
//! leg's 50 µs changes tracking errors at 10 Hz by less than 2 %, at 1 Hz and below by less than 0.1 % (tested in
//! `scenario.rs`). In the limit of small steps the 10 Hz errors are 2 to 3 % above those of 50 µs.

use super::actuators::Actuators;
use super::filter::{Resonance, SmoothLag};
use super::{LegParameters, steps_within};

/// A leg with amplifier lag, hysteresis, creep, asymmetry and one resonance. See the module for its equations.
#[derive(Debug, Clone, PartialEq)]
pub struct LegPlant {
    actuator: Actuators<1>,
    structure: Resonance,
    /// Lag of the gauge, µm; none: no lag.
    gauge: Option<SmoothLag>,
    longest_step: f64,
}

impl LegPlant {
    /// A leg as built, from checked parameters.
    pub fn new(parameters: &LegParameters) -> Self {
        let p = parameters;
        Self {
            actuator: Actuators::new(std::slice::from_ref(p), f64::INFINITY),
            structure: Resonance::new(p.fn_hz, p.zeta),
            gauge: (p.gauge_lag_s > 0.0).then(|| SmoothLag::new(p.gauge_lag_s)),
            longest_step: p.step_s,
        }
    }

    /// Holds `drive` (V, at the amplifier input, gain 1) for `interval` (s, > 0) and returns the
    /// displacement at its end (m, > 0 extends; relative to the leg as built, not to any gauge zero).
    pub fn hold(&mut self, drive: f64, interval: f64) -> f64 {
        let steps = steps_within(interval, self.longest_step);
        let step = interval / f64::from(steps);
        if step.to_bits() != self.actuator.step().to_bits() {
            self.actuator.set_step(step);
            self.structure.set_step(step);
            self.gauge.iter_mut().for_each(|gauge| gauge.set_step(step));
        }
        for _ in 0..steps {
            let [free] = self.actuator.advance(&[drive], true);
            let before = self.structure.motion();
            self.structure.advance(free);
            if let Some(gauge) = &mut self.gauge {
                gauge.advance(before, self.structure.motion());
            }
        }
        self.displacement()
    }

    /// Drives a straight line from `from` to `to` (V) in `duration` (s), as steps of `update` (s) or a little less,
    /// each at the value of its end, and returns the displacement at the end (m).
    pub fn ramp(&mut self, from: f64, to: f64, duration: f64, update: f64) -> f64 {
        let steps = steps_within(duration, update);
        let interval = duration / f64::from(steps);
        for step in 1..=steps {
            let fraction = f64::from(step) / f64::from(steps);
            self.hold(from + (to - from) * fraction, interval);
        }
        self.displacement()
    }

    /// Present displacement, m, as last returned by [`LegPlant::hold`].
    pub fn displacement(&self) -> f64 {
        self.structure.motion()[0] * 1e-6
    }

    /// Noise-free gauge signal, m.
    pub fn seen(&self) -> f64 {
        self.gauge.as_ref().map_or_else(|| self.displacement(), |gauge| gauge.output() * 1e-6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference() -> LegPlant {
        LegPlant::new(&LegParameters::reference())
    }

    #[test]
    fn the_loop_has_the_width_of_a_piezo_stack() {
        // The study gives 13.1 % at 0.1 Hz.
        let mut leg = reference();
        leg.ramp(0.0, 100.0, 5.0, 1e-3);
        leg.ramp(100.0, 0.0, 5.0, 1e-3);
        let bottom = leg.displacement();
        let up = leg.ramp(0.0, 50.0, 2.5, 1e-3) - bottom;
        let top = leg.ramp(50.0, 100.0, 2.5, 1e-3) - bottom;
        let down = leg.ramp(100.0, 50.0, 2.5, 1e-3) - bottom;
        let width = (down - up) / top;
        assert!((0.125..0.140).contains(&width), "{width}");
        assert!((55e-6..70e-6).contains(&top), "{top}");
    }

    #[test]
    fn minor_loops_between_the_same_voltages_are_not_congruent() {
        // What an Everett table would force: equal strokes of 40 → 60 V whatever came before.
        let stroke = |history: f64| {
            let mut leg = reference();
            leg.ramp(0.0, history, 0.1, 1e-4);
            leg.ramp(history, 40.0, 0.1, 1e-4);
            let low = leg.displacement();
            leg.ramp(40.0, 60.0, 0.1, 1e-4) - low
        };
        assert!((stroke(0.0) - stroke(100.0)).abs() > 50e-9);
    }

    #[test]
    fn a_held_voltage_creeps_on() {
        let mut leg = reference();
        let first = leg.hold(70.0, 0.05);
        let later = leg.hold(70.0, 2.0);
        assert!(later - first > 0.3e-6, "{first} {later}");
    }
}
